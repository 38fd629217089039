/// The closed loop in flight, with everything a trim does not need: actuator limits and lags, a
/// schedule, wind, the ground, anti-windup. docs/simulate.md derives each equation.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <limits>
#include <string>
#include <vector>

#include "vehicles/tiltrotor/corridor.hpp"
#include "vehicles/tiltrotor/vehicle.hpp"

namespace tiltrim {

/// Wind over the ground.
struct Wind {
  double forward = 0.0, up = 0.0;            ///< m/s
  double forward_rate = 0.0, up_rate = 0.0;  ///< m/s²
};

/// Added to the commands V [m/s] and gamma [rad] and, after the control law but before the limits,
/// to theta0, a1s and delta_e [-, rad, rad].
struct Disturbance {
  double V = 0.0, gamma = 0.0, theta0 = 0.0, a1s = 0.0, delta_e = 0.0;  ///< 0: nothing
};

/// How pitch control is handed over at cyclic_off if the controls are not blended.
enum class HandOver {
  as_printed,  ///< x2, the integral that both laws share, is continuous
  bumpless,    ///< x2 is reset so that the pitching moment is continuous
};

/// Rate limits of the actuators [1/s, rad/s]; infinite: the actuator follows at once.
struct ActuatorRates {
  double theta0 = std::numeric_limits<double>::infinity();   ///< 1/s
  double a1s = std::numeric_limits<double>::infinity();      ///< rad/s
  double delta_e = std::numeric_limits<double>::infinity();  ///< rad/s
  double eta = std::numeric_limits<double>::infinity();      ///< rad/s, of the nacelles
};

/// The command over time and height; by default the corridor (16).
struct Schedule {
  /// At time t [s] and height h [m].
  std::function<Command(double t, double h)> command = [](double, double h) { return corridor(h); };
  std::vector<double> kink_heights{corridor_rises,
                                   corridor_top};  ///< m, rising: where it is not smooth
  std::vector<double> kink_times{};                ///< s, rising: the same
};

/// Everything that determines a flight except its initial state.
struct Flight {
  Vehicle vehicle;                                     ///< with consistent equations
  GainSchedule gains{};                                ///< empty: the vehicle's at every tilt
  Schedule schedule{};                                 ///< what is commanded
  std::function<Wind(double t)> wind{};                ///< empty: calm
  std::function<Disturbance(double t)> disturbance{};  ///< empty: none
  std::vector<double> kink_times{};                    ///< of wind and disturbance, s; rising
  Axes axes = Axes::body;                              ///< wind axes divide by V
  HandOver hand_over = HandOver::as_printed;           ///< if the controls are not blended
  ActuatorRates rates{};                               ///< no limits by default
  double lag = 0.05;                                   ///< s, of an actuator whose rate is limited
  /// s, time constant of the back-calculation [51] that discharges the integrals while a command is
  /// beyond its limit; infinite: no anti-windup.
  double anti_windup = 1.0;
};

/// The flight's gains at a tilt [rad].
Gains gains_at(const Flight& flight, double eta);

/// The state of a flight. Velocities through the air come first: V, gamma in wind axes, u, w in
/// body axes. Works are per unit mass [m²/s²]; the last four are the actuators' positions, constant
/// for an actuator without lag.
struct FlightState {
  double along = 0.0, across = 0.0;                            ///< V, gamma or u, w; m/s, rad
  double theta = 0.0, q = 0.0;                                 ///< rad, rad/s
  double x1 = 0.0, x2 = 0.0;                                   ///< integrals of He and Le, s
  double distance = 0.0, height = 0.0;                         ///< m, over the ground
  double thrust_work = 0.0, drag_work = 0.0, wind_work = 0.0;  ///< m²/s², per unit mass
  double eta = 0.0, theta0 = 0.0, a1s = 0.0, delta_e = 0.0;    ///< actuator positions
};
/// Number of states.
inline constexpr std::size_t flight_states = sizeof(FlightState) / sizeof(double);
/// Names, units and nominal sizes of the states, in order.
Signals flight_signals(Axes axes);

/// The discrete state of a flight.
struct FlightMode {
  bool on_ground = false;  ///< held on the ground at rest until thrust and lift carry the weight
  bool airplane = false;   ///< the elevator controls pitch (if the controls are not blended)
};

/// The three control inputs [-, rad, rad].
struct Actuators {
  double theta0, a1s, delta_e;  ///< in that order
};

/// All quantities at one instant of a flight.
struct FlightPoint {
  FlightState rates;          ///< of every state, 1/s
  Command command;            ///< the schedule's, with the disturbance added
  double eta;                 ///< the tilt, which may lag its command
  double V, gamma, alpha;     ///< through the air
  Actuators asked, used;      ///< commanded by the law, before limits; applied to the airframe
  double He, Le;              ///< (7), with the actual V'
  double V_rate;              ///< m/s², through the air
  double thrust, lift, drag;  ///< N
  double induced_velocity;    ///< m/s, (3)
  double pitch_acceleration;  ///< rad/s²
  double climb_rate, ground_speed;  ///< m/s, over the ground
  double lift_off;                  ///< upward acceleration without the ground, m/s²
};
/// Evaluates the flight at time t [s] in state x.
FlightPoint flight_point(const Flight& flight, const FlightMode& mode, double t,
                         const FlightState& x);

/// Whether the elevator controls pitch at this tilt.
bool elevator_side(const Aircraft& aircraft, double eta);
/// The x2 at which the law on the other side of the handover commands the present pitching moment,
/// or the closest that the limits allow. x2 is unchanged if K_Li is zero.
double bumpless_x2(const Flight& flight, const FlightMode& before, double t, const FlightState& x);

/// A constant command.
Schedule held(const Command& command);

/// Commands at given heights or times; each component is a monotone cubic between them (Fritsch and
/// Carlson [56]) and constant beyond the ends.
struct Commands {
  std::vector<double> at;       ///< heights [m] or times [s], rising; two at least
  std::vector<Command> values;  ///< at each
};
/// By height [m]. Throws std::invalid_argument for fewer than two heights, heights that do not
/// rise, or a different number of values.
Schedule over_height(const Commands& commands);
/// By time [s]; throws like over_height().
Schedule over_time(const Commands& commands);

/// The corridor (16) over time: the tilt falls at a constant rate; path angle and speed are those
/// at the height where (16) has this tilt.
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

/// The corridor (16) backwards: its tilt and speed, from top to bottom, over time on a level path;
/// then the path turns down and the aircraft descends to the ground at the final speed.
struct Reconversion {
  double begins = 5.0;                     ///< s
  double lasts = 120.0;                    ///< s, from airplane to helicopter
  double hovers = 10.0;                    ///< s, level at the final speed
  double turns = 20.0;                     ///< s, until the path has turned down
  double descent = -std::numbers::pi / 6;  ///< rad, the path angle from then on
};
/// The schedule of a reconversion.
Schedule reconversion(const Reconversion& times = {});

/// A temporary change of a command or an actuator.
struct DisturbanceTable {
  /// Waveform.
  enum class Kind {
    step,                       ///< `size` from `at` on, for `duration` (0: to the end)
    doublet,                    ///< `size` for `duration`, then -`size` for as long
  } kind = Kind::step;          ///< which
  std::string on = "gamma";     ///< V, gamma, theta0, a1s or delta_e
  double at = 0.0, size = 0.0;  ///< s; SI, radians
  double duration = 0.0;        ///< s
};

/// Wind over the ground.
struct GustTable {
  /// Waveform.
  enum class Kind {
    steady,            ///< `size` at all times
    one_minus_cosine,  ///< up to `size` and back, (1 - cos)/2 from `at` for `duration` [53]
    dryden,            ///< turbulence of standard deviation `size`, a sum of sinusoids [53]
  } kind = Kind::one_minus_cosine;  ///< which
  bool up = false;                  ///< vertical; else along the ground, forward
  double size = 0.0;                ///< m/s
  double at = 0.0;                  ///< s
  double duration = 1.0;            ///< s
  double length = 50.0;             ///< m, turbulence scale length
  double speed = 15.0;              ///< m/s, the airspeed at which the turbulence is traversed
  std::uint64_t seed = 1;           ///< of the turbulence
};

/// The sum of all gusts, and the times at which it has kinks. Turbulence is a sum of sinusoids with
/// the Dryden spectra [53] and random phases [55]: smooth, with exactly the requested standard
/// deviation, and determined by the seed.
struct Weather {
  std::function<Wind(double t)> wind;  ///< empty: calm
  std::vector<double> kink_times;      ///< s, rising
};
/// The sum of these gusts.
Weather weather(const std::vector<GustTable>& gusts);

/// The longitudinal or lateral Dryden spectrum Φ(Ω) [m²/s² per rad/m] at a wave number Ω ≥ 0
/// [rad/m]; its integral over all wave numbers is sigma².
double dryden_spectrum(double wave_number, double sigma, double length, bool across);

/// The sum of all steps and doublets, and the times at which it jumps.
struct Disturbances {
  std::function<Disturbance(double t)> at;  ///< empty: none
  std::vector<double> kink_times;           ///< s, rising
};
/// The sum of these disturbances.
Disturbances disturbances(const std::vector<DisturbanceTable>& tables);

}  // namespace tiltrim
