// tiltrim sweep and diff: maps, and the differences between two.
#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <new>

#include "cli/commands.hpp"
#include "cli/terminal.hpp"
#include "report/qualities.hpp"
#include "report/sweeps.hpp"
#include "runtime/whole_file.hpp"
#include "study/problems.hpp"
#include "study/study.hpp"
#include "sweep/map.hpp"
#include "sweep/sweep.hpp"

namespace tiltrim::cli {

namespace {

std::string in_words(const SweepProgress& p) {
  return fmt::format("{} of {} {}: {} stable, {} unstable, {} undecided, {} without trim", p.done,
                     p.total, p.what, p.stable, p.unstable, p.undecided, p.no_trim);
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

}  // namespace

SweepMap swept(const Study& study, const std::vector<Condition>& conditions, const SweepTable& grid,
               SweepOptions options) {
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
    SweepMap map = sweep(sweep_requests(study, conditions, grid.axes), grid.axes, options);
    map.study = study.text;
    map.program = "tiltrim " TILTRIM_VERSION;
    return map;
  } catch (const std::invalid_argument& e) {
    throw StudyError(fmt::format("{}: {}", study.file.string(), e.what()));
  } catch (const std::bad_alloc&) {
    throw StudyError(fmt::format("{}: not enough memory for a map of {}; expected fewer points",
                                 study.file.string(), size_in_words(conditions, grid)));
  }
}

Outcome run(const SweepCommand& command, const TextStyle& style, const std::stop_token& stop) {
  const Study study = read_study(command.common.study);
  if (!study.sweep)
    throw StudyError(
        fmt::format("{}: no [[sweep.axis]] table; expected one or more, with key, from, "
                    "to and count, or values",
                    study.file.string()));
  if (std::isnan(command.checkpoint))
    throw std::invalid_argument("--checkpoint: nan is not a number of seconds");
  const std::filesystem::path& output = command.common.output;
  // The same log, whichever link leads to the output.
  const std::filesystem::path log = filing::target_of(output).string() + ".log";
  SweepMap map;
  std::optional<QualityLayer> levels;
  try {
    const std::vector<Condition> conditions = chosen(study, command.common.only);
    SweepOptions options;
    options.threads = command.threads;
    options.checkpoint = command.checkpoint;
    options.identity = identity_of(study, conditions);
    options.stop = stop;
    if (!output.empty()) options.log = log;
    const bool resumed = !output.empty() && first_of_ranks() && std::filesystem::exists(log);
    map = swept(study, conditions, *study.sweep, options);
    if (study.qualities && first_of_ranks())
      levels = quality_layer(study, conditions, *study.sweep, map, stop);
    if (resumed)
      fmt::print(stderr, "tiltrim: resumed from {}: its lines were not computed again\n",
                 log.string());
  } catch (const SweepInterrupted& e) {
    if (e.failed_elsewhere) return {"", bad_input, true};
    if (!output.empty() && first_of_ranks())
      fmt::print(
          stderr,
          "tiltrim: stopped; finished lines are in {}: the same command continues from there\n",
          log.string());
    return {"", unanswered, true};
  }
  if (!first_of_ranks()) return {"", answered, true};
  const bool all = std::ranges::none_of(map.verdict, [](std::int8_t v) {
    return v < 0 || static_cast<Verdict>(v) == Verdict::undecided;
  });
  Outcome outcome{"", all ? answered : unanswered, false};
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
  if (is_netcdf(output)) {
    write_netcdf(map, output);
    outcome.output = in_format(command.common.format, text, text, text, document);
    outcome.written = true;
  } else {
    outcome.output = in_format(
        command.common.format, json, [&] { return as_csv(map_sheet(map)); }, text, document);
    if (!output.empty()) {
      write_whole(output, outcome.output);
      outcome = {"", outcome.exit_code, true};
    }
  }
  if (!output.empty()) std::filesystem::remove(log);
  return outcome;
}

Outcome run(const DiffCommand& command, const TextStyle& style, const std::stop_token&) {
  const SweepMap before = read_netcdf(command.common.study), after = read_netcdf(command.after);
  const MapDifference difference = tiltrim::difference(before, after);
  return {in_format(
              command.common.format, [&] { return difference_json(before, difference); },
              [&] { return as_csv(difference_sheet(before, difference)); },
              [&] { return difference_text(before, difference, style); },
              [&] { return difference_document(before, difference); }),
          difference.changed.empty() ? answered : unanswered};
}

}  // namespace tiltrim::cli
