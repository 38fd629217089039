#include "linearize/modes.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <stdexcept>
#include <type_traits>
#include <utility>

#include "dense/dense.hpp"
#include "linearize/balance.hpp"
#include "linearize/decompose.hpp"
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

constexpr double undetermined = std::numeric_limits<double>::quiet_NaN();

double Mode::damping() const {
  const double size = std::abs(eigenvalue);
  if (size == 0) return 0.0;
  return size > error ? -eigenvalue.real() / size : undetermined;
}

double Mode::time_to_half() const {
  const double rate = std::abs(eigenvalue.real());
  return rate == 0 || rate > error ? std::numbers::ln2 / rate : undetermined;
}

using machine::epsilon;
using machine::infinity;

namespace {

constexpr double denormal = std::numeric_limits<double>::denorm_min();
constexpr double tiny = 1e-280;         // for a matrix whose results may become denormal
constexpr double ill_determined = 1e8;  // condition above which half the digits are lost

// ‖Av - λv‖₁/(n ‖A‖₁ ε ‖v‖₁): LAPACK's measure, for A as given, of size n ‖A‖₁ ε.  [12]
template <class Vector>
double scaled_residual(const Vector& Av, const Vector& v, typename Vector::Scalar lambda,
                       double size) {
  const double residual = (Av - lambda * v).template lpNorm<1>();
  return residual == 0 ? 0.0 : residual / (size * v.template lpNorm<1>());
}

// The smaller one of two vectors: v, and the singular vector of A - λI for its smallest singular
// value. After balancing, components of v are accurate relative to the balanced vector only.
template <class Vector>
double backward_error(const MatrixXd& A, const Vector& Av, const Vector& v,
                      typename Vector::Scalar lambda, double size) {
  constexpr double good = 1.0;  // the rounding of one product: no better vector needed
  const double own = scaled_residual(Av, v, lambda, size);
  if (own <= good) return own;
  const MatrixXcd shifted = A - lambda * MatrixXcd::Identity(A.rows(), A.cols());
  const VectorXcd least = dense::least_singular_vector(shifted);
  const double best = scaled_residual<VectorXcd>(A * least, least, lambda, size);
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

// Eigenvalues with their bounds.
struct Spectrum {
  VectorXcd values;  // 1/s
  VectorXd error;
  Verdict verdict = Verdict::stable;
  bool converged = true;
};

Spectrum spectrum_of(const Decomposed& d) {
  if (!d.solved.converged) return {{}, {}, Verdict::undecided, false};
  const VectorXcd values = d.scale * d.solved.values;
  if (!values.cwiseAbs().allFinite())
    throw std::invalid_argument(
        "modes: an eigenvalue is beyond 1.8e308, the range of double precision");
  const Bounds b = bounds(d.balanced.B, d.error, d.solved, d.inv);
  return {values, d.scale * b.error.array() + (d.scale < tiny ? 4 * denormal : 0.0), b.verdict};
}

// If exact zeros make a matrix block triangular, its spectrum is that of its blocks, each bounded
// separately: a 1x1 zero block gives an exact zero.
Spectrum by_blocks(const std::vector<Decomposed>& blocks, Index n) {
  Spectrum all{VectorXcd(n), VectorXd(n)};
  Index at = 0;
  bool undecided = false, unstable = false;
  for (const Decomposed& block : blocks) {
    const Spectrum own = spectrum_of(block);
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

// Unit length, and the largest component real and positive, which makes the vector unique.
template <class Vector>
void make_unique(Vector& v) {
  Index largest = 0;
  v.cwiseAbs().maxCoeff(&largest);
  v *= Eigen::numext::conj(v[largest]) / std::abs(v[largest]) / v.norm();
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

// Column i of V from its real columns; of reals for a real eigenvalue.
template <class Vector>
Vector column(const Eigen::Ref<const MatrixXd>& P, const VectorXcd& values, Index i) {
  if constexpr (std::is_same_v<Vector, VectorXd>)
    return P.col(i);
  else
    return dense::complex_column(P, values, i);
}

// A V = V Λ,  W = V⁻¹;  participation of state k in mode i is |vₖᵢ wᵢₖ|            [3]
// In the order of the blocks v is zero after its own and w before it.
template <class Vector>
void add_vectors(Mode& mode, const Decomposed& d, Index i, Vector v, Index first) {
  const Index n = d.condition.size(), end = v.size(), own = end - first;
  const auto& [B, order, scale] = d.balanced;
  make_unique(v);
  mode.right = mode.left = VectorXcd::Zero(n);
  mode.participation = VectorXd::Zero(n);
  for (Index k = 0; k < end; ++k) mode.right[order[std::size_t(k)]] = v[k];
  if (!d.distinct(i)) return;
  Vector left = column<Vector>(d.inv.W, d.solved.values, i);
  left.array() /= scale.array();
  left *= 1.0 / Eigen::numext::conj(left.segment(first, own).dot(v.tail(own)));
  for (Index k = first; k < n; ++k) mode.left[order[std::size_t(k)]] = left[k];
  const auto squares = [&](const MatrixXd& columns) {
    return columns.block(first, i, own, std::is_same_v<Vector, VectorXd> ? 1 : 2)
        .rowwise()
        .squaredNorm();
  };
  const VectorXd share = squares(d.solved.P).cwiseProduct(squares(d.inv.W)).cwiseSqrt();
  const double sum = share.sum();
  for (Index k = first; k < end; ++k)
    mode.participation[order[std::size_t(k)]] = share[k - first] / sum;
}

// All properties but the names.
std::vector<Mode> with_vectors(const MatrixXd& A, const Decomposed& d, const Spectrum& found) {
  const Index n = A.rows();
  const std::vector<Index>& order = d.balanced.order;
  const VectorXcd& values = d.solved.values;
  const MatrixXd scaled_A = A(order, order) / d.scale;
  const MatrixXd V = d.balanced.scale.asDiagonal() * d.solved.P, AV = product(scaled_A, V, d.ends);
  const double size = double(n) * epsilon * scaled_A.cwiseAbs().colwise().sum().maxCoeff();
  std::vector<Mode> modes(static_cast<std::size_t>(n));
  Index first = 0;
  auto end = d.ends.begin();
  const auto add = [&]<class Vector>(Mode& mode, Index i, Vector v, auto lambda) {
    const Vector Av = column<Vector>(AV.topRows(*end), values, i);
    mode.backward_error = backward_error(scaled_A, Av, v, lambda, size);
    add_vectors(mode, d, i, std::move(v), first);
  };
  for (Index i = 0; i < n; ++i) {
    if (i == *end) first = *end++;
    Mode& mode = modes[std::size_t(i)];
    mode.eigenvalue = found.values[i];
    mode.error = found.error[i];
    if (values[i].imag() < 0) {
      conjugate(mode, modes[std::size_t(i - 1)]);
      continue;
    }
    mode.condition = d.condition[i];
    mode.determined = mode.condition <= ill_determined;
    if (values[i].imag() > 0)
      add(mode, i, dense::complex_column(V.topRows(*end), values, i), values[i]);
    else
      add(mode, i, VectorXd(V.col(i).head(*end)), values[i].real());
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
  const auto parts = irreducible_blocks(A, A_error);
  std::vector<Decomposed> blocks;
  blocks.reserve(parts.size());
  for (const std::vector<Index>& states : parts)
    blocks.push_back(decompose(A, A_error, states, max_iterations));
  const Spectrum found = by_blocks(blocks, A.rows());
  if (!found.converged) {
    result.converged = false;
    result.verdict = Verdict::undecided;
    return result;
  }
  const bool whole = blocks.size() == 1;
  result.modes = with_vectors(A, whole ? blocks[0] : join(A, blocks, found.values), found);
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
    const MatrixXd own = A(block, block);
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
