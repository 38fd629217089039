// tiltrim tune.
#include <fmt/core.h>

#include <algorithm>
#include <cmath>

#include "cli/commands.hpp"
#include "cli/terminal.hpp"
#include "report/tuning_report.hpp"
#include "study/problems.hpp"
#include "study/study.hpp"

namespace tiltrim::cli {

namespace {

// "decay 0.3371 1/s, limited by damping at climb, stationary to 0.002; 3 starts, 1234 of 100000,
// 850/s", short enough for one line.
std::string in_words(const TuneTable& tune, const TuneProgress& at) {
  TuneProblem goals;
  goals.goal = tune.goal;
  goals.goals = tune.goals;
  const std::string_view in = goal_unit(goals);
  const std::string where = at.decides.substr(0, at.decides.find(','));
  const std::string stationary =
      std::isnan(at.stationarity) ? "" : fmt::format(", stationary to {:.1g}", at.stationarity);
  return fmt::format("{} {:.4g}{}{}, {} {}{}; {} starts, {} of {}, {:.0f}/s", goal_name(goals),
                     at.best, in.empty() ? "" : " ", in, at.feasible ? "limited by" : "missing",
                     where, stationary, at.starts, at.evaluations, at.of,
                     double(at.evaluations) / std::max(at.seconds, 1e-3));
}

// Each search and the samples have their own progress.
TuningReport tuned(const TuneCommand& command, const Study& study, const std::stop_token& stop) {
  TuneOptions options = tune_options(study);
  options.threads = command.threads;
  options.stop = stop;
  if (command.evaluations) options.evaluations = *command.evaluations;
  if (command.seconds) options.seconds = *command.seconds;
  if (command.seed) options.seed = *command.seed;
  std::optional<Progress> progress;
  std::string shown;
  return tune_study(study, options, [&](const std::string& what, const TuneProgress& at) {
    if (what != shown) progress.emplace(1);
    shown = what;
    const double share = double(at.evaluations) / double(std::max(at.of, 1L));
    const double of_time = options.seconds > 0 ? at.seconds / options.seconds : 0.0;
    progress->tell(what + ": " + in_words(*study.tune, at), std::max(share, of_time));
  });
}

}  // namespace

Outcome run(const TuneCommand& command, const TextStyle& style, const std::stop_token& stop) {
  const Study study = read_study(command.common.study);
  if (command.seconds && std::isnan(*command.seconds))
    throw std::invalid_argument("--seconds: nan is not a number of seconds");
  if (!command.gains.empty()) {
    check_apart(command.gains, "--gains", command.common.study, "the study");
    check_apart(command.gains, "--gains", command.common.output, "-o");
    check_writable(command.gains);
  }
  TuningReport report;
  try {
    report = tuned(command, study, stop);
  } catch (const std::invalid_argument& e) {
    throw StudyError(fmt::format("{}: {}", study.file.string(), e.what()));
  }
  const std::string gains = tuning_toml(report);
  if (!command.gains.empty() && !gains.empty()) write_whole(command.gains, gains);
  const int code = report.result ? answered : unanswered;
  return {in_format(
              command.common.format, [&] { return tuning_json(report); },
              [&] { return as_csv(tuning_sheet(report)); },
              [&] { return tuning_text(report, style); }, [&] { return tuning_document(report); }),
          code};
}

}  // namespace tiltrim::cli
