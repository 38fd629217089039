#include "tune/step_response.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>
#include <vector>

#include "dense/dense.hpp"
#include "design/design.hpp"

namespace tiltrim {

using Eigen::Index;
using Eigen::MatrixXcd;
using Eigen::MatrixXd;
using Eigen::RowVectorXd;
using Eigen::VectorXcd;
using Eigen::VectorXd;

namespace {

// exp(A) for ‖A‖ <= 0.1: the next term of the series is below rounding.
MatrixXd small_exponential(const MatrixXd& A) {
  constexpr int terms = 10;
  MatrixXd term = MatrixXd::Identity(A.rows(), A.cols()), sum = term;
  for (int k = 1; k <= terms; ++k) {
    term = (term * A / k).eval();
    sum += term;
  }
  return sum;
}

// The cubic with these values and derivatives with respect to s in [0, 1] at its ends.
struct Cubic {
  double y0, d0, y1, d1;

  double at(double s) const {
    const double c2 = 3 * (y1 - y0) - 2 * d0 - d1, c3 = 2 * (y0 - y1) + d0 + d1;
    return y0 + s * (d0 + s * (c2 + s * c3));
  }
  // 0, the extrema between, 1; fewer extrema: 0 again.
  std::array<double, 4> turns() const {
    const double c2 = 3 * (y1 - y0) - 2 * d0 - d1, c3 = 2 * (y0 - y1) + d0 + d1;
    std::array<double, 4> all{0.0, 0.0, 0.0, 1.0};
    const double under = c2 * c2 - 3 * c3 * d0;
    if (under >= 0) {
      const double q = -(c2 + std::copysign(std::sqrt(under), c2));
      const double first = q / (3 * c3), second = d0 / q;
      if (first > 0 && first < 1) all[1] = first;
      if (second > 0 && second < 1) all[2] = second;
    }
    std::ranges::sort(all);
    return all;
  }
  // Of sign · y.
  double largest(double sign) const {
    double value = sign * y0;
    for (const double s : turns()) value = std::max(value, sign * at(s));
    return value;
  }
  // The last s with |y| > band; negative: none.
  double last_beyond(double band) const {
    const std::array<double, 4> ends = turns();
    if (std::abs(y1) > band) return 1.0;
    for (std::size_t k = ends.size() - 1; k-- > 0;) {
      if (!(std::abs(at(ends[k])) > band)) continue;
      double out = ends[k], in = ends[k + 1];
      for (int i = 0; i < 50; ++i)
        (std::abs(at((out + in) / 2)) > band ? out : in) = (out + in) / 2;
      return out;
    }
    return -1.0;
  }
};

// The states that are reached from x0 and reach y. The others may decay slowly, but y has nothing
// of them.
std::vector<Index> in_between(const MatrixXd& A, const RowVectorXd& c, const VectorXd& x0) {
  const Index n = A.rows();
  std::vector<bool> from, to;
  for (Index i = 0; i < n; ++i) {
    from.push_back(x0[i] != 0);
    to.push_back(c[i] != 0);
  }
  for (Index round = 0; round < n; ++round)
    for (Index i = 0; i < n; ++i)
      for (Index j = 0; j < n; ++j) {
        if (A(i, j) == 0) continue;
        if (from[std::size_t(j)]) from[std::size_t(i)] = true;
        if (to[std::size_t(i)]) to[std::size_t(j)] = true;
      }
  std::vector<Index> both;
  for (Index i = 0; i < n; ++i)
    if (from[std::size_t(i)] && to[std::size_t(i)]) both.push_back(i);
  return both;
}

// ---- bounds on what follows ----

constexpr double decay_error = 1e-3;  // largest relative error of a decay that counts as known

// |w| of y(t) = Re Σ w exp(λ t); empty if the eigenvectors are so nearly dependent that rounding
// hides a decay.
VectorXd amplitudes(const MatrixXd& A, const RowVectorXd& c, const VectorXd& x0,
                    const dense::Eigensystem& eigen) {
  const MatrixXcd W = dense::inverse(eigen.V);
  const MatrixXcd left = A * eigen.V - eigen.V * MatrixXcd(eigen.values.asDiagonal());
  const double rounding =
      double(A.rows()) * std::numeric_limits<double>::epsilon() * A.norm();  // of A v
  for (Index i = 0; i < A.rows(); ++i)
    if (!(W.row(i).norm() * (left.col(i).norm() + rounding) <=
          decay_error * -eigen.values[i].real()))
      return {};
  const VectorXcd z = W * VectorXcd(x0.cast<std::complex<double>>());
  const Eigen::RowVectorXcd out = c * eigen.V;
  return z.cwiseAbs().cwiseProduct(out.cwiseAbs().transpose());
}

// |y| from t on is at most the sum of the modes' amplitudes, and √(c M⁻¹ cᵀ) √(xᵀ M x), where
// Aᵀ M + M A + Q = 0. The second is needed where the first is not known or amplitudes cancel.
struct Bound {
  VectorXcd lambda{};
  VectorXd amplitude{};  // empty: not known
  MatrixXd M{};          // empty: not needed
  double of_output = 0.0;
  double negligible = 0.0;

  double operator()(double t, const VectorXd& x) const {
    double least = std::numeric_limits<double>::infinity(), sum = 0;
    if (M.size() > 0) least = of_output * std::sqrt(std::max(0.0, x.dot(M * x)));
    if (amplitude.size() == 0) return least;
    for (Index i = 0; i < amplitude.size(); ++i)
      sum += amplitude[i] * std::exp((1 - decay_error) * lambda[i].real() * t);
    return std::min(least, sum);
  }
  // The largest |λ| of the modes that have not decayed at t.
  double fastest(double t) const {
    constexpr double gone = -40;  // exp(gone) is below rounding
    double most = 0;
    for (Index i = 0; i < lambda.size(); ++i) {
      const double exponent = lambda[i].real() * t;
      const bool left =
          amplitude.size() == 0 ? exponent > gone : amplitude[i] * std::exp(exponent) > negligible;
      if (left) most = std::max(most, std::abs(lambda[i]));
    }
    return most;
  }
};

std::optional<Bound> bound_of(const MatrixXd& A, const RowVectorXd& c, const VectorXd& x0,
                              double close, double size) {
  constexpr double cancel = 10;
  const Index n = A.rows();
  const dense::Eigensystem eigen = dense::eigensystem(A);
  if (!eigen.converged) return {};
  Bound bound{.lambda = eigen.values, .amplitude = amplitudes(A, c, x0, eigen)};
  bound.negligible = close / double(n);
  if (bound.amplitude.size() > 0 && bound.amplitude.sum() <= cancel * size) return bound;
  const EquationSolution lyapunov_function =
      lyapunov(A.transpose(), MatrixXd::Identity(n, n) * A.norm());
  const dense::Eigensystem sizes =
      lyapunov_function ? dense::eigenvalues(lyapunov_function.X) : dense::Eigensystem{};
  if (sizes.converged && sizes.values.real().minCoeff() > 0) {
    bound.M = lyapunov_function.X;
    bound.of_output =
        std::sqrt(std::max(0.0, c.dot(dense::solve(bound.M, VectorXd(c.transpose())))));
  } else if (bound.amplitude.size() == 0) {
    return {};  // A is not stable
  }
  return bound;
}

// ---- search in halves of halves of time ----

// y on [t, t + h 2ᵏ] is a cubic where that is accurate, otherwise both halves are searched. All
// that the bound or a rough cubic leaves out is skipped, so that the many periods of a mode with
// little damping cost nothing.
struct Halves {
  const RowVectorXd& c;
  const RowVectorXd rate;
  const Bound bound;
  const double h, close;
  std::vector<MatrixXd> powers;  // exp(A h 2ᵏ)
  double largest = 0.0;
  long left = 100'000;  // intervals

  struct Piece {
    VectorXd middle;
    Cubic y;
    double length, error;  // of the cubic in the middle
  };
  Piece piece(int level, double t, const VectorXd& x, const VectorXd& next) const {
    const double length = h * std::ldexp(1.0, level);
    Piece p{powers[std::size_t(level - 1)] * x,
            {c.dot(x), length * rate.dot(x), c.dot(next), length * rate.dot(next)},
            length,
            0.0};
    p.error = std::abs(p.y.at(0.5) - c.dot(p.middle));
    const bool blind = length * bound.fastest(t) > 1;  // a period may hide between samples
    if (blind) p.error = std::numeric_limits<double>::infinity();
    if (level == 1) p.error = 0;
    return p;
  }
  static double rough(const Piece& p) { return 4 * p.error; }  // with room for what is beside it

  // The last time with |y| > band; negative: none.
  double last_beyond(double band, int level, double t, const VectorXd& x, const VectorXd& next) {
    constexpr double none = -1, sharp = 1e-4;  // |y| may pass the band at a small angle
    if (left == 0 || bound(t, x) <= band) return none;
    --left;
    const Piece p = piece(level, t, x, next);
    if (p.error <= close) {
      const double last = p.y.last_beyond(band);
      if (last < 0) return none;
      if (p.error <= sharp * close) return t + last * p.length;
    } else if (std::max(p.y.largest(1), p.y.largest(-1)) + rough(p) <= band) {
      return none;
    }
    const double later = last_beyond(band, level - 1, t + p.length / 2, p.middle, next);
    return later >= 0 ? later : last_beyond(band, level - 1, t, x, p.middle);
  }
  void find_largest(double sign, int level, double t, const VectorXd& x, const VectorXd& next) {
    if (left == 0 || bound(t, x) <= std::max(largest, close)) return;
    --left;
    const Piece p = piece(level, t, x, next);
    const double own = p.y.largest(sign);
    if (p.error <= close) {
      largest = std::max(largest, own);
      return;
    }
    if (own + rough(p) <= largest) return;
    find_largest(sign, level - 1, t, x, p.middle);
    find_largest(sign, level - 1, t + p.length / 2, p.middle, next);
  }
};

Decaying decaying_in_between(const MatrixXd& A, const RowVectorXd& c, const VectorXd& x0,
                             double sign, double band, double size) {
  constexpr double fine = 0.02, accurate = 1e-8, of_band = 1e-2;
  constexpr int most_levels = 60;
  const double close = band > 0 ? std::min(accurate * size, of_band * band) : accurate * size;
  const std::optional<Bound> bound = bound_of(A, c, x0, close, size);
  if (!bound) return {};
  const double h = fine / A.norm();
  Halves halves{c, c * A, *bound, h, close, {small_exponential(A * h)}};
  // the first power of two by which all that matters is over
  VectorXd end;
  int level = 0;
  do {
    if (++level > most_levels) return {};
    halves.powers.emplace_back(halves.powers.back() * halves.powers.back());
    end = halves.powers.back() * x0;
  } while (!((*bound)(h * std::ldexp(1.0, level), end) <= (band > 0 ? band : close)));
  Decaying found;
  if (band > 0)
    found.last_beyond = std::max(0.0, halves.last_beyond(band, level, 0.0, x0, end));
  else
    halves.find_largest(sign, level, 0.0, x0, end);
  found.largest = halves.largest;
  found.determined = halves.left > 0;
  return found;
}

}  // namespace

Decaying decaying(const MatrixXd& A, const RowVectorXd& c, const VectorXd& x0, double sign,
                  double band, double size) {
  const std::vector<Index> all = in_between(A, c, x0);
  if (all.empty()) return {.determined = true};
  return decaying_in_between(A(all, all), c(all), x0(all), sign, band, size);
}

}  // namespace tiltrim
