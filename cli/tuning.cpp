// tiltrim tune.
#include <fmt/core.h>

#include <algorithm>
#include <cmath>

#include "cli/commands.hpp"
#include "cli/terminal.hpp"
#include "report/tuning_report.hpp"
#include "study/problems.hpp"
#include "study/study.hpp"
#include "tune/measures.hpp"

namespace tiltrim::cli {

namespace {

// "decay 0.3371 1/s (damping at climb), stationarity 0.002, 3 starts": the best so far, what is
// active, or before that "no answer yet (missing damping at climb), 3 starts". What is active is
// cut where the line would be longer than `columns`.
std::string in_words(const TuneTable& tune, const TuneProgress& at, std::size_t columns) {
  TuneProblem goals;
  goals.goal = tune.goal;
  goals.goals = tune.goals;
  const std::string_view in = goal_unit(goals);
  const std::string best = at.feasible ? fmt::format("{} {:.4g}{}{}", goal_name(goals), at.best,
                                                     in.empty() ? "" : " ", in)
                                       : "no answer yet";
  const std::string stationary =
      std::isnan(at.stationarity) ? "" : fmt::format(", stationarity {:.1g}", at.stationarity);
  const std::string starts = fmt::format(", {} start{}", at.starts, at.starts == 1 ? "" : "s");
  std::string active = (at.feasible ? "" : "missing ") + at.decides.substr(0, at.decides.find(','));
  const std::size_t others = best.size() + stationary.size() + starts.size() + 3;
  const std::size_t room = columns > others ? columns - others : 0;
  if (active.size() > room)
    active = fmt::format("{:.{}}…", active, std::max<std::size_t>(room, 6) - 1);
  return fmt::format("{} ({}){}{}", best, active, stationary, starts);
}

std::string samples_in_words(const TuneProgress& at) {
  return fmt::format("robustness: {} of {} samples, {}", at.evaluations, at.of,
                     at.feasible ? "all meet the limits" : "missing " + at.decides);
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
  const std::string first = to_string(options.global);
  return tune_study(study, options, [&](const std::string& what, const TuneProgress& at) {
    if (what != shown) progress.emplace(1);
    shown = what;
    const double share = double(at.evaluations) / double(std::max(at.of, 1L));
    const double of_time = options.seconds > 0 ? at.seconds / options.seconds : 0.0;
    if (what == "robustness") return progress->tell(samples_in_words(at), share);
    const std::string which = what == first ? "" : what + ": ";
    const std::size_t columns = Progress::columns() - Progress::own - which.size();
    progress->tell(which + in_words(*study.tune, at, columns), std::max(share, of_time), "< ");
  });
}

}  // namespace

Outcome run(const TuneCommand& command, const TextStyle& style, const std::stop_token& stop) {
  const Study study = read_study(command.common, {{command.gains, "--gains"}});
  if (command.seconds && std::isnan(*command.seconds))
    throw std::invalid_argument("--seconds: nan is not a number of seconds");
  if (!command.gains.empty()) check_writable(command.gains);
  TuningReport report;
  try {
    report = tuned(command, study, stop);
  } catch (const std::invalid_argument& e) {
    throw placed(study, e);
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
