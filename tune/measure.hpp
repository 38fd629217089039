/// @file
/// What is asked of a tuned loop: measures, requirements, and the numbers that are free.
#pragma once

#include <limits>
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
  figure,            ///< a number of the caller's own: TuneProblem::figures
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
  /// half_time: the mode's name. Margins and uses: the actuator; if empty the worst of those
  /// that act.
  std::string of{};
  std::string figure{};  ///< of Measure::figure: which
};
/// Its name: the measure's, or the figure's.
std::string name_of(const Requirement& requirement);

/// A parameter of all the models that may be chosen within bounds, in SI units.
struct FreeGain {
  std::string name;                 ///< the models' signal, "gains.K_Lp"
  double lower = 0.0, upper = 0.0;  ///< both are allowed
  bool logarithmic = true;          ///< the search moves in its logarithm; needs lower > 0
};

}  // namespace tiltrim
