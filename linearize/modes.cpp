#include "linearize/modes.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <numbers>
#include <queue>
#include <stdexcept>
#include <tuple>

#include "dense/dense.hpp"
#include "linearize/balance.hpp"
#include "linearize/eigenvalues.hpp"
#include "linearize/mode_name.hpp"
#include "linearize/spectrum_bounds.hpp"
#include "runtime/memory.hpp"
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

// ‖Av - λv‖₁/(n ‖A‖₁ ε ‖v‖₁): LAPACK's measure, for A as given, of size n ‖A‖₁ ε.  [12]
double scaled_residual(const VectorXcd& Av, const VectorXcd& v, std::complex<double> lambda,
                       double size) {
  const double residual = (Av - lambda * v).lpNorm<1>();
  return residual == 0 ? 0.0 : residual / (size * v.lpNorm<1>());
}

// The smaller one of two vectors: v, and the singular vector of A - λI for its smallest singular
// value. After balancing, components of v are accurate relative to the balanced vector only.
double backward_error(const MatrixXd& A, const VectorXcd& Av, const VectorXcd& v,
                      std::complex<double> lambda, double size) {
  constexpr double good = 1.0;  // the rounding of one product: no better vector needed
  const double own = scaled_residual(Av, v, lambda, size);
  if (own <= good) return own;
  const MatrixXcd shifted = A - lambda * MatrixXcd::Identity(A.rows(), A.cols());
  const VectorXcd least = dense::least_singular_vector(shifted);
  const double best = scaled_residual(A * least, least, lambda, size);
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

// A matrix in units of `scale` and balanced coordinates B, with its eigensystem.
struct Decomposed {
  double scale = 1.0;
  Balanced balanced;
  MatrixXd error;  // of B
  dense::RealEigensystem solved;
  Inverse inv;

  VectorXcd right(Index i) const { return dense::complex_column(solved.P, solved.values, i); }
  VectorXcd left(Index i) const { return dense::complex_column(inv.W, solved.values, i); }
  double condition(Index i) const {
    return inv.defect < 1 ? left(i).norm() * right(i).norm() : infinity;
  }
  double worst_condition() const {
    double worst = 0.0;
    for (Index i = 0; i < solved.values.size(); ++i) worst = std::max(worst, condition(i));
    return worst;
  }
  Bounds bounds() const { return tiltrim::bounds(balanced.B, error, solved, inv); }
};

Decomposed decompose(const MatrixXd& A, const MatrixXd& A_error, Balanced balanced, double scale,
                     int max_iterations) {
  Decomposed d{scale, std::move(balanced), {}, {}, {}};
  d.error = lost(A, scale, d.balanced);
  if (A_error.size() > 0) d.error += d.balanced.same(A_error / scale);
  d.solved = dense::real_eigensystem(d.balanced.B, max_iterations);
  if (d.solved.converged) d.inv = inverse(d.solved);
  return d;
}

// Balanced, unless that worsens an ill-conditioned eigenvalue.                   [67]
Decomposed decompose(const MatrixXd& A, const MatrixXd& A_error, int max_iterations) {
  constexpr double ill_conditioned = 1e6;
  const double scale = unit(A);
  Decomposed d = decompose(A, A_error, balance(A / scale), scale, max_iterations);
  const bool converged = d.solved.converged;
  if (converged && d.worst_condition() < ill_conditioned) return d;
  Decomposed plain = decompose(A, A_error, as_given(A / scale), scale, max_iterations);
  if (!converged) return plain;
  const bool better = plain.solved.converged && plain.bounds().error.sum() < d.bounds().error.sum();
  return better ? plain : d;
}

// Eigenvalues with their bounds.
struct Spectrum {
  VectorXcd values;  // 1/s
  VectorXd error;
  Verdict verdict = Verdict::stable;
  bool converged = true;
};

Spectrum spectrum_of(const Decomposed& d) {
  if (!d.solved.converged) return {{}, {}, Verdict::undecided, false};
  const Bounds b = d.bounds();
  return {d.scale * d.solved.values,
          d.scale * b.error.array() + (d.scale < tiny ? 4 * denormal : 0.0), b.verdict};
}

MatrixXd part(const MatrixXd& A, const std::vector<Index>& block) {
  return A.size() > 0 ? MatrixXd(A(block, block)) : MatrixXd();
}

// If exact zeros make a matrix block triangular, its spectrum is that of its blocks, each bounded
// separately: a 1x1 zero block gives an exact zero.
Spectrum by_blocks(const MatrixXd& A, const MatrixXd& A_error,
                   const std::vector<std::vector<Index>>& blocks, int max_iterations) {
  Spectrum all{VectorXcd(A.rows()), VectorXd(A.rows())};
  Index at = 0;
  bool undecided = false, unstable = false;
  for (const std::vector<Index>& block : blocks) {
    const Spectrum own =
        spectrum_of(decompose(part(A, block), part(A_error, block), max_iterations));
    if (!own.converged) return own;
    all.values.segment(at, own.values.size()) = own.values;
    all.error.segment(at, own.values.size()) = own.error;
    at += own.values.size();
    undecided = undecided || own.verdict == Verdict::undecided;
    unstable = unstable || own.verdict == Verdict::unstable;
  }
  all.verdict = unstable ? Verdict::unstable : undecided ? Verdict::undecided : Verdict::stable;
  return all;
}

// Matches each eigenvalue of the whole matrix to one of the blocks, the nearest pairs first.
std::vector<Index> matched(const VectorXcd& whole, const VectorXcd& of_blocks) {
  const Index n = whole.size();
  using Pair = std::tuple<double, Index, Index>;
  std::vector<Pair> pairs;
  pairs.reserve(std::size_t(n * n));
  for (Index i = 0; i < n; ++i)
    for (Index j = 0; j < n; ++j) pairs.emplace_back(std::abs(whole[i] - of_blocks[j]), i, j);
  std::priority_queue nearest(std::greater<Pair>(), std::move(pairs));
  std::vector<Index> match(std::size_t(n), -1);
  std::vector<bool> taken(std::size_t(n), false);
  for (Index open = n; open > 0; nearest.pop()) {
    const auto [apart, i, j] = nearest.top();
    if (match[std::size_t(i)] >= 0 || taken[std::size_t(j)]) continue;
    match[std::size_t(i)] = j;
    taken[std::size_t(j)] = true;
    --open;
  }
  return match;
}

// The blocks' eigenvalues, in the order of those of the whole matrix.
Spectrum in_order(const VectorXcd& whole, const Spectrum& of_blocks) {
  Spectrum ordered = of_blocks;
  const std::vector<Index> match = matched(whole, of_blocks.values);
  for (Index i = 0; i < whole.size(); ++i) {
    ordered.values[i] = of_blocks.values[match[std::size_t(i)]];
    ordered.error[i] = of_blocks.error[match[std::size_t(i)]];
  }
  return ordered;
}

// Unit length, and the largest component real and positive, which makes the vector unique.
void add_vectors(Mode& mode, VectorXcd right, const VectorXcd& left) {
  Index largest = 0;
  right.cwiseAbs().maxCoeff(&largest);
  right *= std::conj(right[largest]) / std::abs(right[largest]) / right.norm();
  mode.left = VectorXcd::Zero(right.size());
  if (left.size() > 0) mode.left = left / std::conj(left.dot(right));
  mode.right = std::move(right);
}

// What a mode has in common with the other one of its pair.
void conjugate(Mode& mode, const Mode& other) {
  mode.backward_error = other.backward_error;
  mode.condition = other.condition;
  mode.determined = other.determined;
  mode.right = other.right.conjugate();
  mode.left = other.left.conjugate();
  mode.participation = other.participation;
}

// A V = V Λ,  W = V⁻¹;  participation of state k in mode i is |vₖᵢ wᵢₖ|            [3]
VectorXd participation(const Decomposed& d, Index i) {
  const VectorXd share = (d.right(i).cwiseAbs2().cwiseProduct(d.left(i).cwiseAbs2())).cwiseSqrt();
  const double sum = share.sum();
  VectorXd of_states(share.size());
  for (Index k = 0; k < share.size(); ++k)
    of_states[d.balanced.order[std::size_t(k)]] = share[k] / sum;
  return of_states;
}

// All properties but the names; `scaled` are the eigenvalues of A/scale.
std::vector<Mode> with_vectors(const MatrixXd& A, const Decomposed& d, const Spectrum& found,
                               const VectorXcd& scaled) {
  const Index n = A.rows();
  const VectorXcd& values = d.solved.values;
  const MatrixXd scaled_A = A / d.scale, V = d.balanced.back(d.solved.P), AV = scaled_A * V;
  const double size = double(n) * epsilon * scaled_A.cwiseAbs().colwise().sum().maxCoeff();
  const bool invertible = d.inv.defect < 1;
  std::vector<Mode> modes(static_cast<std::size_t>(n));
  for (Index i = 0; i < n; ++i) {
    Mode& mode = modes[std::size_t(i)];
    mode.eigenvalue = found.values[i];
    mode.error = found.error[i];
    if (values[i].imag() < 0 && scaled[i] == std::conj(scaled[i - 1])) {
      conjugate(mode, modes[std::size_t(i - 1)]);
      continue;
    }
    const VectorXcd right = dense::complex_column(V, values, i);
    mode.backward_error =
        backward_error(scaled_A, dense::complex_column(AV, values, i), right, scaled[i], size);
    mode.condition = d.condition(i);
    mode.determined = mode.condition <= ill_determined;
    add_vectors(mode, right, invertible ? d.balanced.back_left(d.left(i)) : VectorXcd());
    mode.participation = invertible ? participation(d, i) : VectorXd::Zero(n);
  }
  return modes;
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
  Modes result;
  result.spectral_abscissa = -infinity;
  result.verdict = Verdict::stable;
  if (A.rows() == 0) return result;

  constexpr std::size_t matrices = 10;  // of twenty; a quarter of a call with 100 states
  keep_freed_memory(matrices * std::size_t(A.size()) * sizeof(double));
  const Decomposed d = decompose(A, A_error, max_iterations);
  const std::vector<std::vector<Index>> blocks = irreducible_blocks(A, A_error);
  const bool whole = blocks.size() == 1;
  Spectrum found = whole ? spectrum_of(d) : by_blocks(A, A_error, blocks, max_iterations);
  if (!d.solved.converged || !found.converged) {
    result.converged = false;
    result.verdict = Verdict::undecided;
    return result;
  }
  if (!whole) found = in_order(d.scale * d.solved.values, found);
  result.modes =
      with_vectors(A, d, found, whole ? d.solved.values : VectorXcd(found.values / d.scale));
  if (!state_names.empty()) {
    const auto possible = possible_names(mode_names, state_names);
    for (Mode& m : result.modes)
      m.name = mode_name(m.eigenvalue, m.participation, state_names, possible);
  }
  std::ranges::sort(result.modes, {}, [](const Mode& m) {
    return std::pair(m.eigenvalue.real(), m.eigenvalue.imag());
  });
  result.spectral_abscissa = result.modes.back().eigenvalue.real();
  result.verdict = found.verdict;
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
