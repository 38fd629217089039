// tiltrim sweep and diff: maps, and the differences between two.
#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <new>

#include "cli/commands.hpp"
#include "cli/terminal.hpp"
#include "report/differences.hpp"
#include "report/map_sheets.hpp"
#include "report/quality_sheets.hpp"
#include "report/verdicts.hpp"
#include "runtime/ranks.hpp"
#include "runtime/whole_file.hpp"
#include "study/problems.hpp"
#include "study/study.hpp"
#include "sweep/difference.hpp"
#include "sweep/map.hpp"
#include "sweep/sweep.hpp"
#include "sweep/verdict_map.hpp"

namespace tiltrim::cli {

namespace {

std::string in_words(const SweepProgress& p) {
  std::string words = fmt::format("{} of {} {}", p.done, p.total, p.what);
  if (p.stable + p.unstable > 0)
    words += fmt::format(": {} stable, {} unstable", p.stable, p.unstable);
  if (p.undecided > 0) words += fmt::format(", {} undecided", p.undecided);
  if (p.no_trim > 0) words += fmt::format(", {} without trim", p.no_trim);
  return words;
}

bool is_netcdf(const std::filesystem::path& file) { return file.extension() == ".nc"; }

// "2 conditions, K_Lp 1000 x k_de 1000 points"
std::string size_in_words(const std::vector<Condition>& conditions, const SweepTable& grid) {
  std::string axes;
  for (const SweepAxis& axis : grid.axes)
    axes += fmt::format("{}{} {}", axes.empty() ? "" : " x ", axis.name, axis.size());
  return fmt::format("{} condition{}, {} points", conditions.size(),
                     conditions.size() == 1 ? "" : "s", axes);
}

// Calls sweep(requests, axes, options) for the study's grid, with a progress display.
auto observed(const Study& study, const std::vector<Condition>& conditions, const SweepTable& grid,
              SweepOptions options, const auto& sweep) {
  options.crossings = grid.crossings;
  options.trimming.time_limit = study.time_limit;
  std::optional<Progress> progress;
  const char* stage = nullptr;
  options.observe = [&](const SweepProgress& p) {
    if (p.what != stage) progress.emplace(1);
    stage = p.what;
    progress->tell(in_words(p), p.total > 0 ? double(p.done) / double(p.total) : 0.0);
  };
  try {
    return sweep(sweep_requests(study, conditions, grid.axes), grid.axes, options);
  } catch (const std::invalid_argument& e) {
    throw placed(study, e);
  } catch (const std::bad_alloc&) {
    throw StudyError(fmt::format("{}: not enough memory for a map of {}; expected fewer points",
                                 study.file.string(), size_in_words(conditions, grid)));
  }
}

// The same log, whichever link leads to the output.
std::filesystem::path log_of(const SweepCommand& command) {
  const std::filesystem::path& output = command.common.output;
  if (output.empty()) return {};
  return filing::target_of(output).string() + ".log";
}

SweepOptions options_of(const SweepCommand& command, const Study& study,
                        const std::vector<Condition>& conditions, const std::stop_token& stop) {
  SweepOptions options;
  options.threads = command.threads;
  options.checkpoint = command.checkpoint;
  options.identity = identity_of(study, conditions);
  options.stop = stop;
  options.log = log_of(command);
  return options;
}

// Runs work(), which may resume from the log; the outcome if it was stopped.
std::optional<Outcome> resumable(const std::filesystem::path& log, const auto& work) {
  try {
    const bool resumed = !log.empty() && rank() == 0 && std::filesystem::exists(log);
    work();
    if (resumed)
      fmt::print(stderr, "tiltrim: resumed from {}: its lines were not computed again\n",
                 log.string());
  } catch (const SweepInterrupted& e) {
    if (e.failed_elsewhere) return Outcome{"", bad_input, true};
    if (!log.empty() && rank() == 0)
      fmt::print(
          stderr,
          "tiltrim: stopped; finished lines are in {}: the same command continues from there\n",
          log.string());
    return Outcome{"", unanswered, true};
  }
  if (rank() != 0) return Outcome{"", answered, true};
  return {};
}

// Writes a NetCDF file and returns the summary, or returns what is not NetCDF.
template <class Text, class Json, class Csv, class Document>
Outcome written(const Common& common, const auto& map, const Text& text, const Json& json,
                const Csv& csv, const Document& document, Exit exit) {
  Outcome outcome{"", exit, false};
  if (is_netcdf(common.output)) {
    write_netcdf(map, common.output);
    outcome.output = in_format(common.format, text, text, text, document);
    outcome.written = true;
    return outcome;
  }
  outcome.output = in_format(common.format, json, csv, text, document);
  if (common.output.empty()) return outcome;
  write_whole(common.output, outcome.output);
  return {"", exit, true};
}

Outcome verdicts_written(const Common& common, const VerdictMap& map, const TextStyle& style) {
  bool all = true;
  for (const VerdictCounts& c : counts_of(map))
    all = all && c[std::size_t(Verdict::undecided)] + c.back() == 0;
  return written(
      common, map, [&] { return verdicts_text(map, style); }, [&] { return verdicts_json(map); },
      [&] { return as_csv(verdicts_sheet(map)); }, [&] { return verdicts_document(map); },
      all ? answered : unanswered);
}

Outcome swept_verdicts(const SweepCommand& command, const Study& study, const TextStyle& style,
                       const std::stop_token& stop) {
  const std::vector<Condition> conditions = chosen(study, command.common.only);
  if (study.qualities)
    throw StudyError(
        fmt::format("{}: detail = \"verdict\" has no eigenvalues for [qualities]; "
                    "expected one of the two",
                    study.file.string()));
  const SweepPart part = command.part.value_or(SweepPart{});
  if (part.of > 1 && !is_netcdf(command.common.output))
    throw std::invalid_argument("--part: a part is written as NetCDF; expected -o PART.nc");
  const SweepOptions options = options_of(command, study, conditions, stop);
  VerdictMap map;
  const auto stopped = resumable(options.log, [&] {
    map = observed(study, conditions, *study.sweep, options,
                   [&](const auto&... arguments) { return sweep_verdicts(arguments..., part); });
  });
  if (stopped) return *stopped;
  sign(study, map.grid);
  const Outcome outcome = verdicts_written(command.common, map, style);
  if (!options.log.empty()) std::filesystem::remove(options.log);
  return outcome;
}

}  // namespace

SweepMap swept(const Study& study, const std::vector<Condition>& conditions, const SweepTable& grid,
               SweepOptions options) {
  double points = 1;
  for (const SweepAxis& axis : grid.axes) points *= double(axis.size());
  if (points > most_points)
    throw StudyError(
        fmt::format("{}: a map with eigenvalues over {:.3g} points; expected at most "
                    "{:.0f}",
                    study.file.string(), points, most_points));
  SweepMap map = observed(study, conditions, grid, std::move(options),
                          [](const auto&... arguments) { return sweep(arguments...); });
  sign(study, map);
  return map;
}

Outcome run(const SweepCommand& command, const TextStyle& style, const std::stop_token& stop) {
  const Study study = read_study(command.common);
  if (!study.sweep)
    throw StudyError(
        fmt::format("{}: no [[sweep.axis]] table; expected one or more, with key, from, "
                    "to and count, or values",
                    study.file.string()));
  if (std::isnan(command.checkpoint))
    throw std::invalid_argument("--checkpoint: nan is not a number of seconds");
  if (study.sweep->verdicts) return swept_verdicts(command, study, style, stop);
  if (command.part)
    throw std::invalid_argument("--part: expected a study with detail = \"verdict\" in [sweep]");
  const std::vector<Condition> conditions = chosen(study, command.common.only);
  const SweepOptions options = options_of(command, study, conditions, stop);
  SweepMap map;
  std::optional<QualityLayer> levels;
  const auto stopped = resumable(options.log, [&] {
    map = swept(study, conditions, *study.sweep, options);
    if (study.qualities && rank() == 0)
      levels = observed(study, conditions, *study.sweep, options,
                        [&](const auto&, const auto&, const SweepOptions& observing) {
                          return quality_layer(study, conditions, *study.sweep, map, observing);
                        });
  });
  if (stopped) return *stopped;
  const bool all = std::ranges::none_of(map.verdict, [](std::int8_t v) {
    return v < 0 || static_cast<Verdict>(v) == Verdict::undecided;
  });
  const auto text = [&] {
    return map_text(map, style) +
           (levels ? "\n" + as_text(borders_sheet(map, *levels), style) : "");
  };
  const auto document = [&] {
    std::vector<Sheet> sheets = map_document(map);
    if (levels) sheets.push_back(borders_sheet(map, *levels));
    return sheets;
  };
  const auto json = [&] {
    return levels ? with_qualities(map_json(map), map, *levels) : map_json(map);
  };
  const Outcome outcome = written(
      command.common, map, text, json, [&] { return as_csv(map_sheet(map)); }, document,
      all ? answered : unanswered);
  if (!options.log.empty()) std::filesystem::remove(options.log);
  return outcome;
}

Outcome run(const MergeCommand& command, const TextStyle& style, const std::stop_token&) {
  if (!is_netcdf(command.common.output))
    throw std::invalid_argument("merge writes a map as NetCDF; expected -o MAP.nc");
  std::vector<VerdictMap> parts;
  std::vector<std::string> names;
  for (const std::filesystem::path& file : command.parts) {
    parts.push_back(read_verdict_map(file));
    names.push_back(file.string());
  }
  return verdicts_written(command.common, merged(std::move(parts), names), style);
}

namespace {

Outcome differences(const Common& common, const auto& before, const auto& after,
                    const TextStyle& style) {
  const auto difference = tiltrim::difference(before, after);
  const Sheet changed = difference_sheet(before, difference);
  return {in_format(
              common.format, [&] { return difference_json(before, difference); },
              [&] { return as_csv(changed); },
              [&] { return difference_text(before, difference, style); },
              [&] { return difference_document(before, difference); }),
          changed.rows.empty() ? answered : unanswered};
}

}  // namespace

Outcome run(const DiffCommand& command, const TextStyle& style, const std::stop_token&) {
  const std::filesystem::path &a = command.common.study, &b = command.after;
  const auto before = read_map(a), after = read_map(b);
  const auto *verdicts = std::get_if<VerdictMap>(&before), *later = std::get_if<VerdictMap>(&after);
  if ((verdicts != nullptr) != (later != nullptr))
    throw std::invalid_argument(
        fmt::format("{} is a map of verdicts alone, {} is not; expected two of a kind",
                    (verdicts ? a : b).string(), (verdicts ? b : a).string()));
  if (verdicts) return differences(command.common, *verdicts, *later, style);
  return differences(command.common, std::get<SweepMap>(before), std::get<SweepMap>(after), style);
}

}  // namespace tiltrim::cli
