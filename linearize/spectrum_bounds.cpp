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
using machine::epsilon;
using machine::infinity;

namespace {

// With it the root of a sum of squares is not below the length if a square underflows.
constexpr double lost_square = 1e-300;

// |V| of a matrix in real columns.
MatrixXd lengths(const MatrixXd& P, const VectorXcd& values) {
  MatrixXd size = P.cwiseAbs();
  for (Index j = 0; j < P.cols(); ++j) {
    if (!(values[j].imag() > 0)) continue;
    size.col(j) = (P.col(j).array().square() + P.col(j + 1).array().square() + lost_square).sqrt();
    size.col(j + 1) = size.col(j);
    ++j;
  }
  return size;
}

// Row sums of |S⁻¹ M S|, where V = P S are the complex columns of P.
VectorXd row_sums(const MatrixXd& M, const VectorXcd& values) {
  const Index n = M.rows();
  VectorXd sums = VectorXd::Zero(n);
  const auto two = [&](Index i) { return values[i].imag() > 0; };
  const auto length = [](double x, double y) { return std::sqrt(x * x + y * y + lost_square); };
  for (Index j = 0; j < n; j += two(j) ? 2 : 1)
    for (Index i = 0; i < n; i += two(i) ? 2 : 1) {
      const double a = M(i, j), b = two(j) ? M(i, j + 1) : 0.0;
      const double c = two(i) ? M(i + 1, j) : 0.0, d = two(i) && two(j) ? M(i + 1, j + 1) : 0.0;
      if (a == 0 && b == 0 && c == 0 && d == 0) continue;
      if (two(i) && two(j))
        sums[i] += 0.5 * (length(a + d, b - c) + length(a - d, b + c));
      else
        sums[i] += two(i) ? 0.5 * length(a, c) : two(j) ? 2 * length(a, b) : std::abs(a);
    }
  for (Index i = 0; i < n; ++i)
    if (two(i)) sums[i + 1] = sums[i];
  return sums;
}

// Row sums of |I - X V| from those of its computed value, and the rounding of the product.
VectorXd with_rounding(const VectorXd& sums, const MatrixXd& X_size, const VectorXd& V_sums) {
  const double rounding = (2 * double(sums.size()) + 4) * epsilon;
  return sums + rounding * (X_size * V_sums);
}

double largest(const VectorXd& rows) { return rows.allFinite() ? rows.maxCoeff() : infinity; }

}  // namespace

// In real columns V = P S,  V⁻¹ = S⁻¹ P⁻¹,  I - V⁻¹V = S⁻¹ (I - P⁻¹P) S.
VectorXd defects(const dense::RealEigensystem& solved, const MatrixXd& W, MatrixXd product) {
  const Index n = W.rows();
  for (Index j = 0; j < n; ++j) {
    for (Index i = 0; i < n; ++i) product(i, j) *= solved.values[i].imag() != 0 ? -2 : -1;
    product(j, j) += 1;
  }
  const VectorXd across = lengths(solved.P, solved.values).rowwise().sum();
  return with_rounding(row_sums(product, solved.values), lengths(W, solved.values).transpose(),
                       across);
}

Inverse inverse(const dense::RealEigensystem& solved) {
  Inverse inv{dense::inverse(solved.P).transpose(), infinity};
  MatrixXd& W = inv.W;
  if (!W.allFinite()) return inv;
  for (Index j = 0; j < W.cols(); ++j)
    if (solved.values[j].imag() != 0) W.col(j) *= 0.5;
  inv.defect = largest(defects(solved, W, W.transpose() * solved.P));
  return inv;
}

namespace {

// Radii of the Gershgorin disks of V⁻¹ (B + E) V = Λ + V⁻¹ (R + E V), R = B V - V Λ, for all |E| <=
// the given error; rounding of this computation is included. Infinite if V is nearly singular.
// Isolated disks contain one eigenvalue each, k joined ones contain k.            [10, ch. 2 secs
// 13, 47]
VectorXd gershgorin_radii(const MatrixXd& B, const MatrixXd& error,
                          const dense::RealEigensystem& solved, const Inverse& inv) {
  const Index n = B.rows();
  if (!(inv.defect < 0.5)) return VectorXd::Constant(n, infinity);
  const MatrixXd& P = solved.P;
  const VectorXcd& lambda = solved.values;
  MatrixXd R = B * P;
  for (Index j = 0; j < n; ++j) {
    const double re = lambda[j].real(), im = lambda[j].imag();
    R.col(j) -= re * P.col(j);
    if (im > 0) R.col(j) += im * P.col(j + 1);
    if (im < 0) R.col(j) += im * P.col(j - 1);
  }
  const MatrixXd size = lengths(P, lambda);
  const VectorXd across = size.rowwise().sum();
  const VectorXd residual =
      lengths(R, lambda).rowwise().sum() + error * across +
      (2 * double(n) + 4) * epsilon * (B.cwiseAbs() * across + size * lambda.cwiseAbs());
  const VectorXd rows = lengths(inv.W, lambda).transpose() * residual;
  return (rows.array() + inv.defect / (1 - inv.defect) * rows.maxCoeff()) * (1 + 1e-6);
}

// The part of schur_error() that takes no products.
double schur_rounding(const MatrixXd& B, const MatrixXd& error,
                      const dense::RealEigensystem& solved) {
  const double n = double(B.rows());
  return (4 * n + 8) * epsilon * std::sqrt(n) * (B.norm() + solved.T.norm()) + error.norm();
}

// Every matrix within the error of B is orthogonally similar to one within this distance of T.
double schur_error(const MatrixXd& B, const MatrixXd& error, const dense::RealEigensystem& solved) {
  const Index n = B.rows();
  const MatrixXd &U = solved.U, &T = solved.T;
  const double orthogonality = (U.transpose() * U - MatrixXd::Identity(n, n)).norm();
  return (B * U - U * T).norm() + orthogonality * (B.norm() + T.norm()) +
         schur_rounding(B, error, solved);
}

// ‖N‖, N the strict upper triangle of the Schur form.
double departure_from_normal(const MatrixXd& T) {
  MatrixXd N = T.triangularView<Eigen::StrictlyUpper>();
  for (Index i = 0; i + 1 < T.rows(); ++i) {  // a 2x2 block made triangular keeps its norm
    const auto block = T.block<2, 2>(i, i);
    const double determinant = block(0, 0) * block(1, 1) - block(1, 0) * block(0, 1);
    if (block(1, 0) != 0)
      N(i, i + 1) = std::sqrt(std::max(block.squaredNorm() - 2 * determinant, 0.0));
  }
  return N.norm();
}

// A bound of ‖E‖ ‖(λ - T)⁻¹‖ at a distance δ from every eigenvalue:
//   ‖E‖ Σₖ ‖N‖ᵏ/δᵏ⁺¹,  k = 0 .. n-1
double resolvent(double departure, double E, Index n, double delta) {
  double sum = 0.0, power = 1.0 / delta;
  for (Index k = 0; k < n; ++k, power *= departure / delta) sum += power;
  return E * sum;
}

// One radius for all n eigenvalues, defective or not: the smallest δ at which it is at most one,
// where E is the backward error of the Schur form plus the given error.       [11, thm 7.2.3]
double schur_radius(double departure, double E, Index n) {
  if (!(E > 0)) return 0.0;
  double low = E, high = E + departure + 1;
  while (resolvent(departure, E, n, high) > 1 && std::isfinite(high)) high *= 2;
  constexpr int halvings = 60;  // to round-off of the exponent
  for (int i = 0; i < halvings; ++i) {
    const double middle = std::sqrt(low) * std::sqrt(high);
    (resolvent(departure, E, n, middle) > 1 ? low : high) = middle;
  }
  return high;
}

// A lower bound of σ_min(M) = 1/‖M⁻¹‖₂, by norms of the inverse.                  [11, sec. 2.3]
double least_singular_value(const MatrixXcd& M) {
  const Index n = M.rows();
  const MatrixXcd X = dense::inverse(M);
  const MatrixXd size = X.cwiseAbs();
  const VectorXd rest = (MatrixXcd::Identity(n, n) - X * M).cwiseAbs().rowwise().sum();
  const double largest_row = largest(with_rounding(rest, size, M.cwiseAbs().rowwise().sum()));
  const double defect = std::sqrt(double(n)) * largest_row;  // of ‖E‖∞, for ‖E‖₂
  if (!(defect < 0.5)) return 0.0;
  const double columns = size.colwise().sum().maxCoeff(), rows = size.rowwise().sum().maxCoeff();
  return (1 - defect) * (1 - 1e-12) / std::min(X.norm(), std::sqrt(columns * rows));
}

// Stability from a vertical line that no eigenvalue of any matrix within the error can cross: if
// σ_min(c + iω - T) > ‖E‖ for every ω, all of them have as many eigenvalues right of the line as T.
// σ_min is 1-Lipschitz in ω, so each value clears an interval.                   [11, sec. 7.9]
std::optional<Index> right_of(double c, const dense::RealEigensystem& solved, double E) {
  constexpr int most_stretches = 200;
  constexpr double safe = 0.9;
  const MatrixXd& T = solved.T;
  const VectorXcd& lambda = solved.values;
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
      const double sum = radius[i] + radius[j];
      if (std::abs(lambda[i].real() - lambda[j].real()) > sum) continue;  // most are, at less cost
      if (std::abs(lambda[i] - lambda[j]) > sum) continue;
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

Verdict axis_verdict(const MatrixXd& B, const MatrixXd& error,
                     const dense::RealEigensystem& solved) {
  constexpr Index largest = 200;  // for which a singular value decomposition is fast
  // The sum of the eigenvalues is the trace: if it is positive, so is an eigenvalue's real part.
  const double trace = B.trace(), rounding = double(B.rows()) * epsilon * B.diagonal().lpNorm<1>();
  if (trace > error.trace() + rounding) return Verdict::unstable;
  if (B.rows() > largest) return Verdict::undecided;
  const double E = schur_error(B, error, solved);
  if (!std::isfinite(E)) return Verdict::undecided;
  if (const auto unstable = right_of(0.0, solved, E))
    return *unstable > 0 ? Verdict::unstable : Verdict::stable;
  const double most = solved.T.diagonal().maxCoeff();  // for a pair, the real part
  if (most > 0)
    if (const auto unstable = right_of(0.5 * most, solved, E); unstable && *unstable > 0)
      return Verdict::unstable;
  return Verdict::undecided;
}

}  // namespace

Bounds bounds(const MatrixXd& B, const MatrixXd& error, const dense::RealEigensystem& solved,
              const Inverse& inv) {
  const Index n = B.rows();
  VectorXd radius = gershgorin_radii(B, error, solved, inv);
  const double mean = radius.sum() / double(n), departure = departure_from_normal(solved.T);
  // The common radius grows with the error: it is larger than the mean if it is so without the
  // products.
  if (!(resolvent(departure, schur_rounding(B, error, solved), n, mean) > 1)) {
    const double of_all = schur_radius(departure, schur_error(B, error, solved), n);
    if (!(mean < of_all)) radius.setConstant(of_all);
  }
  Bounds b = of_discs(solved.values, radius);
  if (b.verdict == Verdict::undecided) b.verdict = axis_verdict(B, error, solved);
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
  std::ranges::reverse(c.found);  // first what no other depends on
  return c.found;
}

}  // namespace tiltrim
