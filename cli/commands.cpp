#include "cli/commands.hpp"

#include <fmt/ranges.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <exception>
#include <mutex>
#include <span>

#include "cli/model_files.hpp"
#include "cli/terminal.hpp"
#include "model/lookup.hpp"
#include "report/envelopes.hpp"
#include "report/linear_models.hpp"
#include "report/loops.hpp"
#include "report/paper.hpp"
#include "report/quality_sheets.hpp"
#include "report/sensitivities.hpp"
#include "runtime/checksum.hpp"
#include "runtime/ranks.hpp"
#include "runtime/threads.hpp"
#include "study/analyses.hpp"
#include "study/angle_remarks.hpp"
#include "study/problems.hpp"
#include "study/reference_vehicle.hpp"
#include "study/study.hpp"
#include "sweep/sweep.hpp"

namespace tiltrim::cli {

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

Study read_study(const std::filesystem::path& file) {
  const Reading now;
  Study study = load_study(file);
  if (rank() == 0)
    for (const std::string& remark : angle_remarks(study))
      fmt::print(stderr, "tiltrim: {}\n", remark);
  return study;
}

Study read_study(const Common& common, const std::vector<FurtherFile>& further) {
  for (const auto& [file, option] : further) {
    check_apart(file, option, common.study, "the study");
    check_apart(file, option, common.output, "-o");
  }
  Study study = read_study(common.study);
  if (study.user_model) return study;
  const std::filesystem::path polar = common.study.parent_path() / study.polar_name;
  check_apart(common.output, "-o", polar, "the study's polar");
  for (const auto& [file, option] : further) check_apart(file, option, polar, "the study's polar");
  return study;
}

std::string identity_of(const Study& study, const std::vector<Condition>& conditions) {
  std::string identity = "tiltrim " TILTRIM_VERSION "\n" + study.text + "\nconditions:";
  for (const Condition& c : conditions) identity += " " + c.name;
  return identity + "\npolar: " + polar_checksum(study);
}

std::string polar_checksum(const Study& study) {
  if (study.user_model) return "";
  const Polar& polar = *study.vehicle.polar;
  std::string rows;
  for (std::size_t i = 0; i < polar.rows().size(); ++i) {
    const Coefficients& c = polar.rows()[i];
    rows += fmt::format("{:a} {:a} {:a} {:a}\n", polar.knots()[i], c.CL, c.CD, c.CM);
  }
  return fmt::format("{:016x}", checksum(std::as_bytes(std::span(rows))));
}

void sign(const Study& study, SweepMap& map) {
  map.study = study.text;
  map.polar = polar_checksum(study);
  map.program = "tiltrim " TILTRIM_VERSION;
}

void for_each(const Study& study, const Common& common, int threads,
              const std::function<void(std::size_t, const Condition&, Progress&)>& work) {
  const std::vector<Condition> conditions = chosen(study, common.only);
  Progress progress(conditions.size());
  std::vector<std::exception_ptr> errors(conditions.size());
  std::mutex order;
  std::atomic<std::size_t> first = conditions.size();  // in error: those after it are not begun
  const auto one = [&](std::size_t k) {
    if (k > first) return;
    try {
      work(k, conditions[k], progress);
      progress.advance();
    } catch (...) {
      errors[k] = std::current_exception();
      const std::scoped_lock lock(order);
      first = std::min(first.load(), k);
    }
  };
  if (threads == 1)
    for (std::size_t k = 0; k < conditions.size(); ++k) one(k);
  else
    with_threads(threads, [&] { in_parallel(conditions.size(), one); });
  if (first == conditions.size()) return;
  const Condition& condition = conditions[first];
  try {
    std::rethrow_exception(errors[first]);
  } catch (const std::invalid_argument& e) {
    const char* const hint =
        study.conditions.size() > 1 ? " (choose other conditions with --only NAME)" : "";
    throw error_in(condition, fmt::format("{}{}", e.what(), hint));
  }
}

void for_each(const Study& study, const Common& common,
              const std::function<void(const Condition&, Progress&)>& work) {
  for_each(study, common, 1, [&](std::size_t, const Condition& condition, Progress& progress) {
    work(condition, progress);
  });
}

// What the condition's trim problem is refused for; empty if it is not.
static std::string refusal(const Condition& condition) {
  if (!condition.user()) return "";
  const TrimProblem p = user_problem(*condition.user());
  try {
    (void)proved_infeasible(p.model, p.spec, p.guess, {.max_boxes = 0});
  } catch (const std::invalid_argument& e) {
    return e.what();
  }
  return "";
}

StudyError placed(const Study& study, const std::invalid_argument& error) {
  for (const Condition& c : study.conditions)
    if (refusal(c) == error.what()) return error_in(c, error.what());
  return StudyError(fmt::format("{}: {}", study.file.string(), error.what()));
}

namespace {

ConditionReport trimmed(const Vehicle& vehicle, const Condition& condition,
                        const TrimOptions& options) {
  ConditionReport report{answer(vehicle, condition, options), {}, {}, {}, {}};
  const TrimStatus status = report.answer.trim.status;
  if (status == TrimStatus::infeasible || status == TrimStatus::not_found)
    report.why = explain(vehicle, condition, options);
  return report;
}

// `models`: linear-model files were requested, so conditions missing from them are reported.
std::string printed(const std::vector<ConditionReport>& reports, const Common& common,
                    const Sheet& csv, const TextStyle& style, bool models = false) {
  const auto left_out = [&](const TextStyle& words) {
    return models ? left_out_text(reports, words) : std::string();
  };
  return in_format(
      common.format, [&] { return conditions_json(reports); }, [&] { return as_csv(csv); },
      [&] { return conditions_text(reports, style) + left_out(style); },
      [&] {
        std::vector<Sheet> sheets = conditions_document(reports);
        sheets.push_back(paragraph_sheet(left_out(unwrapped)));
        return sheets;
      });
}

}  // namespace

static JudgedQualities judged_qualities(const Study& study, const ConditionReport& r) {
  const QualitiesOptions options =
      qualities_options(study, r.answer.condition, *r.linear, r.answer.trim.outputs);
  return {options, qualities(*r.linear, options)};
}

ConditionReport linearized(const Study& study, const Condition& condition,
                           const TrimOptions& trimming, const LinearizeOptions& asked) {
  ConditionReport r = trimmed(vehicle_at(study, condition), condition, trimming);
  if (!r.answer.has_equilibrium() || r.answer.table) return r;
  LinearizeOptions options = asked;
  if (options.inputs.empty() && condition.command()) options.inputs = {"V", "gamma", "eta"};
  options.moving = moving_states(condition);
  options.time_limit = study.time_limit;
  r.linear = linearize(r.answer.model, r.answer.trim.point, options);
  if (*r.linear) r.modes = modes(*r.linear);
  if (*r.linear && study.qualities) r.qualities = judged_qualities(study, r);
  return r;
}

ConditionReport judged(const Study& study, const Condition& condition, const TrimOptions& trimming,
                       const LinearizeOptions& options) {
  ConditionReport r = linearized(study, condition, trimming, options);
  if (r.modes && !r.qualities) r.qualities = judged_qualities(study, r);
  return r;
}

Outcome run(const TrimCommand& command, const TextStyle& style, const std::stop_token& stop) {
  const Study study = read_study(command.common);
  TrimOptions options = command.options;
  options.stop = stop;
  options.time_limit = study.time_limit;
  std::vector<ConditionReport> reports;
  for_each(study, command.common, [&](const Condition& condition, Progress&) {
    reports.push_back(trimmed(vehicle_at(study, condition), condition, options));
    if (command.all && !condition.table())
      reports.back().all = all_equilibria(vehicle_at(study, condition), condition, options);
  });
  const bool all = std::ranges::all_of(reports, [](const auto& r) { return bool(r.answer.trim); });
  const Sheet csv = command.all ? all_sheet(reports) : trim_sheet(reports);
  return {printed(reports, command.common, csv, style), all ? answered : unanswered};
}

static void check_inputs(const std::vector<std::string>& names) {
  for (auto name = names.begin(); name != names.end(); ++name)
    if (std::find(names.begin(), name, *name) != name)
      throw StudyError(fmt::format("--inputs: '{}' names two inputs; expected each once", *name));
}

Outcome run(const LinearizeCommand& command, const TextStyle& style, const std::stop_token& stop) {
  check_model_files(command.models);
  check_inputs(command.inputs);
  std::vector<FurtherFile> models;
  for (const auto& file : command.models) models.push_back({file, "--models"});
  const Study study = read_study(command.common, models);
  TrimOptions trimming = command.options;
  trimming.stop = stop;
  trimming.time_limit = study.time_limit;
  LinearizeOptions options;
  options.method = command.method;
  options.inputs = command.inputs;
  std::vector<ConditionReport> reports;
  for_each(study, command.common, [&](const Condition& condition, Progress&) {
    reports.push_back(linearized(study, condition, trimming, options));
  });
  const bool all = std::ranges::all_of(reports, [](const auto& r) {
    return r.answer.trim && r.modes && r.modes->verdict != Verdict::undecided;
  });
  write_model_files(command.models, reports);
  return {
      printed(reports, command.common, all_modes_sheet(reports), style, !command.models.empty()),
      all ? answered : unanswered};
}

// The variable that an option names.
static Key named_by(const char* option, const std::string& name, const Study& study) {
  try {
    return key_among(keys_of(study), name);
  } catch (const std::invalid_argument& e) {
    throw StudyError(fmt::format("{}: {}", option, e.what()));
  }
}

// The branch requested on the command line or in the study.
static FollowTable asked(const FollowCommand& command, const Study& study) {
  const std::string file = study.file.string();
  if (command.parameter.empty() != !command.to)
    throw StudyError("--parameter and --to are given together or not at all");
  if (command.parameter.empty() && !study.follow)
    throw StudyError(fmt::format(
        "{}: no [follow] table; expected one with parameter and to, or --parameter KEY --to VALUE",
        file));
  if (command.parameter.empty()) return *study.follow;
  const Key key = named_by("--parameter", command.parameter, study);
  if (!(*command.to >= key.accepted.lower && *command.to <= key.accepted.upper))
    throw StudyError(fmt::format("--to: {} is out of range; expected {} from {} to {} {}",
                                 *command.to, key.name, key.accepted.lower, key.accepted.upper,
                                 key.unit));
  return {key, key.in_si(*command.to)};
}

Outcome run(const FollowCommand& command, const TextStyle& style, const std::stop_token& stop) {
  const Study study = read_study(command.common);
  const FollowTable what = asked(command, study);
  if (what.parameter.signal == "eta" && !study.schedule.eta.empty())
    throw StudyError(
        fmt::format("{}: the gains depend on the tilt (schedule_eta_deg); expected another "
                    "parameter than eta_deg, or a sweep over it",
                    study.file.string()));
  std::vector<BranchAnswer> branches;
  for_each(study, command.common, [&](const Condition& condition, Progress& progress) {
    TrimOptions trimming = command.trimming;
    FollowOptions options = command.options;
    trimming.stop = options.stop = stop;
    trimming.time_limit = study.time_limit;
    options.observe = [&](double value, std::size_t points) {
      progress.say(fmt::format("{}: {} = {:.6g}, {} points", condition.name, what.parameter.name,
                               what.parameter.in_study(value), points));
    };
    branches.push_back(follow(vehicle_at(study, condition), condition, what.parameter, what.to,
                              options, trimming));
  });
  const int code = std::ranges::all_of(branches, &BranchAnswer::answered) ? answered : unanswered;
  return {in_format(
              command.common.format, [&] { return branches_json(branches); },
              [&] { return as_csv(branches_sheet(branches)); },
              [&] { return branches_text(branches, style); },
              [&] { return branches_document(branches); }),
          code};
}

Outcome run(const EnvelopeCommand& command, const TextStyle& style, const std::stop_token& stop) {
  const Study study = read_study(command.common);
  const EnvelopeTable table = envelope_table(study, command.over, command.count);
  std::vector<EnvelopeAnswer> envelopes(chosen(study, command.common.only).size());
  const bool one = envelopes.size() == 1;  // then its points are spread over the threads
  const auto work = [&](std::size_t k, const Condition& condition, Progress& progress) {
    EnvelopeOptions options;
    options.rows = envelope_rows(table, bool(study.user_model));
    options.threads = one ? command.threads : 1;
    options.stop = stop;
    options.observe = [&](double share) {
      progress.say(fmt::format("{}: {:.0f} % of the grid", condition.name, 100 * share), share);
    };
    envelopes[k] = envelope(study.vehicle, condition, table, options);
  };
  for_each(study, command.common, one ? 1 : command.threads, work);
  const int code =
      std::ranges::all_of(envelopes, &EnvelopeAnswer::answered) ? answered : unanswered;
  return {in_format(
              command.common.format, [&] { return envelopes_json(envelopes); },
              [&] { return as_csv(border_sheet(envelopes)); },
              [&] { return envelopes_text(envelopes, style); },
              [&] { return envelopes_document(envelopes); }),
          code};
}

Outcome run(const SensitivitiesCommand& command, const TextStyle& style,
            const std::stop_token& stop) {
  const Study study = read_study(command.common);
  std::vector<Key> keys;
  for (const std::string& name : command.parameters)
    keys.push_back(named_by("--parameters", name, study));
  std::vector<SensitivityAnswer> conditions;
  for_each(study, command.common, [&](const Condition& condition, Progress&) {
    TrimOptions trimming = command.trimming;
    trimming.stop = stop;
    trimming.time_limit = study.time_limit;
    conditions.push_back(sensitivities(vehicle_at(study, condition), condition, keys, trimming));
  });
  const bool all = std::ranges::all_of(
      conditions, [](const SensitivityAnswer& c) { return bool(c.sensitivities); });
  const int code = all ? answered : unanswered;
  return {in_format(
              command.common.format, [&] { return sensitivities_json(conditions); },
              [&] { return as_csv(sensitivities_sheet(conditions)); },
              [&] { return sensitivities_text(conditions, command.most, style); },
              [&] { return sensitivities_document(conditions, command.most); }),
          code};
}

// Checks the frequencies that do not depend on the condition.
static void check_frequencies(const LoopsOptions& options) {
  const auto check = [](const char* flag, const std::optional<double>& value) {
    if (value && !(*value > 0 && std::isfinite(*value)))
      throw StudyError(
          fmt::format("{}: {} is not a frequency; expected a number above 0 rad/s", flag, *value));
  };
  check("--from", options.from);
  check("--to", options.to);
  if (options.from && options.to && !(*options.from < *options.to))
    throw StudyError(fmt::format("--from {} is not below --to {}", *options.from, *options.to));
}

// Checks the names of all loops before the first is broken.
static void check_loops(const std::vector<std::string>& asked, const Study& study) {
  std::vector<std::string> all = actuators();
  if (study.user_model) {
    all.clear();
    for (const UserModel::Loop& loop : study.user_model->loops) all.push_back(loop.name);
  }
  for (const std::string& name : asked)
    if (!all.empty() && std::ranges::find(all, name) == all.end())
      throw StudyError(
          fmt::format("--loop: no loop '{}'; there are: {}", name, fmt::join(all, ", ")));
}

Outcome run(const MarginsCommand& command, const TextStyle& style, const std::stop_token& stop) {
  check_frequencies(command.options);
  const std::filesystem::path& bode = command.bode;
  const Study study = read_study(command.common, {{bode, "--bode"}});
  check_loops(command.options.actuators, study);
  if (!bode.empty()) check_writable(bode);
  std::vector<LoopsAnswer> conditions;
  for_each(study, command.common, [&](const Condition& condition, Progress&) {
    TrimOptions trimming = command.trimming;
    trimming.stop = stop;
    trimming.time_limit = study.time_limit;
    conditions.push_back(
        actuator_loops(vehicle_at(study, condition), condition, command.options, trimming));
  });
  if (!bode.empty()) write_whole(bode, as_csv(bode_sheet(conditions)));
  const int code = std::ranges::all_of(conditions, &LoopsAnswer::answered) ? answered : unanswered;
  return {in_format(
              command.common.format, [&] { return margins_json(conditions); },
              [&] { return as_csv(margins_sheet(conditions)); },
              [&] { return margins_text(conditions, style); },
              [&] { return margins_document(conditions); }),
          code};
}

Outcome run(const TablesCommand& asked, const TextStyle& style, const std::stop_token&) {
  const Common& command = asked.common;
  Vehicle vehicle;
  if (command.study.empty()) {
    vehicle = reference_vehicle();
  } else {
    const Study study = read_study(command.study);
    if (study.user_model)
      throw StudyError(
          fmt::format("{}: the tables are those of the paper's tiltrotor; expected a study without "
                      "[model], or no study",
                      command.study.string()));
    vehicle = study.vehicle;
  }
  const PaperTables tables = paper_tables(data_directory(), vehicle);
  const bool found = tables.identified.status == IdentifyStatus::reproduced;
  const int code = found ? answered : unanswered;
  return {in_format(
              command.format, [&] { return paper_json(tables); }, [&] { return paper_csv(tables); },
              [&] { return paper_text(tables, style); }, [&] { return paper_document(tables); }),
          code};
}

Outcome run(const QualitiesCommand& command, const TextStyle& style, const std::stop_token& stop) {
  const Study study = read_study(command.common);
  TrimOptions trimming = command.trimming;
  trimming.stop = stop;
  trimming.time_limit = study.time_limit;
  LinearizeOptions options;
  options.method = command.method;
  std::vector<ConditionReport> reports;
  for_each(study, command.common, [&](const Condition& condition, Progress&) {
    reports.push_back(judged(study, condition, trimming, options));
  });
  const bool all = std::ranges::all_of(reports, [](const ConditionReport& r) {
    return r.qualities && int(r.qualities->qualities.level) > int(Level::undecided);
  });
  return {in_format(
              command.common.format, [&] { return qualities_json(reports); },
              [&] { return as_csv(qualities_sheet(reports)); },
              [&] { return qualities_text(reports, style); },
              [&] { return qualities_document(reports); }),
          all ? answered : unanswered};
}

}  // namespace tiltrim::cli
