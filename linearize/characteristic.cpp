#include "linearize/characteristic.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace tiltrim::characteristic {

using Eigen::Index;
using Eigen::MatrixXd;

namespace {

constexpr double underflow = 1e-190;  // bounds underflow in coefficients of matrices of norm one
constexpr double rank_tolerance = 1e-10;

}  // namespace

void check_square(const MatrixXd& A, Index n, const char* name) {
  if (A.rows() != n || A.cols() != n || n > largest)
    throw std::invalid_argument(fmt::format("gains: {} is {} x {}, not {} x {} of at most {}", name,
                                            A.rows(), A.cols(), n, n, largest));
  if (!A.allFinite())
    throw std::invalid_argument(fmt::format("gains: {} has an entry that is not finite", name));
}

Frame::Frame(const MatrixXd& sizes) {
  const double top = sizes.maxCoeff();
  if (!std::isfinite(top)) throw std::invalid_argument("gains times matrices overflow");
  const double first = top > 0 ? std::ldexp(1.0, std::clamp(std::ilogb(top), -1000, 1000)) : 1.0;
  balanced = balance(sizes / first);
  const double norm = balanced.B.rowwise().sum().maxCoeff();
  const double second = norm > 0 ? std::ldexp(1.0, std::ilogb(norm)) : 1.0;
  balanced.B /= second;
  unit = first * second;
}

// In one step, so that only values far below rounding of the whole can underflow.
Sizes Frame::of(const MatrixXd& A) const {
  Sizes B(A.rows(), A.cols());
  const int down = std::ilogb(unit);
  for (Index i = 0; i < B.rows(); ++i)
    for (Index j = 0; j < B.cols(); ++j)
      B(i, j) = std::scalbn(A(balanced.order[std::size_t(i)], balanced.order[std::size_t(j)]),
                            std::ilogb(balanced.scale[j]) - std::ilogb(balanced.scale[i]) - down);
  return B;
}

RankOne rank_one(const Sizes& A, const char* name) {
  const Index n = A.rows();
  RankOne r{WideVector::Zero(n), WideVector::Zero(n), Sizes::Zero(n, n)};
  Index i = 0, j = 0;
  if (n == 0 || A.cwiseAbs().maxCoeff(&i, &j) == 0) return r;
  r.u = A.col(j).cast<Wide>() / Wide(A(i, j));
  r.v = A.row(i).transpose().cast<Wide>();
  const WideMatrix product = r.u * r.v.transpose();
  const Sizes size = product.cwiseAbs().cast<double>();
  r.left_over = (A.cast<Wide>() - product).cwiseAbs().cast<double>();
  if (!(r.left_over.norm() <= rank_tolerance * A.norm()))
    throw std::invalid_argument(fmt::format("gains: {} is not of rank one", name));
  r.left_over = inflated * (r.left_over + 2 * wide_u * size);
  return r;
}

std::array<double, largest + 1> perturbation(const Sizes& sizes, double phi) {
  const Index n = sizes.cols();
  std::array<double, largest + 1> e{1.0}, error{};
  for (Index j = 0; j < n; ++j) {
    const double column = sizes.col(j).norm() + phi;
    for (Index k = j + 1; k > 0; --k) e[std::size_t(k)] += column * e[std::size_t(k - 1)];
  }
  for (Index k = 1; k <= n; ++k)
    error[std::size_t(k)] =
        inflated * std::sqrt(double(n - k + 1)) * phi * e[std::size_t(k - 1)] + underflow;
  return error;
}

// By Faddeev's method with running bounds: adj(sI - A) = Σ Bₖ sⁿ⁻¹⁻ᵏ, B₀ = I, Bₖ = A Bₖ₋₁ + cₖ I,
// cₖ = -tr(A Bₖ₋₁)/k.                                                         [34, vol. 1, ch. 4]
Pencil pencil(const WideMatrix& A, const Sizes& A_error, const WideVector& right,
              const WideVector& left) {
  const Index n = A.rows();
  const double rounding = inflated * double(n + 2) * wide_u;
  const Sizes size = A.cwiseAbs().cast<double>(), own = A_error + rounding * size;
  const Sizes whole = size + A_error, right_size = right.cwiseAbs().cast<double>(),
              left_size = left.transpose().cwiseAbs().cast<double>();
  Pencil result;
  result.p[0].value = 1;
  WideMatrix B = WideMatrix::Identity(n, n), next(n, n);
  Sizes error = Sizes::Zero(n, n), B_size(n, n), next_error(n, n);
  for (Index k = 1; k <= n; ++k) {
    B_size = B.cwiseAbs().cast<double>();
    const Sizes off = (error + 2 * rounding * B_size).lazyProduct(right_size);
    result.q[std::size_t(k)] = {-left.dot(B.lazyProduct(right).eval()),
                                inflated * left_size.lazyProduct(off).value()};
    next.noalias() = A.lazyProduct(B);
    next_error.noalias() = whole.lazyProduct(error) + own.lazyProduct(B_size);
    Bounded& c = result.p[std::size_t(k)];
    const Wide trace = next.trace();
    const double sizes = double(next.diagonal().cwiseAbs().sum());
    c.value = -trace / Wide(k);
    c.error = inflated * (next_error.trace() + rounding * sizes) / double(k) +
              wide_u * double(std::abs(c.value));
    B.swap(next);
    B.diagonal().array() += c.value;
    error.swap(next_error);
    error.diagonal().array() += c.error + wide_u * B.diagonal().cwiseAbs().cast<double>().array();
  }
  return result;
}

Wide Series::value(Wide x) const {
  Wide sum = 0;
  for (std::size_t k = c.size(); k-- > 0;) sum = sum * x + c[k];
  return sum;
}

Wide Series::slope(Wide x) const {
  Wide sum = 0;
  for (std::size_t k = c.size(); k-- > 1;) sum = sum * x + Wide(k) * c[k];
  return sum;
}

double Series::bound(double x) const {
  double sum = 0;
  for (std::size_t k = c.size(); k-- > 0;)
    sum = sum * x + error[k] + 2 * double(c.size()) * wide_u * double(std::abs(c[k]));
  return inflated * sum;
}

namespace {

// The even or odd part of a polynomial of degree n at s = iω: Σ ±c x^m of s^(2m) or s^(2m+1).
Series part(const Polynomial& p, std::size_t n, std::size_t odd) {
  Series s;
  for (std::size_t m = 0; 2 * m + odd <= n; ++m) {
    const Bounded& c = p[n - 2 * m - odd];
    s.c.push_back(m % 2 == 0 ? c.value : -c.value);
    s.error.push_back(c.error);
  }
  if (s.c.empty()) return {{0}, {0}};
  return s;
}

}  // namespace

OnAxis::OnAxis(const Pencil& pencil, std::size_t n)
    : E0(part(pencil.p, n, 0)),
      O0(part(pencil.p, n, 1)),
      E1(part(pencil.q, n, 0)),
      O1(part(pencil.q, n, 1)) {}

}  // namespace tiltrim::characteristic
