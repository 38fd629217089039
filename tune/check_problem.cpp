#include "tune/check_problem.hpp"

#include <fmt/core.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <set>
#include <stdexcept>

#include "tune/measures.hpp"
#include "tune/response.hpp"

namespace tiltrim {

namespace {

void check_range(const std::string& name, const char* what, double lower, double upper) {
  if (!std::isfinite(lower) || !std::isfinite(upper) || !(lower < upper))
    throw std::invalid_argument(
        fmt::format("{} is {} in [{}, {}]; expected finite bounds, the lower below the upper", name,
                    what, lower, upper));
}

void check_gains(const TuneProblem& problem) {
  if (problem.gains.empty()) throw std::invalid_argument("nothing to tune: no gain is free");
  for (const FreeGain& g : problem.gains) {
    check_range(g.name, "free", g.lower, g.upper);
    if (g.logarithmic && !(g.lower > 0))
      throw std::invalid_argument(
          fmt::format("{} is free in [{}, {}] on a logarithmic scale; expected positive bounds",
                      g.name, g.lower, g.upper));
  }
  std::set<std::string> names;
  for (const FreeGain& g : problem.gains)
    if (!names.insert(g.name).second)
      throw std::invalid_argument(fmt::format("{} is free twice; expected once", g.name));
  for (const Uncertain& u : problem.uncertain)
    if (!names.insert(u.name).second)
      throw std::invalid_argument(
          fmt::format("{} is both free and uncertain, or uncertain twice; expected once", u.name));
  const std::vector<double>& s = problem.schedule;
  if (s.size() == 1 || std::ranges::adjacent_find(s, std::greater_equal<>()) != s.end())
    throw std::invalid_argument(
        fmt::format("a schedule over [{}]; expected at least two places in ascending order",
                    fmt::join(s, ", ")));
}

void check_asked(const TuneProblem& problem, const Requirement& r, bool limit) {
  const std::string name = name_of(r);
  if (limit && !std::isfinite(r.limit))
    throw std::invalid_argument(
        fmt::format("the limit of {} is {}; expected a number", name, r.limit));
  if (r.measure == Measure::half_time && r.of.empty())
    throw std::invalid_argument("half_time without a mode; expected the mode's name");
  if (r.measure == Measure::half_time && limit && !(r.limit > 0))
    throw std::invalid_argument(
        fmt::format("the limit of half_time is {}; expected a positive time", r.limit));
  const bool margin = r.measure == Measure::peak_sensitivity ||
                      (r.measure >= Measure::gain_margin_db && r.measure <= Measure::disk_margin);
  if (margin && problem.loops.size() != problem.points.size())
    throw std::invalid_argument(
        fmt::format("{} for models whose loops cannot be opened; expected for each point a model "
                    "whose inputs act after the actuators",
                    name));
  if (r.measure == Measure::response_use && problem.disturbance.empty())
    throw std::invalid_argument("response_use without a disturbance; expected one");
  const bool is_figure = r.measure == Measure::figure;
  if (is_figure && !problem.figures.contains(r.figure))
    throw std::invalid_argument(
        fmt::format("{} is not among the problem's figures; expected its function", name));
  if (is_figure && !problem.schedule.empty())
    throw std::invalid_argument(name + " is for constant gains; expected no schedule");
  if (r.measure == Measure::sensitivity && problem.uncertain.empty())
    throw std::invalid_argument("sensitivity without uncertain numbers; expected some");
  if (of_a_response(r.measure))
    for (std::size_t i = 0; i < problem.points.size(); ++i)
      check_response(problem, r,
                     problem.responses.empty() ? problem.points[i].model : problem.responses[i]);
  if (r.measure == Measure::pole_region && !(r.decay > 0 || r.damping > 0 || r.frequency > 0))
    throw std::invalid_argument(
        "pole_region without bounds; expected a positive decay, damping or frequency");
}

// These must be the points' models, except for their inputs.
void check_like(const TuneProblem& problem, const std::vector<Model>& models, const char* what) {
  if (!models.empty() && models.size() != problem.points.size())
    throw std::invalid_argument(fmt::format("{} models of {} for {} points; expected one for each",
                                            models.size(), what, problem.points.size()));
  for (std::size_t i = 0; i < models.size(); ++i) {
    const Model& own = problem.points[i].model;
    if (names(models[i].states) != names(own.states) ||
        names(models[i].parameters) != names(own.parameters))
      throw std::invalid_argument(
          fmt::format("the {} of '{}' have other states or parameters than its model", what,
                      problem.points[i].name));
  }
}

}  // namespace

void check(const TuneProblem& problem) {
  if (problem.points.empty()) throw std::invalid_argument("no operating point to tune for");
  check_gains(problem);
  for (const SweepRequest& point : problem.points)
    for (const FreeGain& gain : problem.gains)
      check_within_limits(point.spec, gain.name, std::array{gain.lower, gain.upper});
  check_like(problem, problem.loops, "loops");
  check_like(problem, problem.responses, "responses");
  if (problem.goals.empty()) check_asked(problem, problem.goal, false);
  for (const Requirement& r : problem.goals) check_asked(problem, r, true);
  for (const Requirement& r : problem.limits) check_asked(problem, r, true);
  for (const Uncertain& u : problem.uncertain) check_range(u.name, "uncertain", u.lower, u.upper);
}

}  // namespace tiltrim
