#include "linearize/margins.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <boost/math/tools/minima.hpp>
#include <boost/math/tools/toms748_solve.hpp>
#include <cmath>
#include <functional>
#include <numbers>
#include <stdexcept>

#include "dense/dense.hpp"
#include "linearize/balance.hpp"
#include "linearize/eigenvalues.hpp"
#include "linearize/peak_search.hpp"
#include "model/lookup.hpp"
#include "runtime/rounding.hpp"

namespace tiltrim {

using Complex = std::complex<double>;
using Eigen::Index, Eigen::MatrixXd, Eigen::RowVectorXd, Eigen::VectorXcd, Eigen::VectorXd;

namespace {

constexpr double infinity = std::numeric_limits<double>::infinity(), pi = std::numbers::pi;
constexpr double epsilon = std::numeric_limits<double>::epsilon();

void check(const LoopTransfer& loop) {
  const Index n = loop.A.rows();
  if (loop.A.cols() != n || loop.b.size() != n || loop.c.size() != n)
    throw std::invalid_argument(fmt::format("loop: A is {} x {}, b has {} rows, c {} columns", n,
                                            loop.A.cols(), loop.b.size(), loop.c.size()));
  if (!loop.A.allFinite() || !loop.b.allFinite() || !loop.c.allFinite() || !std::isfinite(loop.d))
    throw std::invalid_argument("loop: A, b, c or d is not finite");
}

// c (iωI - A)⁻¹ b
Complex proper(const LoopTransfer& g, double frequency) {
  if (g.A.rows() == 0 || std::isinf(frequency)) return 0.0;
  Eigen::MatrixXcd M = -g.A.cast<Complex>();
  M.diagonal().array() += Complex(0, frequency);
  const VectorXcd x = dense::solve(M, g.b.cast<Complex>());
  const Complex y = (g.c.cast<Complex>() * x).value();
  return std::isfinite(std::abs(y)) ? y : Complex(infinity);
}

// 1/g = 1/d - c/d (sI - A + b c/d)⁻¹ b/d
LoopTransfer inverse(const LoopTransfer& g) {
  return {g.A - g.b * (g.c / g.d), g.b / g.d, -g.c / g.d, 1 / g.d};
}

// 1/(1 + L) from L, and 1 + L from S - 1.
LoopTransfer inverse_of_one_plus(LoopTransfer g) {
  check(g);
  g.d += 1;
  if (g.d == 0) throw std::invalid_argument("loop: 1 + d = 0, the closed loop is not well posed");
  return inverse(g);
}

// States scaled so that A, b and c have similar size: the same transfer function.
LoopTransfer balanced(const LoopTransfer& g) {
  const Index n = g.A.rows();
  MatrixXd M(n + 1, n + 1);
  M << g.A, g.b, g.c, g.d;
  const Balanced as = balance(M);
  VectorXd unit(n + 1);
  for (Index i = 0; i <= n; ++i) unit[as.order[std::size_t(i)]] = as.scale[i];
  M = unit.cwiseInverse().asDiagonal() * M * unit.asDiagonal();
  return {M.topLeftCorner(n, n), M.topRightCorner(n, 1), M.bottomLeftCorner(1, n), g.d};
}

// p + q G(s) + r G(-s) + t G(s) G(-s), with G(-s) = bᵀ (-sI - Aᵀ)⁻¹ cᵀ + d.  Its real zeros on the
// axis are eigenvalues of a Hamiltonian matrix.                                         [44, 45]
struct Terms {
  double p, q, r, t;
};

LoopTransfer combined(const LoopTransfer& g, const Terms& k) {
  const Index n = g.A.rows();
  LoopTransfer f{MatrixXd::Zero(2 * n, 2 * n), VectorXd(2 * n), RowVectorXd(2 * n), 0.0};
  f.A.topLeftCorner(n, n) = g.A;
  f.A.bottomLeftCorner(n, n) = -k.t * g.c.transpose() * g.c;
  f.A.bottomRightCorner(n, n) = -g.A.transpose();
  f.b << g.b, -(k.r + k.t * g.d) * g.c.transpose();
  f.c << (k.q + k.t * g.d) * g.c, g.b.transpose();
  f.d = k.p + (k.q + k.r) * g.d + k.t * g.d * g.d;
  return f;
}

// With c = (γ 0 ... 0) a zero has x₁ = 0, and the equation for x₁' becomes the output.       [46]
LoopTransfer without_output_state(const LoopTransfer& g) {
  const Index rest = g.A.rows() - 1;
  const MatrixXd Q = dense::svd(g.c.transpose()).U;
  const MatrixXd A = Q.transpose() * g.A * Q;
  const VectorXd b = Q.transpose() * g.b;
  return {A.bottomRightCorner(rest, rest), b.tail(rest), A.row(0).tail(rest), b[0]};
}

// Zeros of G: eigenvalues of A - b c/d if d is not zero. If rounding leaves that in doubt, the
// zeros for both cases. Returns false if an eigenvalue iteration reached its limit.
bool collect_zeros(LoopTransfer g, std::vector<Complex>& found) {
  constexpr double certainly_zero = epsilon, certainly_not = 1e-3;  // d relative to the rest
  bool complete = true;
  for (; g.A.rows() > 0; g = without_output_state(g)) {
    const double dynamic = g.b.norm() * g.c.norm(), direct = std::abs(g.d) * g.A.norm();
    if (direct > certainly_zero * dynamic) {
      const VectorXcd zeros = eigenvalues(inverse(g).A);
      complete = complete && zeros.size() == g.A.rows();
      found.insert(found.end(), zeros.begin(), zeros.end());
    }
    if (direct > certainly_not * dynamic || dynamic == 0) break;
  }
  return complete;
}

/// The imaginary axis for a stable closed loop: S = 1/(1 + L) is finite everywhere on it.
struct Axis {
  static constexpr double resolved = 1e-7;  // a few √ε
  LoopTransfer S;
  std::vector<double> poles;  // |λ|, |Im λ| of the closed loop
  double slow = 0.0, fast = infinity;
  bool complete = true;

  explicit Axis(const LoopTransfer& closed) : S(balanced(closed)) {
    // ω² loses accuracy below √ε of the slowest pole, and by the same ratio above the fastest.
    const VectorXcd lambda = eigenvalues(S.A);
    complete = lambda.size() == S.A.rows();
    if (lambda.size() == 0) return;
    slow = resolved * lambda.cwiseAbs().minCoeff();
    fast = lambda.cwiseAbs().maxCoeff() / resolved;
    poles = stops({lambda.begin(), lambda.end()});
  }

  Complex sensitivity(double frequency) const { return S.d + proper(S, frequency); }
  Complex complementary(double frequency) const { return (1 - S.d) - proper(S, frequency); }

  // Ascending frequencies of roots on or near the axis, and the range's ends, without duplicates.
  std::vector<double> stops(const std::vector<Complex>& places) const {
    std::vector<double> found{slow, fast};
    for (const Complex s : places)
      for (const double w : {std::abs(s.imag()), std::abs(s)})
        if (w > slow && w < fast) found.push_back(w);
    std::ranges::sort(found);
    const auto one = [](double w, double next) { return next <= w * (1 + resolved); };
    found.erase(std::unique(found.begin(), found.end(), one), found.end());
    return found;
  }

  // The same, with a frequency between each two.
  std::vector<double> samples(const LoopTransfer& g, const Terms& terms) {
    if (S.A.rows() == 0) return {};
    std::vector<Complex> zeros;
    complete = collect_zeros(combined(g, terms), zeros) && complete;
    const std::vector<double> at = stops(zeros);
    std::vector<double> found{at.front()};
    for (std::size_t k = 1; k < at.size(); ++k) {
      found.push_back(std::sqrt(at[k - 1]) * std::sqrt(at[k]));
      found.push_back(at[k]);
    }
    return found;
  }
};

using Function = std::function<double(double)>;
using Crossing = Margins::Crossing;

double root_between(const Function& f, double low, double high) {
  std::uintmax_t steps = 200;  // bisection alone takes less than 100 for ratios of 1e15
  const auto [a, b] = boost::math::tools::toms748_solve(
      f, low, high, boost::math::tools::eps_tolerance<double>(52), steps);
  return std::abs(f(a)) < std::abs(f(b)) ? a : b;
}

// The minimum of f between two samples, located to half the digits.
std::pair<double, double> turning(const Function& f, double low, double high) {
  constexpr int half_of_the_digits = 26;
  std::uintmax_t steps = 100;
  return boost::math::tools::brent_find_minima(f, low, high, half_of_the_digits, steps);
}

// Roots of f from its signs at ascending samples. Where f comes close to zero with no sign change,
// its minimum is located: two close roots, a double root, or no root.
std::vector<double> roots(const Function& f, const std::vector<double>& at) {
  constexpr double near = 1e-6, touching = 1e-13;
  std::vector<double> value, found;
  for (const double w : at) value.push_back(f(w));
  for (std::size_t k = 1; k + 1 < at.size(); ++k) {
    const double before = value[k - 1], after = value[k + 1], sign = before > 0 ? 1 : -1;
    if (!(std::abs(value[k]) < near) || sign * after <= 0) continue;
    if (std::abs(value[k]) > std::min(std::abs(before), std::abs(after))) continue;
    const auto [turn, least] = turning([&](double w) { return sign * f(w); }, at[k - 1], at[k + 1]);
    if (least < -touching) {
      found.push_back(root_between(f, at[k - 1], turn));
      found.push_back(root_between(f, turn, at[k + 1]));
    } else if (least < touching) {
      found.push_back(turn);
    }
    value[k] = before;  // processed
  }
  for (std::size_t k = 1; k < at.size(); ++k)
    if ((value[k] > 0) != (value[k - 1] > 0)) found.push_back(root_between(f, at[k - 1], at[k]));
  std::ranges::sort(found);
  return found;
}

struct Peak {
  double value, frequency;
};

// The largest value of f at the samples, refined by local maximization.
Peak highest(const Function& f, const std::vector<double>& at, Peak best) {
  std::size_t top = at.size();
  for (std::size_t k = 0; k < at.size(); ++k)
    if (const double value = f(at[k]); value > best.value) best = {value, at[k]}, top = k;
  if (top == 0 || top + 1 >= at.size()) return best;
  const auto [w, least] = turning([&](double x) { return -f(x); }, at[top - 1], at[top + 1]);
  return -least > best.value ? Peak{-least, w} : best;
}

// ‖S - m‖∞: from the highest value found, level by level, until no frequency reaches it. [44, 45]
Peak peak(Axis& axis, double m, int max_levels) {
  constexpr double above = 1e-9;  // relative
  LoopTransfer g = axis.S;
  g.d -= m;
  const Function size = [&](double w) { return std::abs(g.d + proper(g, w)); };
  const double rest = size(0), end = size(infinity);
  Peak best = highest(size, axis.poles, rest < end ? Peak{end, infinity} : Peak{rest, 0.0});
  for (int k = 0; k < max_levels; ++k) {
    const double level = (1 + above) * best.value;
    if (level == 0) return best;
    best = highest(size, axis.samples(g, {-level * level, 0, 0, 1}), best);
    if (!(best.value > level)) return best;
  }
  axis.complete = false;
  return best;
}

// L < 0 real: S > 1 or S < 0, and real. Where S or 1 - S is extremely small, rounding destroys its
// phase (about ε^⅔ near a double integrator).
std::vector<Crossing> phase_crossings(Axis& axis) {
  constexpr double farthest = 1e9;
  const Function f = [&](double w) {
    const Complex T = axis.complementary(w);
    return T == 0.0 ? 0.0 : T.imag() / std::abs(T);
  };
  std::vector<double> at = roots(f, axis.samples(axis.S, {0, 1, -1, 0}));
  at.insert(at.begin(), 0.0);
  at.push_back(infinity);
  std::vector<Crossing> found;
  for (const double w : at) {
    const double factor = -axis.sensitivity(w).real() / axis.complementary(w).real();  // -1/L
    if (factor > 1 / farthest && factor < farthest) found.push_back({w, factor});
  }
  return found;
}

// |L| = 1: |S| = |1 - S|, Re S = ½
std::vector<Crossing> gain_crossovers(Axis& axis) {
  constexpr double touching = 1e-14;
  const Function f = [&](double w) {
    const Complex S = axis.sensitivity(w);
    return (S.real() - 0.5) / (std::abs(S) + 0.5);
  };
  std::vector<double> at = roots(f, axis.samples(axis.S, {-1, 1, 1, 0}));
  if (std::abs(f(0)) < touching) at.insert(at.begin(), 0.0);
  if (std::abs(f(infinity)) < touching) at.push_back(infinity);
  std::vector<Crossing> found;
  for (const double w : at)
    found.push_back({w, std::arg(-axis.complementary(w) / axis.sensitivity(w))});  // -L = exp(iφ)
  return found;
}

void take_gains(Margins& m) {
  m.gain_up = infinity, m.gain_down = 0;
  for (const Crossing& at : m.phase_crossings) {
    if (at.change > 1 && at.change < m.gain_up) m.gain_up = at.change, m.gain_up_at = at.frequency;
    if (at.change < 1 && at.change > m.gain_down)
      m.gain_down = at.change, m.gain_down_at = at.frequency;
  }
}

// A delay τ is a phase lag ωτ. For |d| >= 1 any delay destabilizes at high frequency.        [47]
void take_phases(Margins& m, double d) {
  m.phase = m.delay = infinity;
  for (const Crossing& at : m.gain_crossovers) {
    if (std::abs(at.change) < m.phase) m.phase = std::abs(at.change), m.phase_at = at.frequency;
    const double delay = (at.change > 0 ? at.change : at.change + 2 * pi) / at.frequency;
    if (delay < m.delay) m.delay = delay, m.delay_at = at.frequency;
  }
  if (std::abs(d) >= 1) m.delay = 0, m.delay_at = infinity;
}

double residual(const Margins& m, const LoopTransfer& loop) {
  double largest = 0.0;
  const auto see = [&](double w, Complex change) {
    const double left_over = std::abs(1.0 + change * (loop.d + proper(loop, w)));
    if (!(left_over <= largest)) largest = left_over;  // also catches NaN
  };
  for (const Crossing& at : m.phase_crossings) see(at.frequency, at.change);
  for (const Crossing& at : m.gain_crossovers) see(at.frequency, std::polar(1.0, -at.change));
  return largest;
}

// Poles and zeros of L, possibly with spurious ones.
std::vector<Complex> poles_and_zeros(const LoopTransfer& loop) {
  std::vector<Complex> found;
  collect_zeros(balanced(loop), found);
  const VectorXcd poles = eigenvalues(loop.A);
  found.insert(found.end(), poles.begin(), poles.end());
  return found;
}

// Change of phase between two frequencies, bounded by the angles that the poles and zeros subtend.
// Steps are halved until the bound is less than half a turn.
double turn(const LoopTransfer& loop, const std::vector<Complex>& places, double from, double to,
            int halvings) {
  constexpr double certain = 2.0;  // rad, well below π
  double most = 0.0;
  for (const Complex s : places)
    most += std::abs(std::arg((Complex(0, to) - s) / (Complex(0, from) - s)));
  if (most > certain && halvings > 0) {
    const double middle = std::sqrt(from) * std::sqrt(to);
    return turn(loop, places, from, middle, halvings - 1) +
           turn(loop, places, middle, to, halvings - 1);
  }
  const double step = std::arg(response(loop, to) / response(loop, from));
  return std::isfinite(step) ? step : 0.0;  // to or from a pole or zero on the axis
}

}  // namespace

std::complex<double> response(const LoopTransfer& loop, double frequency) {
  check(loop);
  if (std::isnan(frequency)) throw std::invalid_argument("loop: the frequency is not a number");
  return loop.d + proper(loop, frequency);
}

LoopTransfer opened(const MatrixXd& A_closed, const VectorXd& b, const RowVectorXd& c, double d) {
  const RoundToNearest environment;
  LoopTransfer loop = inverse_of_one_plus({A_closed, b, c, d});
  loop.d = -d / (1 + d);
  return loop;
}
LoopTransfer opened(const LinearModel& closed, std::string_view input, std::string_view output) {
  const Index j = index_of(closed.inputs, input, "input");
  const Index i = index_of(closed.outputs, output, "output");
  return opened(closed.A, closed.B.col(j), closed.C.row(i), closed.D(i, j));
}

// (1 + z)/(1 - z) for real z, and for imaginary z                                            [43]
double Margins::disk_gain_down() const { return std::max((2 - disk) / (2 + disk), 0.0); }
double Margins::disk_gain_up() const { return disk < 2 ? (2 + disk) / (2 - disk) : infinity; }
double Margins::disk_phase() const { return 2 * std::atan(disk / 2); }

Margins margins(const LoopTransfer& loop) { return margins(loop, peak_levels); }

Margins margins(const LoopTransfer& loop, int max_levels) {
  const RoundToNearest environment;
  const LoopTransfer closed = inverse_of_one_plus(loop);
  Margins m;
  const Modes closed_modes = modes(closed.A);
  m.closed_loop = closed_modes.verdict;
  m.complete = closed_modes.converged;
  if (!m.stable()) return m;
  Axis axis(closed);
  m.phase_crossings = phase_crossings(axis);
  m.gain_crossovers = gain_crossovers(axis);
  take_gains(m);
  take_phases(m, loop.d);
  m.residual = residual(m, loop);
  const Peak disk = peak(axis, 0.5, max_levels);  // (S - T)/2 = S - ½
  m.disk = 1 / disk.value, m.disk_at = disk.frequency;
  const Peak sensitivity = peak(axis, 0.0, max_levels);
  m.sensitivity_peak = sensitivity.value, m.sensitivity_peak_at = sensitivity.frequency;
  constexpr double verified = 1e-6;
  m.complete = axis.complete && m.residual < verified;
  return m;
}

Bode bode(const LoopTransfer& loop, double from, double to, int points) {
  const RoundToNearest environment;
  check(loop);
  if (!(from > 0 && from < to && std::isfinite(to)) || points < 2)
    throw std::invalid_argument(fmt::format("bode: no {} points from {} to {}", points, from, to));
  const std::vector<Complex> places = poles_and_zeros(loop);
  constexpr double rounding = 1e-3;
  constexpr int halvings = 60;  // then the step is at rounding level
  Bode answer;
  for (int k = 0; k < points; ++k) {
    const double w = k + 1 == points ? to : from * std::pow(to / from, double(k) / (points - 1));
    const Complex L = response(loop, w);
    const double angle = std::arg(L);
    const double expected =
        k == 0 ? -pi / 2 + rounding
               : answer.phase.back() + turn(loop, places, answer.frequency.back(), w, halvings);
    answer.frequency.push_back(w);
    answer.magnitude.push_back(std::abs(L));
    answer.phase.push_back(angle + 2 * pi * std::round((expected - angle) / (2 * pi)));
  }
  return answer;
}

}  // namespace tiltrim
