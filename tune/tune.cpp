#include "tune/tune.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>

#include "optimize/optimize.hpp"
#include "tune/search.hpp"

namespace tiltrim {

using Eigen::VectorXd;

namespace {

constexpr double settled = 1e-7;  // of the goal
constexpr int local_steps = 60;

// Local searches from the best, with and without the eigenvalues that meet held together, until
// they gain nothing.
void polish(Search& search) {
  constexpr int rounds = 12, steps = 100;
  for (int round = 0; round < rounds; ++round) {
    const double before = search.best.merit.value();
    for (const double radius : {0.2, 0.02})
      for (const double within : {0.02, 0.1}) search_coalesced(search, within, radius, steps);
    search_locally(search, search.best.y, LocalSearch::slsqp, 0.1, steps);
    if (search.best.merit.value() <= before + settled) return;
  }
}

// From the best with one gain at its other end, then from random places about it: other basins.
void hop(Search& search) {
  constexpr double far = 0.3;  // of each gain's range
  std::mt19937_64 random(search.options.seed);
  std::normal_distribution<double> normal(0.0, far);
  for (Eigen::Index next = 0;;) {
    const double before = search.best.merit.value();
    const long counted = search.evaluations;
    VectorXd y = search.best.y;
    if (next < y.size())
      y[next] = 1.0 - y[next];
    else
      for (double& v : y) v = std::clamp(v + normal(random), 0.0, 1.0);
    ++next;
    search_locally(search, y, search.options.local, 1.0, local_steps);
    if (search.evaluations == counted) return;
    if (search.best.merit.value() <= before + settled) continue;
    polish(search);
    next = 0;
  }
}

// The answer again, from trims of its own.
TuneResult verified(Search& search) {
  const TuneProblem& problem = search.problem;
  TuneResult result;
  result.gains = search.gains_at(search.best.y);
  const std::vector<PointModes> points = search.candidates.anew(result.gains);
  const Merit found = merit(problem, points);
  result.goal = better(problem.goal) * found.goal;
  for (std::size_t p = 0; p < points.size(); ++p) {
    if (!points[p].valid()) {
      result.message =
          fmt::format("no equilibrium at '{}': {}", problem.points[p].name, points[p].message);
      return result;
    }
    const auto add = [&](Measure what, double limit, double decisive) {
      const Worst w = worst(what, points[p]);
      const double off = std::abs(w.value - decisive);
      constexpr double active = 1e-4;
      result.achieved.push_back({int(p), what, limit, w.value, points[p].eigenvalues[w.eigenvalue],
                                 off <= active * std::max(std::abs(decisive), 1e-3)});
    };
    add(problem.goal, std::numeric_limits<double>::quiet_NaN(), result.goal);
    for (const Requirement& r : problem.limits) add(r.measure, r.limit, r.limit);
  }
  result.status = found.feasible ? TuneStatus::tuned : TuneStatus::limits_unmet;
  result.coalescing = !meetings_at(search, 1e-3).empty();
  if (found.feasible) return result;
  const auto missed = [&](const Achieved& a) {
    return std::isnan(a.limit)
               ? 0.0
               : better(a.measure) * (a.limit - a.value) / (a.limit != 0 ? std::abs(a.limit) : 1.0);
  };
  const Achieved& most = *std::ranges::max_element(result.achieved, {}, missed);
  result.message = fmt::format("{} of {:.6g} is not met at '{}': {:.6g} is the best found",
                               to_string(most.measure), most.limit,
                               problem.points[std::size_t(most.point)].name, most.value);
  return result;
}

}  // namespace

std::string to_string(TuneStatus status) {
  switch (status) {
    case TuneStatus::tuned:
      return "tuned";
    case TuneStatus::limits_unmet:
      return "limits_unmet";
    case TuneStatus::no_trim:
      return "no_trim";
  }
  return "unknown";
}

TuneResult tune(const TuneProblem& problem, const TuneOptions& options) {
  Search search(problem, options);
  try {
    search.evaluate(VectorXd::Constant(search.gains(), 0.5), false);
    search_globally(search);
    const std::vector<Search::Seen> starts = search.kept;
    for (const Search::Seen& start : starts) {
      const double before = search.best.merit.value();
      search_locally(search, start.y, options.local, 1.0, local_steps);
      if (search.best.merit.value() > before) polish(search);
    }
    polish(search);
    hop(search);
  } catch (const EndSearch&) {
  }
  TuneResult result;
  if (search.best.y.size() == 0)
    result.message = "not one candidate was evaluated";
  else
    result = verified(search);
  result.evaluations = search.evaluations;
  result.interrupted = search.interrupted;
  result.out_of_time = search.out_of_time;
  result.out_of_evaluations = search.out_of_evaluations;
  return result;
}

}  // namespace tiltrim
