/// Command-line options of each command. Internal to cli/.
#pragma once

#include <string>
#include <vector>

#include "cli/commands.hpp"

namespace CLI {
class App;
class Option;
}  // namespace CLI

namespace tiltrim::cli {

/// Options that several commands have.
void add_output(CLI::App* app, Common& common);  ///< --format of every format, and -o FILE
void add_output_file(CLI::App* app, Common& common, const std::string& type,
                     const std::string& help);  ///< -o alone
/// --format of some formats only.
void add_formats(CLI::App* app, Common& common, const std::vector<std::string>& some,
                 const std::string& help);
void add_study(CLI::App* app, Common& common, bool needed);
void add_common(CLI::App* app, Common& common, bool needs_study);
void add_only(CLI::App* app, Common& common);
void add_threads(CLI::App* app, int& threads);

/// Adds the command; its options are stored in `command`.
CLI::App* add_trim(CLI::App& app, TrimCommand& command);
CLI::App* add_linearize(CLI::App& app, LinearizeCommand& command);
CLI::App* add_modes(CLI::App& app, ModesCommand& command);
CLI::App* add_follow(CLI::App& app, FollowCommand& command);
CLI::App* add_envelope(CLI::App& app, EnvelopeCommand& command);
CLI::App* add_sensitivities(CLI::App& app, SensitivitiesCommand& command);
CLI::App* add_margins(CLI::App& app, MarginsCommand& command);
CLI::App* add_qualities(CLI::App& app, QualitiesCommand& command);
CLI::App* add_loads(CLI::App& app, LoadsCommand& command);
CLI::App* add_validate(CLI::App& app, ValidateCommand& command);
CLI::App* add_check_proof(CLI::App& app, CheckProofCommand& command);
CLI::App* add_sweep(CLI::App& app, SweepCommand& command);
CLI::App* add_merge(CLI::App& app, MergeCommand& command);
CLI::App* add_prove(CLI::App& app, ProveCommand& command);
CLI::App* add_tune(CLI::App& app, TuneCommand& command);
CLI::App* add_simulate(CLI::App& app, SimulateCommand& command);
CLI::App* add_report(CLI::App& app, ReportCommand& command);
CLI::App* add_diff(CLI::App& app, DiffCommand& command);
CLI::App* add_tables(CLI::App& app, TablesCommand& command);

/// An example command line and its result, for --help, the command's help and the manual.
struct Example {
  std::string command, line, answers;
};
const std::vector<Example>& examples();
/// The examples of one command, or all for an empty name, as --help prints them.
std::string examples_text(const std::string& command);

/// Without --format the ending of the output decides: .json, .csv, .md, .tex, .txt, or that of the
/// command's own files, `own`. Throws std::invalid_argument if the two contradict each other, or
/// the ending is that of another kind of file.
void settle_format(Common& common, const std::string& own = "");

/// "-f", "--format"
std::vector<std::string> flags(const CLI::Option& option);
bool takes_value(const CLI::Option& option);        ///< false for a switch
std::string value_name(const CLI::Option& option);  ///< "FILE"

/// The script that completes commands, options and their values in "bash", "zsh" or "fish".
std::string completion_script(const CLI::App& app, const std::string& shell);
/// The manual page of a command in roff, or of the program for an empty name.
std::string manual_page(const CLI::App& app, const std::string& command);

}  // namespace tiltrim::cli
