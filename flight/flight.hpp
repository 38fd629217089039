/// @file
/// The closed loop in flight, with what a trim need not know: actuators that end and lag, a
/// schedule, wind, the ground, integrals that do not wind up. docs/simulate.md derives each line.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <limits>
#include <string>
#include <vector>

#include "vehicles/tiltrotor/vehicle.hpp"

namespace tiltrim {

/// Wind over the ground.
struct Wind {
  double forward = 0.0, up = 0.0;            ///< m/s
  double forward_rate = 0.0, up_rate = 0.0;  ///< m/s²
};

/// What is added to the commands V [m/s] and gamma [rad], and behind the law, ahead of the limits,
/// to theta0, a1s and delta_e [-, rad, rad].
struct Disturbance {
  double V = 0.0, gamma = 0.0, theta0 = 0.0, a1s = 0.0, delta_e = 0.0;  ///< 0: nothing
};

/// How pitch control changes hands at cyclic_off where there is no blend.
enum class HandOver {
  as_printed,  ///< x2, the integral that both laws share, goes on from where it is
  bumpless,    ///< x2 is set anew, so that the pitching moment does not jump
};

/// Largest rates of the actuators [1/s, rad/s]; infinite: they follow at once.
struct ActuatorRates {
  double theta0 = std::numeric_limits<double>::infinity();   ///< 1/s
  double a1s = std::numeric_limits<double>::infinity();      ///< rad/s
  double delta_e = std::numeric_limits<double>::infinity();  ///< rad/s
  double eta = std::numeric_limits<double>::infinity();      ///< rad/s, of the nacelles
};

/// What is commanded when and where; by default the corridor (16).
struct Schedule {
  /// At time t [s] and height h [m].
  std::function<Command(double t, double h)> command = [](double, double h) { return corridor(h); };
  std::vector<double> kink_heights{20.0, 120.0};  ///< m, rising: where it is not smooth
  std::vector<double> kink_times{};               ///< s, rising: the same
};

/// All that decides a flight but its start.
struct Flight {
  Vehicle vehicle;                                     ///< with consistent equations
  GainSchedule gains{};                                ///< empty: the vehicle's at any tilt
  Schedule schedule{};                                 ///< what is commanded
  std::function<Wind(double t)> wind{};                ///< empty: calm
  std::function<Disturbance(double t)> disturbance{};  ///< empty: none
  std::vector<double> kink_times{};                    ///< of these two, s; rising
  Axes axes = Axes::body;                              ///< wind axes divide by V
  HandOver hand_over = HandOver::as_printed;           ///< where there is no blend
  ActuatorRates rates{};                               ///< none limited by default
  double lag = 0.05;                                   ///< s, of an actuator whose rate is limited
  /// s, in which the integrals bring a command beyond its limit back to it (back-calculation [51]);
  /// infinite: they wind up.
  double anti_windup = 1.0;
};

/// The gains that it has at a tilt.
Gains gains_at(const Flight& flight, double eta);

/// The state of a flight. First velocities through the air: V, gamma in wind axes, u, w in body
/// axes. Works are per mass [m²/s²]; the last four belong to actuators that lag, else stay.
struct FlightState {
  double along = 0.0, across = 0.0;                            ///< V, gamma or u, w; m/s, rad
  double theta = 0.0, q = 0.0;                                 ///< rad, rad/s
  double x1 = 0.0, x2 = 0.0;                                   ///< integrals of He and Le, s
  double distance = 0.0, height = 0.0;                         ///< m, over the ground
  double thrust_work = 0.0, drag_work = 0.0, wind_work = 0.0;  ///< m²/s²
  double eta = 0.0, theta0 = 0.0, a1s = 0.0, delta_e = 0.0;    ///< where the actuators are
};
/// Numbers of a FlightState.
inline constexpr std::size_t flight_states = sizeof(FlightState) / sizeof(double);
/// Names, units and sizes of the state, in order.
Signals flight_signals(Axes axes);

/// On which side of its jumps a flight is.
struct FlightMode {
  bool on_ground = false;  ///< held there at rest, until its weight is carried
  bool airplane = false;   ///< the elevator has the pitch (where there is no blend)
};

/// The three actuators [-, rad, rad].
struct Actuators {
  double theta0, a1s, delta_e;  ///< in that order
};

/// One instant of a flight.
struct FlightPoint {
  FlightState rates;                ///< of every state, 1/s
  Command command;                  ///< the schedule's, disturbed
  double eta;                       ///< the tilt, which may lag behind its command
  double V, gamma, alpha;           ///< through the air
  Actuators asked, used;            ///< by the law, before limits; by the airframe
  double He, Le;                    ///< (7), with the V' that there is
  double V_rate;                    ///< m/s², through the air
  double thrust, lift, drag;        ///< N
  double induced_velocity;          ///< m/s, (3)
  double pitch_acceleration;        ///< rad/s²
  double climb_rate, ground_speed;  ///< m/s, over the ground
  double lift_off;                  ///< acceleration upwards, were there no ground, m/s²
};
/// All there is at time t [s] in state x.
FlightPoint flight_point(const Flight& flight, const FlightMode& mode, double t,
                         const FlightState& x);

/// The side of the hand-over that a tilt is on.
bool elevator_side(const Aircraft& aircraft, double eta);
/// x2 at which the law on the other side of the hand-over asks for the pitching moment there is
/// now, or comes as near as limits allow. Where K_Li is zero x2 has no effect and stays.
double bumpless_x2(const Flight& flight, const FlightMode& before, double t, const FlightState& x);

/// One command all the way.
Schedule held(const Command& command);

/// Commands between which each number is a monotone cubic (Fritsch and Carlson [56]), held beyond
/// the ends.
struct Commands {
  std::vector<double> at;       ///< heights [m] or times [s], rising; two at least
  std::vector<Command> values;  ///< at each
};
/// By height [m]. Throws std::invalid_argument where they are fewer than two, not rising, or not as
/// many.
Schedule over_height(const Commands& commands);
/// By time [s]; throws as over_height().
Schedule over_time(const Commands& commands);

/// The corridor (16) against time: the tilt falls at a constant rate; path angle and speed are
/// those of the height at which (16) has that tilt.
struct SteadyTilt {
  double begins = 0.0;                           ///< s
  double rate = std::numbers::pi / 180;          ///< rad/s, > 0
  double from = std::numbers::pi / 2, to = 0.0;  ///< rad, falling
  /// s
  double ends() const { return begins + (from - to) / rate; }
};
/// Throws std::invalid_argument for a rate that is not above zero, or tilts that do not fall.
Schedule corridor_at_tilt_rate(const SteadyTilt& tilt);
/// The height at which (16) has a tilt, 0 to 120 m.
double corridor_height(double eta);

/// The corridor (16) backwards: its tilt and speed from top to foot over time on a level path, then
/// the path turns down, and the aircraft sinks to the ground at the foot's speed.
struct Reconversion {
  double begins = 5.0;                     ///< s
  double lasts = 120.0;                    ///< s, from airplane to helicopter
  double hovers = 10.0;                    ///< s, level at the foot's speed
  double turns = 20.0;                     ///< s, until the path is down
  double descent = -std::numbers::pi / 6;  ///< rad, the path's angle from there on
};
/// That schedule.
Schedule reconversion(const Reconversion& times = {});

/// A change of a command or an actuator for a time.
struct DisturbanceTable {
  /// Its course over time.
  enum class Kind {
    step,                       ///< `size` from `at` on, for `duration` (0: to the end)
    doublet,                    ///< `size` for `duration`, then its opposite for as long
  } kind = Kind::step;          ///< which
  std::string on = "gamma";     ///< V, gamma, theta0, a1s or delta_e
  double at = 0.0, size = 0.0;  ///< s; SI, radians
  double duration = 0.0;        ///< s
};

/// Wind over the ground.
struct GustTable {
  /// Its course over time.
  enum class Kind {
    steady,            ///< `size` all the time
    one_minus_cosine,  ///< up to `size` and back, (1 - cos)/2 from `at` for `duration` [53]
    dryden,            ///< turbulence of standard deviation `size`, by a sum of waves [53]
  } kind = Kind::one_minus_cosine;  ///< which
  bool up = false;                  ///< else forward
  double size = 0.0;                ///< m/s
  double at = 0.0;                  ///< s
  double duration = 1.0;            ///< s
  double length = 50.0;             ///< m, scale of the turbulence
  double speed = 15.0;              ///< m/s at which it is flown through
  std::uint64_t seed = 1;           ///< of the turbulence
};

/// All gusts together, and the times at which they have kinks. Turbulence is a sum of waves of the
/// Dryden spectra [53] with random phases [55]: smooth, of exactly the standard deviation asked
/// for, the same for a seed.
struct Weather {
  std::function<Wind(double t)> wind;  ///< empty: calm
  std::vector<double> kink_times;      ///< s, rising
};
/// Of these gusts, added up.
Weather weather(const std::vector<GustTable>& gusts);

/// The Dryden spectrum along the flight or across it, Φ(Ω) [m²/s² per rad/m] at a wave number
/// Ω ≥ 0 [rad/m]; its integral over all of them is sigma².
double dryden_spectrum(double wave_number, double sigma, double length, bool across);

/// Steps and doublets of the commands and actuators, and the times at which they jump.
struct Disturbances {
  std::function<Disturbance(double t)> at;  ///< empty: none
  std::vector<double> kink_times;           ///< s, rising
};
/// Of these, added up.
Disturbances disturbances(const std::vector<DisturbanceTable>& tables);

}  // namespace tiltrim
