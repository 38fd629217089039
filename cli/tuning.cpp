// tiltrim tune: search, comparison with a second algorithm, random samples, front.
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

// "decay 0.3371 1/s, held by damping at climb; 3 starts, 1234 of 100000, 850/s", short enough for
// one line.
std::string in_words(const TuneProblem& problem, const TuneProgress& at) {
  const std::string_view in = unit(problem.goal.measure);
  const std::string where = at.decides.substr(0, at.decides.find(','));
  return fmt::format("{} {:.4g}{}{}, {} {}; {} starts, {} of {}, {:.0f}/s", name_of(problem.goal),
                     at.best, in.empty() ? "" : " ", in, at.feasible ? "limited by" : "missing",
                     where, at.starts, at.evaluations, at.of,
                     double(at.evaluations) / std::max(at.seconds, 1e-3));
}

void tell(Progress& progress, const std::string& what, const TuneProblem& problem,
          const TuneOptions& options, const TuneProgress& at) {
  const double share = double(at.evaluations) / double(std::max(at.of, 1L));
  const double of_time = options.seconds > 0 ? at.seconds / options.seconds : 0.0;
  progress.tell(what + ": " + in_words(problem, at), std::max(share, of_time));
}

// The search, with progress under its own heading.
template <class Work>
auto watched(const std::string& what, const TuneProblem& problem, TuneOptions options,
             const Work& work) {
  Progress progress(1);
  options.observe = [&](const TuneProgress& at) { tell(progress, what, problem, options, at); };
  return work(options);
}

TuneResult searched(const std::string& what, const TuneProblem& problem,
                    const TuneOptions& options) {
  return watched(what, problem, options, [&](const TuneOptions& o) { return tune(problem, o); });
}

// The optimum for each value of one limit, from the strictest on; each search starts at the
// previous optimum, which satisfies the next limit too.
std::vector<TuningReport::FrontPoint> front_of(const TuneProblem& problem,
                                               const TuneTable::Front& front, TuneOptions options) {
  const auto limit_at = [&](int k) {
    return front.from + (front.to - front.from) * k / (front.count - 1);
  };
  const bool rising = more_is_better(front.limit.measure) == (front.to > front.from);
  std::vector<TuningReport::FrontPoint> points;
  for (int i = 0; i < front.count && !options.stop.stop_requested(); ++i) {
    TuneProblem own = problem;
    Requirement limit = front.limit;
    limit.limit = limit_at(rising ? front.count - 1 - i : i);
    std::erase_if(own.limits, [&](const Requirement& r) {
      return r.measure == limit.measure && r.of == limit.of;
    });
    own.limits.push_back(limit);
    points.push_back(
        {limit.limit, searched(fmt::format("front, {} of {}", i + 1, front.count), own, options)});
    if (const TuneResult& found = points.back().result; found) options.start = found.gains;
  }
  if (rising) std::ranges::reverse(points);
  return points;
}

TuningReport tuned(const TuneCommand& command, const Study& study, const std::stop_token& stop) {
  TuningReport report;
  report.problem = tune_problem(study);
  report.user_model = bool(study.user_model);
  const TuneProblem& problem = report.problem;
  TuneOptions& options = report.options;
  options = tune_options(study);
  options.threads = command.threads;
  options.stop = stop;
  if (command.evaluations) options.evaluations = *command.evaluations;
  if (command.seconds) options.seconds = *command.seconds;
  if (command.seed) options.seed = *command.seed;
  const TuneTable& table = *study.tune;
  std::optional<Progress> progress;
  std::string shown;
  TuningAnswer found = tuned_twice(problem, options, table.second,
                                   [&](const std::string& algorithm, const TuneProgress& at) {
                                     if (algorithm != shown) progress.emplace(1);
                                     shown = algorithm;
                                     tell(*progress, algorithm, problem, options, at);
                                   });
  progress.reset();
  report.result = std::move(found.result);
  report.second = std::move(found.second);
  report.second_algorithm = found.second_algorithm;
  options.global = found.algorithm;
  if (table.robustness > 0 && !problem.uncertain.empty() && report.result.gains.size() > 0 &&
      !stop.stop_requested())
    report.robustness = watched("robustness", problem, options, [&](const TuneOptions& o) {
      return robustness(problem, report.result.gains, table.robustness, o);
    });
  if (table.front) {
    report.front_limit = table.front->limit;
    report.front = front_of(problem, *table.front, options);
  }
  report.interrupted = stop.stop_requested();
  return report;
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
