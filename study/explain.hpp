/// @file
/// Why a flight condition has no equilibrium, in the words of flight mechanics.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "study/answer.hpp"
#include "trim/diagnosis.hpp"

namespace tiltrim {

/// Vertical forces on the aircraft [N], up positive.
struct VerticalForces {
  double thrust, wing, weight;  ///< N; weight is positive
};

/// Why a condition has no equilibrium.
struct Explanation {
  Model airframe;  ///< asked whether any inputs within the limits could hold the condition
  /// Absent where the airframe alone has an equilibrium: then it is the control law that has none.
  std::optional<Diagnosis> diagnosis;
  std::vector<std::string> words;  ///< one finding each, the most telling first
};

/// Explains a trim of the condition that found no equilibrium: forces, the limits and equations in
/// conflict, what each would have to give alone, the nearest V, gamma and eta that can be flown.
/// Nothing for formulation table.
[[nodiscard]] std::optional<Explanation> explain(const Vehicle& vehicle, const Condition& condition,
                                                 const TrimOptions& options = {});

}  // namespace tiltrim
