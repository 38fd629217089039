/// Each command's options on the command line. Internal to cli/.
#pragma once

#include <string>
#include <vector>

#include "cli/commands.hpp"

namespace CLI {
class App;
class Option;
}  // namespace CLI

namespace tiltrim::cli {

/// Adds the command, whose options are read into `command`.
CLI::App* add_trim(CLI::App& app, TrimCommand& command);
CLI::App* add_linearize(CLI::App& app, LinearizeCommand& command);
CLI::App* add_modes(CLI::App& app, ModesCommand& command);
CLI::App* add_follow(CLI::App& app, FollowCommand& command);
CLI::App* add_envelope(CLI::App& app, EnvelopeCommand& command);
CLI::App* add_sensitivities(CLI::App& app, SensitivitiesCommand& command);
CLI::App* add_margins(CLI::App& app, MarginsCommand& command);
CLI::App* add_sweep(CLI::App& app, SweepCommand& command);
CLI::App* add_tune(CLI::App& app, TuneCommand& command);
CLI::App* add_simulate(CLI::App& app, SimulateCommand& command);
CLI::App* add_report(CLI::App& app, ReportCommand& command);
CLI::App* add_diff(CLI::App& app, DiffCommand& command);
CLI::App* add_tables(CLI::App& app, TablesCommand& command);

/// A command line to try, and what it answers: in --help, in the command's own and in the manual.
struct Example {
  std::string command, line, answers;
};
const std::vector<Example>& examples();
/// Those of one command, or all for an empty name, as --help prints them.
std::string examples_text(const std::string& command);

/// Without --format the ending of the output decides: .json, .csv, .md, .tex, .txt. Throws
/// std::invalid_argument where both are given and differ.
void settle_format(Common& common);

/// "-f", "--format"
std::vector<std::string> flags(const CLI::Option& option);
bool takes_value(const CLI::Option& option);        ///< not a switch
std::string value_name(const CLI::Option& option);  ///< "FILE"

/// The script that completes commands, options and their values in "bash", "zsh" or "fish".
std::string completion_script(const CLI::App& app, const std::string& shell);
/// The manual page of a command in roff, or of the program for an empty name.
std::string manual_page(const CLI::App& app, const std::string& command);

}  // namespace tiltrim::cli
