/// Reads [prove]. Internal to study/.
#pragma once

#include "study/section.hpp"
#include "study/study.hpp"

namespace tiltrim::reading {

/// Reads [prove]; throws StudyError. Shares in percent are of the vehicle's own numbers.
ProveTable read_prove(const Section& section, const Vehicle& vehicle);

}  // namespace tiltrim::reading
