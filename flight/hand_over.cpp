#include "flight/hand_over.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <boost/math/tools/toms748_solve.hpp>
#include <cmath>
#include <cstdint>
#include <functional>
#include <limits>
#include <numbers>
#include <utility>

#include "flight/flight.hpp"
#include "flight/fly.hpp"
#include "linearize/linearize.hpp"
#include "linearize/modes.hpp"
#include "model/degrees.hpp"
#include "runtime/rounding.hpp"
#include "vehicles/tiltrotor/corridor.hpp"
#include "vehicles/tiltrotor/formulations.hpp"
#include "vehicles/tiltrotor/numbers.hpp"

namespace tiltrim {

namespace {

constexpr double beside = 1e-9;  // rad: distance of the two trims from the handover

// Sign changes of a function, sampled on a fine grid.
std::vector<double> sign_changes(const std::function<double(double)>& f, double from, double to) {
  constexpr int points = 2000;
  std::vector<double> found;
  double before = f(from);
  for (int k = 1; k <= points; ++k) {
    const double a = from + (to - from) * (k - 1) / points, b = from + (to - from) * k / points;
    const double here = f(b);
    if ((before > 0) != (here > 0)) {
      std::uintmax_t steps = 100;
      if (here == 0 || before == 0)
        found.push_back(here == 0 ? b : a);
      else
        found.push_back(
            boost::math::tools::toms748_solve(f, a, b, before, here,
                                              boost::math::tools::eps_tolerance<double>(), steps)
                .second);
    }
    before = here;
  }
  return found;
}

struct Place {
  double t, h;
  bool to_elevator;
};

std::vector<Place> places(const Flight& flight, const HandOverOptions& options) {
  const double off = flight.vehicle.aircraft.cyclic_off;
  const auto beyond = [&](double t, double h) { return flight.schedule.command(t, h).eta - off; };
  std::vector<Place> found;
  for (const double h : sign_changes([&](double h) { return beyond(0.0, h); }, 0.0, options.height))
    found.push_back({0.0, h, beyond(0.0, h + 1e-6) < 0});
  if (!found.empty()) return found;
  for (const double t :
       sign_changes([&](double t) { return beyond(t, options.height); }, 0.0, options.duration))
    found.push_back({t, options.height, beyond(t + 1e-6, options.height) < 0});
  return found;
}

// ∫ dh/(V sin γ) over the schedule's heights, or the time itself.
double seconds_to(const Schedule& schedule, const Place& place) {
  if (place.t > 0) return place.t;
  constexpr int slices = 1000;
  double seconds = 0.0;
  for (int k = 0; k < slices; ++k) {
    const Command c = schedule.command(0.0, place.h * (k + 0.5) / slices);
    seconds += place.h / slices / (c.V * std::sin(c.gamma));
  }
  return seconds;
}

// The loop frozen on one side of the handover: constant command, tilt just off the handover.
Flight frozen(const Flight& flight, const Command& command, bool airplane) {
  Flight steady = flight;
  Command held_at = command;
  held_at.eta = flight.vehicle.aircraft.cyclic_off + (airplane ? -beside : beside);
  steady.schedule = held(held_at);
  steady.wind = {};
  steady.disturbance = {};
  steady.kink_times.clear();
  steady.rates = {};
  return steady;
}

HandOverSide side_of(const Flight& flight, const Command& command, bool airplane, double height,
                     const TrimOptions& trimming) {
  const Flight steady = frozen(flight, command, airplane);
  const Command at = steady.schedule.command(0.0, height);
  HandOverSide side;
  side.airplane = airplane;
  const TrimmedStart trim = trimmed_start(steady, at, height, trimming);
  side.status = trim.status;
  side.message = trim.message;
  if (!trim) return side;
  side.state = trim.start.state;
  side.inputs = flight_point(steady, {false, airplane}, 0.0, side.state).used;
  Vehicle vehicle = flight.vehicle;
  vehicle.gains = gains_at(flight, at.eta);
  Eigen::VectorXd x(6);
  x << 0.0, 0.0, side.state.theta, side.state.q, side.state.x1, side.state.x2;
  const Eigen::VectorXd p = closed_loop_parameters(vehicle, at);
  const LinearModel linear = linearize(closed_loop(vehicle), {x, Eigen::VectorXd(), p});
  side.abscissa =
      linear ? modes(linear).spectral_abscissa : std::numeric_limits<double>::quiet_NaN();
  return side;
}

// Continues along the schedule from the trim before the handover; a lagging tilt starts just past
// it.
FlightResult flown_on(const Flight& flight, const HandOverCheck& check, double seconds) {
  Flight on = flight;
  on.axes = Axes::body;
  on.wind = {};
  on.disturbance = {};
  on.kink_times.clear();
  constexpr double just_behind = 1e-6;  // s, m
  FlightStart start{check.front.state, false};
  start.state.height = check.height + just_behind;
  start.state.eta = flight.vehicle.aircraft.cyclic_off + (check.behind.airplane ? -beside : beside);
  FlyOptions options;
  options.begins = check.t + just_behind;
  options.duration = seconds;
  return fly(on, start, options);
}

bool settled(const Flight& flight, const FlightResult& flown, double steepest) {
  if (!flown && flown.status != FlightStatus::landed) return false;
  for (const FlightState& x : flown.states)
    if (std::abs(x.theta) > steepest) return false;
  constexpr double speed = 0.5, angle = 0.1;  // m/s, rad: near the final command
  const FlightPoint at =
      flight_point(flight, flown.modes.back(), flown.t.back(), flown.states.back());
  return std::abs(at.V - at.command.V) < speed && std::abs(at.gamma - at.command.gamma) < angle;
}

std::string beyond(double value, const Range& range, const char* name, double unit,
                   const char* unit_name) {
  if (value >= range.lower && value <= range.upper) return "";
  const double limit = value > range.upper ? range.upper : range.lower;
  return fmt::format("{} would need {:.3g}{}, but its limit is {:.3g}{}", name, value * unit,
                     unit_name, limit * unit, unit_name);
}

std::string cause(const Flight& flight, const HandOverCheck& c) {
  const Gains k = gains_at(flight, c.command.eta);
  const Limits& limits = flight.vehicle.limits;
  const std::string demand =
      c.behind.airplane ? beyond(c.asked.delta_e, limits.delta_e, "the elevator", degrees, "°")
                        : beyond(c.asked.a1s, limits.a1s, "the cyclic", degrees, "°");
  std::string words = fmt::format(
      "the integral x2, which both laws share, is {:.4g} s before the handover and is trimmed at "
      "{:.4g} s after it: K_Li x2 must change from {:.3g} to {:.3g}",
      c.front.state.x2, c.behind.state.x2, k.K_Li * c.front.state.x2, k.K_Li * c.behind.state.x2);
  if (!demand.empty()) words += "; " + demand;
  if (!(c.behind.abscissa < 0))
    words +=
        fmt::format("; the loop after the handover is itself unstable there (Re λ = {:.3g} 1/s)",
                    c.behind.abscissa);
  return words;
}

void judge(const Flight& flight, const HandOverOptions& options, HandOverCheck& check) {
  for (const HandOverSide* side : {&check.front, &check.behind})
    if (!is_equilibrium(side->status)) {
      check.verdict = HandOverVerdict::no_trim;
      check.message = fmt::format("no trim {} the handover: {}",
                                  side == &check.front ? "before" : "after", side->message);
      return;
    }
  const Gains k = gains_at(flight, check.command.eta);
  Flight behind = frozen(flight, check.command, check.behind.airplane);
  if (flight.hand_over == HandOver::bumpless)
    check.front.state.x2 =
        bumpless_x2(behind, {false, check.front.airplane}, 0.0, check.front.state);
  const FlightPoint after =
      flight_point(behind, {false, check.behind.airplane}, 0.0, check.front.state);
  check.asked = after.asked;
  check.integral_jump = k.K_Li * (check.behind.state.x2 - check.front.state.x2);
  const FlightResult flown = flown_on(flight, check, options.seconds);
  check.ends = flown.status;
  check.ends_at = flown.t.back() - check.t;
  check.verdict = settled(flight, flown, std::numbers::pi / 2)      ? HandOverVerdict::settles
                  : -check.front.abscissa * check.seconds_there < 1 ? HandOverVerdict::not_reached
                                                                    : HandOverVerdict::lost;
  check.message = cause(flight, check);
}

}  // namespace

std::string to_string(HandOverVerdict verdict) {
  constexpr std::array names{"settles", "lost", "not_reached", "no_trim", "blended", "never"};
  return names[std::size_t(verdict)];
}

std::vector<HandOverCheck> check_hand_over(const Flight& flight, const HandOverOptions& options) {
  const RoundToNearest environment;
  if (flight.vehicle.aircraft.cyclic_blend > 0) return {{HandOverVerdict::blended}};
  std::vector<HandOverCheck> checks;
  for (const Place& place : places(flight, options)) {
    const auto [t, h, to_elevator] = place;
    HandOverCheck check;
    check.seconds_there = seconds_to(flight.schedule, place);
    check.t = t;
    check.height = h;
    check.command = flight.schedule.command(t, h);
    check.front = side_of(flight, check.command, !to_elevator, h, options.trimming);
    check.behind = side_of(flight, check.command, to_elevator, h, options.trimming);
    judge(flight, options, check);
    checks.push_back(std::move(check));
  }
  if (checks.empty()) checks.push_back({HandOverVerdict::never});
  return checks;
}

}  // namespace tiltrim
