#include "flight/fly.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <numbers>
#include <stdexcept>

#include "runtime/rounding.hpp"
#include "simulate/integrate.hpp"

namespace tiltrim {

namespace {

using Values = std::array<double, flight_states>;
constexpr double never = -1.0;     // value of an event function that does not apply at present
constexpr double rounding = 1e-6;  // m: level flight at ground height is no contact

// Event functions in the order of event_functions(): each is positive beyond its bound. Zero counts
// as below: at the tilt of the handover the cyclic controls pitch.
enum EventIndex : std::size_t {
  theta0_upper,
  theta0_lower,
  a1s_upper,
  a1s_lower,
  delta_e_upper,
  delta_e_lower,
  theta_upper,
  theta_lower,
  hand_over,
  ground,
  lift_off,
  too_fast,
  turned_over,
  first_kink
};
constexpr std::array limit_names{"theta0 upper",  "theta0 lower",  "a1s upper",   "a1s lower",
                                 "delta_e upper", "delta_e lower", "theta upper", "theta lower"};

FlightState state_of(const double* x) {
  return std::bit_cast<FlightState>([&] {
    Values values;
    std::copy_n(x, flight_states, values.begin());
    return values;
  }());
}

void write(const FlightState& state, double* x) {
  std::ranges::copy(std::bit_cast<Values>(state), x);
}

std::vector<EventFunction> event_functions(const Flight& flight, const FlyOptions& options) {
  using enum EventFunction::Direction;
  std::vector<EventFunction> all;
  for (const char* name : limit_names) all.push_back({name});
  all.push_back({"handover"});
  all.push_back({"ground contact", rising, true});
  all.push_back({"lift-off", rising});
  all.push_back({"too fast", rising, true});
  all.push_back({fmt::format("pitched over (beyond {:.3g} rad)", options.steepest), rising, true});
  for (const double h : flight.schedule.kink_heights) all.push_back({fmt::format("h = {:g} m", h)});
  return all;
}

void watch(const Flight& flight, const FlyOptions& options, const FlightMode& mode,
           const FlightPoint& at, const FlightState& x, double* g) {
  const Limits& limits = flight.vehicle.limits;
  const auto both = [&](std::size_t upper, double value, const Range& range) {
    g[upper] = value - range.upper;
    g[upper + 1] = range.lower - value;
  };
  both(theta0_upper, at.asked.theta0, limits.theta0);
  both(a1s_upper, at.asked.a1s, limits.a1s);
  both(delta_e_upper, at.asked.delta_e, limits.delta_e);
  both(theta_upper, x.theta, limits.theta);
  const bool switches = !(flight.vehicle.aircraft.cyclic_blend > 0);
  g[hand_over] = switches ? flight.vehicle.aircraft.cyclic_off - at.eta : never;
  g[ground] = mode.on_ground ? never : -x.height - rounding;
  g[lift_off] = mode.on_ground ? at.lift_off : never;
  g[too_fast] = at.V - options.fastest;
  g[turned_over] = std::abs(x.theta) - options.steepest;
  for (std::size_t k = 0; k < flight.schedule.kink_heights.size(); ++k)
    g[first_kink + k] = x.height - flight.schedule.kink_heights[k];
}

void check(const Flight& flight, const FlightStart& start, const FlyOptions& options) {
  const auto require = [](bool holds, const char* why) {
    if (!holds) throw std::invalid_argument(std::string("fly: ") + why);
  };
  require(flight.vehicle.polar != nullptr, "the vehicle has no polar");
  require(flight.vehicle.equations == Equations::consistent,
          "the printed equations cannot be simulated; expected the consistent ones");
  require(bool(flight.schedule.command), "the flight has no schedule of commands");
  require(flight.lag > 0 && flight.anti_windup > 0,
          "lag and anti_windup must be greater than zero");
  require(options.duration > 0, "the duration must be greater than zero");
  require(!(start.state.height < 0), "the start is below the ground");
  const Limits& limits = flight.vehicle.limits;
  for (const Range& range : {limits.theta0, limits.a1s, limits.delta_e, limits.theta})
    require(std::isfinite(range.upper - range.lower) && range.lower <= range.upper,
            "the limits must be finite and in order");
  const ActuatorRates& rates = flight.rates;
  for (const double rate : {rates.theta0, rates.a1s, rates.delta_e, rates.eta})
    require(rate > 0, "the actuators' rate limits must be greater than zero");
  for (const double option : {options.begins, options.fastest, options.steepest, options.sinks,
                              options.rolls, options.leans})
    require(std::isfinite(option), "an option is not finite");
  if (flight.axes == Axes::wind) {
    require(!start.on_ground, "wind axes cannot start at rest; expected body axes");
    require(start.state.along > 0, "wind axes need an airspeed greater than zero");
  }
}

FlightEventKind kind_of(const MotionEvent& event) {
  using enum FlightEventKind;
  switch (event.which) {
    case EventIndex::hand_over:
      return hand_over;
    case EventIndex::ground:
      return ground_contact;
    case EventIndex::lift_off:
      return lift_off;
    case EventIndex::too_fast:
    case EventIndex::turned_over:
      return lost;
    default:
      if (event.which >= first_kink) return schedule_kink;
      return event.rising ? limit_reached : limit_left;
  }
}

FlightStatus status_of(const Trajectory& trajectory) {
  switch (trajectory.status) {
    case MotionStatus::completed:
      return FlightStatus::flown;
    case MotionStatus::ended_by_event:
      return trajectory.events.back().which == ground ? FlightStatus::ground_contact
                                                      : FlightStatus::lost;
    case MotionStatus::diverged:
      return FlightStatus::lost;
    case MotionStatus::not_finite:
      return FlightStatus::not_finite;
    case MotionStatus::inaccurate:  // returned by simulate() only
    case MotionStatus::interrupted:
      return FlightStatus::interrupted;
    case MotionStatus::step_too_small:
    case MotionStatus::step_limit:
    case MotionStatus::event_limit:
      break;
  }
  return FlightStatus::stuck;
}

// At rest the path has no direction, and the law's first thrust depends on it: start along the
// commanded path at negligible speed, from where the motion is unique.
FlightState lifted(const Flight& flight, double t, FlightState x) {
  constexpr double barely = 1e-12;  // m/s
  const double alpha = x.theta - flight.schedule.command(t, x.height).gamma;
  x.along = barely * std::cos(alpha);
  x.across = barely * std::sin(alpha);
  return x;
}

// Too fast or pitched over initially, before an event function could cross zero.
bool lost_at_once(const Motion& motion, double t, const std::vector<double>& x0, int number,
                  FlightResult& result) {
  std::vector<double> g(motion.event_functions.size());
  motion.g(t, x0.data(), number, g.data());
  for (const std::size_t bound : {too_fast, turned_over}) {
    if (!(g[bound] > 0)) continue;
    const FlightState x = state_of(x0.data());
    const FlightMode mode = mode_of(number);
    const std::string& why = motion.event_functions[bound].name;
    result = {FlightStatus::lost, why, {t}, {x}, {mode}, std::move(result.events)};
    result.events.push_back({FlightEventKind::lost, why, t, x, x, mode, mode});
    return true;
  }
  return false;
}

void touch_down(const Flight& flight, const FlyOptions& options, FlightResult& result) {
  const FlightState& x = result.states.back();
  const FlightPoint at = flight_point(flight, result.modes.back(), result.t.back(), x);
  const bool soft = -at.climb_rate <= options.sinks && std::abs(at.ground_speed) <= options.rolls &&
                    std::abs(x.theta) <= options.leans;
  if (soft) result.status = FlightStatus::landed;
  result.message = fmt::format(
      "touches down at {:.3g} m/s vertical and {:.3g} m/s horizontal speed, θ = {:.3g}°",
      -at.climb_rate, at.ground_speed, x.theta * 180 / std::numbers::pi);
}

}  // namespace

std::string to_string(FlightEventKind kind) {
  constexpr std::array names{"limit_reached",  "limit_left",    "hand_over", "lift_off",
                             "ground_contact", "schedule_kink", "lost"};
  return names[std::size_t(kind)];
}

std::string to_string(FlightStatus status) {
  constexpr std::array names{"flown",      "landed", "ground_contact", "lost",
                             "not_finite", "stuck",  "interrupted"};
  static_assert(names.size() == flight_statuses);
  return names[std::size_t(status)];
}

FlightStart at_rest() { return {{}, true}; }

int number_of(const FlightMode& mode) { return int(mode.on_ground) + 2 * int(mode.airplane); }
FlightMode mode_of(int number) { return {(number & 1) != 0, (number & 2) != 0}; }

FlightMode mode_at(const Flight& flight, const FlightStart& start, double t) {
  const bool lags = !std::isinf(flight.rates.eta);
  const double eta = lags ? start.state.eta : flight.schedule.command(t, start.state.height).eta;
  const FlightMode standing{start.on_ground, elevator_side(flight.vehicle.aircraft, eta)};
  const bool carried = flight_point(flight, standing, t, start.state).lift_off > 0;
  return {start.on_ground && !carried, standing.airplane};
}

Motion motion_of(const Flight& flight, const FlyOptions& options) {
  Motion motion;
  motion.states = flight_signals(flight.axes);
  motion.event_functions = event_functions(flight, options);
  std::ranges::set_union(flight.schedule.kink_times, flight.kink_times,
                         std::back_inserter(motion.breaks));
  motion.f = [&flight](double t, const double* x, int mode, double* rates) {
    write(flight_point(flight, mode_of(mode), t, state_of(x)).rates, rates);
  };
  motion.g = [&flight, options](double t, const double* x, int number, double* g) {
    const FlightMode mode = mode_of(number);
    const FlightState state = state_of(x);
    watch(flight, options, mode, flight_point(flight, mode, t, state), state, g);
  };
  motion.at = [&flight](const MotionEvent& event, double* x, int number) {
    FlightMode mode = mode_of(number);
    if (event.which == lift_off) {
      mode.on_ground = false;
      write(lifted(flight, event.t, state_of(x)), x);
    }
    if (event.which == ground) {
      FlightState state = state_of(x);
      state.height = 0;
      write(state, x);
    }
    if (event.which == hand_over) {
      FlightState state = state_of(x);
      if (flight.hand_over == HandOver::bumpless) {
        state.x2 = bumpless_x2(flight, mode, event.t, state);
        write(state, x);
      }
      mode.airplane = event.rising;
    }
    return number_of(mode);
  };
  return motion;
}

// One run of the integrator.
static FlightResult flown_once(const Flight& flight, const FlightStart& start,
                               const FlyOptions& options) {
  Motion motion = motion_of(flight, options);
  FlightResult result;
  const auto at = motion.at;
  motion.at = [&](const MotionEvent& event, double* x, int number) {
    FlightEvent happened{kind_of(event),
                         motion.event_functions[event.which].name,
                         event.t,
                         state_of(x),
                         {},
                         mode_of(number),
                         {}};
    const int after = at(event, x, number);
    happened.after = state_of(x);
    happened.mode_after = mode_of(after);
    if (event.which == hand_over)
      happened.what = event.rising ? "to the elevator" : "to the cyclic";
    result.events.push_back(std::move(happened));
    return after;
  };
  const FlightMode mode = mode_at(flight, start, options.begins);
  const bool at_once = start.on_ground && !mode.on_ground;
  std::vector<double> x0(flight_states);
  write(at_once ? lifted(flight, options.begins, start.state) : start.state, x0.data());
  if (at_once)
    result.events.push_back({FlightEventKind::lift_off,
                             "at once",
                             options.begins,
                             start.state,
                             state_of(x0.data()),
                             {true, mode.airplane},
                             mode});
  if (lost_at_once(motion, options.begins, x0, number_of(mode), result)) return result;
  const Trajectory trajectory = integrate(motion, x0, number_of(mode), options.begins,
                                          options.begins + options.duration, options.integrate);
  result.status = status_of(trajectory);
  result.message = trajectory.message;
  result.t = trajectory.t;
  result.steps = trajectory.steps;
  result.evaluations = trajectory.evaluations;
  for (std::size_t k = 0; k < trajectory.samples(); ++k) {
    result.states.push_back(state_of(trajectory.state(k)));
    result.modes.push_back(mode_of(trajectory.modes[k]));
  }
  if (result.status == FlightStatus::ground_contact) touch_down(flight, options, result);
  return result;
}

FlightResult fly(const Flight& flight, const FlightStart& start, const FlyOptions& options) {
  const RoundToNearest environment;
  check(flight, start, options);
  FlightResult result = flown_once(flight, start, options);
  if (!options.global_error || !result.ended() || options.integrate.fixed_step > 0) return result;
  FlyOptions rougher = options;
  rougher.integrate.tolerance = rough_tolerance * options.integrate.tolerance;
  // The longest step grows with the tolerance; otherwise the runs would agree where it alone limits
  // the step.
  rougher.integrate.longest_step *= std::pow(rough_tolerance, 1.0 / 5);
  rougher.integrate.sample = std::numeric_limits<double>::infinity();
  const FlightResult rough = flown_once(flight, start, rougher);
  if (rough.status == result.status)
    result.rough_end = FlightEnd{rough.t.back(), rough.states.back(), rough.modes.back()};
  return result;
}

}  // namespace tiltrim
