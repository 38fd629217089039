#include <cmath>

#include "report/json.hpp"
#include "report/tuning_parts.hpp"
#include "tune/measures.hpp"

namespace tiltrim {

using json::ordered_json;
using namespace tuning;

namespace {

ordered_json requirement_json(const Requirement& asked) {
  ordered_json j{
      {"measure", name_of(asked)}, {"of", asked.of}, {"unit", std::string(unit(asked.measure))}};
  if (!asked.from.empty()) j.update({{"input", asked.from}, {"output", asked.to}});
  return j;
}

// A requirement and its worst case; a single goal's limit is null.
ordered_json worst_json(const TuningReport& report, std::size_t asked) {
  const Requirement requirement = asked_of(report.problem)[asked];
  const Achieved* a = worst(report.result, asked, everywhere);
  ordered_json j = requirement_json(requirement);
  j["limit"] = requirement.limit;
  j["value"] = a ? a->value : nan;
  j["point"] = a ? ordered_json(point_name(report.problem, a->place)) : ordered_json();
  j["scatter"] = a ? ordered_json(a->place.scatter) : ordered_json();
  j["reserve"] = a ? a->reserve() : nan;
  j["active"] = any_active(report.result, asked, everywhere);
  return j;
}

// By the models' names, in SI units; with a schedule its tilts, then each gain's values there.
ordered_json gains_json(const TuneProblem& problem, const TuneResult& result) {
  if (!has_gains(problem, result)) return nullptr;
  ordered_json gains = ordered_json::object();
  if (!problem.schedule.empty()) gains[problem.schedule_over] = problem.schedule;
  for (std::size_t g = 0; g < problem.gains.size(); ++g) {
    const std::vector<double> values = values_of(problem, result, g);
    if (problem.schedule.empty())
      gains[problem.gains[g].name] = values.front();
    else
      gains[problem.gains[g].name] = values;
  }
  return gains;
}

ordered_json achieved_json(const TuneProblem& problem, const Achieved& a) {
  ordered_json j{{"point", point_name(problem, a.place)}, {"scatter", a.place.scatter}};
  j.update(requirement_json(a.requirement));
  j["limit"] = a.requirement.limit;
  j["value"] = a.value;
  j["reserve"] = a.reserve();
  const bool decides = std::isfinite(a.eigenvalue.real()) && std::isfinite(a.eigenvalue.imag());
  j["eigenvalue"] = decides ? ordered_json{{"re", a.eigenvalue.real()}, {"im", a.eigenvalue.imag()}}
                            : ordered_json();
  j["active"] = a.active;
  return j;
}

ordered_json effect_json(const TuneResult::GainEffect& e) {
  return {{"name", e.name},
          {"value", e.value},
          {"slopes", e.slopes},
          {"goal_less", e.goal_less},
          {"goal_more", e.goal_more},
          {"limits_less", e.limits_less},
          {"limits_more", e.limits_more}};
}

// The result of a search, without the parts reported only for the first.
ordered_json answer_json(const TuneProblem& problem, const TuneResult& r) {
  return {{"status", to_string(r.status)},
          {"message", r.message},
          {"goal", r.status == TuneStatus::no_trim ? nan : r.goal},
          {"gains", gains_json(problem, r)},
          {"end", to_string(r.end)},
          {"stationarity", r.stationarity},
          {"starts", r.starts},
          {"agreeing", r.agreeing},
          {"evaluations", r.evaluations},
          {"interrupted", r.interrupted},
          {"out_of_time", r.out_of_time},
          {"out_of_evaluations", r.out_of_evaluations}};
}

ordered_json robustness_json(const Robustness& r) {
  return {{"samples", r.samples},   {"met", r.met},
          {"no_trim", r.no_trim},   {"unstable", r.unstable},
          {"fraction", r.fraction}, {"lower", r.lower},
          {"upper", r.upper},       {"worst_goal", r.worst_goal},
          {"worst", r.worst},       {"interrupted", r.interrupted}};
}

}  // namespace

std::string tuning_json(const TuningReport& report) {
  const TuneProblem& problem = report.problem;
  const TuneResult& r = report.result;
  ordered_json all = answer_json(problem, r);
  all["goal"] = worst_json(report, 0);
  if (!problem.goals.empty()) {
    all["reserve"] = r.status == TuneStatus::no_trim ? nan : r.goal;
    all["goals"] = ordered_json::array();
    for (std::size_t i = 0; i < problem.goals.size(); ++i)
      all["goals"].push_back(worst_json(report, i));
  }
  all["limits"] = ordered_json::array();
  for (std::size_t i = goals_of(problem); i < asked_of(problem).size(); ++i)
    all["limits"].push_back(worst_json(report, i));
  all["toml"] = tuning_toml(report);
  all["achieved"] = ordered_json::array();
  for (const Achieved& a : r.achieved) all["achieved"].push_back(achieved_json(problem, a));
  all["effects"] = ordered_json::array();
  for (const TuneResult::GainEffect& e : r.effects) all["effects"].push_back(effect_json(e));
  all["coalescing"] = r.coalescing;
  all["second"] = nullptr;
  if (report.second) {
    all["second"] = {{"global", report.second_algorithm}};
    all["second"].update(answer_json(problem, *report.second));
  }
  all["robustness"] = report.robustness ? robustness_json(*report.robustness) : ordered_json();
  all["front_limit"] = report.front.empty() ? ordered_json() : requirement_json(report.front_limit);
  all["front"] = ordered_json::array();
  for (const TuningReport::FrontPoint& p : report.front) {
    ordered_json point{{"limit", p.limit}};
    point.update(answer_json(problem, p.result));
    all["front"].push_back(point);
  }
  all["interrupted"] = report.interrupted || r.interrupted;
  all["global"] = to_string(report.options.global);
  all["local"] = to_string(report.options.local);
  all["seed"] = report.options.seed;
  return all.dump(1) + '\n';
}

Sheet tuning_sheet(const TuningReport& report) {
  Sheet sheet;
  for (const char* key : {"point", "scatter", "measure", "of", "unit", "limit", "value", "reserve",
                          "eigenvalue_re", "eigenvalue_im", "active"})
    sheet.columns.push_back({key, "", ""});
  for (const Achieved& a : report.result.achieved)
    sheet.rows.push_back(
        {point_name(report.problem, a.place), a.place.scatter, name_of(a.requirement),
         a.requirement.of, std::string(unit(a.requirement.measure)),
         number_cell(a.requirement.limit), number_cell(a.value), number_cell(a.reserve()),
         number_cell(a.eigenvalue.real()), number_cell(a.eigenvalue.imag()), a.active ? 1.0 : 0.0});
  return sheet;
}

}  // namespace tiltrim
