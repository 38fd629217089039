/// Reads the flight conditions of a study. Internal to study/.
#pragma once

#include <vector>

#include "study/study.hpp"
#include "study/toml_reader.hpp"

namespace tiltrim::reading {

/// Reads and checks the [[condition]] tables of a study; throws StudyError.
std::vector<Condition> read_conditions(const Entry& root, const std::filesystem::path& file,
                                       Equations equations,
                                       const std::shared_ptr<const UserModel>& own);

/// The keys of a condition that are variables of the models.
std::vector<Key> condition_keys();

}  // namespace tiltrim::reading
