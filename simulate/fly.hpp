/// A flight of the closed loop from a start, with all that happens on the way.
#pragma once

#include <string>
#include <vector>

#include "model/flight.hpp"
#include "simulate/integrate.hpp"

namespace tiltrim {

/// Where a flight begins.
struct FlightStart {
  FlightState state{};
  bool on_ground = false;
};
/// At rest on the ground, body axes, level.
FlightStart at_rest();

struct FlyOptions {
  double begins = 0.0;     ///< s, on the clock of schedule and weather
  double duration = 90.0;  ///< s
  IntegrateOptions integrate{};
  double fastest = 60.0;  ///< m/s through the air: beyond it the flight is lost
  double steepest = 3.0;  ///< rad of |theta|: the same
  /// A landing: ground contact at no more than these, m/s down and along, rad of |theta|.
  double sinks = 3.0, rolls = 3.0, leans = 0.35;
};

enum class FlightEventKind {
  limit_reached,
  limit_left,
  hand_over,  ///< of the pitch between cyclic and elevator
  lift_off,
  ground_contact,  ///< ends the flight
  schedule_kink,   ///< a height at which the schedule changes its law
  lost,            ///< too fast or turned over: ends the flight
};
std::string to_string(FlightEventKind kind);

struct FlightEvent {
  FlightEventKind kind = FlightEventKind::limit_reached;
  std::string what;  ///< "theta0 upper", "elevator", "airspeed above 60 m/s"
  double t = 0.0;
  FlightState before, after;
  FlightMode mode_before, mode_after;
};

enum class FlightStatus {
  flown,           ///< to the end of its time
  landed,          ///< on the ground, softly: see FlyOptions
  ground_contact,  ///< on the ground otherwise
  lost,            ///< too fast or turned over
  not_finite,
  stuck,  ///< step too small, steps or events used up: the message says which
  interrupted,
};
inline constexpr std::size_t flight_statuses = 7;
std::string to_string(FlightStatus status);

struct FlightResult {
  FlightStatus status = FlightStatus::flown;
  std::string message;
  std::vector<double> t;
  std::vector<FlightState> states;
  std::vector<FlightMode> modes;
  std::vector<FlightEvent> events;
  long steps = 0, evaluations = 0;

  explicit operator bool() const { return status == FlightStatus::flown; }
};

/// Throws std::invalid_argument for a vehicle without polar, with printed equations, limits or
/// options that are not finite, a start below the ground, or without airspeed in wind axes.
[[nodiscard]] FlightResult fly(const Flight& flight, const FlightStart& start,
                               const FlyOptions& options = {});

/// The flight as the integrator takes it, its mode as a number.
Motion motion_of(const Flight& flight, const FlyOptions& options = {});
int number_of(const FlightMode& mode);
FlightMode mode_of(int number);
/// The side of the hand-over where the flight starts.
FlightMode mode_at(const Flight& flight, const FlightStart& start, double t = 0.0);

}  // namespace tiltrim
