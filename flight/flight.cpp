#include "flight/flight.hpp"

#include <algorithm>
#include <boost/math/tools/toms748_solve.hpp>
#include <cmath>
#include <cstdint>

#include "vehicles/tiltrotor/corridor.hpp"
#include "vehicles/tiltrotor/physics.hpp"

namespace tiltrim {

namespace {

using namespace physics;

struct Air {
  double V, alpha, gamma;
};

Air air_of(const Flight& flight, const FlightState& x, double commanded_gamma) {
  if (flight.axes == Axes::wind) return {x.along, x.theta - x.across, x.across};
  const auto [V, alpha] = airspeed(x.along, x.across);
  if (!(V > 0))
    return {0.0, x.theta - commanded_gamma, commanded_gamma};  // as closed_loop() has it
  return {V, alpha, x.theta - alpha};
}

double share_of_cyclic(const Flight& flight, const FlightMode& mode, double eta) {
  if (flight.vehicle.aircraft.cyclic_blend > 0) return authority(flight.vehicle.aircraft, eta);
  return mode.airplane ? 0.0 : 1.0;
}

double limited(double value, const Range& range) {
  return std::clamp(value, range.lower, range.upper);
}

// A rate-limited actuator is a first-order lag with saturated rate; without a limit it follows at
// once.
double follow_rate(double target, double now, double rate, double lag) {
  return std::isinf(rate) ? 0.0 : std::clamp((target - now) / lag, -rate, rate);
}

// Back-calculation: the rate by which an excess of a command over its limit discharges an integral
// with gain `per_integral`.
double unwound(double excess, double per_integral, double anti_windup) {
  return excess == 0 || per_integral == 0 ? 0.0 : excess / (per_integral * anti_windup);
}

}  // namespace

Signals flight_signals(Axes axes) {
  const bool wind = axes == Axes::wind;
  return {wind ? Signal{"V", "m/s", 1.0} : Signal{"u", "m/s", 1.0},
          wind ? Signal{"gamma", "rad", 0.1} : Signal{"w", "m/s", 1.0},
          {"theta", "rad", 0.1},
          {"q", "rad/s", 0.1},
          {"energy_integral", "s", 1.0},
          {"distribution_integral", "s", 1.0},
          {"distance", "m", 10.0},
          {"height", "m", 10.0},
          {"thrust_work", "m²/s²", 100.0},
          {"drag_work", "m²/s²", 100.0},
          {"wind_work", "m²/s²", 100.0},
          {"eta", "rad", 0.1},
          {"theta0", "", 0.1},
          {"a1s", "rad", 0.1},
          {"delta_e", "rad", 0.1}};
}

Gains gains_at(const Flight& flight, double eta) {
  return flight.gains.eta.empty() ? flight.vehicle.gains : gains_at(flight.gains, eta);
}

bool elevator_side(const Aircraft& aircraft, double eta) { return eta < aircraft.cyclic_off; }

namespace {

// The disturbed commands, the tilt, and the velocity through the air.
void set_command(const Flight& flight, double t, const FlightState& x, const Disturbance& added,
                 FlightPoint& at) {
  at.command = flight.schedule.command(t, x.height);
  at.command.V += added.V;
  at.command.gamma += added.gamma;
  at.eta = std::isinf(flight.rates.eta) ? at.command.eta : x.eta;
  const auto [V, alpha, gamma] = air_of(flight, x, at.command.gamma);
  at.V = V;
  at.alpha = alpha;
  at.gamma = gamma;
}

// The wind and its rate along the path, which is subtracted from the rate of airspeed.
struct WindOnPath {
  WindOnPath(const Wind& now, const SinCos<double>& flown)
      : wind(now), path(flown), against(wind.forward_rate * path.cos + wind.up_rate * path.sin) {}
  Wind wind;
  SinCos<double> path;
  double against;
};

void set_forces(const Flow<double>& air, const Aircraft& a, FlightPoint& at) {
  at.thrust = air.thrust;
  at.lift = lift(air, at.used.delta_e, a);
  at.drag = drag(air);
  at.induced_velocity = induced_velocity(at.used.theta0, a);
  at.pitch_acceleration = pitch_acceleration(air, at.used.delta_e, a);
}

// Rates of the integrals, with anti-windup, and of the actuators, whose target is `within`.
void set_controller_rates(const Flight& flight, const FlightState& x, const Actuators& within,
                          double s, const Gains& k, FlightPoint& at) {
  const double excess = flight.vehicle.aircraft.thrust_excess;
  const ActuatorRates& fastest = flight.rates;
  FlightState& rate = at.rates;
  rate.x1 = at.He - unwound(at.asked.theta0 - within.theta0, k.K_Ei / (1 + excess * k.K_Ep),
                            flight.anti_windup);
  rate.x2 = at.Le -
            s * unwound(at.asked.a1s - within.a1s, k.K_Li / (1 + k.K_Lp), flight.anti_windup) -
            (1 - s) * unwound(at.asked.delta_e - within.delta_e, k.K_Li, flight.anti_windup);
  rate.eta = follow_rate(at.command.eta, x.eta, fastest.eta, flight.lag);
  rate.theta0 = follow_rate(within.theta0, x.theta0, fastest.theta0, flight.lag);
  rate.a1s = follow_rate(within.a1s, x.a1s, fastest.a1s, flight.lag);
  rate.delta_e = follow_rate(within.delta_e, x.delta_e, fastest.delta_e, flight.lag);
}

// Rates of the airframe off the ground, and of the works.
void set_motion(const Flight& flight, const FlightState& x, const Flow<double>& air,
                const BodyAcceleration<double>& body, const WindOnPath& on_path,
                const SinCos<double>& pitch, FlightPoint& at) {
  const Aircraft& a = flight.vehicle.aircraft;
  const auto& [wind, path, against] = on_path;
  at.ground_speed = at.V * path.cos + wind.forward;
  at.climb_rate = at.V * path.sin + wind.up;
  FlightState& rate = at.rates;
  if (flight.axes == Axes::wind) {
    const double across = (wind.up_rate * path.cos - wind.forward_rate * path.sin) / at.V;
    rate.along = at.V_rate;
    rate.across =
        path_rate(air, at.V, path.cos, at.used.delta_e, a, Equations::consistent) - across;
  } else {
    rate.along = body.u - wind.forward_rate * pitch.cos - wind.up_rate * pitch.sin;
    rate.across = body.w - wind.forward_rate * pitch.sin + wind.up_rate * pitch.cos;
  }
  rate.theta = x.q;
  rate.q = at.pitch_acceleration;
  rate.distance = at.ground_speed;
  rate.height = at.climb_rate;
  rate.thrust_work = at.thrust * air.phi.cos * at.V / a.mass;
  rate.drag_work = at.drag * at.V / a.mass;
  rate.wind_work = a.gravity * wind.up - against * at.V;
}

}  // namespace

FlightPoint flight_point(const Flight& flight, const FlightMode& mode, double t,
                         const FlightState& x) {
  const Aircraft& a = flight.vehicle.aircraft;
  const Limits& limits = flight.vehicle.limits;
  const ActuatorRates& fastest = flight.rates;
  const Disturbance added = flight.disturbance ? flight.disturbance(t) : Disturbance{};

  FlightPoint at{};
  set_command(flight, t, x, added, at);
  const double s = share_of_cyclic(flight, mode, at.eta);
  const Gains k = gains_at(flight, at.eta);
  const double V_err = at.command.V - at.V;
  const SinCos<double> pitch = sin_cos(x.theta), incidence = sin_cos(at.alpha),
                       path = pitch - incidence;
  const double sin_gamma_err = std::sin(at.command.gamma - at.gamma);
  const Sensed<double> sensed{at.V, V_err, path.sin, sin_gamma_err, x.theta, x.q, x.x1, x.x2};
  const CoefficientsOf<double> C = coefficients(*flight.vehicle.polar, at.alpha);

  // The law's command, then its limits, then the actuators' lag.
  const RotorCommand<double> rotor = rotor_command(sensed, C.CD, s, a, k);
  Actuators within{};
  at.asked.theta0 = rotor.theta0 + added.theta0;
  at.asked.a1s = rotor.a1s + added.a1s;
  within.theta0 = limited(at.asked.theta0, limits.theta0);
  within.a1s = limited(at.asked.a1s, limits.a1s);
  at.used.theta0 = std::isinf(fastest.theta0) ? within.theta0 : x.theta0;
  at.used.a1s = std::isinf(fastest.a1s) ? within.a1s : x.a1s;

  const Flow<double> air = flow(at.V, incidence, C, x.q, at.used.theta0, at.used.a1s, at.eta, a);
  const WindOnPath on_path(flight.wind ? flight.wind(t) : Wind{}, path);
  at.V_rate = mode.on_ground ? 0.0 : speed_rate(air, path.sin, a) - on_path.against;
  const auto [He, Le] = energy_errors(sensed, at.V_rate, a, k);
  at.He = He;
  at.Le = Le;
  at.asked.delta_e = elevator_command(sensed, Le, s, k) + added.delta_e;
  within.delta_e = limited(at.asked.delta_e, limits.delta_e);
  at.used.delta_e = std::isinf(fastest.delta_e) ? within.delta_e : x.delta_e;

  set_controller_rates(flight, x, within, s, k, at);
  set_forces(air, a, at);
  const auto body =
      body_acceleration(air, x.along, x.across, pitch, x.q, at.used.delta_e, a);  // body axes only
  at.lift_off = body.u * pitch.sin - body.w * pitch.cos;
  if (!mode.on_ground) set_motion(flight, x, air, body, on_path, pitch, at);
  return at;
}

double bumpless_x2(const Flight& flight, const FlightMode& before, double t, const FlightState& x) {
  const FlightPoint now = flight_point(flight, before, t, x);
  Flight behind = flight;  // actuators follow at once
  behind.rates.a1s = behind.rates.delta_e = std::numeric_limits<double>::infinity();
  const FlightMode after{before.on_ground, !before.airplane};
  const auto with = [&](double x2) {
    FlightState there = x;
    there.x2 = x2;
    return flight_point(behind, after, t, there);
  };
  // The command is affine in x2: solve for the x2 that commands `value` from two evaluations.
  const auto actuator = after.airplane ? &Actuators::delta_e : &Actuators::a1s;
  const double none = with(0).asked.*actuator;
  const double per_x2 = with(1).asked.*actuator - none;
  if (per_x2 == 0) return x.x2;
  const auto x2_for = [&](double value) { return (value - none) / per_x2; };
  const auto miss = [&](double value) {
    return with(x2_for(value)).pitch_acceleration - now.pitch_acceleration;
  };
  const Limits& limits = flight.vehicle.limits;
  const Range& range = after.airplane ? limits.delta_e : limits.a1s;
  const double lower = miss(range.lower), upper = miss(range.upper);
  if (!(lower * upper < 0))  // no solution within the limits
    return x2_for(std::abs(lower) < std::abs(upper) ? range.lower : range.upper);
  std::uintmax_t steps = 60;
  const auto [from, to] =
      boost::math::tools::toms748_solve(miss, range.lower, range.upper, lower, upper,
                                        boost::math::tools::eps_tolerance<double>(), steps);
  return x2_for(from + (to - from) / 2);
}

}  // namespace tiltrim
