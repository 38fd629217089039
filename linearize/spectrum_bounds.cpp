#include "linearize/spectrum_bounds.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <optional>

namespace tiltrim {

using Eigen::Index;
using Eigen::MatrixXcd;
using Eigen::MatrixXd;
using Eigen::VectorXcd;
using Eigen::VectorXd;
using spectrum::epsilon;
using spectrum::infinity;

Inverse inverse(const MatrixXcd& V) {
  const double n = double(V.rows());
  Inverse inv{dense::inverse(V), infinity};
  if (!inv.X.allFinite()) return inv;
  const MatrixXcd I = MatrixXcd::Identity(V.rows(), V.cols());
  const MatrixXd rounding = (2 * n + 4) * epsilon * inv.X.cwiseAbs() * V.cwiseAbs();
  inv.defect = ((I - inv.X * V).cwiseAbs() + rounding).rowwise().sum().maxCoeff();
  return inv;
}

namespace {

// Radii of the Gershgorin disks of V⁻¹ (B + E) V = Λ + V⁻¹ (R + E V), R = B V - V Λ, for all |E| <=
// the given error; rounding of this computation is included. Infinite if V is nearly singular.
// Isolated disks contain one eigenvalue each, k joined ones contain k.            [10, ch. 2 secs
// 13, 47]
VectorXd gershgorin_radii(const MatrixXd& B, const MatrixXd& error, const MatrixXcd& V,
                          const VectorXcd& lambda, const Inverse& inv) {
  const Index n = B.rows();
  if (!(inv.defect < 0.5)) return VectorXd::Constant(n, infinity);
  const MatrixXd size = B.cwiseAbs() * V.cwiseAbs() + V.cwiseAbs() * lambda.cwiseAbs().asDiagonal();
  const MatrixXd residual = (B * V - V * lambda.asDiagonal()).cwiseAbs() +
                            (2 * double(n) + 4) * epsilon * size + error * V.cwiseAbs();
  const VectorXd rows = (inv.X.cwiseAbs() * residual).rowwise().sum();
  return (rows.array() + inv.defect / (1 - inv.defect) * rows.maxCoeff()) * (1 + 1e-6);
}

// Every matrix within the error of B is orthogonally similar to one within this distance of T.
double schur_error(const MatrixXd& B, const MatrixXd& error, const dense::Schur& schur) {
  const Index n = B.rows();
  const MatrixXd &U = schur.U, &T = schur.T;
  const double size = B.norm() + T.norm();
  const double orthogonality = (U.transpose() * U - MatrixXd::Identity(n, n)).norm();
  const double rounding = (4 * double(n) + 8) * epsilon * std::sqrt(double(n)) * size;
  return (B * U - U * T).norm() + orthogonality * size + rounding + error.norm();
}

// One radius for all eigenvalues, defective or not: the smallest δ with
//   ‖E‖ Σₖ ‖N‖ᵏ/δᵏ⁺¹ <= 1,  k = 0 .. n-1
// where N is the strict upper triangle of the Schur form and E its backward error plus the given
// error.                                                                       [11, thm 7.2.3]
double schur_radius(const MatrixXd& B, const MatrixXd& error, const dense::Schur& schur) {
  const Index n = B.rows();
  const MatrixXd& T = schur.T;
  const double E = schur_error(B, error, schur);
  MatrixXd N = T.triangularView<Eigen::StrictlyUpper>();
  for (Index i = 0; i + 1 < n; ++i) {  // making a 2x2 block triangular keeps its Frobenius norm
    const auto block = T.block<2, 2>(i, i);
    const double determinant = block(0, 0) * block(1, 1) - block(1, 0) * block(0, 1);
    if (block(1, 0) != 0)
      N(i, i + 1) = std::sqrt(std::max(block.squaredNorm() - 2 * determinant, 0.0));
  }
  const double departure = N.norm();
  if (!(E > 0)) return 0.0;
  const auto resolvent = [&](double delta) {
    double sum = 0.0, power = 1.0 / delta;
    for (Index k = 0; k < n; ++k, power *= departure / delta) sum += power;
    return E * sum;
  };
  double low = E, high = E + departure + 1;
  while (resolvent(high) > 1 && std::isfinite(high)) high *= 2;
  constexpr int halvings = 60;  // to round-off of the exponent
  for (int i = 0; i < halvings; ++i) {
    const double middle = std::sqrt(low) * std::sqrt(high);
    (resolvent(middle) > 1 ? low : high) = middle;
  }
  return high;
}

// A lower bound of σ_min(M) = 1/‖M⁻¹‖₂, by norms of the inverse.                  [11, sec. 2.3]
double least_singular_value(const MatrixXcd& M) {
  const auto [X, largest_row] = inverse(M);
  const double defect = std::sqrt(double(M.rows())) * largest_row;  // of ‖E‖∞, for ‖E‖₂
  if (!(defect < 0.5)) return 0.0;
  const MatrixXd size = X.cwiseAbs();
  const double columns = size.colwise().sum().maxCoeff(), rows = size.rowwise().sum().maxCoeff();
  return (1 - defect) * (1 - 1e-12) / std::min(X.norm(), std::sqrt(columns * rows));
}

// Stability from a vertical line that no eigenvalue of any matrix within the error can cross: if
// σ_min(c + iω - T) > ‖E‖ for every ω, all of them have as many eigenvalues right of the line as T.
// σ_min is 1-Lipschitz in ω, so each value clears an interval.                   [11, sec. 7.9]
std::optional<Index> right_of(double c, const dense::Schur& schur, const VectorXcd& lambda,
                              double E) {
  constexpr int most_stretches = 200;
  constexpr double safe = 0.9;
  const MatrixXd& T = schur.T;
  const Index n = T.rows();
  const double size = T.norm();
  const auto clear_at = [&](double omega) {
    MatrixXcd shifted = -T;
    shifted.diagonal().array() += std::complex<double>(c, omega);
    const double rounding = 2 * epsilon * (size + std::abs(c) + omega);  // of the shift
    return least_singular_value(shifted) - rounding - E;
  };
  // Test first next to the nearest eigenvalue, where the line is most likely to fail.
  Index nearest = 0;
  (lambda.real().array() - c).abs().minCoeff(&nearest);
  if (!(clear_at(std::abs(lambda[nearest].imag())) > 0)) return {};
  double omega = 0.0;
  for (int i = 0; omega <= size + E; ++i) {
    const double clear = clear_at(omega);
    if (!(clear > 0) || i == most_stretches) return {};
    omega += safe * clear;
  }
  Index count = 0;
  for (Index i = 0; i < n; ++i) {
    const bool pair = i + 1 < n && T(i + 1, i) != 0;  // a standard 2x2 block: equal diagonals
    const double re = pair ? 0.5 * (T(i, i) + T(i + 1, i + 1)) : T(i, i);
    count += re > c ? (pair ? 2 : 1) : 0;
    i += pair ? 1 : 0;
  }
  return count;
}

// Overlapping disks share their eigenvalues: the group of each disk.
std::vector<Index> groups(const VectorXcd& lambda, const VectorXd& radius) {
  const Index n = lambda.size();
  std::vector<Index> group(static_cast<std::size_t>(n));
  std::iota(group.begin(), group.end(), Index{0});
  for (Index i = 0; i < n; ++i)
    for (Index j = 0; j < i; ++j) {
      if (std::abs(lambda[i] - lambda[j]) > radius[i] + radius[j]) continue;
      const Index from = group[std::size_t(i)], to = group[std::size_t(j)];
      std::ranges::replace(group, from, to);
    }
  return group;
}

// Error of each eigenvalue and stability from the disks: stable if all groups are left of the axis,
// unstable if one is entirely right of it.
Bounds of_discs(const VectorXcd& lambda, const VectorXd& radius) {
  const Index n = lambda.size();
  const std::vector<Index> group = groups(lambda, radius);
  Bounds b{VectorXd::Zero(n), Verdict::stable};
  VectorXd leftmost = VectorXd::Constant(n, infinity);
  for (Index i = 0; i < n; ++i) {
    for (Index j = 0; j < n; ++j)
      if (group[std::size_t(i)] == group[std::size_t(j)])
        b.error[i] = std::max(b.error[i], std::abs(lambda[i] - lambda[j]) + radius[j]);
    double& left = leftmost[group[std::size_t(i)]];
    left = std::min(left, lambda[i].real() - radius[i]);
    if (!(lambda[i].real() + radius[i] < 0)) b.verdict = Verdict::undecided;
  }
  for (Index i = 0; i < n; ++i)
    if (leftmost[group[std::size_t(i)]] > 0) b.verdict = Verdict::unstable;
  return b;
}

Verdict axis_verdict(const MatrixXd& B, const MatrixXd& error, const VectorXcd& lambda,
                     const dense::Schur& schur) {
  constexpr Index largest = 200;  // for which a singular value decomposition is fast
  const double E = schur_error(B, error, schur);
  // The sum of the eigenvalues is the trace: if it is positive, so is an eigenvalue's real part.
  const double trace = B.trace(), rounding = double(B.rows()) * epsilon * B.diagonal().lpNorm<1>();
  if (trace > error.trace() + rounding) return Verdict::unstable;
  if (B.rows() > largest || !std::isfinite(E)) return Verdict::undecided;
  if (const auto unstable = right_of(0.0, schur, lambda, E))
    return *unstable > 0 ? Verdict::unstable : Verdict::stable;
  const double most = schur.T.diagonal().maxCoeff();  // for a pair, the real part
  if (most > 0)
    if (const auto unstable = right_of(0.5 * most, schur, lambda, E); unstable && *unstable > 0)
      return Verdict::unstable;
  return Verdict::undecided;
}

}  // namespace

Bounds bounds(const MatrixXd& B, const MatrixXd& error, const dense::Eigensystem& solved,
              const Inverse& inv, const dense::Schur& schur) {
  const VectorXd separate = gershgorin_radii(B, error, solved.V, solved.values, inv);
  const VectorXd common = VectorXd::Constant(B.rows(), schur_radius(B, error, schur));
  Bounds b = of_discs(solved.values, separate.sum() < common.sum() ? separate : common);
  if (b.verdict == Verdict::undecided) b.verdict = axis_verdict(B, error, solved.values, schur);
  return b;
}

namespace {

// Tarjan's strongly connected components.                                          [68]
struct Components {
  const MatrixXd& A;
  const MatrixXd& error;
  std::vector<Index> number, low, stack{};
  std::vector<bool> waiting;
  std::vector<std::vector<Index>> found{};
  Index next = 0;

  bool edge(Index i, Index j) const {
    return i != j && (A(i, j) != 0 || (error.size() > 0 && error(i, j) != 0));
  }
  void visit(Index v) {
    const auto at = [](auto& all, Index i) -> auto& { return all[std::size_t(i)]; };
    at(number, v) = at(low, v) = next++;
    stack.push_back(v);
    waiting[std::size_t(v)] = true;
    for (Index w = 0; w < A.rows(); ++w) {
      if (!edge(v, w)) continue;
      if (at(number, w) < 0) {
        visit(w);
        at(low, v) = std::min(at(low, v), at(low, w));
      } else if (waiting[std::size_t(w)]) {
        at(low, v) = std::min(at(low, v), at(number, w));
      }
    }
    if (at(low, v) != at(number, v)) return;
    std::vector<Index> component;
    for (Index w = -1; w != v;) {
      w = stack.back();
      stack.pop_back();
      waiting[std::size_t(w)] = false;
      component.push_back(w);
    }
    std::ranges::sort(component);
    found.push_back(std::move(component));
  }
};

}  // namespace

std::vector<std::vector<Index>> irreducible_blocks(const MatrixXd& A, const MatrixXd& A_error) {
  const auto n = std::size_t(A.rows());
  Components c{A,
               A_error,
               std::vector<Index>(n, -1),
               std::vector<Index>(n, -1),
               {},
               std::vector<bool>(n, false)};
  for (Index v = 0; v < A.rows(); ++v)
    if (c.number[std::size_t(v)] < 0) c.visit(v);
  return c.found;
}

}  // namespace tiltrim
