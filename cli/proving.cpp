// tiltrim prove: theorems over boxes of parameters, and their certificate.
#include <fmt/core.h>

#include <algorithm>

#include "cli/commands.hpp"
#include "cli/terminal.hpp"
#include "flight/closed_loop_proof.hpp"
#include "report/proofs.hpp"
#include "runtime/threads.hpp"
#include "study/study.hpp"

namespace tiltrim::cli {

namespace {

ProveProblem problem_of(const Study& study, const Condition& condition) {
  std::vector<ProveParameter> parameters;
  for (const ProveTable::Parameter& p : study.prove->parameters) {
    const std::string& signal = p.key.signal.empty() ? p.key.name : p.key.signal;
    parameters.push_back({signal, p.from, p.to});
  }
  return closed_loop_proof(study.vehicle, study.schedule, condition.name, *condition.command(),
                           parameters);
}

// The closed-loop conditions; of a box over h, which sets their commands, the first.
std::vector<Condition> to_prove(const Study& study, const ProveCommand& command) {
  if (!study.prove)
    throw StudyError(
        fmt::format("{}: no [prove] table; expected [[prove.parameter]], one or more, "
                    "with key, from and to, or percent",
                    study.file.string()));
  if (study.vehicle.equations == Equations::printed)
    throw StudyError(
        fmt::format("{}: prove needs equations = \"consistent\"", study.file.string()));
  std::vector<Condition> conditions;
  for (const Condition& condition : chosen(study, command.common.only))
    if (condition.command()) conditions.push_back(condition);
  if (conditions.empty())
    throw StudyError(fmt::format("{}: prove needs a closed-loop condition", study.file.string()));
  const bool over_h =
      std::ranges::any_of(study.prove->parameters, [](const auto& p) { return p.key.name == "h"; });
  if (over_h) conditions.resize(1);
  return conditions;
}

}  // namespace

Outcome run(const ProveCommand& command, const TextStyle&, const std::stop_token& stop) {
  const Study study = read_study(command.common.study);
  const std::vector<Condition> conditions = to_prove(study, command);
  check_apart(command.certificate, "--certificate", command.common.study, "the study");
  if (!command.certificate.empty()) check_writable(command.certificate);
  Progress progress(conditions.size());
  ProveOptions options;
  options.margin = command.margin.value_or(study.prove->margin);
  options.max_boxes = command.boxes.value_or(study.prove->boxes);
  options.undecided = study.prove->undecided;
  options.stop = stop;
  options.observe = [&](double proved, std::size_t boxes) {
    progress.tell(fmt::format("{:.6f} of the volume proved, {} boxes", proved, boxes), proved);
  };
  std::vector<Theorem> theorems;
  with_threads(command.threads, [&] {
    for (const Condition& condition : conditions)
      theorems.push_back(command.largest
                             ? prove_largest_margin(problem_of(study, condition), options)
                             : prove(problem_of(study, condition), options));
  });
  if (!command.certificate.empty())
    write_whole(command.certificate, certificate_of(study, theorems));
  const bool all = std::ranges::all_of(
      theorems, [](const Theorem& t) { return t.status() == ProofStatus::proved; });
  const auto text = [&] { return theorems_text(study, theorems); };
  if (command.common.format == Format::json)
    return {theorems_json(study, theorems, command.certificate.string()),
            all ? answered : unanswered};
  if (command.common.format != Format::text)
    throw std::invalid_argument("prove writes text and json");
  return {text(), all ? answered : unanswered};
}

}  // namespace tiltrim::cli
