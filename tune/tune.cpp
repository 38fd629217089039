#include "tune/tune.hpp"

#include <cmath>

#include "tune/optimizer.hpp"
#include "tune/search.hpp"

namespace tiltrim {

using Eigen::VectorXd;

TuneResult tune(const TuneProblem& problem, const TuneOptions& options) {
  Search search(problem, options);
  TuneResult result;
  try {
    search_globally(search);
  } catch (const EndSearch&) {
  }
  result.evaluations = search.evaluations;
  result.gains = search.gains_at(search.best.y);
  result.goal = search.best.merit.goal;
  result.status = search.best.merit.feasible ? TuneStatus::tuned : TuneStatus::limits_unmet;
  return result;
}

}  // namespace tiltrim
