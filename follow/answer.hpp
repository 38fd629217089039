/// A study's condition, followed along one of the study's numbers.
#pragma once

#include "follow/follow.hpp"
#include "model/keys.hpp"
#include "trim/answer.hpp"

namespace tiltrim {

struct BranchAnswer {
  Answer start;  ///< the condition trimmed, in the equations that are followed
  Key parameter;
  double to = 0.0;  ///< SI
  Branch branch;
  double from() const;  ///< the condition's own value, in the study's unit

  /// The branch ended by what the question or the flight mechanics say, not by the search.
  bool answered() const;
};

/// Trims the condition and follows its branch from the condition's own value of the parameter
/// towards `to` (SI). A closed loop whose speed is to fall below body_axes_below is followed in
/// body axes. Throws std::invalid_argument where the condition does not have the parameter, or has
/// no branch (formulation table).
[[nodiscard]] BranchAnswer follow(const Vehicle& vehicle, const Condition& condition,
                                  const Key& parameter, double to,
                                  const FollowOptions& options = {},
                                  const TrimOptions& trimming = {});

}  // namespace tiltrim
