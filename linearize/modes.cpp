#include "linearize/modes.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <stdexcept>

#include "dense/dense.hpp"
#include "linearize/balance.hpp"
#include "linearize/eigenvalues.hpp"
#include "linearize/mode_name.hpp"
#include "linearize/spectrum_bounds.hpp"
#include "runtime/rounding.hpp"

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

using spectrum::epsilon;
using spectrum::infinity;

namespace {

constexpr double denormal = std::numeric_limits<double>::denorm_min();
constexpr double tiny = 1e-280;         // for a matrix whose results may become denormal
constexpr double ill_determined = 1e8;  // condition above which half the digits are lost

// ‖Av - λv‖₁/(n ‖A‖₁ ε ‖v‖₁): LAPACK's measure, for A as given.                      [12]
double scaled_residual(const MatrixXd& A, const VectorXcd& v, std::complex<double> lambda) {
  const double norm = A.cwiseAbs().colwise().sum().maxCoeff();
  const double size = double(A.rows()) * norm * epsilon * v.lpNorm<1>();
  const double residual = (A * v - lambda * v).lpNorm<1>();
  return residual == 0 ? 0.0 : residual / size;
}

// The smaller one of two vectors: v, and the singular vector of A - λI for its smallest singular
// value. After balancing, components of v are accurate relative to the balanced vector only.
double backward_error(const MatrixXd& A, const VectorXcd& v, std::complex<double> lambda) {
  constexpr double good = 1.0;  // the rounding of one product: no better vector needed
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

// Power of two that scales the norm to about one, so that no square overflows or underflows.
double unit(const MatrixXd& A) {
  const double largest = A.cwiseAbs().maxCoeff();
  return largest > 0 ? std::ldexp(1.0, std::clamp(std::ilogb(largest), -1000, 1000)) : 1.0;
}

// Bound of the underflow in B caused by A/scale and balancing.
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

// Unit length, and the largest component real and positive, which makes the vector unique.
void add_vectors(Mode& mode, VectorXcd right, const VectorXcd& left) {
  Index largest = 0;
  right.cwiseAbs().maxCoeff(&largest);
  right *= std::conj(right[largest]) / std::abs(right[largest]) / right.norm();
  mode.right = right;
  mode.left = VectorXcd::Zero(right.size());
  if (left.size() > 0) mode.left = left / std::conj(left.dot(right));
}

// A matrix in units of `scale` and balanced coordinates B, with its eigensystem and error bounds.
struct Decomposed {
  double scale = 1.0;
  Balanced balanced;
  dense::Eigensystem solved;
  Inverse inv;
  Bounds bounds;
  bool converged = false;

  double condition(Index i) const {
    return inv.defect < 1 ? inv.X.row(i).norm() * solved.V.col(i).norm() : infinity;
  }
  double worst_condition() const {
    double worst = 0.0;
    for (Index i = 0; i < solved.values.size(); ++i) worst = std::max(worst, condition(i));
    return worst;
  }
};

Decomposed decompose(const MatrixXd& A, const MatrixXd& A_error, Balanced balanced, double scale,
                     int max_iterations) {
  Decomposed d{scale, std::move(balanced), {}, {}, {}, false};
  const MatrixXd& B = d.balanced.B;
  MatrixXd error = lost(A, scale, d.balanced);
  if (A_error.size() > 0) error += d.balanced.same(A_error / scale);
  d.solved = dense::eigensystem(B, max_iterations);
  const dense::Schur schur = dense::schur(B, max_iterations);
  d.converged = d.solved.converged && schur.converged;
  if (!d.converged) return d;
  d.inv = inverse(d.solved.V);
  d.bounds = bounds(B, error, d.solved, d.inv, schur);
  return d;
}

// Balanced, unless that worsens an ill-conditioned eigenvalue.                   [67]
Decomposed decompose(const MatrixXd& A, const MatrixXd& A_error, int max_iterations) {
  constexpr double ill_conditioned = 1e6;
  const double scale = unit(A);
  Decomposed d = decompose(A, A_error, balance(A / scale), scale, max_iterations);
  if (d.converged && d.worst_condition() < ill_conditioned) return d;
  Decomposed plain = decompose(A, A_error, as_given(A / scale), scale, max_iterations);
  const bool better = plain.converged && plain.bounds.error.sum() < d.bounds.error.sum();
  return better || !d.converged ? plain : d;
}

// If exact zeros make a matrix block triangular, its spectrum is that of its blocks, each bounded
// separately: a 1x1 zero block gives an exact zero.
struct Blocks {
  VectorXcd values;  // 1/s
  VectorXd error;
  Verdict verdict = Verdict::stable;
  bool converged = true;
};

MatrixXd part(const MatrixXd& A, const std::vector<Index>& block) {
  return A.size() > 0 ? MatrixXd(A(block, block)) : MatrixXd();
}

Blocks by_blocks(const MatrixXd& A, const MatrixXd& A_error,
                 const std::vector<std::vector<Index>>& blocks, int max_iterations) {
  Blocks all{VectorXcd(A.rows()), VectorXd(A.rows())};
  Index at = 0;
  bool undecided = false, unstable = false;
  for (const std::vector<Index>& block : blocks) {
    const Decomposed d = decompose(part(A, block), part(A_error, block), max_iterations);
    all.converged = all.converged && d.converged;
    if (!d.converged) return all;
    for (Index i = 0; i < std::ssize(block); ++i, ++at) {
      all.values[at] = d.scale * d.solved.values[i];
      all.error[at] = d.scale * d.bounds.error[i] + (d.scale < tiny ? 4 * denormal : 0.0);
    }
    undecided = undecided || d.bounds.verdict == Verdict::undecided;
    unstable = unstable || d.bounds.verdict == Verdict::unstable;
  }
  all.verdict = unstable ? Verdict::unstable : undecided ? Verdict::undecided : Verdict::stable;
  return all;
}

// Matches each eigenvalue of the whole matrix to one of the blocks, the nearest pairs first.
std::vector<Index> matched(const VectorXcd& whole, const VectorXcd& of_blocks) {
  const Index n = whole.size();
  struct Pair {
    double apart;
    Index i, j;
  };
  std::vector<Pair> pairs;
  for (Index i = 0; i < n; ++i)
    for (Index j = 0; j < n; ++j) pairs.push_back({std::abs(whole[i] - of_blocks[j]), i, j});
  std::ranges::stable_sort(pairs, {}, &Pair::apart);
  std::vector<Index> match(std::size_t(n), -1);
  std::vector<bool> taken(std::size_t(n), false);
  for (const auto& [apart, i, j] : pairs) {
    if (match[std::size_t(i)] >= 0 || taken[std::size_t(j)]) continue;
    match[std::size_t(i)] = j;
    taken[std::size_t(j)] = true;
  }
  return match;
}

}  // namespace

Modes modes(const MatrixXd& A, const MatrixXd& A_error, const std::vector<std::string>& state_names,
            const std::shared_ptr<const std::vector<ModeName>>& mode_names) {
  return modes(A, A_error, state_names, mode_names, qr_steps);
}

Modes modes(const MatrixXd& A, const MatrixXd& A_error, const std::vector<std::string>& state_names,
            const std::shared_ptr<const std::vector<ModeName>>& mode_names, int max_iterations) {
  const RoundToNearest environment;
  check_matrix(A, A_error, state_names);
  const Index n = A.rows();
  Modes result;
  result.spectral_abscissa = -infinity;
  result.verdict = Verdict::stable;
  if (n == 0) return result;

  const Decomposed d = decompose(A, A_error, max_iterations);
  const std::vector<std::vector<Index>> blocks = irreducible_blocks(A, A_error);
  const Blocks apart = blocks.size() > 1 ? by_blocks(A, A_error, blocks, max_iterations) : Blocks{};
  if (!d.converged || !apart.converged) {
    result.converged = false;
    result.verdict = Verdict::undecided;
    return result;
  }
  const double scale = d.scale;
  const Balanced& balanced = d.balanced;
  const MatrixXcd& V = d.solved.V;
  const MatrixXcd V_of_A = balanced.back(V);
  const bool invertible = d.inv.defect < 1;
  const std::vector<Index> match = blocks.size() > 1
                                       ? matched(scale * d.solved.values, apart.values)
                                       : std::vector<Index>(std::size_t(n), -1);
  for (Index i = 0; i < n; ++i) {
    Mode mode;
    mode.eigenvalue = scale * d.solved.values[i];
    mode.error = scale * d.bounds.error[i] + (scale < tiny ? 4 * denormal : 0.0);
    mode.condition = d.condition(i);
    if (const Index j = match[std::size_t(i)]; j >= 0) {
      mode.eigenvalue = apart.values[j];
      mode.error = apart.error[j];
    }
    mode.determined = mode.condition <= ill_determined;
    const std::complex<double> scaled =
        blocks.size() > 1 ? mode.eigenvalue / scale : d.solved.values[i];
    mode.backward_error = backward_error(A / scale, V_of_A.col(i), scaled);
    add_vectors(mode, V_of_A.col(i), invertible ? balanced.back_left(d.inv.X.row(i)) : VectorXcd());
    // A V = V Λ,  W = V⁻¹;  participation of state k in mode i is |vₖᵢ wᵢₖ|            [3]
    mode.participation = VectorXd::Zero(n);
    if (invertible) {
      const VectorXd share = V.col(i).cwiseProduct(d.inv.X.row(i).transpose()).cwiseAbs();
      for (Index k = 0; k < n; ++k)
        mode.participation[balanced.order[std::size_t(k)]] = share[k] / share.sum();
    }
    if (!state_names.empty())
      mode.name = mode_name(mode.eigenvalue, mode.participation, state_names, mode_names);
    result.modes.push_back(mode);
  }
  std::ranges::sort(result.modes, {}, [](const Mode& m) {
    return std::pair(m.eigenvalue.real(), m.eigenvalue.imag());
  });
  result.spectral_abscissa = result.modes.back().eigenvalue.real();
  result.verdict = blocks.size() > 1 ? apart.verdict : d.bounds.verdict;
  return result;
}

VectorXcd eigenvalues(const MatrixXd& A, int max_iterations) {
  const RoundToNearest environment;
  check_matrix(A, {}, {});
  const Index n = A.rows();
  if (n == 0) return {};
  VectorXcd lambda(n);
  Index at = 0;
  for (const std::vector<Index>& block : irreducible_blocks(A, {})) {
    const MatrixXd own = part(A, block);
    const double scale = unit(own);
    const dense::Eigensystem solved = dense::eigenvalues(balance(own / scale).B, max_iterations);
    if (!solved.converged) return {};
    lambda.segment(at, own.rows()) = scale * solved.values;
    at += own.rows();
  }
  std::ranges::sort(lambda, {},
                    [](const std::complex<double>& z) { return std::pair(z.real(), z.imag()); });
  return lambda;
}

Modes modes(const LinearModel& linear) {
  if (!linear) throw std::invalid_argument("modes: no linear model: " + linear.message);
  return modes(linear.A, linear.A_error, names(linear.states), linear.mode_names);
}

}  // namespace tiltrim
