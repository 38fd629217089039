/// The lines and maps of a report: read from files or computed. Internal to cli/.
#pragma once

#include <filesystem>
#include <stop_token>

#include "cli/commands.hpp"
#include "report/study_report.hpp"

namespace tiltrim::cli {

/// The printed equations do not describe flight, and no gain stabilizes them: only their conditions
/// are reported.
bool has_closed_loop(const Study& study);

/// A map written by sweep. Throws std::runtime_error with what differs if it is not one of this
/// study.
StudyReport::Map map_in(const std::filesystem::path& file, const Study& study);

/// Computes what the report's maps leave open of those that its study asks for, or of the default.
void add_maps(const ReportCommand& command, const std::stop_token& stop, StudyReport& report);

}  // namespace tiltrim::cli
