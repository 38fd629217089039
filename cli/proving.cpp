// tiltrim prove: theorems over boxes of parameters, and their certificate.
#include <fmt/core.h>

#include <algorithm>
#include <filesystem>
#include <memory>
#include <stdexcept>

#include "cli/commands.hpp"
#include "cli/terminal.hpp"
#include "report/proofs.hpp"
#include "runtime/log.hpp"
#include "runtime/threads.hpp"
#include "runtime/whole_file.hpp"
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
  std::vector<Condition> conditions = chosen(study, only);
  for (const Condition& condition : conditions)
    if (!condition.command())
      throw error_in(condition, "prove needs the closed loop; expected formulation closed_loop");
  const bool over_h =
      std::ranges::any_of(study.prove->parameters, [](const auto& p) { return p.key.name == "h"; });
  if (over_h) conditions.resize(1);
  return conditions;
}

double margin_of(const Study& study, const ProveCommand& command) {
  return command.margin.value_or(study.prove->margin);
}
double damping_of(const Study& study, const ProveCommand& command) {
  return command.damping.value_or(study.prove->damping);
}
std::size_t boxes_of(const Study& study, const ProveCommand& command) {
  return command.boxes.value_or(study.prove->boxes);
}

}  // namespace

std::vector<Theorem> theorems(const Study& study, const ProveCommand& command,
                              const std::stop_token& stop, const ProofProgress& observe, Log* log) {
  const std::vector<Condition> conditions = to_prove(study, command.common.only);
  ProveOptions options;
  options.margin = margin_of(study, command);
  options.damping = damping_of(study, command);
  options.max_boxes = boxes_of(study, command);
  options.undecided = study.prove->undecided;
  options.stop = stop;
  options.log = log;
  std::vector<Theorem> all;
  options.observe = [&](double proved, std::size_t boxes) {
    observe(all.size(), conditions.size(), proved, boxes);
  };
  with_threads(command.threads, [&] {
    for (const Condition& condition : conditions) {
      options.log_part = all.size();
      const ProveProblem problem = prove_problem(study, condition);
      try {
        all.push_back(command.largest ? prove_largest_margin(problem, options)
                                      : prove(problem, options));
      } catch (const std::invalid_argument& e) {
        throw error_in(condition, e.what());
      }
    }
  });
  return all;
}

namespace {

std::string in_its_format(const Study& study, const ProveCommand& command,
                          const std::vector<Theorem>& all) {
  if (command.common.format == Format::json)
    return theorems_json(study, all, command.certificate.string());
  return theorems_text(study, all);
}

std::unique_ptr<Log> opened(const Study& study, const ProveCommand& command) {
  if (command.log.empty()) return {};
  check_apart(command.log, "--log", command.certificate, "the certificate");
  auto log =
      std::make_unique<Log>(filing::target_of(command.log),
                            identity_of(study, to_prove(study, command.common.only)) +
                                fmt::format("\nprove: margin {:a}, damping {:a}",
                                            margin_of(study, command), damping_of(study, command)));
  if (!log->recovered().empty())
    fmt::print(stderr, "tiltrim: resumed from {}: its boxes are not examined again\n",
               command.log.string());
  return log;
}

void check_format(const Common& common) {
  if (common.format == Format::json || common.format == Format::text) return;
  throw std::invalid_argument(
      fmt::format("-o {}: prove writes text and json; expected .txt or .json, or --format",
                  common.output.string()));
}

// Whether more boxes would change nothing.
bool at_its_end(const Study& study, const ProveCommand& command, const Theorem& t) {
  return !t.interrupted &&
         (t.boxes < boxes_of(study, command) || t.undecided <= study.prove->undecided);
}

}  // namespace

Outcome run(const ProveCommand& command, const TextStyle&, const std::stop_token& stop) {
  check_format(command.common);
  const Study study =
      read_study(command.common, {{command.certificate, "--certificate"}, {command.log, "--log"}});
  Progress progress(to_prove(study, command.common.only).size());
  if (study.user_model && !command.certificate.empty())
    throw std::invalid_argument(fmt::format("--certificate: {}", no_certificate));
  if (!command.certificate.empty()) check_writable(command.certificate);
  const std::unique_ptr<Log> log = opened(study, command);
  const std::vector<Theorem> all = theorems(
      study, command, stop,
      [&](std::size_t, std::size_t, double proved, std::size_t boxes) {
        progress.tell(fmt::format("{:.6f} of the volume proved, {} boxes", proved, boxes), proved);
      },
      log.get());
  if (!command.certificate.empty()) write_whole(command.certificate, certificate_of(study, all));
  const int code =
      std::ranges::all_of(all, [](const Theorem& t) { return t.status() == ProofStatus::proved; })
          ? answered
          : unanswered;
  const std::string text = in_its_format(study, command, all);
  if (!log) return {text, code};
  // The log is removed only after the result is saved.
  if (command.common.output.empty())
    print_whole(text);
  else
    write_whole(command.common.output, text);
  if (std::ranges::all_of(all, [&](const Theorem& t) { return at_its_end(study, command, t); }))
    log->remove();
  else
    fmt::print(stderr,
               "tiltrim: the examined boxes are in {}: the same command continues from there, with "
               "more --boxes too\n",
               command.log.string());
  return {"", code, true};
}

}  // namespace tiltrim::cli
