/// @file
/// A flight of the closed loop from a start, with all that happens on the way.
#pragma once

#include <string>
#include <vector>

#include "flight/flight.hpp"
#include "simulate/integrate.hpp"

namespace tiltrim {

/// Where a flight begins.
struct FlightStart {
  FlightState state{};     ///< at the beginning
  bool on_ground = false;  ///< held there, until its weight is carried
};
/// At rest on the ground, body axes, level.
FlightStart at_rest();

/// How fly() goes about it.
struct FlyOptions {
  double begins = 0.0;              ///< s, on the clock of schedule and weather
  double duration = 90.0;           ///< s
  IntegrateOptions integrate{};     ///< steps, samples, caps
  double fastest = 60.0;            ///< m/s through the air: beyond it the flight is lost
  double steepest = 3.0;            ///< rad of |theta|: the same
  double sinks = 3.0, rolls = 3.0;  ///< m/s down, along: a landing has no more at the ground
  double leans = 0.35;              ///< rad of |theta|: the same
};

/// What happens in flight.
enum class FlightEventKind {
  limit_reached,   ///< an actuator comes to its limit
  limit_left,      ///< and off it
  hand_over,       ///< of the pitch between cyclic and elevator
  lift_off,        ///< the ground carries no weight any more
  ground_contact,  ///< ends the flight
  schedule_kink,   ///< a height at which the schedule changes its law
  lost,            ///< too fast or turned over: ends the flight
};
std::string to_string(FlightEventKind kind);  ///< as JSON spells it

/// An event of a flight.
struct FlightEvent {
  FlightEventKind kind = FlightEventKind::limit_reached;  ///< what happens
  std::string what;                    ///< "theta0 upper", "elevator", "airspeed above 60 m/s"
  double t = 0.0;                      ///< s
  FlightState before, after;           ///< the same unless a state is set anew
  FlightMode mode_before, mode_after;  ///< on which side of the jumps
};

/// How a flight ended.
enum class FlightStatus {
  flown,           ///< to the end of its time
  landed,          ///< on the ground, softly: see FlyOptions
  ground_contact,  ///< on the ground otherwise
  lost,            ///< too fast or turned over
  not_finite,      ///< a rate was not
  stuck,           ///< step too small, steps or events used up: the message says which
  interrupted,     ///< the caller asked to stop
};
inline constexpr std::size_t flight_statuses = 7;  ///< how many there are
std::string to_string(FlightStatus status);        ///< as JSON spells it

/// What fly() answers.
struct FlightResult {
  FlightStatus status = FlightStatus::flown;  ///< how it ended
  std::string message;                        ///< where and why, if not in time
  std::vector<double> t;                      ///< s, of each sample
  std::vector<FlightState> states;            ///< at each
  std::vector<FlightMode> modes;              ///< at each
  std::vector<FlightEvent> events;            ///< in their order
  long steps = 0, evaluations = 0;            ///< of the integrator

  /// To the end of its time.
  explicit operator bool() const { return status == FlightStatus::flown; }
};

/// Throws std::invalid_argument for a vehicle without polar, with printed equations, limits or
/// options that are not finite, a start below the ground, or without airspeed in wind axes.
[[nodiscard]] FlightResult fly(const Flight& flight, const FlightStart& start,
                               const FlyOptions& options = {});

/// The flight as the integrator takes it, its mode as a number.
Motion motion_of(const Flight& flight, const FlyOptions& options = {});
int number_of(const FlightMode& mode);  ///< as motion_of() has it
FlightMode mode_of(int number);         ///< the mode of that number
/// The side of the hand-over where the flight starts.
FlightMode mode_at(const Flight& flight, const FlightStart& start, double t = 0.0);

}  // namespace tiltrim
