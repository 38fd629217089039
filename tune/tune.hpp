/// @file
/// Tuning: gains whose worst case over operating points is as good as it can be.
#pragma once

#include <complex>
#include <cstdint>
#include <functional>
#include <limits>
#include <map>
#include <stop_token>
#include <string>
#include <string_view>
#include <vector>

#include "sweep/sweep.hpp"

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

/// A number of the caller's own to ask for, of which less is better, at a model's parameters.
using FigureOfMerit = std::function<double(const Eigen::VectorXd& parameters)>;

/// What is to be tuned.
struct TuneProblem {
  std::vector<SweepRequest> points;  ///< each trimmed again for every candidate
  /// Each point's model with inputs added behind its actuators, "theta0_added" for the output
  /// theta0 and so on (closed_loop_with_inputs()); needed for margins alone, else empty.
  std::vector<Model> loops{};
  std::vector<FreeGain> gains{};  ///< at least one
  /// Gains linear between their values at these (rising) of a parameter that the points have;
  /// empty: constant. Tuned are the values at each, first all of the first gain.
  std::vector<double> schedule{};
  std::string schedule_over{};         ///< that parameter
  std::vector<Uncertain> uncertain{};  ///< empty: none
  bool corners = true;            ///< each point again at every corner of the uncertain numbers
  int samples = 0;                ///< and at as many random places between, the same at each point
  std::uint64_t sample_seed = 1;  ///< of these places
  /// By state, in its unit: where the closed loop starts from, beside its trim (response_use).
  std::map<std::string, double> disturbance{};
  /// By name, for Measure::figure. They count once for each scatter, at the first point.
  std::map<std::string, FigureOfMerit> figures{};
  Requirement goal{Measure::decay};   ///< its worst value is to be as good as it can be
  std::vector<Requirement> limits{};  ///< that hold at all places

  /// Numbers tuned: gains, times places of the schedule.
  std::size_t variables() const { return gains.size() * (schedule.empty() ? 1 : schedule.size()); }
};

/// All that is asked: the goal, the limits, and stability (decay of 0) where neither speaks of
/// decay or damping.
[[nodiscard]] std::vector<Requirement> asked_of(const TuneProblem& problem);

/// Where the search begins: NLopt's algorithms, or local searches from many starts.
enum class GlobalSearch {
  crs2,        ///< controlled random search
  isres,       ///< evolution with stochastic ranking
  esch,        ///< evolution
  direct,      ///< dividing rectangles
  mlsl,        ///< multi-level single linkage
  multistart,  ///< local searches from the best of random points
};
/// How it goes on: NLopt's algorithms.
enum class LocalSearch {
  slsqp,   ///< sequential quadratic programming
  mma,     ///< moving asymptotes
  bobyqa,  ///< quadratic models, no slopes
  cobyla,  ///< linear models, no slopes
  sbplx,   ///< subspaces and simplexes, no slopes
};
std::string to_string(GlobalSearch algorithm);  ///< as a study spells it
std::string to_string(LocalSearch algorithm);   ///< as a study spells it
/// From its name; throws std::invalid_argument with all of them if there is none.
GlobalSearch global_search(const std::string& name);
/// The same.
LocalSearch local_search(const std::string& name);

/// How far a search is.
struct TuneProgress {
  long evaluations = 0, of = 0;  ///< candidates
  double seconds = 0.0;          ///< since it began
  double best = 0.0;             ///< of the goal, where `feasible`
  bool feasible = false;         ///< the best meets all limits
  std::string decides;  ///< what holds the best where it is: requirement and point, in words
};

/// How tune() goes about it.
struct TuneOptions {
  GlobalSearch global = GlobalSearch::multistart;  ///< first
  LocalSearch local = LocalSearch::slsqp;          ///< then
  std::uint64_t seed = 1;                          ///< of all that is random
  Eigen::VectorXd start{};  ///< tried first, SI, each cut to its bounds; empty: the middle alone
  long evaluations = 4000;  ///< candidates, each at all points
  double seconds = 0.0;     ///< 0: no limit
  int threads = 0;          ///< 0: as many as the machine has; the answer is the same for any
  TrimOptions trimming{.starts = 8, .max_boxes = 2000, .closest = false};  ///< of each place
  std::stop_token stop{};                              ///< asked between candidates
  std::function<void(const TuneProgress&)> observe{};  ///< from one thread at a time
};

/// How a tuning ended.
enum class TuneStatus {
  tuned,         ///< the best point found meets all limits, verified
  limits_unmet,  ///< no point found does; the one that misses them least is given
  unstable,      ///< limits are met, yet some eigenvalue is not left of the axis by its bound
  no_trim,       ///< at no candidate were all points in equilibrium
};
std::string to_string(TuneStatus status);  ///< as JSON spells it

/// A place at which gains are tried: an operating point, and where in the scatter.
struct TunePlace {
  std::size_t point = 0;  ///< of the problem's
  std::string scatter;    ///< "mass +15 %, CM_de -15 %"; empty: nominal
};

/// One requirement at one place, or the goal (limit NaN).
struct Achieved {
  TunePlace place;                  ///< where
  std::size_t asked = 0;            ///< position in asked_of()
  Requirement requirement;          ///< that one
  double value = 0.0;               ///< NaN: it does not apply here (no mode of that name)
  std::complex<double> eigenvalue;  ///< which decides, where an eigenvalue does; else NaN
  bool active = false;              ///< it holds the answer where it is, to 1e-4
  /// How far the limit is met, over its size; negative: missed. The goal: NaN.
  double reserve() const;
};

/// What one of the tuned numbers does at the answer.
struct GainEffect {
  std::string name;                         ///< "gains.K_Lp", or "gains.K_Lp at eta = 30 deg"
  double value = 0.0;                       ///< SI
  std::vector<double> slopes;               ///< [asked]: d(worst value)/d(ln gain) of what decides
  double goal_less = 0.0, goal_more = 0.0;  ///< worst goal, trimmed again, gain 10 % less and more
  bool limits_less = false, limits_more = false;  ///< the limits are met there
};

/// What tune() answers.
struct TuneResult {
  TuneStatus status = TuneStatus::no_trim;  ///< the verdict
  std::string message;                      ///< why not tuned: which requirement at which point
  Eigen::VectorXd gains;                    ///< SI, TuneProblem::variables() of them
  double goal = 0.0;                        ///< the worst over all places
  std::vector<Achieved> achieved;           ///< [place][asked]
  std::vector<GainEffect> effects;          ///< largest first
  bool coalescing = false;  ///< two eigenvalues that decide, or nearly (1 %), meet at the answer
  long evaluations = 0;     ///< candidates tried
  bool interrupted = false, out_of_time = false, out_of_evaluations = false;  ///< why it stopped

  /// The best point found meets all limits.
  explicit operator bool() const { return status == TuneStatus::tuned; }
};

/// Global search, then local search from what it found, then, where eigenvalues that decide
/// coalesce, on the manifold where they do. Every number of the answer is evaluated again at the
/// answer, from trims of their own. Throws std::invalid_argument for names the models do not have,
/// bounds reversed or not finite, nothing free, no point, a requirement that cannot be evaluated.
[[nodiscard]] TuneResult tune(const TuneProblem& problem, const TuneOptions& options = {});

/// How gains fare between the corners.
struct Robustness {
  long samples = 0, met = 0;        ///< met: at every point in trim, stable, all limits met
  long no_trim = 0, unstable = 0;   ///< of those not met; the rest miss a limit
  double fraction = 0.0;            ///< met of samples
  double lower = 0.0, upper = 0.0;  ///< Clopper-Pearson interval of the fraction, 95 %
  double worst_goal = std::numeric_limits<double>::quiet_NaN();  ///< over the samples in trim
  std::string worst;                                             ///< where: point and numbers
  bool interrupted = false;                                      ///< fewer samples than asked
};
/// Uniform random numbers between the uncertain ones' bounds; sample i depends on the seed and i
/// alone. Throws std::invalid_argument as tune() does, and without uncertain numbers.
[[nodiscard]] Robustness robustness(const TuneProblem& problem, const Eigen::VectorXd& gains,
                                    long samples, const TuneOptions& options = {});

}  // namespace tiltrim
