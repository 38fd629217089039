/// @file
/// Flying qualities of a linear model: short period, phugoid, hovering oscillations, attitude
/// bandwidth, and their levels by the military specifications.
#pragma once

#include <array>
#include <functional>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "linearize/modes.hpp"
#include "qualities/bandwidth.hpp"
#include "qualities/levels.hpp"
#include "qualities/zeros.hpp"

namespace tiltrim {

/// What the signals of a model are. Each is the name of a state or an output; empty: the model has
/// none. Angles in rad.
struct Roles {
  std::string pitch;                ///< pitch attitude
  std::string pitch_rate;           ///< rad/s
  std::string alpha;                ///< angle of attack; or
  std::string downward_speed;       ///< velocity along the body's z axis, in the unit of airspeed
  std::string speed;                ///< forward speed or airspeed
  std::string height;               ///< altitude
  std::string normal_acceleration;  ///< positive up, in g or in the unit of gravity
  std::string stick;                ///< an input: the pitch control
};

/// Aircraft classes of MIL-F-8785C 1.3 [94].
enum class AircraftClass {
  I,     ///< small, light
  II_L,  ///< medium weight, low to medium maneuverability, land-based
  II_C,  ///< the same, carrier-based
  III,   ///< large, heavy, low to medium maneuverability
  IV,    ///< high maneuverability
};
/// Flight phase categories of MIL-F-8785C 1.4 [94].
enum class FlightCategory {
  A,  ///< rapid maneuvering, precision tracking
  B,  ///< gradual maneuvers: climb, cruise, descent
  C,  ///< terminal: takeoff, approach, landing
};
/// Which requirements apply.
enum class FlightRegime {
  forward,  ///< MIL-F-8785C
  hover,    ///< hover and low speed: MIL-F-83300 and ADS-33E-PRF
};
std::string to_string(AircraftClass one);   ///< "I", "II-L", "II-C", "III", "IV"
std::string to_string(FlightCategory one);  ///< "A", "B", "C"
std::string to_string(FlightRegime one);    ///< "forward", "hover"

/// Options of qualities().
struct QualitiesOptions {
  Roles roles;                                   ///< of the model's signals
  AircraftClass aircraft = AircraftClass::II_L;  ///< class
  FlightCategory category = FlightCategory::B;   ///< of the flight phase
  FlightRegime regime = FlightRegime::forward;   ///< which requirements apply
  ResponseType response = ResponseType::rate;    ///< for the bandwidth
  /// True airspeed at the operating point; NaN: from the states with the roles of speed and
  /// downward speed.
  double airspeed = std::numeric_limits<double>::quiet_NaN();
  double gravity = 9.80665;  ///< in the units of airspeed and s
  /// Normal acceleration over angle of attack, g/rad, if known; NaN: computed.
  double n_per_alpha = std::numeric_limits<double>::quiet_NaN();
  /// Lowest bandwidth [rad/s] over phase delay [s] for levels 1 and 2, linear between points:
  /// curves of a specification, which prints them as figures. Empty: the bandwidth has no level.
  std::array<std::vector<std::array<double, 2>>, 2> least_bandwidth{};
};

/// A value with its error bound; NaN if not known.
struct Bounded {
  double value = std::numeric_limits<double>::quiet_NaN();  ///< in its unit
  double error = 0.0;                                       ///< bound
};

/// How an oscillation was found.
enum class OscillationKind {
  pair,      ///< a complex pair
  two_real,  ///< two stable real roots: frequency and damping of their product
  absent,    ///< neither; see `message`
};
std::string to_string(OscillationKind kind);  ///< as in JSON

/// Short period or phugoid.
struct Oscillation {
  OscillationKind kind = OscillationKind::absent;  ///< how it was found
  std::vector<std::size_t> modes;                  ///< positions in the modes; of a pair, both
  Bounded frequency;                               ///< undamped, rad/s
  Bounded damping;                                 ///< ratio
  std::string message;                             ///< which roots are there instead
};

/// Shares of a mode's participation, in coordinates made of the roles' signals.
struct ModeShares {
  double fast = 0.0;                                   ///< angle of attack and pitch rate
  double slow = 0.0;                                   ///< speed, pitch attitude and height
  double longitudinal() const { return fast + slow; }  ///< all of them
};

/// Status of flying qualities.
enum class QualitiesStatus {
  judged,                ///< there are longitudinal modes
  no_longitudinal_mode,  ///< no mode has most of its participation in the roles' signals
};
std::string to_string(QualitiesStatus status);  ///< as in JSON

/// Flying qualities of one linear model.
struct Qualities {
  QualitiesStatus status = QualitiesStatus::no_longitudinal_mode;  ///< whether they exist
  Level level = Level::not_judged;                                 ///< the worst of all criteria
  std::vector<Criterion> criteria;        ///< in the order of the specifications
  Modes modes;                            ///< of the linear model
  std::vector<ModeShares> shares;         ///< one for each mode
  Oscillation short_period, phugoid;      ///< in hover: absent
  Bounded n_per_alpha;                    ///< g/rad; in hover: not computed
  std::optional<ZerosAndPoles> attitude;  ///< stick to pitch; empty without these roles
  Bandwidth bandwidth;                    ///< of it
  std::vector<std::string> remarks;       ///< what could not be judged, and why
};

/// Finds the modes by the participation of the roles' signals, computes the figures with error
/// bounds from those of the linear model, and judges them. A requirement whose border lies within
/// the error bound is undecided. Throws std::invalid_argument for unknown names, without a linear
/// model, without the roles of pitch and pitch rate, and for options out of range.
[[nodiscard]] Qualities qualities(const LinearModel& linear, const QualitiesOptions& options);

}  // namespace tiltrim
