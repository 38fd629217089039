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
constexpr double verified = 1e-6;  // relative

// Poles and zeros of L, possibly with spurious ones.
std::vector<Complex> poles_and_zeros(const LoopTransfer& loop) {
  std::vector<Complex> found;
  collect_zeros(balanced(loop), found);
  const VectorXcd poles = eigenvalues(loop.A);
  found.insert(found.end(), poles.begin(), poles.end());
  return found;
}

/// The imaginary axis for a stable closed loop: S = 1/(1 + L) is finite everywhere on it.
struct Axis {
  static constexpr double resolved = 1e-7;  // a few √ε
  LoopTransfer L, S;
  std::vector<double> resonances;  // frequencies near poles and zeros that are close to the axis
  std::vector<double> poles;       // these, and |λ|, |Im λ| of the closed loop
  double slow = 0.0, fast = infinity;
  bool complete = true;

  Axis(const LoopTransfer& loop, const LoopTransfer& closed)
      : L(balanced(loop)), S(balanced(closed)) {
    // ω² loses accuracy below √ε of the slowest pole, and by the same ratio above the fastest.
    const VectorXcd lambda = eigenvalues(S.A);
    complete = lambda.size() == S.A.rows();
    if (lambda.size() == 0) return;
    slow = resolved * lambda.cwiseAbs().minCoeff();
    fast = lambda.cwiseAbs().maxCoeff() / resolved;
    resonances = near(lambda);
    poles = with_resonances(stops({lambda.begin(), lambda.end()}));
  }

  Complex sensitivity(double frequency) const { return S.d + proper(S, frequency); }
  Complex complementary(double frequency) const { return (1 - S.d) - proper(S, frequency); }
  // T/S. Near a pole of L rounding destroys the phase of S, but not that of L.
  Complex loop(double frequency) const {
    constexpr double small = 0.01;
    const Complex G = proper(S, frequency), s = S.d + G;
    return std::abs(s) < small ? L.d + proper(L, frequency) : (1 - S.d - G) / s;
  }

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

  // S varies within |Re λ| of Im λ, and the phase of L within that of its poles and zeros, which
  // may be less than the error of the zeros of combined(). These frequencies lie on both sides of
  // what is so close to the axis, by octaves.
  std::vector<double> near(const VectorXcd& lambda) const {
    constexpr double first = 0.125, last = 1e-5;  // of |Re λ|; of the fastest pole, ≫ √ε
    const double far = last * lambda.cwiseAbs().maxCoeff();
    std::vector<Complex> places{lambda.begin(), lambda.end()};
    for (const Complex s : poles_and_zeros(L))
      if (s.imag() > std::abs(s.real())) places.push_back(s);
    std::vector<double> found;
    for (const Complex s : places) {
      const double least = std::numeric_limits<double>::epsilon() * std::abs(s);
      const double close = std::max(first * std::abs(s.real()), least);
      if (close < far) found.push_back(s.imag());
      for (double away = close; away < far; away *= 2)
        for (const double w : {s.imag() - away, s.imag() + away}) found.push_back(w);
    }
    std::erase_if(found, [&](double w) { return !(w > slow && w < fast); });
    return found;
  }

  std::vector<double> with_resonances(std::vector<double> found) const {
    found.insert(found.end(), resonances.begin(), resonances.end());
    std::ranges::sort(found);
    found.erase(std::unique(found.begin(), found.end()), found.end());
    return found;
  }

  // Stops at the zeros, resonances, and a frequency between each two.
  std::vector<double> samples(const LoopTransfer& g, const Terms& terms) {
    if (S.A.rows() == 0) return {};
    std::vector<Complex> zeros;
    complete = collect_zeros(combined(g, terms), zeros) && complete;
    const std::vector<double> at = with_resonances(stops(zeros));
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

// The minimum of f between two samples, located to half the digits of their distance.
std::pair<double, double> turning(const Function& f, double low, double high) {
  constexpr int half_of_the_digits = 26;
  std::uintmax_t steps = 100;
  const auto at = [&](double share) { return std::min(low * std::pow(high / low, share), high); };
  const auto [turn, least] = boost::math::tools::brent_find_minima(
      [&](double share) { return f(at(share)); }, 0.0, 1.0, half_of_the_digits, steps);
  return {at(turn), least};
}

// How far f may be below the lowest of three samples: more than a parabola is.
double bend(double before, double lowest, double after) { return 0.5 * (before + after) - lowest; }

// Roots of f from its signs at ascending samples. Where f comes close to zero with no sign change,
// its minimum is located: two close roots, a double root, or no root.
std::vector<double> roots(const Function& f, const std::vector<double>& at) {
  constexpr double near = 1e-6, touching = 1e-13;
  std::vector<double> value, found;
  for (const double w : at) value.push_back(f(w));
  for (std::size_t k = 1; k + 1 < at.size(); ++k) {
    const double before = value[k - 1], after = value[k + 1], sign = before > 0 ? 1 : -1;
    const double lowest = sign * value[k], sides[] = {sign * before, sign * after};
    if (sides[1] <= 0 || std::abs(lowest) > std::min(sides[0], sides[1])) continue;
    if (!(std::abs(lowest) < std::max(near, bend(sides[0], lowest, sides[1])))) continue;
    auto [turn, least] = turning([&](double w) { return sign * f(w); }, at[k - 1], at[k + 1]);
    if (lowest < least) turn = at[k], least = lowest;
    if (least < -touching) {
      found.push_back(root_between(f, at[k - 1], turn));
      found.push_back(root_between(f, turn, at[k + 1]));
    } else if (least < touching) {
      found.push_back(turn);
    }
    value[k++] = before;  // processed
  }
  for (std::size_t k = 1; k < at.size(); ++k)
    if ((value[k] > 0) != (value[k - 1] > 0)) found.push_back(root_between(f, at[k - 1], at[k]));
  std::ranges::sort(found);
  return found;
}

struct Peak {
  double value, frequency;
};

// The largest value of f at the samples, and by local maximization wherever that may be higher.
Peak highest(const Function& f, const std::vector<double>& at, Peak best) {
  std::vector<double> value;
  for (const double w : at) {
    value.push_back(f(w));
    if (value.back() > best.value) best = {value.back(), w};
  }
  for (std::size_t k = 1; k + 1 < at.size(); ++k) {
    if (value[k] < std::max(value[k - 1], value[k + 1])) continue;
    const double rise = bend(-value[k - 1], -value[k], -value[k + 1]);
    if (value[k] + rise <= best.value) continue;
    const auto [w, least] = turning([&](double x) { return -f(x); }, at[k - 1], at[k + 1]);
    if (-least > best.value) best = {-least, w};
  }
  return best;
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

// L < 0 real. Where L is extremely small, rounding destroys its phase.
std::vector<Crossing> phase_crossings(Axis& axis) {
  constexpr double farthest = 1e9;
  const Function f = [&](double w) {
    const Complex L = axis.loop(w);
    return L == 0.0 || std::isinf(std::abs(L)) ? 0.0 : L.imag() / std::abs(L);
  };
  std::vector<double> at = roots(f, axis.samples(axis.S, {0, 1, -1, 0}));
  at.insert(at.begin(), 0.0);
  at.push_back(infinity);
  std::vector<Crossing> found;
  for (const double w : at) {
    if (std::abs(f(w)) > 0.5) continue;  // L passes through infinity or zero
    const double factor = -1 / axis.loop(w).real();
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

// The height of a resonance is as accurate as its pole's distance to the axis.
bool accurate(const Mode& pole) {
  constexpr double relative = 1e-3;
  return pole.error <= relative * std::abs(pole.eigenvalue.real());
}

// S at the peak again, from the loop as given.
bool confirmed(const Peak& peak, const Axis& axis, const LoopTransfer& loop) {
  const Complex L = loop.d + proper(loop, peak.frequency);
  const Complex S = std::isfinite(std::abs(L)) ? 1.0 / (1.0 + L) : 0.0;
  return std::abs(S - axis.sensitivity(peak.frequency)) <= verified * peak.value;
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
  Axis axis(loop, closed);
  m.phase_crossings = phase_crossings(axis);
  m.gain_crossovers = gain_crossovers(axis);
  take_gains(m);
  take_phases(m, loop.d);
  m.residual = residual(m, loop);
  const Peak disk = peak(axis, 0.5, max_levels);  // (S - T)/2 = S - ½
  m.disk = 1 / disk.value, m.disk_at = disk.frequency;
  const Peak sensitivity = peak(axis, 0.0, max_levels);
  m.sensitivity_peak = sensitivity.value, m.sensitivity_peak_at = sensitivity.frequency;
  m.complete = axis.complete && m.residual < verified &&
               std::ranges::all_of(closed_modes.modes, accurate) && confirmed(disk, axis, loop) &&
               confirmed(sensitivity, axis, loop);
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
