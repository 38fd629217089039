#include "linearize/margins.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <boost/math/tools/minima.hpp>
#include <boost/math/tools/toms748_solve.hpp>
#include <cmath>
#include <functional>
#include <numbers>
#include <stdexcept>

#include "linearize/eigenvalues.hpp"
#include "linearize/loop_transfer.hpp"
#include "linearize/peak_search.hpp"
#include "runtime/rounding.hpp"

namespace tiltrim {

using namespace transfer;
using Eigen::VectorXcd;

namespace {

constexpr double infinity = std::numeric_limits<double>::infinity(), pi = std::numbers::pi;

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
