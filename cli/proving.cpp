// tiltrim prove: theorems over boxes of parameters, and their certificate.
#include <fmt/core.h>

#include <algorithm>

#include "cli/commands.hpp"
#include "cli/terminal.hpp"
#include "report/proofs.hpp"
#include "runtime/threads.hpp"
#include "study/problems.hpp"

namespace tiltrim::cli {

namespace {

// All conditions of a [model]; of the tiltrotor those of its closed loop, of a box over h, which
// sets their commands, the first.
std::vector<Condition> to_prove(const Study& study, const std::vector<std::string>& only) {
  if (!study.prove)
    throw StudyError(
        fmt::format("{}: no [prove] table; expected [[prove.parameter]], one or more, "
                    "with key, from and to, or percent",
                    study.file.string()));
  if (study.user_model) return chosen(study, only);
  if (study.vehicle.equations == Equations::printed)
    throw StudyError(
        fmt::format("{}: prove needs equations = \"consistent\"", study.file.string()));
  std::vector<Condition> conditions;
  for (const Condition& condition : chosen(study, only))
    if (condition.command()) conditions.push_back(condition);
  if (conditions.empty())
    throw StudyError(fmt::format("{}: prove needs a closed-loop condition", study.file.string()));
  const bool over_h =
      std::ranges::any_of(study.prove->parameters, [](const auto& p) { return p.key.name == "h"; });
  if (over_h) conditions.resize(1);
  return conditions;
}

}  // namespace

std::vector<Theorem> theorems(const Study& study, const ProveCommand& command,
                              const std::stop_token& stop, const ProofProgress& observe) {
  const std::vector<Condition> conditions = to_prove(study, command.common.only);
  ProveOptions options;
  options.margin = command.margin.value_or(study.prove->margin);
  options.damping = command.damping.value_or(study.prove->damping);
  options.max_boxes = command.boxes.value_or(study.prove->boxes);
  options.undecided = study.prove->undecided;
  options.stop = stop;
  std::vector<Theorem> all;
  options.observe = [&](double proved, std::size_t boxes) {
    observe(all.size(), conditions.size(), proved, boxes);
  };
  with_threads(command.threads, [&] {
    for (const Condition& condition : conditions)
      all.push_back(command.largest ? prove_largest_margin(prove_problem(study, condition), options)
                                    : prove(prove_problem(study, condition), options));
  });
  return all;
}

Outcome run(const ProveCommand& command, const TextStyle&, const std::stop_token& stop) {
  const Study study = read_study(command.common.study);
  Progress progress(to_prove(study, command.common.only).size());
  check_apart(command.certificate, "--certificate", command.common.study, "the study");
  if (study.user_model && !command.certificate.empty())
    throw std::invalid_argument(fmt::format("--certificate: {}", no_certificate));
  if (!command.certificate.empty()) check_writable(command.certificate);
  const std::vector<Theorem> all = theorems(
      study, command, stop, [&](std::size_t, std::size_t, double proved, std::size_t boxes) {
        progress.tell(fmt::format("{:.6f} of the volume proved, {} boxes", proved, boxes), proved);
      });
  if (!command.certificate.empty()) write_whole(command.certificate, certificate_of(study, all));
  const int code =
      std::ranges::all_of(all, [](const Theorem& t) { return t.status() == ProofStatus::proved; })
          ? answered
          : unanswered;
  if (command.common.format == Format::json)
    return {theorems_json(study, all, command.certificate.string()), code};
  if (command.common.format != Format::text)
    throw std::invalid_argument("prove writes text and json");
  return {theorems_text(study, all), code};
}

}  // namespace tiltrim::cli
