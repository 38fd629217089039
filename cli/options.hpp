/// Each command's options on the command line. Internal to cli/.
#pragma once

#include "cli/commands.hpp"

namespace CLI {
class App;
}

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

}  // namespace tiltrim::cli
