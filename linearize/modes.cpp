#include "linearize/modes.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <numeric>
#include <stdexcept>

#include "dense/dense.hpp"
#include "linearize/balance.hpp"

namespace tiltrim {

using Eigen::Index;
using Eigen::MatrixXcd;
using Eigen::MatrixXd;
using Eigen::VectorXcd;
using Eigen::VectorXd;

std::string to_string(Verdict verdict) {
  switch (verdict) {
    case Verdict::stable:
      return "stable";
    case Verdict::unstable:
      return "unstable";
    case Verdict::undecided:
      return "undecided";
  }
  return "unknown";
}

double Mode::damping() const {
  const double size = std::abs(eigenvalue);
  return size > 0 ? -eigenvalue.real() / size : 0.0;
}

double Mode::time_to_half() const { return std::numbers::ln2 / std::abs(eigenvalue.real()); }

namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();
constexpr double epsilon = std::numeric_limits<double>::epsilon();
constexpr double denormal = std::numeric_limits<double>::denorm_min();
constexpr double tiny = 1e-280;         // of a matrix whose results may round as denormals
constexpr double not_determined = 1e8;  // condition above which half of the digits are gone

// V⁻¹ and a bound of what its computed form is wrong by: V⁻¹ = (I - E)⁻¹ X, ‖E‖∞ <= defect.
struct Inverse {
  MatrixXcd X;
  double defect = infinity;
};

Inverse inverse(const MatrixXcd& V) {
  const double n = double(V.rows());
  Inverse inv{dense::inverse(V), infinity};
  if (!inv.X.allFinite()) return inv;
  const MatrixXcd I = MatrixXcd::Identity(V.rows(), V.cols());
  const MatrixXd rounding = (2 * n + 4) * epsilon * inv.X.cwiseAbs() * V.cwiseAbs();
  inv.defect = ((I - inv.X * V).cwiseAbs() + rounding).rowwise().sum().maxCoeff();
  return inv;
}

// Radii of Gershgorin's discs of V⁻¹ (B + E) V = Λ + V⁻¹ (R + E V), R = B V - V Λ, for all |E| <=
// the error given; every rounding of this computation included. Infinite if V is too near singular.
// Isolated discs hold one eigenvalue each, k joined ones hold k.                  [10, ch. 2 secs
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

// One radius for all eigenvalues, defective or not: the least δ with
//   ‖E‖ Σₖ ‖N‖ᵏ/δᵏ⁺¹ <= 1,  k = 0 .. n-1
// where N is the strict upper triangle of the Schur form and E its backward error and the error
// given.                                                                       [11, thm 7.2.3]
double schur_radius(const MatrixXd& B, const MatrixXd& error, const dense::Schur& schur) {
  const Index n = B.rows();
  const MatrixXd &U = schur.U, &T = schur.T;
  const double size = B.norm() + T.norm();
  const double orthogonality = (U.transpose() * U - MatrixXd::Identity(n, n)).norm();
  const double rounding = (4 * double(n) + 8) * epsilon * std::sqrt(double(n)) * size;
  const double E = (B * U - U * T).norm() + orthogonality * size + rounding + error.norm();
  MatrixXd N = T.triangularView<Eigen::StrictlyUpper>();
  for (Index i = 0; i + 1 < n; ++i) {  // a 2x2 block made triangular keeps its Frobenius norm
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

// Discs that touch share their eigenvalues: the group each disc belongs to.
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

struct Bounds {
  VectorXd error;  // to the far side of the group
  Verdict verdict = Verdict::undecided;
};

// What the discs say of each eigenvalue and of stability: all groups left of the axis, or one
// wholly to its right.
Bounds bounds(const VectorXcd& lambda, const VectorXd& radius) {
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

// ‖Av - λv‖₁/(n ‖A‖₁ ε ‖v‖₁): LAPACK's measure, on A as given.                       [12]
double scaled_residual(const MatrixXd& A, const VectorXcd& v, std::complex<double> lambda) {
  const double norm = A.cwiseAbs().colwise().sum().maxCoeff();
  const double size = double(A.rows()) * norm * epsilon * v.lpNorm<1>();
  const double residual = (A * v - lambda * v).lpNorm<1>();
  return residual == 0 ? 0.0 : residual / size;
}

// The same for the better of two vectors: v, and the one that A - λI shrinks most. Balancing gives
// v's components the accuracy of the balanced vector's, not that of v's largest.
double backward_error(const MatrixXd& A, const VectorXcd& v, std::complex<double> lambda) {
  constexpr double good = 1.0;  // of the rounding of one product: no better vector needed
  const double own = scaled_residual(A, v, lambda);
  if (own <= good) return own;
  const MatrixXcd shifted = A - lambda * MatrixXcd::Identity(A.rows(), A.cols());
  const double best = scaled_residual(A, dense::least_singular_vector(shifted), lambda);
  return own < best ? own : best;  // own may be NaN
}

void check_matrix(const MatrixXd& A, const MatrixXd& error, const std::vector<std::string>& names) {
  if (A.rows() != A.cols())
    throw std::invalid_argument(
        fmt::format("modes need a square matrix, this one is {} x {}", A.rows(), A.cols()));
  if (!A.allFinite())
    throw std::invalid_argument("modes: the matrix has entries that are not finite");
  if (error.size() > 0 && (error.rows() != A.rows() || error.cols() != A.cols()))
    throw std::invalid_argument(fmt::format("modes: the error is {} x {}, the matrix {} x {}",
                                            error.rows(), error.cols(), A.rows(), A.cols()));
  if (error.size() > 0 && !(error.array() >= 0).all())
    throw std::invalid_argument("modes: an error bound is negative or not a number");
  if (!names.empty() && std::ssize(names) != A.rows())
    throw std::invalid_argument(
        fmt::format("modes: {} names for {} states", names.size(), A.rows()));
}

// Power of two that brings the matrix's norm near one, so that no square overflows or vanishes.
double unit(const MatrixXd& A) {
  const double largest = A.cwiseAbs().maxCoeff();
  return largest > 0 ? std::ldexp(1.0, std::clamp(std::ilogb(largest), -1000, 1000)) : 1.0;
}

// Bound of what A/scale and balancing lost, in B: entries that fell below the normal doubles.
MatrixXd lost(const MatrixXd& A, double scale, const Balanced& b) {
  constexpr double least = std::numeric_limits<double>::min();
  MatrixXd lost = MatrixXd::Zero(A.rows(), A.cols());
  for (Index i = 0; i < A.rows(); ++i)
    for (Index j = 0; j < A.cols(); ++j) {
      const double kept = b.B(i, j) * (b.scale[i] / b.scale[j]) * scale;
      if (kept != A(b.order[std::size_t(i)], b.order[std::size_t(j)]))
        lost(i, j) = least * (1 + b.scale[j] / b.scale[i]);
    }
  return lost;
}

// Length one, and the largest component real and positive: one vector of all the multiples.
void add_vectors(Mode& mode, VectorXcd right, const VectorXcd& left) {
  Index largest = 0;
  right.cwiseAbs().maxCoeff(&largest);
  right *= std::conj(right[largest]) / std::abs(right[largest]) / right.norm();
  mode.right = right;
  mode.left = VectorXcd::Zero(right.size());
  if (left.size() > 0) mode.left = left / std::conj(left.dot(right));
}

}  // namespace

Modes modes(const MatrixXd& A, const MatrixXd& A_error, const std::vector<std::string>& state_names,
            const ModesOptions& options) {
  check_matrix(A, A_error, state_names);
  const Index n = A.rows();
  Modes result;
  result.spectral_abscissa = -infinity;
  result.verdict = Verdict::stable;
  if (n == 0) return result;

  const double scale = unit(A);
  const Balanced balanced = balance(A / scale);
  const MatrixXd& B = balanced.B;
  MatrixXd error = lost(A, scale, balanced);
  if (A_error.size() > 0) error += balanced.same(A_error / scale);
  const dense::Eigensystem solved = dense::eigensystem(B, options.max_iterations);
  const dense::Schur schur = dense::schur(B, options.max_iterations);
  if (!solved.converged || !schur.converged) {
    result.converged = false;
    result.verdict = Verdict::undecided;
    return result;
  }
  const VectorXcd& lambda = solved.values;
  const MatrixXcd& V = solved.V;
  const Inverse inv = inverse(V);
  const VectorXd separate = gershgorin_radii(B, error, V, lambda, inv);
  const VectorXd common = VectorXd::Constant(n, schur_radius(B, error, schur));
  const Bounds b = bounds(lambda, separate.sum() < common.sum() ? separate : common);
  const MatrixXcd V_of_A = balanced.back(V);
  const bool invertible = inv.defect < 1;
  for (Index i = 0; i < n; ++i) {
    Mode mode;
    mode.eigenvalue = scale * lambda[i];
    mode.error = scale * b.error[i] + (scale < tiny ? 4 * denormal : 0.0);
    mode.condition = invertible ? inv.X.row(i).norm() * V.col(i).norm() : infinity;
    mode.determined = mode.condition <= not_determined;
    mode.backward_error = backward_error(A / scale, V_of_A.col(i), lambda[i]);
    add_vectors(mode, V_of_A.col(i), invertible ? balanced.back_left(inv.X.row(i)) : VectorXcd());
    // A V = V Λ,  W = V⁻¹;  participation of state k in mode i is |vₖᵢ wᵢₖ|            [3]
    mode.participation = VectorXd::Zero(n);
    if (invertible) {
      const VectorXd share = V.col(i).cwiseProduct(inv.X.row(i).transpose()).cwiseAbs();
      for (Index k = 0; k < n; ++k)
        mode.participation[balanced.order[std::size_t(k)]] = share[k] / share.sum();
    }
    if (!state_names.empty())
      mode.name = mode_name(mode.eigenvalue, mode.participation, state_names, options.mode_names);
    result.modes.push_back(mode);
  }
  std::ranges::sort(result.modes, {}, [](const Mode& m) {
    return std::pair(m.eigenvalue.real(), m.eigenvalue.imag());
  });
  result.spectral_abscissa = result.modes.back().eigenvalue.real();
  result.verdict = b.verdict;
  return result;
}

VectorXcd eigenvalues(const MatrixXd& A, const ModesOptions& options) {
  check_matrix(A, {}, {});
  const Index n = A.rows();
  if (n == 0) return {};
  const double scale = unit(A);
  const dense::Eigensystem solved =
      dense::eigenvalues(balance(A / scale).B, options.max_iterations);
  if (!solved.converged) return {};
  VectorXcd lambda = scale * solved.values;
  std::ranges::sort(lambda, {},
                    [](const std::complex<double>& z) { return std::pair(z.real(), z.imag()); });
  return lambda;
}

Modes modes(const LinearModel& linear) {
  if (!linear) throw std::invalid_argument("modes: there is no linear model: " + linear.message);
  return modes(linear.A, linear.A_error, names(linear.states), {.mode_names = linear.mode_names});
}

}  // namespace tiltrim
