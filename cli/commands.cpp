#include "cli/commands.hpp"

#include <fmt/ranges.h>

#include <algorithm>

#include "cli/terminal.hpp"
#include "model/study.hpp"
#include "report/paper.hpp"

namespace tiltrim::cli {

namespace {

// The conditions asked for by name, in the study's order.
std::vector<Condition> chosen(const Study& study, const std::vector<std::string>& only) {
  std::vector<std::string> names;
  for (const Condition& c : study.conditions) names.push_back(c.name);
  for (const std::string& name : only)
    if (std::ranges::find(names, name) == names.end()) {
      const std::string near = nearest_name(name, names);
      throw StudyError(fmt::format("{}: no condition '{}'{}; there are: {}", study.file.string(),
                                   name, near.empty() ? "" : fmt::format(" (nearest: '{}')", near),
                                   fmt::join(names, ", ")));
    }
  std::vector<Condition> conditions;
  for (const Condition& c : study.conditions)
    if (only.empty() || std::ranges::find(only, c.name) != only.end()) conditions.push_back(c);
  return conditions;
}

// Each condition in turn; where the caller stopped, the rest say so.
template <class Work>
std::vector<ConditionReport> for_each(const Study& study, const Common& common, TrimOptions options,
                                      const std::stop_token& stop, const Work& work) {
  options.stop = stop;
  std::vector<ConditionReport> reports;
  const std::vector<Condition> conditions = chosen(study, common.only);
  Progress progress(conditions.size());
  for (const Condition& condition : conditions) {
    try {
      reports.push_back({answer(study.vehicle, condition, options), {}, {}});
    } catch (const std::invalid_argument& e) {  // asked what cannot be asked
      throw StudyError(
          fmt::format("{}: condition '{}': {}", study.file.string(), condition.name, e.what()));
    }
    work(reports.back());
    progress.advance();
  }
  return reports;
}

std::string printed(const std::vector<ConditionReport>& reports, const Common& common,
                    const Sheet& csv, const TextStyle& style) {
  switch (common.format) {
    case Format::json:
      return conditions_json(reports);
    case Format::csv:
      return as_csv(csv);
    case Format::text:
      break;
  }
  return conditions_text(reports, style);
}

}  // namespace

Outcome run(const TrimCommand& command, const TextStyle& style, const std::stop_token& stop) {
  const Study study = load_study(command.common.study);
  const auto reports =
      for_each(study, command.common, command.options, stop, [](ConditionReport&) {});
  const bool all = std::ranges::all_of(reports, [](const auto& r) { return bool(r.answer.trim); });
  return {printed(reports, command.common, trim_sheet(reports), style),
          all ? answered : unanswered};
}

Outcome run(const LinearizeCommand& command, const TextStyle& style, const std::stop_token& stop) {
  const Study study = load_study(command.common.study);
  const auto linear = [&](ConditionReport& r) {
    if (!r.answer.has_equilibrium() || r.answer.table) return;
    LinearizeOptions options;
    options.method = command.method;
    options.inputs = command.inputs;
    if (options.inputs.empty() && r.answer.model.inputs.empty())
      options.inputs = {"V", "gamma", "eta"};
    r.linear = linearize(r.answer.model, r.answer.trim.point, options);
    if (*r.linear) r.modes = modes(*r.linear);
  };
  const auto reports = for_each(study, command.common, command.options, stop, linear);
  const bool all = std::ranges::all_of(reports, [](const auto& r) {
    return r.answer.trim && r.modes && r.modes->verdict != Verdict::undecided;
  });
  return {printed(reports, command.common, all_modes_sheet(reports), style),
          all ? answered : unanswered};
}

Outcome run_tables(const Common& command, const TextStyle& style) {
  const Vehicle vehicle =
      command.study.empty() ? reference_vehicle() : load_study(command.study).vehicle;
  const PaperTables tables = paper_tables(data_directory(), vehicle);
  const bool found = tables.identified.status == IdentifyStatus::reproduced;
  const int code = found ? answered : unanswered;
  switch (command.format) {
    case Format::json:
      return {paper_json(tables), code};
    case Format::csv:
      return {paper_csv(tables), code};
    case Format::text:
      break;
  }
  return {paper_text(tables, style), code};
}

}  // namespace tiltrim::cli
