/// @file
/// Tuning: gains optimized for the worst case over all operating points.
#pragma once

#include <complex>
#include <cstdint>
#include <functional>
#include <limits>
#include <map>
#include <stop_token>
#include <string>
#include <vector>

#include "sweep/sweep.hpp"

namespace tiltrim {

/// The measures of the closed loop at an operating point.
enum class Measure {
  decay,             ///< smallest -Re λ, 1/s: the spectral abscissa, negated
  damping,           ///< smallest -Re λ/|λ|
  frequency,         ///< largest |λ|, rad/s
  half_time,         ///< ln 2/(-Re λ) of the slowest mode with a given name, s
  gain_margin_db,    ///< smallest destabilizing factor, up or down, of a broken loop, dB
  phase_margin_deg,  ///< smallest destabilizing lag or lead, degrees
  delay_margin,      ///< smallest destabilizing delay, s
  disk_margin,       ///< symmetric disk margin
  use,               ///< actuator's distance from the middle of its range over half the range
  response_use,      ///< its maximum after a disturbance, linear response
  figure,            ///< a user-defined figure: TuneProblem::figures
  sensitivity,       ///< largest move of an eigenvalue, rad/s, over an uncertain parameter's range
  peak_gain,         ///< H∞ norm of the weighted transfer from some signals to others
  peak_sensitivity,  ///< H∞ norm of the sensitivity 1/(1 + L) of a broken loop, weighted
  h2_norm,           ///< H2 norm of the weighted transfer: root mean square for white noise
  quadratic_cost,    ///< integral of weighted squares after a disturbance, linear response
  overshoot,         ///< of a step response, over its final value
  settling_time,     ///< of a step response into a band around its final value, s
  pole_region,       ///< least of decay, damping and 1/frequency over those required; 1: inside
};

/// As in a study file: "decay", "phase_margin_deg", ...
std::string to_string(Measure measure);
/// The worst value over all operating points must be at least `limit` (or at most), in the
/// measure's unit. NaN: no limit, as for a goal.
struct Requirement {
  Measure measure = Measure::damping;                       ///< what is measured
  double limit = std::numeric_limits<double>::quiet_NaN();  ///< minimum or maximum; or NaN
  /// half_time: mode name. Margins and uses: actuator; empty: the worst of those with an effect.
  std::string of{};
  std::string figure{};               ///< name of the figure for Measure::figure
  std::vector<std::string> from{};    ///< transfers: inputs or other variables; steps: one
  std::vector<std::string> to{};      ///< transfers: outputs or states; steps: one
  std::vector<double> numerator{};    ///< weight of transfers, in s, highest power first; empty: 1
  std::vector<double> denominator{};  ///< of the weight; empty: 1
  std::map<std::string, double> weights{};  ///< quadratic_cost: of squared outputs and states
  double band = 0.02;                       ///< settling_time: relative to the final value
  /// pole_region: smallest decay, 1/s; NaN: not required.
  double decay = std::numeric_limits<double>::quiet_NaN();
  /// pole_region: smallest damping; NaN: not required.
  double damping = std::numeric_limits<double>::quiet_NaN();
  /// pole_region: largest |λ|, rad/s; NaN: not required.
  double frequency = std::numeric_limits<double>::quiet_NaN();

  /// True if both measure the same thing, whatever their limits.
  bool same_measure(const Requirement& other) const;
};
/// A tunable parameter of all models with its bounds, in SI units.
struct FreeGain {
  std::string name;                 ///< name in the models, "gains.K_Lp"
  double lower = 0.0, upper = 0.0;  ///< bounds, included
  bool logarithmic = true;          ///< search in its logarithm; needs lower > 0
};

/// A tuning problem.
struct TuneProblem {
  std::vector<SweepRequest> points;  ///< each trimmed again for every candidate
  /// Each point's model with inputs added after its control law, "theta0_added" for the output
  /// theta0 and so on (closed_loop_with_inputs()); needed only for margins, otherwise empty.
  std::vector<Model> loops{};
  /// Each point's model with the inputs from which peak_gain, h2_norm and steps lead, if they are
  /// not its own (closed_loop_with_commands()); otherwise empty.
  std::vector<Model> responses{};
  std::vector<FreeGain> gains{};  ///< at least one
  /// Gains are linear between their values at these (ascending) values of a parameter of the
  /// points; empty: constant. The values at each are tuned, first all of the first gain.
  std::vector<double> schedule{};
  std::string schedule_over{};         ///< name of that parameter
  std::vector<Uncertain> uncertain{};  ///< empty: no uncertain parameters
  bool corners = true;                 ///< at every corner of the uncertain parameters
  int samples = 0;                     ///< and at random samples between, the same for each point
  std::uint64_t sample_seed = 1;       ///< of these samples
  /// Initial deviation of the closed loop from its trim (response_use), by state, in its unit.
  std::map<std::string, double> disturbance{};
  /// User-defined figures by name, for Measure::figure: functions of a model's parameters, of which
  /// smaller is better. Evaluated once per parameter set, at the first point.
  std::map<std::string, std::function<double(const Eigen::VectorXd& parameters)>> figures{};
  Requirement goal{Measure::decay};  ///< its worst value is optimized
  /// Several soft goals in place of `goal`, each with its target as the limit: the smallest reserve
  /// (Achieved::reserve()) over all of them and all places is maximized; 0: all targets are met.
  std::vector<Requirement> goals{};
  std::vector<Requirement> limits{};  ///< required at all places

  /// Number of tuned values: gains, times breakpoints of the schedule.
  std::size_t variables() const { return gains.size() * (schedule.empty() ? 1 : schedule.size()); }
};

/// Figures of merit by name from one function that computes them all, in the order of the names.
/// Figures that a thread asks for one after the other at the same parameters take one call. `all`
/// must be callable from several threads at once.
decltype(TuneProblem::figures) figures_together(
    const std::vector<std::string>& names,
    const std::function<std::vector<double>(const Eigen::VectorXd& parameters)>& all);

/// Global search: NLopt's algorithms, or local searches from many starts.
enum class GlobalSearch {
  crs2,        ///< controlled random search
  isres,       ///< evolution strategy with stochastic ranking
  esch,        ///< evolutionary algorithm
  direct,      ///< dividing rectangles
  mlsl,        ///< multi-level single linkage
  multistart,  ///< none: local searches from the best of twenty random points each
};
/// Local search: a quasi-Newton method for functions with kinks, or NLopt's algorithms.
enum class LocalSearch {
  bfgs,    ///< nonsmooth BFGS (Lewis and Overton) on a penalty function, then slsqp
  slsqp,   ///< sequential quadratic programming
  mma,     ///< moving asymptotes
  bobyqa,  ///< quadratic models, derivative-free
  cobyla,  ///< linear models, derivative-free
  sbplx,   ///< subspaces and simplexes, derivative-free
};
std::string to_string(GlobalSearch algorithm);  ///< as in a study file
std::string to_string(LocalSearch algorithm);   ///< as in a study file
/// Progress of a search.
struct TuneProgress {
  long evaluations = 0, of = 0;  ///< candidates: evaluated, allowed
  double seconds = 0.0;          ///< since the start
  double best = 0.0;             ///< of the goal, if `feasible`
  bool feasible = false;         ///< the best candidate meets all limits
  std::string decides;           ///< what limits the best: requirement and point, as text
  long starts = 0;               ///< local searches completed
  /// TuneResult::stationarity of the best when the last start that improved it ended; NaN: none
  /// did.
  double stationarity = std::numeric_limits<double>::quiet_NaN();
};

/// Options of tune().
struct TuneOptions {
  GlobalSearch global = GlobalSearch::multistart;  ///< used first
  LocalSearch local = LocalSearch::bfgs;           ///< used next
  std::uint64_t seed = 1;                          ///< of all random numbers
  Eigen::VectorXd start{};  ///< tried first, SI, limited to the bounds; empty: the middle only
  std::vector<Eigen::VectorXd> starts{};  ///< further starts, as regulator_starts()
  int searches = 10;                      ///< local searches to begin with, at least 1
  /// Searches that must end within 0.1 % of the best, at least 1: ends the search.
  int agreeing = 3;
  /// Candidates, each at all points: at most; the search ends earlier where starts agree.
  long evaluations = 100000;
  double seconds = 0.0;  ///< 0: no limit
  int threads = 0;       ///< 0: one per hardware thread; the result does not depend on it
  TrimOptions trimming{.starts = 8, .max_boxes = 2000, .closest = false};  ///< of each place
  std::stop_token stop{};                              ///< checked between candidates
  std::function<void(const TuneProgress&)> observe{};  ///< called by one thread at a time
};

/// Status of a tuning.
enum class TuneStatus {
  tuned,         ///< the best point found meets all limits, verified
  limits_unmet,  ///< no point found meets all limits; the one with the smallest violation is given
  unstable,      ///< limits are met, but an eigenvalue is not left of the axis by its error bound
  no_trim,       ///< no candidate had an equilibrium at every point
};
std::string to_string(TuneStatus status);  ///< as in JSON

/// Why a search ended.
enum class TuneEnd {
  locally_optimal,  ///< independent starts agree, and the gradients around their end cancel
  stagnated,        ///< independent starts agree, but the gradients around their end do not cancel
  budget_spent,     ///< candidates, time, or an interrupt ended it before three starts agreed
  no_influence,     ///< no tuned value changes the goal
};
std::string to_string(TuneEnd end);  ///< as in JSON

/// The value of one requirement at one place, or of the goal (limit NaN).
struct Achieved {
  /// An operating point with a set of uncertain parameters.
  struct Place {
    std::size_t point = 0;  ///< index in the problem
    std::string scatter;    ///< "mass +15 %, CM_de -15 %"; empty: nominal
  };

  Place place;                      ///< its place
  std::size_t asked = 0;            ///< index: goals, limits, then stability if none bounds it
  Requirement requirement;          ///< the requirement; of a single goal the limit is NaN
  double value = 0.0;               ///< NaN: not applicable (no mode of that name)
  std::complex<double> eigenvalue;  ///< the decisive eigenvalue, if there is one; otherwise NaN
  bool active = false;              ///< active at the solution, to 1e-4
  /// Margin to the limit or target, relative to its size; negative: not met. NaN for a single goal.
  double reserve() const;
};

/// The result of tune().
struct TuneResult {
  /// The effect of one tuned value at the solution.
  struct GainEffect {
    std::string name;            ///< "gains.K_Lp", or "gains.K_Lp at eta = 30 deg"
    double value = 0.0;          ///< SI
    std::vector<double> slopes;  ///< [asked]: d(worst value)/d(ln gain) where decisive
    double goal_less = 0.0;      ///< worst goal, trimmed again, gain 10 % less
    double goal_more = 0.0;      ///< the same with 10 % more
    bool limits_less = false, limits_more = false;  ///< all limits are met there
  };

  TuneStatus status = TuneStatus::no_trim;  ///< outcome
  std::string message;                      ///< if not tuned: which requirement at which point
  Eigen::VectorXd gains;                    ///< SI, TuneProblem::variables() values
  double goal = 0.0;  ///< the worst value over all places; of several goals the smallest reserve
  std::vector<Achieved> achieved;   ///< [place][asked]
  std::vector<GainEffect> effects;  ///< largest first
  bool coalescing = false;          ///< two decisive eigenvalues (to 1 %) coalesce at the solution
  TuneEnd end = TuneEnd::budget_spent;  ///< why the search ended
  /// Least norm in the hull of the gradients within `stationarity_radius` of the solution, over the
  /// largest of these gradients: 0 where it is stationary, 1 where all of them point one way; the
  /// tuned values are measured over their bounds. NaN: not computed; so for a single candidate.
  double stationarity = std::numeric_limits<double>::quiet_NaN();
  static constexpr double stationarity_radius = 1e-3;  ///< of the bounds' ranges
  long starts = 0, agreeing = 0;  ///< local searches completed; of these within 0.1 % of the best
  long evaluations = 0;           ///< candidates evaluated
  bool interrupted = false, out_of_time = false, out_of_evaluations = false;  ///< why it stopped

  /// True if the best point found meets all limits.
  explicit operator bool() const { return status == TuneStatus::tuned; }
};

/// Local searches from many starts, each followed, if decisive eigenvalues coalesce, by searches on
/// the manifold where they do; then hops around the best ends, until starts agree. With
/// a larger budget the same search goes on, so its result is never worse. Every value of the result
/// is evaluated again with new trims. Throws std::invalid_argument for unknown names, bounds that
/// are reversed or not finite, no gains, no points, or a requirement that cannot be evaluated.
[[nodiscard]] TuneResult tune(const TuneProblem& problem, const TuneOptions& options = {});

/// Starts for tune() from linear-quadratic regulators. At the equilibrium of each point with the
/// tuned values `at`, each loop is opened where its input is added (TuneProblem::loops); Q weighs
/// states by 1/nominal², R the loops' commands by effort/nominal². One start for each effort: the
/// tuned values whose control law, its derivatives by the states, is nearest to the regulators of
/// all points, by least squares in nominal units, limited to the bounds. Points without equilibrium
/// or regulator do not count; an effort for which none is left gives no start. Throws
/// std::invalid_argument without loops, and for efforts that are not positive.
[[nodiscard]] std::vector<Eigen::VectorXd> regulator_starts(const TuneProblem& problem,
                                                            const Eigen::VectorXd& at,
                                                            const std::vector<double>& efforts,
                                                            const TrimOptions& trimming = {});

/// The same from state feedback that places the poles of each opened loop at -decay to -2 decay
/// [1/s], evenly spaced: one start for each decay. Points where place() does not find it do not
/// count. Throws std::invalid_argument without loops, and for decays that are not positive.
[[nodiscard]] std::vector<Eigen::VectorXd> placed_starts(const TuneProblem& problem,
                                                         const Eigen::VectorXd& at,
                                                         const std::vector<double>& decays,
                                                         const TrimOptions& trimming = {});

/// Robustness of gains to random parameters between the corners.
struct Robustness {
  long samples = 0, met = 0;        ///< met: all points are trimmed and stable, and all limits met
  long no_trim = 0, unstable = 0;   ///< of those not met; the others violate a limit
  double fraction = 0.0;            ///< met / samples
  double lower = 0.0, upper = 0.0;  ///< Clopper-Pearson interval of the fraction, 95 %
  double worst_goal = std::numeric_limits<double>::quiet_NaN();  ///< over the samples with trim
  std::string worst;                                             ///< its point and parameters
  bool interrupted = false;                                      ///< fewer samples than requested
};
/// Uniform random values between the bounds of the uncertain parameters; sample i depends only on
/// the seed and i. Throws std::invalid_argument as tune() does, and without uncertain parameters.
[[nodiscard]] Robustness robustness(const TuneProblem& problem, const Eigen::VectorXd& gains,
                                    long samples, const TuneOptions& options = {});

}  // namespace tiltrim
