/// Reads [model] of a study and its conditions. Internal to study/.
#pragma once

#include <memory>

#include "study/section.hpp"
#include "study/study.hpp"
#include "study/user_model.hpp"

namespace tiltrim::reading {

/// Reads [model]; throws StudyError.
UserModel read_model(const Section& section);

/// The vehicle that `vehicle` and `variant` at the top level of a study name; throws StudyError.
UserModel read_published(const Section& top, const std::filesystem::path& data);
/// Values and a start for what a condition of a published vehicle leaves out.
void complete_published(const Section& section, const UserModel& own, UserCondition& condition);

/// An angle has two keys, in rad and in degrees, unless the second name is already in use.
std::vector<Key> keys_for(const Model& model, const Signals& signals);
/// Those of its states, inputs and parameters.
std::vector<Key> keys_of(const Model& model);

/// Reads one [[condition]] of a study with [model]; throws StudyError.
Condition read_user_condition(const Entry& entry, const std::filesystem::path& file,
                              const std::shared_ptr<const UserModel>& own);

}  // namespace tiltrim::reading
