#include "linearize/balance.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

namespace tiltrim {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

void swap_both(Balanced& b, Index i, Index j) {
  b.B.row(i).swap(b.B.row(j));
  b.B.col(i).swap(b.B.col(j));
  std::swap(b.order[std::size_t(i)], b.order[std::size_t(j)]);
}

// A row (or column) whose off-diagonal entries inside [low, high] are zero isolates an eigenvalue.
bool isolate(Balanced& b, Index& low, Index& high) {
  const Index size = high - low + 1;
  for (Index i = low; i <= high; ++i) {
    const auto alone = [&](const auto& entries) {
      return (entries.array() != 0).count() == (b.B(i, i) != 0 ? 1 : 0);
    };
    if (alone(b.B.row(i).segment(low, size))) {
      swap_both(b, i, high--);
      return true;
    }
    if (alone(b.B.col(i).segment(low, size).transpose())) {
      swap_both(b, i, low++);
      return true;
    }
  }
  return false;
}

// Scales state i by the power of two that makes the norms of its row and column nearly equal.
bool scale_one(Balanced& b, Index i, Index low, Index high) {
  constexpr double worth = 0.95;  // a step that gains less is not applied
  // Sums exclude the diagonal; subtracting it afterwards would lose digits if it dominates.
  double c = 0.0, r = 0.0;
  for (Index j = low; j <= high; ++j) {
    if (j == i) continue;
    c += std::abs(b.B(j, i));
    r += std::abs(b.B(i, j));
  }
  if (!(c > 0 && r > 0)) return false;
  // f = 2^k nearest to √(r/c), limited so that no entry leaves the range of doubles
  constexpr int farthest = 200;
  const int k =
      std::clamp(int(std::lround(0.5 * (std::log2(r) - std::log2(c)))), -farthest, farthest);
  if (k == 0 || !(std::ldexp(c, k) + std::ldexp(r, -k) < worth * (c + r))) return false;
  const double f = std::ldexp(1.0, k);
  if (std::abs(std::log2(b.scale[i] * f)) > 2 * farthest) return false;
  b.B.col(i) *= f;
  b.B.row(i) /= f;
  b.scale[i] *= f;
  return true;
}

}  // namespace

MatrixXd Balanced::same(const MatrixXd& of) const {
  MatrixXd m(of.rows(), of.cols());
  for (Index i = 0; i < m.rows(); ++i)
    for (Index j = 0; j < m.cols(); ++j)
      m(i, j) = of(order[std::size_t(i)], order[std::size_t(j)]) * (scale[j] / scale[i]);
  return m;
}

MatrixXd Balanced::back(const MatrixXd& V) const {
  MatrixXd v(V.rows(), V.cols());
  for (Index i = 0; i < V.rows(); ++i) v.row(order[std::size_t(i)]) = scale[i] * V.row(i);
  return v;
}

// wᴴ B = λ wᴴ  =>  (wᴴ D⁻¹ Pᵀ) A = λ (wᴴ D⁻¹ Pᵀ)
Eigen::VectorXcd Balanced::back_left(const Eigen::VectorXcd& w) const {
  Eigen::VectorXcd left(w.size());
  for (Index i = 0; i < w.size(); ++i) left[order[std::size_t(i)]] = w[i] / scale[i];
  return left;
}

Balanced as_given(const MatrixXd& A) {
  Balanced b{A, std::vector<Index>(std::size_t(A.rows())), VectorXd::Ones(A.rows())};
  std::iota(b.order.begin(), b.order.end(), Index{0});
  return b;
}

Balanced balance(const MatrixXd& A) {
  const Index n = A.rows();
  Balanced b = as_given(A);
  Index low = 0, high = n - 1;
  while (low <= high && isolate(b, low, high)) {
  }
  constexpr int cap = 100;  // sweeps; each scaling lowers the norm, and a few sweeps suffice
  bool moving = true;
  for (int sweep = 0; moving && sweep < cap; ++sweep) {
    moving = false;
    for (Index i = low; i <= high; ++i) moving = scale_one(b, i, low, high) || moving;
  }
  return b;
}

}  // namespace tiltrim
