/// [model] of a study, and the conditions asked of it.
/// Internal to model/.
#pragma once

#include <memory>

#include "model/own_model.hpp"
#include "model/section.hpp"
#include "model/study.hpp"

namespace tiltrim::reading {

/// Reads [model]; throws StudyError.
OwnModel read_model(const Section& section);

/// Reads one [[condition]] of a study with [model]; throws StudyError.
Condition read_own_condition(const Entry& entry, const std::filesystem::path& file,
                             const std::shared_ptr<const OwnModel>& own);

}  // namespace tiltrim::reading
