/// @file
/// A study's conditions as they are swept.
#pragma once

#include "study/study.hpp"
#include "sweep/sweep.hpp"

namespace tiltrim {

/// The study's conditions as requests. Throws std::invalid_argument, naming the condition, where
/// one cannot be swept: formulation table, or a number that it does not have.
[[nodiscard]] std::vector<SweepRequest> sweep_requests(const Study& study,
                                                       const std::vector<Condition>& conditions,
                                                       const std::vector<SweepAxis>& axes);

}  // namespace tiltrim
