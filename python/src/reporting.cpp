// report: a study's page, by the program's own command.
#include <filesystem>

#include "cli/commands.hpp"
#include "python/src/calls.hpp"
#include "python/src/studies.hpp"
#include "python/src/verbs.hpp"

namespace tiltrim::python {

namespace {

py::tuple reported(const HeldStudy& held, const std::string& file,
                   const std::vector<std::string>& only, const std::vector<std::string>& maps,
                   const std::string& figures, const std::string& tables, int threads) {
  refuse_within_callable("report", "trim with method='newton' and closest=False");
  cli::ReportCommand command;
  command.common.study = held.study->file;
  command.common.output = file;
  command.common.only = only;
  command.sweeps.assign(maps.begin(), maps.end());
  command.figures = figures;
  command.tables = tables;
  command.threads = threads;
  const auto work = [&](const std::stop_token& stop) {
    cli::check_apart(command.common.output, "the page", command.common.study, "the study");
    cli::check_writable(command.common.output);
    return cli::reported(*held.study, command, unwrapped, stop);
  };
  const cli::Outcome outcome = run(false, work).first;
  return py::make_tuple(outcome.output, outcome.exit_code == cli::answered);
}

}  // namespace

void add_report(py::module_& module) {
  using py::arg;
  module.def("report", &reported, arg("study"), arg("file"), arg("only"), arg("maps"),
             arg("figures"), arg("tables"), arg("threads"));
}

}  // namespace tiltrim::python
