/// @file
/// Flying qualities of a linear model: short period, phugoid, hovering oscillations, attitude
/// bandwidth, and their levels by the military specifications; zeros and poles with error bounds.
#pragma once

#include <Eigen/Core>
#include <array>
#include <complex>
#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "linearize/linearize.hpp"
#include "linearize/modes.hpp"
#include "model/model.hpp"

namespace tiltrim {

/// Status of the zeros of a transfer function.
enum class ZerosStatus {
  found,             ///< every zero is enclosed in a disk of its own
  not_enclosed,      ///< some zeros are multiple or ill conditioned: their errors are infinite,
                     ///< and where the QZ iteration fails they are NaN
  degree_undecided,  ///< a Markov parameter may be zero: the number of finite zeros is not known
  no_response,       ///< the input has no effect on the output
};
std::string to_string(ZerosStatus status);  ///< as in JSON

/// A root with the radius of a disk that contains a true one.
struct EnclosedRoot {
  std::complex<double> value;  ///< 1/s
  double error = 0.0;          ///< infinite: not enclosed
};

/// G(s) = gain Π(s - zero)/Π(s - pole).
struct ZerosAndPoles {
  ZerosStatus status = ZerosStatus::no_response;  ///< of the zeros
  std::vector<EnclosedRoot> zeros;                ///< finite, by ascending real part
  std::vector<EnclosedRoot> poles;                ///< by ascending real part
  int relative_degree = 0;  ///< poles less finite zeros: the number of infinite zeros
  double gain = 0.0;        ///< the first Markov parameter that is not zero
  double gain_error = 0.0;  ///< its bound
  int cancelled = 0;        ///< states without a path from the input or to the output: left out
};

/// Zeros and poles from an input of a linear model to a state or an output: finite zeros of the
/// Rosenbrock pencil [A - sI, b; c, d] by QZ, each improved by Newton's method and enclosed by
/// Krawczyk's test for all matrices within the error bounds. States that the input cannot reach or
/// the output cannot see, by exact zeros, are left out. The number of finite zeros is proved by the
/// first Markov parameter d, cb, cAb, ... that cannot be zero. Throws std::invalid_argument for an
/// unknown name or without a linear model.
[[nodiscard]] ZerosAndPoles zeros_and_poles(const LinearModel& linear, const std::string& input,
                                            const std::string& output);

/// What a constant stick commands.
enum class ResponseType {
  rate,      ///< a rate: the bandwidth is the lesser of the gain and the phase bandwidth
  attitude,  ///< an attitude: the bandwidth is the phase bandwidth
};

std::string to_string(ResponseType type);  ///< "rate", "attitude"

/// A value with its error bound; NaN if not known.
struct Bounded {
  double value = std::numeric_limits<double>::quiet_NaN();  ///< in its unit
  double error = 0.0;                                       ///< bound
};

/// Small-amplitude bandwidth and phase delay of attitude to stick [97, 3.3.2.1].
struct Bandwidth {
  /// The value of a frequency that the response does not reach.
  static constexpr double never = std::numeric_limits<double>::infinity();

  bool known = false;  ///< false: the transfer function's zeros are not known; see `message`
  Bounded phase_bandwidth{never};  ///< rad/s: 45 degrees of phase margin, a phase of -135 degrees
  Bounded gain_bandwidth{never};   ///< rad/s: 6 dB of gain margin, |G| = 6 dB above |G(iω180)|
  Bounded bandwidth{never};        ///< rad/s: by the response type
  Bounded crossover{never};        ///< rad/s: ω180, a phase of -180 degrees
  Bounded phase_delay{0.0};        ///< s: (-180° - phase(2 ω180))/(2 ω180); 0 without ω180
  std::string message;             ///< why it is not known, or what is ambiguous
};

/// Bandwidth of a transfer function from its zeros and poles, for either sign of the stick. Phases
/// are continuous in frequency and end at -90 degrees for each of the poles in excess of zeros, 180
/// degrees lower for each zero in the right half-plane of at least 0.1 rad/s. Such a zero acts as a
/// delay: its lag starts from 0 at rest. A slower one ends at +90 degrees, as in the left
/// half-plane. A root within its error of the axis counts as left of it.
[[nodiscard]] Bandwidth bandwidth(const ZerosAndPoles& transfer,
                                  ResponseType type = ResponseType::rate);

/// A level of a requirement.
enum class Level : std::int8_t {
  not_judged = -1,  ///< the requirement does not apply, or its figure is not known
  undecided = 0,    ///< a border lies within the error bound
  one = 1,          ///< clearly adequate
  two = 2,          ///< adequate with more workload
  three = 3,        ///< controllable
  none = 4,         ///< worse than the limit of level 3
};
std::string to_string(Level level);  ///< "1", "2", "3", "none", "undecided", "not judged"

/// A figure judged by one requirement.
struct Criterion {
  std::string name;                 ///< "short-period damping"
  std::string requirement;          ///< "MIL-F-8785C 3.2.2.1.2"
  std::string unit;                 ///< of the figure
  double value = 0.0;               ///< NaN: not known
  double error = 0.0;               ///< its bound
  Level level = Level::not_judged;  ///< its level
  /// Signed distances to the border of level 1, 2, ...: positive inside.
  std::vector<double> margins{};
  double margin_error = 0.0;  ///< bound of each margin's error
  std::string margin_unit{};  ///< of the margins
  std::string remark{};       ///< why it is not judged, or how it was found

  std::size_t nearest() const;  ///< index of the nearest border in `margins`
  double distance() const;      ///< to that border, signed; NaN without margins
};

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
  /// In the units of airspeed and s; NaN: standard gravity, in m/s² or, where the states with the
  /// roles of speed are in ft/s, in ft/s².
  double gravity = std::numeric_limits<double>::quiet_NaN();
  /// Normal acceleration over angle of attack, g/rad, if known; NaN: computed.
  double n_per_alpha = std::numeric_limits<double>::quiet_NaN();
  /// Lowest bandwidth [rad/s] over phase delay [s] for levels 1 and 2, linear between points:
  /// curves of a specification, which prints them as figures. Empty: the bandwidth has no level.
  std::array<std::vector<std::array<double, 2>>, 2> least_bandwidth{};
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

/// Status of flying qualities.
enum class QualitiesStatus {
  judged,                ///< there are longitudinal modes
  no_longitudinal_mode,  ///< no mode has most of its participation in the roles' signals
};
std::string to_string(QualitiesStatus status);  ///< as in JSON

/// Flying qualities of one linear model.
struct Qualities {
  /// Shares of a mode's participation, in coordinates made of the roles' signals.
  struct ModeShares {
    double fast = 0.0;                                   ///< angle of attack and pitch rate
    double slow = 0.0;                                   ///< speed, pitch attitude and height
    double longitudinal() const { return fast + slow; }  ///< all of them
  };

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
