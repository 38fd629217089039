/// Reads [model] of a study and its conditions. Internal to study/.
#pragma once

#include <memory>

#include "study/section.hpp"
#include "study/study.hpp"
#include "study/user_model.hpp"

namespace tiltrim::reading {

/// Reads [model]; throws StudyError.
UserModel read_model(const Section& section);

/// Reads one [[condition]] of a study with [model]; throws StudyError.
Condition read_user_condition(const Entry& entry, const std::filesystem::path& file,
                              const std::shared_ptr<const UserModel>& own);

}  // namespace tiltrim::reading
