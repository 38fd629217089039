#include <fmt/core.h>

#include <algorithm>

#include "cli/commands.hpp"
#include "cli/matrix_file.hpp"
#include "cli/terminal.hpp"
#include "report/mode_sheets.hpp"
#include "vehicles/mode_names.hpp"

namespace tiltrim::cli {

using Eigen::Index;
using Eigen::MatrixXd;

namespace {

// The names given on the command line, or the file's, or x1, x2, ...
Signals states_of(const ModesCommand& command, const MatrixFile& file, const std::string& where) {
  const Index n = file.values.rows();
  std::vector<std::string> names = command.states.empty() ? file.states : command.states;
  const std::string from = command.states.empty() ? where : "--states";
  if (names.empty())
    for (Index i = 1; i <= n; ++i) names.push_back(fmt::format("x{}", i));
  if (Index(names.size()) != n)
    refuse(from, fmt::format("{} name{} of states", names.size(), names.size() == 1 ? "" : "s"),
           fmt::format("{}, one for each row", n));
  Signals states;
  for (const std::string& name : names) {
    if (name.empty()) refuse(from, "a state without a name", "a name for each");
    if (std::ranges::any_of(name, [](unsigned char c) { return c < 0x20 || c == 0x7F; }))
      refuse(from, "state " + in_quotes(name) + " has a control character", "printable text");
    if (find(states, name) >= 0) refuse(from, in_quotes(name) + " names two states", "each once");
    states.push_back({name, ""});
  }
  return states;
}

MatrixXd bounds_of(const ModesCommand& command, const MatrixFile& A) {
  if (command.error.empty()) return {};
  const MatrixFile E = read_matrix(command.error, command.variable.value_or("A") + "_error", true);
  const std::string where = command.error.string();
  if (E.values.rows() != A.values.rows())
    refuse(where, fmt::format("{0} x {0} bounds", E.values.rows()),
           fmt::format("{0} x {0}, as the matrix", A.values.rows()));
  if (!E.states.empty() && !A.states.empty() && E.states != A.states)
    refuse(where, "its states have other names", "the names of the matrix");
  return E.values;
}

}  // namespace

Outcome run(const ModesCommand& command, const TextStyle& style, const std::stop_token&) {
  const std::filesystem::path& file = command.common.study;
  if (file == "-" && command.error == "-")
    refuse("--error", "standard input is already the matrix", "a file");
  check_apart(command.common.output, "-o", command.error, "--error");
  if (file.extension() == ".toml") refuse(file.string(), "is a study", "a matrix; see linearize");
  const MatrixFile A = read_matrix(file, command.variable.value_or("A"));
  const std::string name = file == "-" ? "standard input" : file.string();
  if (command.variable && !A.named)
    refuse("--variable", name + " has one matrix, without a name", "a MAT-file or a JSON object");
  const Signals states = states_of(command, A, name);
  const Modes found = modes(A.values, bounds_of(command, A), names(states), aircraft_modes());
  const int code = found.verdict == Verdict::undecided ? unanswered : answered;
  return {in_format(
              command.common.format, [&] { return modes_json(found, states); },
              [&] { return as_csv(all_modes_sheet(found)); },
              [&] { return modes_text(name, found, states, style); },
              [&] { return std::vector{judged_modes_sheet(name, found, states)}; }),
          code};
}

}  // namespace tiltrim::cli
