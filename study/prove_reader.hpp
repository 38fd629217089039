/// Reads [prove]. Internal to study/.
#pragma once

#include "study/section.hpp"
#include "study/study.hpp"

namespace tiltrim::reading {

/// Reads [prove]; throws StudyError. Shares in percent are of the vehicle's own numbers.
ProveTable read_prove(const Section& section, const Vehicle& vehicle);
/// The same of a study with [model]; shares in percent are of the model's parameters.
ProveTable read_user_prove(const Section& section, const UserModel& own,
                           const std::vector<Condition>& conditions);

}  // namespace tiltrim::reading
