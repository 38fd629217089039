/// A flight of the closed loop: its initial state, its events, its time histories as a table, and
/// the comparison of linear and nonlinear response.
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

/// The initial state of a flight.
struct FlightStart {
  FlightState state{};     ///< at the beginning
  bool on_ground = false;  ///< held on the ground until thrust and lift carry the weight
};
/// At rest on the ground, body axes, level.
FlightStart at_rest();

/// Options of fly().
struct FlyOptions {
  double begins = 0.0;              ///< s, on the clock of schedule and weather
  double duration = 90.0;           ///< s
  IntegrateOptions integrate{};     ///< steps, samples, caps
  double fastest = 60.0;            ///< m/s through the air: above it the flight is lost
  double steepest = 3.0;            ///< rad, |theta| above which the flight is lost
  double sinks = 3.0, rolls = 3.0;  ///< m/s vertically, horizontally: limits of a landing
  double leans = 0.35;              ///< rad, limit of |theta| in a landing
  /// Estimates the error at the end (FlightColumn::error) from a second run at a looser tolerance;
  /// costs two thirds more.
  bool global_error = false;
};

/// Tolerance of the second run of FlyOptions::global_error, relative to the first.
inline constexpr double rough_tolerance = 10.0;

/// Kinds of events.
enum class FlightEventKind {
  limit_reached,   ///< a control or the pitch attitude reaches its limit
  limit_left,      ///< it leaves its limit
  hand_over,       ///< pitch control passes between cyclic and elevator
  lift_off,        ///< the ground no longer carries weight
  ground_contact,  ///< ends the flight
  schedule_kink,   ///< a height at which the schedule is not smooth
  lost,            ///< too fast or pitched over: ends the flight
};
std::string to_string(FlightEventKind kind);  ///< as JSON spells it

/// An event of a flight.
struct FlightEvent {
  FlightEventKind kind = FlightEventKind::limit_reached;  ///< what happens
  std::string what;                    ///< "theta0 upper", "to the elevator", "too fast"
  double t = 0.0;                      ///< s
  FlightState before, after;           ///< equal unless a state is reset
  FlightMode mode_before, mode_after;  ///< the discrete states
};

/// How a flight ended.
enum class FlightStatus {
  flown,           ///< to the end of its duration
  landed,          ///< on the ground, softly: see FlyOptions
  ground_contact,  ///< on the ground otherwise
  lost,            ///< too fast or pitched over
  not_finite,      ///< a rate was not finite
  stuck,           ///< step too small, step or event limit reached: see the message
  interrupted,     ///< the caller asked to stop
};
inline constexpr std::size_t flight_statuses = 7;  ///< number of enumerators
std::string to_string(FlightStatus status);        ///< as JSON spells it

/// The final state of a flight.
struct FlightEnd {
  double t = 0.0;       ///< s
  FlightState state{};  ///< there
  FlightMode mode{};    ///< there
};

/// Result of fly().
struct FlightResult {
  FlightStatus status = FlightStatus::flown;  ///< how it ended
  std::string message;                        ///< where and why, if the flight ended early
  std::vector<double> t;                      ///< s, of each sample
  std::vector<FlightState> states;            ///< at each
  std::vector<FlightMode> modes;              ///< at each
  std::vector<FlightEvent> events;            ///< in order
  long steps = 0, evaluations = 0;            ///< of the integrator

  /// Of the run at the looser tolerance, if FlyOptions::global_error requests one and it ends in
  /// the same way.
  std::optional<FlightEnd> rough_end{};

  /// True if the flight itself ended, rather than the integrator failing or being stopped.
  bool ended() const {
    return status != FlightStatus::stuck && status != FlightStatus::not_finite &&
           status != FlightStatus::interrupted;
  }

  /// True if the flight reached the end of its duration.
  explicit operator bool() const { return status == FlightStatus::flown; }
};

/// Throws std::invalid_argument for a vehicle without polar, printed equations, limits or options
/// that are not finite, a start below the ground, and a start without airspeed in wind axes.
[[nodiscard]] FlightResult fly(const Flight& flight, const FlightStart& start,
                               const FlyOptions& options = {});

/// The flight as a problem for the integrator, its discrete state as a number.
Motion motion_of(const Flight& flight, const FlyOptions& options = {});
int number_of(const FlightMode& mode);  ///< as motion_of() numbers it
FlightMode mode_of(int number);         ///< the mode of that number
/// The discrete state in which the flight starts.
FlightMode mode_at(const Flight& flight, const FlightStart& start, double t = 0.0);

/// The closed loop's trim at a command, as the state of a flight at a height.
struct TrimmedStart {
  TrimStatus status = TrimStatus::not_found;  ///< of the trim
  std::string message;                        ///< why no trim was found
  FlightStart start;                          ///< valid if a trim was found

  /// True if a trim was found.
  explicit operator bool() const { return is_equilibrium(status); }
};
/// Trims the closed loop at a command and height [m].
[[nodiscard]] TrimmedStart trimmed_start(const Flight& flight, const Command& command,
                                         double height, const TrimOptions& options = {});

/// The arguments of fly(), and how they came about.
struct FlightPlan {
  Flight flight;                                    ///< its first argument
  FlyOptions options;                               ///< its third
  FlightStart start;                                ///< its second
  TrimStatus start_status = TrimStatus::converged;  ///< of the trim at the start
  std::string message;      ///< why there is no trim to start from; else empty
  std::string start_words;  ///< "at rest on the ground", "from the trim at 15 m/s, 0°, tilt 0°"
  bool lands = false;       ///< the schedule ends on the ground
};

/// Sets the states given by name: V, gamma, theta, q, energy_integral, distribution_integral (SI).
/// V and gamma keep their values unless given, whatever happens to theta.
void put(const std::map<std::string, double>& states, Axes axes, FlightState& x);

/// One time history.
struct FlightColumn {
  std::string name;            ///< "theta_deg"
  std::string unit;            ///< "degrees"
  std::string what;            ///< "pitch attitude"
  std::vector<double> values;  ///< one for each sample
  /// Estimated error of the last value; NaN if there is no estimate.
  double error = std::numeric_limits<double>::quiet_NaN();
};

/// Time, states, commands, controls, energy errors, forces and powers at every sample. Angles are
/// in degrees, everything else is SI.
struct FlightTable {
  std::vector<FlightColumn> columns;  ///< time first
  /// Number of samples.
  std::size_t rows() const { return columns.empty() ? 0 : columns.front().values.size(); }
  /// Throws std::invalid_argument with all names if there is no such column.
  const std::vector<double>& operator[](const std::string& name) const;
};
/// The table of a flight.
FlightTable flight_table(const Flight& flight, const FlightResult& flown);

/// The attributes and events that a file stores with the table.
struct FlightNotes {
  /// An event.
  struct Event {
    double t = 0.0;          ///< s
    std::string kind, what;  ///< in words
  };
  std::string title, study, program, status, message;  ///< attributes of these names
  std::vector<Event> events;                           ///< in their order
};
/// The notes of a flight.
FlightNotes notes_of(const FlightResult& flown);

/// Writes NetCDF-4 with dimension `time` and the events, completely or not at all. Throws
/// std::runtime_error "path: why".
void write_netcdf(const FlightTable& table, const FlightNotes& notes,
                  const std::filesystem::path& file);

/// Linear and nonlinear response from an offset to the trim of a constant command, in wind axes.
/// `offset` by state name: V, gamma, theta, q, energy_integral, distribution_integral (SI). Throws
/// std::invalid_argument for other names, a zero offset and options as for a motion.
[[nodiscard]] Response response(const Flight& flight, const Command& command,
                                const std::map<std::string, double>& offset,
                                const ResponseOptions& options = {});

}  // namespace tiltrim
