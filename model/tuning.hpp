/// @file
/// [tune] of a study: which gains are free, where they are to hold, and what is asked of them.
#pragma once

#include <cstdint>
#include <limits>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace tiltrim {

/// What a number says of the closed loop at an operating point.
enum class Measure {
  decay,             ///< least -Re λ, 1/s: the spectral abscissa, negated
  damping,           ///< least -Re λ/|λ|
  frequency,         ///< largest |λ|, rad/s
  half_time,         ///< ln 2/(-Re λ) of the slowest mode of a name, s
  gain_margin_db,    ///< least factor up or down that destabilises a broken loop, dB
  phase_margin_deg,  ///< least lag or lead, degrees
  delay_margin,      ///< least delay, s
  disk_margin,       ///< symmetric disk margin
  use,               ///< an actuator's distance from the middle of its range over half the range
  response_use,      ///< the largest of it after a disturbance, linear response
  flight,            ///< of [simulate]: what it misses its aims by over what is allowed; 10 to 100:
                     ///< it ends early
  tracking,          ///< of the same: root mean square of its errors, 1 m/s and 0.1 rad each one
  sensitivity,       ///< largest move of an eigenvalue, rad/s, by an uncertain number's own scatter
};

/// As in a study: "decay", "phase_margin_deg", ...
std::string to_string(Measure measure);
/// "1/s", "rad/s", "dB", "degrees", "s" or "".
std::string_view unit(Measure measure);
/// Whether more is better: its limit is then a least value, else a largest.
bool more_is_better(Measure measure);
/// All of them, in order.
const std::vector<Measure>& measures();

/// The worst value over all operating points is to be at least `limit`, or at most; in the
/// measure's unit. NaN: nothing is asked, as of a goal.
struct Requirement {
  Measure measure = Measure::damping;                       ///< what is measured
  double limit = std::numeric_limits<double>::quiet_NaN();  ///< least or largest; or NaN
  /// half_time: the mode's name. Margins and uses: the actuator, "theta0", "a1s" or "delta_e"; if
  /// empty the worst of those that act.
  std::string of{};
};

/// A parameter of all the models that may be chosen within bounds, in SI units.
struct FreeGain {
  std::string name;                 ///< the models' signal, "gains.K_Lp"
  double lower = 0.0, upper = 0.0;  ///< both are allowed
  bool logarithmic = true;          ///< the search moves in its logarithm; needs lower > 0
};

/// A parameter that may be anywhere between two values, in SI units.
struct Uncertain {
  std::string name;                 ///< the models' signal, "aircraft.mass"
  double lower = 0.0, upper = 0.0;  ///< both may be
};

/// [tune]
struct TuneTable {
  std::vector<std::string> conditions;  ///< names of the study's, in its order
  std::vector<double> heights;          ///< points along corridor (16) beside them, m
  std::vector<FreeGain> gains;          ///< at least one
  std::vector<double> schedule;  ///< tilts [rad], rising: the gains are linear in eta between them;
                                 ///< empty: constant
  std::vector<Uncertain> uncertain;           ///< empty: none
  bool corners = true;                        ///< all of them are operating points
  int samples = 0;                            ///< seeded ones beside them
  std::map<std::string, double> disturbance;  ///< of V [m/s], gamma, theta [rad], q [rad/s] by name
  Requirement goal{Measure::decay};           ///< whose worst value is to be best
  std::vector<Requirement> limits;            ///< that hold at all points
  std::string global = "multistart", local = "slsqp";  ///< as tune/tune.hpp spells them
  std::string second = "crs2";                         ///< whose answer stands beside; "none"
  std::uint64_t seed = 1;                              ///< of all that is random
  long evaluations = 4000;                             ///< candidates tried
  double seconds = 0.0;                                ///< 0: no limit
  long robustness = 10'000;  ///< random samples that the answer is tried on
  /// The goal over a limit that moves.
  struct Front {
    Requirement limit;            ///< NaN
    double from = 0.0, to = 0.0;  ///< of its value, in the measure's unit
    int count = 0;                ///< of values
  };
  std::optional<Front> front;  ///< not given: none
};

}  // namespace tiltrim
