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
  for (Index i = low; i <= high; ++i) {
    const auto alone = [&](const auto& entry) {
      Index k = high;
      while (k >= low && (k == i || entry(k) == 0)) --k;
      return k < low;
    };
    if (alone(b.B.row(i))) {
      swap_both(b, i, high--);
      return true;
    }
    if (alone(b.B.col(i))) {
      swap_both(b, i, low++);
      return true;
    }
  }
  return false;
}

// Scales state i by the power of two that makes the norms of its row and column nearly equal.
bool scale_one(Balanced& b, MatrixXd& transposed, Index i, Index low, Index high) {
  constexpr double worth = 0.95;  // a step that gains less is not applied
  // Without the diagonal; subtracting it afterwards would lose digits if it dominates.
  const auto sum = [&](const auto& column) {
    return column.segment(low, i - low).cwiseAbs().sum() +
           column.segment(i + 1, high - i).cwiseAbs().sum();
  };
  const double c = sum(b.B.col(i)), r = sum(transposed.col(i));
  if (!(c > 0 && r > 0) || (r < 2 * c && c < 2 * r)) return false;
  // f = 2^k nearest to √(r/c), limited so that no entry leaves the range of doubles
  constexpr int farthest = 200;
  const int k =
      std::clamp(int(std::lround(0.5 * (std::log2(r) - std::log2(c)))), -farthest, farthest);
  if (k == 0 || !(std::ldexp(c, k) + std::ldexp(r, -k) < worth * (c + r))) return false;
  const double f = std::ldexp(1.0, k);
  if (std::abs(std::log2(b.scale[i] * f)) > 2 * farthest) return false;
  b.B.col(i) *= f;
  b.B.row(i) /= f;
  transposed.row(i) *= f;
  transposed.col(i) /= f;
  b.scale[i] *= f;
  return true;
}

}  // namespace

MatrixXd Balanced::same(const MatrixXd& of) const {
  MatrixXd m(of.rows(), of.cols());
  for (Index j = 0; j < m.cols(); ++j)
    for (Index i = 0; i < m.rows(); ++i)
      m(i, j) = of(order[std::size_t(i)], order[std::size_t(j)]) * (scale[j] / scale[i]);
  return m;
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
  MatrixXd transposed = b.B.transpose();  // whose columns are quicker to add than rows
  bool moving = true;
  for (int sweep = 0; moving && sweep < cap; ++sweep) {
    moving = false;
    for (Index i = low; i <= high; ++i) moving = scale_one(b, transposed, i, low, high) || moving;
  }
  return b;
}

}  // namespace tiltrim
