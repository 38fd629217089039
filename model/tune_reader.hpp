/// [tune]: what is free, where it is to hold and what is asked.
/// Internal to model/.
#pragma once

#include <vector>

#include "model/section.hpp"
#include "model/study.hpp"

namespace tiltrim::reading {

/// Reads [tune]; uncertain numbers may be shares of the vehicle's. Throws StudyError.
TuneTable read_tune(const Section& section, const std::filesystem::path& file,
                    const Vehicle& vehicle, const std::vector<Condition>& conditions);

}  // namespace tiltrim::reading
