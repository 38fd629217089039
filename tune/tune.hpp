/// Tuning: gains whose worst case over operating points is as good as it can be.
#pragma once

#include <complex>
#include <cstdint>
#include <functional>
#include <stop_token>
#include <string>
#include <vector>

#include "sweep/sweep.hpp"

namespace tiltrim {

/// A parameter of all the models that may be chosen within bounds, in SI units.
struct FreeGain {
  std::string name;
  double lower = 0.0, upper = 0.0;
  bool logarithmic = true;  ///< the search moves in its logarithm; needs lower > 0
};

/// What is asked of the eigenvalues λ at every operating point.
enum class Measure {
  decay,      ///< least -Re λ, 1/s: the spectral abscissa, negated
  damping,    ///< least -Re λ/|λ|
  frequency,  ///< largest |λ|, rad/s
};
std::string to_string(Measure measure);

/// The worst value over all points is to be at least `limit` (a frequency: at most).
struct Requirement {
  Measure measure = Measure::damping;
  double limit = 0.0;
};

struct TuneProblem {
  std::vector<SweepRequest> points;  ///< each trimmed again for every candidate
  std::vector<FreeGain> gains;
  Measure goal = Measure::decay;  ///< its worst value is to be as good as it can be
  std::vector<Requirement> limits;
};

enum class GlobalSearch { crs2, isres, esch, direct, mlsl, multistart };
enum class LocalSearch { slsqp, bobyqa, cobyla };
std::string to_string(GlobalSearch algorithm);
std::string to_string(LocalSearch algorithm);

struct TuneProgress {
  long evaluations = 0;
  double best = 0.0;  ///< of the goal, where `feasible`
  bool feasible = false;
};

struct TuneOptions {
  GlobalSearch global = GlobalSearch::multistart;
  LocalSearch local = LocalSearch::slsqp;
  std::uint64_t seed = 1;
  long evaluations = 4000;  ///< candidates, each at all points
  double seconds = 0.0;     ///< 0: no limit
  TrimOptions trimming{.starts = 8, .max_boxes = 2000, .closest = false};
  std::stop_token stop{};
  std::function<void(const TuneProgress&)> observe{};
};

enum class TuneStatus {
  tuned,         ///< the best point found meets all limits, verified
  limits_unmet,  ///< no point found does; the one that misses them least is given
  no_trim,       ///< at no candidate were all points in equilibrium
};
std::string to_string(TuneStatus status);

/// One requirement at one operating point, or the goal (limit NaN).
struct Achieved {
  int point = 0;
  Measure measure = Measure::decay;
  double limit = 0.0, value = 0.0;
  std::complex<double> eigenvalue;  ///< which decides
  bool active = false;              ///< it holds the answer where it is, to 1e-4
};

struct TuneResult {
  TuneStatus status = TuneStatus::no_trim;
  std::string message;    ///< why not tuned: which requirement at which point
  Eigen::VectorXd gains;  ///< in the order of the problem's
  double goal = 0.0;      ///< the worst over the points
  std::vector<Achieved> achieved;
  bool coalescing = false;  ///< two of the eigenvalues that decide meet at the answer
  long evaluations = 0;
  bool interrupted = false, out_of_time = false, out_of_evaluations = false;

  explicit operator bool() const { return status == TuneStatus::tuned; }
};

/// Global search, then local search from what it found, then, where eigenvalues that decide
/// coalesce, on the manifold where they do. Every number of the answer is evaluated again at the
/// answer, from trims of their own. Throws std::invalid_argument for names the models do not have,
/// bounds reversed or not finite, nothing free, no point.
[[nodiscard]] TuneResult tune(const TuneProblem& problem, const TuneOptions& options = {});

}  // namespace tiltrim
