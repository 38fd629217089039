#include "qualities/qualities.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>

#include "model/lookup.hpp"
#include "qualities/coordinates.hpp"
#include "qualities/levels.hpp"
#include "qualities/oscillations.hpp"
#include "runtime/rounding.hpp"

namespace tiltrim {

using Eigen::Index;
using Root = std::complex<double>;

std::string to_string(AircraftClass one) {
  constexpr std::array names{"I", "II-L", "II-C", "III", "IV"};
  return names[std::size_t(one)];
}

std::string to_string(FlightCategory one) {
  constexpr std::array names{"A", "B", "C"};
  return names[std::size_t(one)];
}

std::string to_string(FlightRegime one) {
  return one == FlightRegime::forward ? "forward" : "hover";
}

std::string to_string(OscillationKind kind) {
  constexpr std::array names{"pair", "two_real", "absent"};
  return names[std::size_t(kind)];
}

std::string to_string(QualitiesStatus status) {
  constexpr std::array names{"judged", "no_longitudinal_mode"};
  return names[std::size_t(status)];
}

namespace {

constexpr double unlimited_above = std::numeric_limits<double>::infinity();
constexpr double most = 0.5;  // of a mode's participation

Criterion not_judged(std::string name, std::string requirement, std::string why) {
  Criterion c{std::move(name), std::move(requirement), {}};
  c.value = std::numeric_limits<double>::quiet_NaN();
  c.remark = std::move(why);
  return c;
}

// Nothing depends on the state of a kinematic integrator, such as height: an exact zero of A, with
// no error, that cannot diverge.
bool is_integrator(const Mode& mode) { return mode.eigenvalue == 0.0 && mode.error == 0; }

// The least over all roots of a margin for each level; margins are distances in the plane of
// eigenvalues, so their errors are those of the roots.
using RootMargins = std::vector<std::function<double(Root)>>;
Criterion for_roots(std::string name, std::string requirement,
                    const std::vector<const Mode*>& modes, const RootMargins& margins) {
  Criterion c{std::move(name), std::move(requirement), "1/s"};
  c.margin_unit = "1/s";
  c.margins.assign(margins.size(), unlimited_above);
  const Mode* worst = nullptr;
  bool integrates = false;
  for (const Mode* mode : modes) {
    integrates = integrates || is_integrator(*mode);
    if (is_integrator(*mode)) continue;
    c.margin_error = std::max(c.margin_error, mode->error);
    for (std::size_t k = 0; k < margins.size(); ++k) {
      const double margin = margins[k](mode->eigenvalue);
      if (!worst || margin < c.margins[0]) worst = k == 0 ? mode : worst;
      c.margins[k] = std::min(c.margins[k], margin);
    }
  }
  if (!worst) {
    c.margins.clear();
    c.value = std::numeric_limits<double>::quiet_NaN();
    c.remark = integrates ? "only integrators, which do not diverge" : "no such mode";
    return c;
  }
  c.value = worst->eigenvalue.real();
  c.error = worst->error;
  const double w = std::abs(worst->eigenvalue.imag());
  if (w > 0 && worst->frequency() > c.error)
    c.remark = fmt::format("{:.4g} ± {:.4g}i: {:.4g} rad/s, damping {:.4g}", c.value, w,
                           worst->frequency(), worst->damping());
  if (c.value > c.error)
    c.remark +=
        fmt::format("{}doubles in {:.3g} s", c.remark.empty() ? "" : ", ", worst->time_to_half());
  return judged(c);
}

struct Judging {
  const LinearModel& linear;
  const QualitiesOptions& options;
  Qualities& answer;

  std::vector<const Mode*> longitudinal(bool oscillating) const {
    std::vector<const Mode*> found;
    for (std::size_t k = 0; k < answer.shares.size(); ++k) {
      const Mode& mode = answer.modes.modes[k];
      const bool asked = oscillating ? mode.eigenvalue.imag() > 0 : mode.eigenvalue.imag() == 0;
      if (asked && answer.shares[k].longitudinal() > most) found.push_back(&mode);
    }
    return found;
  }
  void add(Criterion c) { answer.criteria.push_back(std::move(c)); }
};

// MIL-F-8785C 3.2.1.1 [94]: no aperiodic divergence; level 3: doubles in 6 s or more.
void judge_static_stability(Judging& j) {
  const auto stable = [](Root r) { return -r.real(); };
  j.add(for_roots("aperiodic stability", "MIL-F-8785C 3.2.1.1", j.longitudinal(false),
                  {stable, stable, [](Root r) { return slower_than(r, 6.0); }}));
}

// MIL-F-8785C 3.2.1.2 [94]: ζ >= 0.04; ζ >= 0; doubles in 55 s or more, -ζ ω <= ln 2/55.
void judge_phugoid(Judging& j) {
  const Oscillation& p = j.answer.phugoid;
  const char* const name = "phugoid damping";
  const char* const source = "MIL-F-8785C 3.2.1.2";
  if (p.kind != OscillationKind::pair) {
    j.add(not_judged(name, source, p.message));
    return;
  }
  const double growth = std::numbers::ln2 / 55, w = p.frequency.value;
  Criterion c{name, source, "", p.damping.value, p.damping.error};
  c.margins = {c.value - 0.04, c.value, c.value + growth / w};
  const double slowest = w - p.frequency.error;
  c.margin_error = c.error + (slowest > 0 ? growth / slowest - growth / w : unlimited_above);
  j.add(judged(c));
}

// MIL-F-8785C 3.2.2.1.2, table IV [94].
std::vector<Range> damping_limits(FlightCategory category) {
  if (category == FlightCategory::B) return {{0.30, 2.00}, {0.20, 2.00}, {0.15, unlimited_above}};
  return {{0.35, 1.30}, {0.25, 2.00}, {0.15, unlimited_above}};
}

// ω²/(n/α): MIL-F-8785C 3.2.2.1.1, figures 1, 2, 3 [94].
std::vector<Range> anticipation_limits(FlightCategory category) {
  switch (category) {
    case FlightCategory::A:
      return {{0.28, 3.6}, {0.16, 10.0}, {0.16, unlimited_above}};
    case FlightCategory::B:
      return {{0.085, 3.6}, {0.038, 10.0}, {0.038, unlimited_above}};
    default:
      return {{0.16, 3.6}, {0.096, 10.0}, {0.096, unlimited_above}};
  }
}

// The least frequency and n/α that figures 1 and 3 add; none in category B, none for level 3.
struct Floors {
  std::array<double, 2> frequency, n_per_alpha;
};
std::optional<Floors> floors_of(FlightCategory category, AircraftClass aircraft) {
  if (category == FlightCategory::A) return Floors{{1.0, 0.6}, {}};
  if (category == FlightCategory::B) return {};
  if (aircraft == AircraftClass::II_L || aircraft == AircraftClass::III)
    return Floors{{0.7, 0.4}, {2.0, 1.0}};
  return Floors{{0.87, 0.6}, {2.7, 1.8}};
}

Criterion floored(const char* name, const char* unit, const Bounded& figure,
                  const std::array<double, 2>& least) {
  return within(name, "MIL-F-8785C 3.2.2.1.1", unit, figure.value, figure.error,
                {{least[0], unlimited_above}, {least[1], unlimited_above}, {}});
}

void judge_anticipation(Judging& j) {
  const Oscillation& s = j.answer.short_period;
  const Bounded& n = j.answer.n_per_alpha;
  if (std::isnan(n.value)) {
    j.add(not_judged("control anticipation", "MIL-F-8785C 3.2.2.1.1", "n/alpha is not known"));
    return;
  }
  const double w = s.frequency.value, e = s.frequency.error, cap = w * w / n.value;
  const double error = n.value > n.error
                           ? ((w + e) * (w + e) - w * w + cap * n.error) / (n.value - n.error)
                           : unlimited_above;
  j.add(within("control anticipation", "MIL-F-8785C 3.2.2.1.1", "1/(g s²)", cap, error,
               anticipation_limits(j.options.category)));
  const auto floors = floors_of(j.options.category, j.options.aircraft);
  if (!floors) return;
  j.add(floored("short-period frequency", "rad/s", s.frequency, floors->frequency));
  if (floors->n_per_alpha[0] > 0)
    j.add(floored("acceleration sensitivity", "g/rad", n, floors->n_per_alpha));
}

void judge_short_period(Judging& j) {
  const Oscillation& s = j.answer.short_period;
  if (s.kind == OscillationKind::absent) {
    j.add(not_judged("short-period damping", "MIL-F-8785C 3.2.2.1.2", s.message));
    j.add(not_judged("control anticipation", "MIL-F-8785C 3.2.2.1.1", s.message));
    return;
  }
  const std::size_t first = j.answer.criteria.size();
  j.add(within("short-period damping", "MIL-F-8785C 3.2.2.1.2", "", s.damping.value,
               s.damping.error, damping_limits(j.options.category)));
  judge_anticipation(j);
  if (s.kind == OscillationKind::two_real)
    for (std::size_t k = first; k < j.answer.criteria.size(); ++k)
      if (Criterion& c = j.answer.criteria[k]; c.level != Level::not_judged)
        c.remark = "equivalent of two real roots" + (c.remark.empty() ? "" : ", " + c.remark);
}

// MIL-F-83300 3.2.2.1 [96]. "a below f" is max(f₀ - f, a): true above f₀, or where a holds.
void judge_hover(Judging& j) {
  const auto above = [](Root r, double w) { return -below_frequency(r, w); };
  const RootMargins aperiodic{[](Root r) { return -r.real(); },
                              [](Root r) { return slower_than(r, 12.0); },
                              [](Root r) { return slower_than(r, 5.0); }};
  const RootMargins oscillating{
      [&](Root r) {
        return std::min({std::max(above(r, 0.5), beyond_damping(r, -0.10)),
                         std::max(below_frequency(r, 0.5), -r.real()),
                         std::max(below_frequency(r, 1.1), beyond_damping(r, 0.3))});
      },
      [](Root r) {
        return std::max(-r.real(), std::min(below_frequency(r, 0.84), slower_than(r, 12.0)));
      },
      [](Root r) {
        return std::max(-r.real(), std::min(below_frequency(r, 1.25), slower_than(r, 5.0)));
      }};
  j.add(for_roots("aperiodic response", "MIL-F-83300 3.2.2.1", j.longitudinal(false), aperiodic));
  j.add(for_roots("oscillation", "MIL-F-83300 3.2.2.1", j.longitudinal(true), oscillating));
  // With divided attention, level 1 needs ζ >= 0.35 at all frequencies [97, 3.3.2.3.2].
  j.add(for_roots("oscillation, divided attention", "ADS-33E-PRF 3.3.2.3.2", j.longitudinal(true),
                  {[](Root r) { return beyond_damping(r, 0.35); }}));
}

// The least bandwidth at a phase delay, and its slope; beyond the ends as at the ends.
std::array<double, 2> border_at(const std::vector<std::array<double, 2>>& border, double delay) {
  if (delay <= border.front()[0]) return {border.front()[1], 0.0};
  for (std::size_t k = 0; k + 1 < border.size(); ++k) {
    const auto &a = border[k], &b = border[k + 1];
    if (delay > b[0]) continue;
    const double slope = (b[1] - a[1]) / (b[0] - a[0]);
    return {a[1] + slope * (delay - a[0]), slope};
  }
  return {border.back()[1], 0.0};
}

void judge_bandwidth(Judging& j) {
  const Roles& roles = j.options.roles;
  if (roles.stick.empty()) return;
  j.answer.attitude = zeros_and_poles(j.linear, roles.stick, roles.pitch);
  Bandwidth& b = j.answer.bandwidth = bandwidth(*j.answer.attitude, j.options.response);
  if (!b.message.empty()) j.answer.remarks.push_back("bandwidth: " + b.message);
  if (j.options.regime != FlightRegime::hover || j.options.least_bandwidth[0].empty()) return;
  const char* const source = "ADS-33E-PRF 3.3.2.1";
  if (!b.known) {
    j.add(not_judged("attitude bandwidth", source, b.message));
    return;
  }
  Criterion c{"attitude bandwidth", source, "rad/s", b.bandwidth.value, b.bandwidth.error};
  c.margin_unit = c.unit;
  double steepest = 0.0;
  for (const auto& border : j.options.least_bandwidth) {
    if (border.empty()) break;
    c.margins.push_back(c.value - border_at(border, b.phase_delay.value)[0]);
    for (const double side : {-1.0, 1.0})
      steepest = std::max(steepest, std::abs(border_at(border, b.phase_delay.value +
                                                                   side * b.phase_delay.error)[1]));
  }
  c.margin_error = c.error + steepest * b.phase_delay.error;
  j.add(judged(c));
}

void check_options(const LinearModel& linear, const QualitiesOptions& options) {
  if (!linear) throw std::invalid_argument("qualities: there is no linear model");
  if (options.roles.pitch.empty() || options.roles.pitch_rate.empty())
    throw std::invalid_argument("qualities: the roles pitch and pitch_rate are needed");
  if (options.airspeed <= 0 || std::isinf(options.airspeed))
    throw std::invalid_argument("qualities: airspeed is not a number above 0");
  if (options.gravity <= 0) throw std::invalid_argument("qualities: gravity is not above 0");
  if (options.n_per_alpha <= 0)
    throw std::invalid_argument("qualities: n_per_alpha is not above 0");
  for (const auto& border : options.least_bandwidth)
    for (std::size_t k = 0; k < border.size(); ++k)
      if (k > 0 && !(border[k][0] > border[k - 1][0]))
        throw std::invalid_argument("qualities: the phase delays of a border do not rise");
  if (!options.roles.stick.empty()) (void)index_of(linear.inputs, options.roles.stick, "input");
}

void judge_forward(Judging& j, const RoleCoordinates& at) {
  Qualities& q = j.answer;
  q.short_period =
      oscillation_with(q.modes, q.shares, &Qualities::ModeShares::fast, "short period", {});
  q.phugoid = oscillation_with(q.modes, q.shares, &Qualities::ModeShares::slow, "phugoid",
                               q.short_period.modes);
  std::string why;
  q.n_per_alpha =
      acceleration_sensitivity(j.linear, at, j.options, airspeed_of(j.linear, j.options), why);
  if (!why.empty()) q.remarks.push_back(why);
  judge_static_stability(j);
  judge_phugoid(j);
  judge_short_period(j);
}

}  // namespace

Qualities qualities(const LinearModel& linear, const QualitiesOptions& options) {
  const RoundToNearest environment;
  check_options(linear, options);
  Qualities answer;
  const RoleCoordinates at = role_coordinates(linear, options.roles);
  answer.modes = modes(linear);
  answer.shares = shares_of(answer.modes, at);
  Judging j{linear, options, answer};
  const bool any = std::ranges::any_of(
      answer.shares, [](const Qualities::ModeShares& s) { return s.longitudinal() > most; });
  answer.status = any ? QualitiesStatus::judged : QualitiesStatus::no_longitudinal_mode;
  if (!any) return answer;
  if (options.regime == FlightRegime::forward)
    judge_forward(j, at);
  else
    judge_hover(j);
  judge_bandwidth(j);
  answer.level = worst_of(answer.criteria);
  return answer;
}

}  // namespace tiltrim
