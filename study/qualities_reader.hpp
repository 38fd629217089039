/// Reads [qualities] of a study. Internal to study/.
#pragma once

#include <vector>

#include "study/section.hpp"
#include "study/study.hpp"

namespace tiltrim::reading {

/// `model`: of a study with [model] or a published vehicle, whose signals the roles name; null: the
/// tiltrotor, whose signals differ by formulation.
QualitiesTable read_qualities(const Section& section, const Model* model,
                              const std::vector<Condition>& conditions);

}  // namespace tiltrim::reading
