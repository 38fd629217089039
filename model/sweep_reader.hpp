/// [sweep] and its axes, and the grids of [report].
/// Internal to model/.
#pragma once

#include "model/section.hpp"
#include "model/study.hpp"

namespace tiltrim::reading {

/// Reads [sweep]; throws StudyError. Axes that move the tilt move scheduled gains with it.
SweepTable read_sweep(const Section& section, const std::filesystem::path& file,
                      const GainSchedule& schedule);

/// Reads [report] of a study whose conditions are read; throws StudyError. A grid has one axis or
/// two.
ReportTable read_report(const Section& section, const std::filesystem::path& file,
                        const GainSchedule& schedule, const std::vector<Condition>& conditions);

}  // namespace tiltrim::reading
