/// [sweep] and its axes.
/// Internal to model/.
#pragma once

#include "model/section.hpp"
#include "model/study.hpp"

namespace tiltrim::reading {

/// Reads [sweep]; throws StudyError. Axes that move the tilt move scheduled gains with it.
SweepTable read_sweep(const Section& section, const std::filesystem::path& file,
                      const GainSchedule& schedule);

}  // namespace tiltrim::reading
