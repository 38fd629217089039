#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <complex>
#include <stdexcept>
#include <utility>
#include <vector>

#include "dense/dense.hpp"
#include "design/checks.hpp"
#include "design/design.hpp"
#include "design/lapack.hpp"
#include "runtime/rounding.hpp"

namespace tiltrim {

using Eigen::Index;
using Eigen::Matrix2d;
using Eigen::MatrixXd;
using Eigen::RowVector2d;
using Eigen::Vector2d;
using Eigen::VectorXcd;
using Complex = std::complex<double>;

namespace {

constexpr double uncontrolled = 1e-10;  // largest ‖wᵀB‖/‖B‖ that counts as zero
constexpr double moved = 1e-8;  // what rounding may move a simple pole by, over ‖A - B K‖

std::string text(Complex p) {
  if (p.imag() == 0) return fmt::format("{:.6g}", p.real());
  return fmt::format("{:.6g}{:+.6g}i", p.real(), p.imag());
}

// Poles that are still to be placed. Of a pair, the one with positive imaginary part.
struct Wanted {
  std::vector<Complex> real, pairs;

  static Complex take(std::vector<Complex>& from, Complex near) {
    const auto nearest = std::ranges::min_element(from, {}, [&](Complex p) {
      return std::abs(p - Complex(near.real(), std::abs(near.imag())));
    });
    const Complex p = *nearest;
    from.erase(nearest);
    return p;
  }
  std::pair<Complex, Complex> take_two(Complex near) {
    if (pairs.empty()) return {take(real, near), take(real, near)};
    const Complex p = take(pairs, near);
    return {p, std::conj(p)};
  }
  // A fixed real mode leaves one real pole of a pair.
  void give_up_one(Complex near) {
    if (!real.empty())
      take(real, near);
    else
      real.emplace_back(take(pairs, near).real());
  }
};

Wanted sorted(const VectorXcd& poles) {
  Wanted wanted;
  std::vector<Complex> below;
  for (const Complex& p : poles) {
    if (p.imag() == 0) wanted.real.push_back(p);
    if (p.imag() > 0) wanted.pairs.push_back(p);
    if (p.imag() < 0) below.push_back(p);
  }
  const auto alone = [](Complex p) {
    return std::invalid_argument(
        fmt::format("place: the pole {} has no conjugate {}", text(p), text(std::conj(p))));
  };
  for (const Complex& p : wanted.pairs) {
    const auto other = std::ranges::find_if(
        below, [&](Complex q) { return std::abs(q - std::conj(p)) <= 1e-12 * std::abs(p); });
    if (other == below.end()) throw alone(p);
    below.erase(other);
  }
  if (!below.empty()) throw alone(below.front());
  return wanted;
}

// k of least norm among two with the eigenvalues p, q of L - G k: of rank one along the input that
// acts most, by Ackermann's formula; or of rank two, L - G k being L with other eigenvalues.
MatrixXd gain_of_two(const Matrix2d& L, const MatrixXd& G, Complex p, Complex q) {
  const dense::SVD svd = dense::svd(G);
  const Vector2d g = svd.U.col(0) * svd.sigma[0];
  Matrix2d reach;
  reach << g, L * g;
  const Matrix2d phi =
      L * L - (p + q).real() * L + (p * q).real() * Matrix2d::Identity();  // of Cayley-Hamilton
  const double determinant = reach(0, 0) * reach(1, 1) - reach(0, 1) * reach(1, 0);
  const RowVector2d last(-reach(1, 0) / determinant, reach(0, 0) / determinant);
  const MatrixXd one = svd.V.col(0) * (last * phi);
  if (svd.sigma.size() < 2 || svd.sigma[1] <= uncontrolled * svd.sigma[0]) return one;

  Matrix2d D;
  if (const double bc = L(0, 1) * L(1, 0); p.imag() == 0) {
    D << p.real(), L(0, 1) + L(1, 0), 0, q.real();
  } else {
    const double b = bc < 0 ? L(0, 1) * p.imag() / std::sqrt(-bc) : p.imag();
    D << p.real(), b, -p.imag() * p.imag() / b, p.real();
  }
  const Matrix2d step = svd.U.transpose() * (L - D);
  const MatrixXd two = svd.V.leftCols(2) * svd.sigma.cwiseInverse().asDiagonal() * step;
  return one.allFinite() && one.norm() < two.norm() ? one : two;
}

// A - B K = Z T Zᵀ: placed blocks up to `first`, uncontrollable ones from `last` on.
struct Assignment {
  lapack::Schur schur;
  MatrixXd B, K;
  Wanted wanted;
  Index first = 0, last;
  std::vector<Complex> fixed;

  // Applies the feedback k from the last states, and reduces their block to Schur form again.
  void apply(const MatrixXd& k) {
    const Index b = k.cols(), at = last - b;
    schur.T.middleCols(at, b) -= schur.Z.transpose() * B * k;
    K += k * schur.Z.middleCols(at, b).transpose();
    const lapack::Schur block = lapack::schur(schur.T.block(at, at, b, b));
    schur.T.middleCols(at, b) = schur.T.middleCols(at, b) * block.Z;
    schur.T.middleRows(at, b) = block.Z.transpose() * schur.T.middleRows(at, b);
    schur.T.block(at, at, b, b) = block.T;
    schur.T.block(at, 0, b, at).setZero();
    schur.T.bottomLeftCorner(schur.T.rows() - last, last).setZero();
    schur.Z.middleCols(at, b) = schur.Z.middleCols(at, b) * block.Z;
  }

  Index block_at_end() const {
    return last - first >= 2 && schur.T(last - 1, last - 2) != 0 ? 2 : 1;
  }
  MatrixXd inputs(Index b) const { return schur.Z.middleCols(last - b, b).transpose() * B; }
  Complex value(Index b) const {  // of the last block, the one with positive imaginary part
    const double re = schur.T(last - 1, last - 1);
    if (b == 1) return re;
    return {re, std::sqrt(std::abs(schur.T(last - 1, last - 2) * schur.T(last - 2, last - 1)))};
  }

  bool deflate(Index b) {
    if (inputs(b).norm() > uncontrolled * B.norm()) return false;
    const Complex mode = value(b);
    fixed.push_back(mode);
    if (b == 2) fixed.push_back(std::conj(mode));
    b == 2 ? void(wanted.take_two(mode)) : wanted.give_up_one(mode);
    last -= b;
    return true;
  }

  // Another real eigenvalue below the last one, so that both become a pair.
  bool bring_second() {
    for (Index i = last - 2; i >= first; i -= 2) {
      const bool pair = i > first && schur.T(i, i - 1) != 0;
      if (!pair) return lapack::move(schur, i, last - 1);
    }
    return false;
  }

  // The inputs move the last two along one direction; if A keeps it, another one, which they do not
  // reach, becomes the last.
  bool bring_unreached() {
    const dense::SVD svd = dense::svd(inputs(2));
    if (svd.sigma.size() == 2 && svd.sigma[1] > uncontrolled * svd.sigma[0]) return false;
    const Matrix2d U = svd.U;
    const Matrix2d L = U.transpose() * schur.T.block(last - 2, last - 2, 2, 2) * U;
    if (std::abs(L(1, 0)) > uncontrolled * schur.T.norm()) return false;
    schur.T.middleCols(last - 2, 2) *= U;
    schur.T.middleRows(last - 2, 2) = (U.transpose() * schur.T.middleRows(last - 2, 2)).eval();
    schur.T(last - 1, last - 2) = 0;
    schur.Z.middleCols(last - 2, 2) *= U;
    return true;
  }

  // Places or gives up at least one eigenvalue. Returns false if two blocks cannot be exchanged.
  bool advance() {
    Index b = block_at_end();
    if (deflate(b)) return true;
    if (b == 1 && !wanted.real.empty()) {
      const MatrixXd g = inputs(1);
      const Complex now = value(1), p = wanted.take(wanted.real, now);
      apply(g.transpose() * ((now - p).real() / g.squaredNorm()));
    } else {
      if (b == 1) {
        if (!bring_second()) return false;
        if (deflate(1) || (bring_unreached() && deflate(1))) return true;
        b = 2;
      }
      const auto [p, q] = wanted.take_two(value(block_at_end()));
      const MatrixXd k = gain_of_two(schur.T.block(last - 2, last - 2, 2, 2), inputs(2), p, q);
      if (!k.allFinite()) return false;
      apply(k);
    }
    if (!schur.T.allFinite()) return false;
    const bool two = b == 2 && schur.T(last - 1, last - 2) == 0;
    const bool exchanged =
        lapack::move(schur, last - b, first) && (!two || lapack::move(schur, last - 1, first + 1));
    first += b;
    return exchanged;
  }
};

double distance(const VectorXcd& wanted, const VectorXcd& found) {
  std::vector<Complex> left(found.begin(), found.end());
  double largest = 0;
  for (const Complex& p : wanted) {
    const auto nearest =
        std::ranges::min_element(left, {}, [&](Complex q) { return std::abs(p - q); });
    largest = std::max(largest, std::abs(p - *nearest));
    left.erase(nearest);
  }
  return largest;
}

// A pole of multiplicity k moves by the k-th root of a perturbation.
double allowed(const VectorXcd& poles, double size) {
  Index multiplicity = 1;
  for (const Complex& p : poles)
    multiplicity = std::max(multiplicity, Index(std::ranges::count_if(poles, [&](Complex q) {
                              return std::abs(p - q) <= 1e-6 * std::abs(p);
                            })));
  return size * std::pow(moved, 1.0 / double(multiplicity));
}

}  // namespace

std::string to_string(PlaceStatus status) {
  switch (status) {
    case PlaceStatus::placed:
      return "placed";
    case PlaceStatus::uncontrollable:
      return "uncontrollable";
    case PlaceStatus::inaccurate:
      break;
  }
  return "inaccurate";
}

Placement place(const MatrixXd& A, const MatrixXd& B, const VectorXcd& poles) {
  const RoundToNearest environment;
  const Index n = A.rows(), m = B.cols();
  checks::shapes("place", {{"A", A, n, n}, {"B", B, n, m}});
  if (poles.size() != n)
    throw std::invalid_argument(
        fmt::format("place: {} poles for {} states; expected {}", poles.size(), n, n));
  if (!poles.allFinite()) throw std::invalid_argument("place: a pole is not finite");
  const Eigen::VectorXd d = lapack::scales(A), over = d.cwiseInverse();  // units that balance A
  Assignment a{lapack::schur(over.asDiagonal() * A * d.asDiagonal()),
               over.asDiagonal() * B,
               MatrixXd::Zero(m, n),
               sorted(poles),
               0,
               n,
               {}};
  bool complete = a.schur.converged;
  for (Index k = 0; complete && k < n && a.first < a.last; ++k) complete = a.advance();

  Placement answer;
  answer.K = a.K * over.asDiagonal();
  answer.uncontrollable = Eigen::Map<const VectorXcd>(a.fixed.data(), std::ssize(a.fixed));
  if (!a.K.allFinite()) return answer;
  const MatrixXd closed = A - B * answer.K;
  answer.poles = lapack::eigenvalues(closed);
  if (answer.poles.size() != n) return answer;
  answer.residual = distance(poles, answer.poles);
  if (complete &&
      answer.residual <= allowed(poles, (over.asDiagonal() * closed * d.asDiagonal()).norm()))
    answer.status = PlaceStatus::placed;
  else if (complete && !a.fixed.empty())
    answer.status = PlaceStatus::uncontrollable;
  return answer;
}

}  // namespace tiltrim
