// prove: theorems over the box of a study, by the program's own functions.
#include <fmt/core.h>
#include <pybind11/stl.h>

#include <optional>
#include <string>
#include <vector>

#include "cli/commands.hpp"
#include "python/src/calls.hpp"
#include "python/src/studies.hpp"
#include "python/src/verbs.hpp"
#include "report/proofs.hpp"

namespace tiltrim::python {

namespace {

// Theorems as JSON, and the certificate of each.
py::tuple proved(const HeldStudy& held, const std::vector<std::string>& only,
                 std::optional<double> margin, std::optional<double> damping,
                 std::optional<std::size_t> boxes, int threads, const py::object& listener) {
  refuse_within_callable("prove", no_ipopt);
  cli::ProveCommand command;
  command.common.only = only;
  command.margin = margin;
  command.damping = damping;
  command.boxes = boxes;
  command.threads = threads;
  Progress progress(listener);
  const auto observe = [&](std::size_t done, std::size_t of, double share, std::size_t count) {
    constexpr double percent = 100.0;
    if (progress)
      progress.tell(std::size_t(percent * (double(done) + share)), 100 * of,
                    fmt::format("% of the volume proved, {} boxes", count));
  };
  const std::vector<Theorem> all = run(
                                       false,
                                       [&](const std::stop_token& stop) {
                                         return cli::theorems(*held.study, command, stop, observe);
                                       },
                                       Lasts::any_time, &progress)
                                       .first;
  std::vector<std::string> certificates;
  for (const Theorem& t : all) certificates.push_back(certificate_of(*held.study, {t}));
  return py::make_tuple(theorems_json(*held.study, all, ""), certificates);
}

}  // namespace

void add_proving(py::module_& module) {
  using py::arg;
  module.def("prove", &proved, arg("study"), arg("only"), arg("margin"), arg("damping"),
             arg("boxes"), arg("threads"), arg("progress"));
}

}  // namespace tiltrim::python
