// The answer to a study's [tune]: two searches, front, random samples.
#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "study/problems.hpp"
#include "tune/measures.hpp"

namespace tiltrim {

namespace {

using Observer = std::function<void(const std::string& what, const TuneProgress&)>;

TuneOptions observed(TuneOptions options, const std::string& what, const Observer& observe) {
  if (observe) options.observe = [&observe, what](const TuneProgress& at) { observe(what, at); };
  return options;
}

// The better of the two optima is the result.
bool better(const TuneResult& a, const TuneResult& b, const TuneProblem& problem) {
  if (a.status != b.status) return a.status < b.status;
  const double more = (more_goal_is_better(problem) ? 1 : -1) * (a.goal - b.goal);
  constexpr double rounding = 1e-6;  // of the goal: convergence of a search
  return a && more > rounding * std::abs(b.goal);
}

void search_twice(TuningReport& report, const std::string& second, const Observer& observe) {
  TuneOptions& options = report.options;
  const auto searched = [&](GlobalSearch algorithm) {
    options.global = algorithm;
    return tune(report.problem, observed(options, to_string(algorithm), observe));
  };
  const GlobalSearch first = options.global;
  report.result = searched(first);
  if (second == "none" || options.stop.stop_requested()) return;
  report.second_algorithm = second;
  report.second = searched(global_search(second));
  if (better(*report.second, report.result, report.problem)) {
    std::swap(report.result, *report.second);
    report.second_algorithm = to_string(first);
  } else {
    options.global = first;
  }
}

// The optimum for each value of one limit, from the strictest on; each search starts at the
// previous optimum, which satisfies the next limit too: fewer other starts will do, and they need
// not agree.
void search_front(TuningReport& report, const TuneTable::Front& front, const Observer& observe) {
  TuneOptions options = report.options;
  options.searches = 3;
  options.agreeing = 1;
  report.front_limit = front.limit;
  const auto limit_at = [&](int k) {
    return front.from + (front.to - front.from) * k / (front.count - 1);
  };
  const bool rising = more_is_better(front.limit.measure) == (front.to > front.from);
  for (int i = 0; i < front.count && !options.stop.stop_requested(); ++i) {
    TuneProblem own = report.problem;
    Requirement limit = front.limit;
    limit.limit = limit_at(rising ? front.count - 1 - i : i);
    std::erase_if(own.limits, [&](const Requirement& r) { return r.same_measure(limit); });
    own.limits.push_back(limit);
    const std::string what = fmt::format("front, {} of {}", i + 1, front.count);
    report.front.push_back({limit.limit, tune(own, observed(options, what, observe))});
    if (const TuneResult& found = report.front.back().result; found) options.start = found.gains;
  }
  if (rising) std::ranges::reverse(report.front);
}

// A front's optimum that meets the study's own limit may be better than both searches: then once
// more from there.
void search_from_front(TuningReport& report, const Observer& observe) {
  const bool more = more_is_better(report.front_limit.measure);
  const auto meets = [&](const TuningReport::FrontPoint& point) {
    return std::ranges::none_of(report.problem.limits, [&](const Requirement& own) {
      return own.same_measure(report.front_limit) &&
             (more ? point.limit < own.limit : point.limit > own.limit);
    });
  };
  const TuneResult* best = &report.result;
  for (const TuningReport::FrontPoint& point : report.front)
    if (meets(point) && better(point.result, *best, report.problem)) best = &point.result;
  if (best == &report.result || report.options.stop.stop_requested()) return;
  TuneOptions options = observed(report.options, to_string(report.options.global), observe);
  options.start = best->gains;
  TuneResult again = tune(report.problem, options);
  if (better(again, report.result, report.problem)) report.result = std::move(again);
}

}  // namespace

TuningReport tune_study(const Study& study, const TuneOptions& options, const Observer& observe) {
  TuningReport report{
      .problem = tune_problem(study), .user_model = study.user_model, .options = options};
  report.problem.sample_seed = options.seed;  // of all random numbers
  const TuneTable& table = *study.tune;
  if (!table.regulator_starts.empty())
    report.options.starts = regulator_starts(report.problem, report.options.start,
                                             table.regulator_starts, report.options.trimming);
  if (!table.placed_starts.empty())
    for (Eigen::VectorXd& start : placed_starts(report.problem, report.options.start,
                                                table.placed_starts, report.options.trimming))
      report.options.starts.push_back(std::move(start));
  search_twice(report, table.second, observe);
  if (table.front) {
    search_front(report, *table.front, observe);
    search_from_front(report, observe);
  }
  const TuneResult& found = report.result;
  if (table.robustness > 0 && !report.problem.uncertain.empty() && found.gains.size() > 0 &&
      !options.stop.stop_requested())
    report.robustness = robustness(report.problem, found.gains, table.robustness,
                                   observed(report.options, "robustness", observe));
  report.interrupted = options.stop.stop_requested();
  return report;
}

}  // namespace tiltrim
