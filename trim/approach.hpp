/// The equations alone, solved with few evaluations. Internal to trim/.
#pragma once

#include <optional>

#include "trim/newton.hpp"

namespace tiltrim {

/// The problem without limits and effort, which only a verdict needs: outputs are evaluated only
/// where an equation holds one. The whole problem if it notes the nearest point.
Problem equations_of(const Problem& problem);

/// A root of the equations from z, or none: Newton with slopes that are differentiated by one
/// evaluation for each unknown and then updated by rank one while the steps converge; where
/// differentiated slopes do not help three times in a row, it gives up. newton() then ends at the
/// root, and leaves its slopes and counts in the memory of the problem.
std::optional<Eigen::VectorXd> few_evaluations(const Problem& problem, const Problem& equations,
                                               Eigen::VectorXd z, const TrimOptions& options);

}  // namespace tiltrim
