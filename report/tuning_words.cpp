#include "report/tuning_words.hpp"

#include <fmt/core.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>

#include "report/tuning_parts.hpp"
#include "tune/measures.hpp"

namespace tiltrim::tuning {

using Eigen::Index;

namespace {

// "gains.K_Lp at eta = 30 deg", as in TuneResult::GainEffect.
std::string variable_name(const TuneProblem& problem, Index variable) {
  if (problem.schedule.empty()) return problem.gains[std::size_t(variable)].name;
  const Index n = std::ssize(problem.schedule);
  const Key over = key_of(problem, problem.schedule_over);
  const double at = over.in_study(problem.schedule[std::size_t(variable % n)]);
  return fmt::format("{} at {} = {:.6g}{}", problem.gains[std::size_t(variable / n)].name,
                     problem.schedule_over, at, over.unit == "degrees" ? " deg" : "");
}

// "0.337 1/s", "45°"
std::string quantity(double value, std::string_view in_unit) {
  const std::string unit_name = unit_in_text(in_unit);
  return fmt::format("{:.4g}{}{}", value, unit_name.empty() || unit_name == "°" ? "" : " ",
                     unit_name);
}

std::string counted(std::size_t count, const std::string& what) {
  return fmt::format("{} {}{}", grouped(long(count)), what, count == 1 ? "" : "s");
}

}  // namespace

std::string without_prefix(const std::string& name) {
  constexpr std::string_view prefix = "gains.";
  return name.starts_with(prefix) ? name.substr(prefix.size()) : name;
}

std::string in_words(const Requirement& asked) {
  std::string words = name_of(asked);
  for (const std::string suffix : {"_db", "_deg"})
    if (words.ends_with(suffix)) words.resize(words.size() - suffix.size());
  std::ranges::replace(words, '_', ' ');
  if (!asked.of.empty()) words += " of " + asked.of;
  if (!asked.from.empty())
    words += fmt::format(" from {} to {}", fmt::join(asked.from, ", "), fmt::join(asked.to, ", "));
  return words;
}

std::string goal_in_words(const TuneProblem& problem) {
  return problem.goals.empty() ? in_words(problem.goal) : goal_name(problem);
}

std::string unit_in_text(std::string_view unit) {
  return unit == "degrees" ? "°" : std::string(unit);
}

const char* sign(Measure measure) { return more_is_better(measure) ? "≥" : "≤"; }

std::string limit_in_words(const Requirement& asked) {
  return fmt::format("{} {}", sign(asked.measure), quantity(asked.limit, unit(asked.measure)));
}

std::string asked_in_words(const Requirement& asked, bool goal) {
  if (!goal) return in_words(asked) + " " + limit_in_words(asked);
  return in_words(asked) +
         (std::isnan(asked.limit) ? ", the goal" : ", target " + limit_in_words(asked));
}

std::string place_in_words(const TuneProblem& problem, const Achieved::Place& place) {
  return point_name(problem, place) + (place.scatter.empty() ? "" : ", " + place.scatter);
}

std::string status_in_words(TuneStatus status) {
  switch (status) {
    case TuneStatus::tuned:
      return "tuned";
    case TuneStatus::limits_unmet:
      return "limits not met";
    case TuneStatus::unstable:
      return "unstable";
    case TuneStatus::no_trim:
      return "no trim";
  }
  return "unknown";
}

Tone tone_of(TuneStatus status) { return status == TuneStatus::tuned ? Tone::good : Tone::bad; }

std::string grouped(long count) {
  std::string digits = std::to_string(count);
  for (std::ptrdiff_t at = std::ssize(digits) - 3; at > (count < 0 ? 1 : 0); at -= 3)
    digits.insert(std::size_t(at), ",");
  return digits;
}

namespace {

std::string where_in_words(const TuningReport& report) {
  const std::size_t points = report.problem.points.size();
  const std::string words = "over " + counted(points, "point");
  return places(report) > points
             ? fmt::format("{} with scatter ({} places)", words, grouped(long(places(report))))
             : words;
}

}  // namespace

std::string verdict_text(const TuningReport& report, const TextStyle& style) {
  const TuneResult& r = report.result;
  std::string words;
  if (r)
    words = fmt::format(": worst {} {} {}; {}", goal_in_words(report.problem),
                        quantity(r.goal, goal_unit(report.problem)), where_in_words(report),
                        report.problem.limits.empty() ? "no limits required" : "all limits met");
  else if (!r.message.empty())
    words = ": " + r.message;
  const char* kept = r.status == TuneStatus::no_trim ? "" : ": the best so far";
  if (r.interrupted) words += fmt::format(" (interrupted{})", kept);
  if (r.out_of_time) words += fmt::format(" (out of time{})", kept);
  const std::string said = wrapped(status_in_words(r.status) + words, 0, style.width);
  const std::size_t status = status_in_words(r.status).size();
  return toned(said.substr(0, status), tone_of(r.status), style) + said.substr(status);
}

namespace {

// The tuned variable with the largest relative difference.
struct Difference {
  Index variable = 0;
  double relative = 0.0;
};
Difference largest_difference(const Eigen::VectorXd& a, const Eigen::VectorXd& b) {
  Difference most;
  for (Index i = 0; i < a.size(); ++i) {
    const double size = std::max(std::abs(a[i]), std::abs(b[i]));
    const double relative = size > 0 ? std::abs(a[i] - b[i]) / size : 0.0;
    if (relative > most.relative) most = {i, relative};
  }
  return most;
}

std::string second_in_words(const TuningReport& report) {
  const TuneProblem& problem = report.problem;
  const TuneResult &first = report.result, &second = *report.second;
  const std::string_view in_unit = goal_unit(problem);
  std::string words = fmt::format("Second search by {}: {}", report.second_algorithm,
                                  status_in_words(second.status));
  if (second.status == TuneStatus::no_trim || !std::isfinite(second.goal))
    return words + (second.message.empty() ? "." : ", " + second.message + ".");
  words += fmt::format(", worst {} {}", goal_in_words(problem), quantity(second.goal, in_unit));
  constexpr double settled = 1e-6;  // relative convergence of a search in goal or gain
  const double more = (more_goal_is_better(problem) ? 1 : -1) * (second.goal - first.goal);
  if (first && second)
    words += std::abs(more) <= settled * std::abs(first.goal)
                 ? ", the same"
                 : fmt::format(", {} {}", quantity(std::abs(more), in_unit),
                               more > 0 ? "better" : "worse");
  if (has_gains(problem, first) && has_gains(problem, second)) {
    const Difference d = largest_difference(first.gains, second.gains);
    words +=
        d.relative <= rounding
            ? "; the same gains"
            : fmt::format("; the gain that differs most is {}, by {:.3g} %",
                          without_prefix(variable_name(problem, d.variable)), 100 * d.relative);
  }
  return words + fmt::format(" ({} candidates).", grouped(second.evaluations));
}

std::string robustness_in_words(const TuningReport& report) {
  const Robustness& r = *report.robustness;
  if (r.samples <= 0) return "No random samples were tried.";
  // Enough digits to resolve one sample.
  const int digits = std::max(1, int(std::ceil(std::log10(double(r.samples)))) - 2);
  std::string words = fmt::format(
      "{} of {} random samples meet all limits: {:.{}f} %, 95 % interval {:.{}f} to {:.{}f} %",
      grouped(r.met), grouped(r.samples), 100 * r.fraction, digits, 100 * r.lower, digits,
      100 * r.upper, digits);
  words += fmt::format("; {} without trim, {} unstable", grouped(r.no_trim), grouped(r.unstable));
  if (r.samples > r.no_trim && std::isfinite(r.worst_goal))
    words += fmt::format("; worst {} {} at {}", goal_in_words(report.problem),
                         quantity(r.worst_goal, goal_unit(report.problem)), r.worst);
  return words + (r.interrupted ? " (interrupted: fewer samples than requested)." : ".");
}

std::string corner_in_words(const TuningReport& report) {
  const Achieved* corner =
      worst(report.result, 0, [](const Achieved::Place& place) { return !place.scatter.empty(); });
  if (!corner) return "";
  const Requirement& goal = corner->requirement;
  return fmt::format("Worst corner of the scatter: {} {} at {}.", in_words(goal),
                     quantity(corner->value, unit(goal.measure)),
                     place_in_words(report.problem, corner->place));
}

// "2 of 3 starts agree to 0.1 %"
std::string agreement_in_words(const TuneResult& r) {
  return fmt::format("{} of {} starts agree to 0.1 %", r.agreeing, r.starts);
}

std::string end_in_words(const TuningReport& report) {
  const TuneResult& r = report.result;
  if (r.status == TuneStatus::no_trim) return "";
  const std::string cancel =
      std::isnan(r.stationarity)
          ? ""
          : fmt::format("{:.2g} (0: stationary point; 1: a clear direction of improvement)",
                        r.stationarity);
  switch (r.end) {
    case TuneEnd::locally_optimal:
      return fmt::format("Locally optimal: {}; stationarity {}.", agreement_in_words(r), cancel);
    case TuneEnd::stagnated:
      return fmt::format("Stagnated: {}, but no stationary point was reached: stationarity {}.",
                         agreement_in_words(r), cancel);
    case TuneEnd::no_influence:
      return fmt::format("No influence: {} is the same for all {} candidates, whatever the gains.",
                         goal_in_words(report.problem), grouped(r.evaluations));
    case TuneEnd::budget_spent:
      break;
  }
  return fmt::format(
      "The search ended before three starts agreed{}{}; a larger budget may find better gains.",
      cancel.empty() ? "" : "; stationarity ", cancel);
}

// Tuned values that change neither the goal nor what is required.
std::string idle_in_words(const TuningReport& report) {
  const TuneResult& r = report.result;
  std::vector<std::string> names;
  for (const TuneResult::GainEffect& e : r.effects) {
    const bool flat = std::ranges::all_of(e.slopes, [](double s) { return s == 0; });
    if (flat && e.goal_less == r.goal && e.goal_more == r.goal)
      names.push_back(without_prefix(e.name));
  }
  if (names.empty() || r.end == TuneEnd::no_influence) return "";
  return fmt::format("Without influence on the goal and the limits here: {}.",
                     fmt::join(names, ", "));
}

}  // namespace

std::string effort_in_words(const TuningReport& report) {
  return fmt::format(
      "{} candidates{}; global {}, local {}, seed {}.", grouped(report.result.evaluations),
      report.result.out_of_evaluations ? " (the limit)" : "", to_string(report.options.global),
      to_string(report.options.local), report.options.seed);
}

std::vector<std::string> paragraphs(const TuningReport& report) {
  std::vector<std::string> words{end_in_words(report), idle_in_words(report)};
  if (report.second) words.push_back(second_in_words(report));
  if (report.robustness) words.push_back(robustness_in_words(report));
  words.push_back(corner_in_words(report));
  if (report.interrupted && !report.result.interrupted)
    words.emplace_back("The steps after the first search were interrupted or not started.");
  std::erase(words, "");
  return words;
}

}  // namespace tiltrim::tuning
