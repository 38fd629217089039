/// @file
/// A flight of the closed loop: where it starts, what happens on the way, the flight as a table,
/// and how far the linear model of its trim reaches.
#pragma once

#include <filesystem>
#include <limits>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "flight/flight.hpp"
#include "simulate/integrate.hpp"
#include "simulate/simulate.hpp"
#include "trim/trim.hpp"

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
  /// Whether a second, rougher run says how far the end may be off (FlightColumn::error), for two
  /// thirds more work.
  bool global_error = false;
};

/// Of the second run of FlyOptions::global_error, times the first one's.
inline constexpr double rough_tolerance = 10.0;

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

/// An end of a flight.
struct FlightEnd {
  double t = 0.0;       ///< s
  FlightState state{};  ///< there
  FlightMode mode{};    ///< there
};

/// What fly() answers.
struct FlightResult {
  FlightStatus status = FlightStatus::flown;  ///< how it ended
  std::string message;                        ///< where and why, if not in time
  std::vector<double> t;                      ///< s, of each sample
  std::vector<FlightState> states;            ///< at each
  std::vector<FlightMode> modes;              ///< at each
  std::vector<FlightEvent> events;            ///< in their order
  long steps = 0, evaluations = 0;            ///< of the integrator

  /// Of a run at ten times the tolerance, if FlyOptions::global_error asks for one and it ends in
  /// the same way.
  std::optional<FlightEnd> rough_end{};

  /// By what the flight does: not because the integrator could not go on, or was stopped.
  bool ended() const {
    return status != FlightStatus::stuck && status != FlightStatus::not_finite &&
           status != FlightStatus::interrupted;
  }

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

/// The closed loop's trim at a command, as a state of a flight at a height.
struct TrimmedStart {
  TrimStatus status = TrimStatus::not_found;  ///< of the trim
  std::string message;                        ///< why there is none
  FlightStart start;                          ///< if there is one

  /// There is one.
  explicit operator bool() const { return is_equilibrium(status); }
};
/// Trims the closed loop there.
[[nodiscard]] TrimmedStart trimmed_start(const Flight& flight, const Command& command,
                                         double height, const TrimOptions& options = {});

/// All that fly() is given.
struct FlightPlan {
  Flight flight;                                    ///< its first argument
  FlyOptions options;                               ///< its third
  FlightStart start;                                ///< its second
  TrimStatus start_status = TrimStatus::converged;  ///< of the trim that it starts from
  std::string message;      ///< why there is no trim to start from; else empty
  std::string start_words;  ///< "at rest on the ground", "from the trim at 15 m/s, 0°, tilt 0°"
  bool lands = false;       ///< the schedule ends on the ground
};

/// Puts states given by name into one: V, gamma, theta, q, energy_integral, distribution_integral
/// (SI). V and gamma stay where they are not given, whatever becomes of theta.
void put(const std::map<std::string, double>& states, Axes axes, FlightState& x);

/// One number over time.
struct FlightColumn {
  std::string name;            ///< "theta_deg"
  std::string unit;            ///< "degrees"
  std::string what;            ///< "pitch attitude"
  std::vector<double> values;  ///< one for each sample
  /// Estimated of the last value; not a number where there is no estimate.
  double error = std::numeric_limits<double>::quiet_NaN();
};

/// Time, states, commands, controls, energy errors, forces and powers at every sample. Angles are
/// in degrees, all else SI.
struct FlightTable {
  std::vector<FlightColumn> columns;  ///< time first
  /// How many samples.
  std::size_t rows() const { return columns.empty() ? 0 : columns.front().values.size(); }
  /// Throws std::invalid_argument with all names if there is none of this one.
  const std::vector<double>& operator[](const std::string& name) const;
};
/// The table of a flight.
FlightTable flight_table(const Flight& flight, const FlightResult& flown);

/// What stands in a file beside the table: attributes and events.
struct FlightNotes {
  /// Something that happened.
  struct Event {
    double t = 0.0;          ///< s
    std::string kind, what;  ///< in words
  };
  std::string title, study, program, status, message;  ///< attributes of these names
  std::vector<Event> events;                           ///< in their order
};
/// Of a flight.
FlightNotes notes_of(const FlightResult& flown);

/// NetCDF-4 with dimension `time`, and the events beside it; written whole or not at all. Throws
/// std::runtime_error "path: why".
void write_netcdf(const FlightTable& table, const FlightNotes& notes,
                  const std::filesystem::path& file);

/// At the trim of a command that is held, in wind axes. `offset` by state name: V, gamma, theta, q,
/// energy_integral, distribution_integral (SI). Throws std::invalid_argument for other names and an
/// offset of nothing.
[[nodiscard]] Response response(const Flight& flight, const Command& command,
                                const std::map<std::string, double>& offset,
                                const ResponseOptions& options = {});

}  // namespace tiltrim
