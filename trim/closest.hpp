/// The closest point where no equilibrium is found: least squares within limits. Internal to trim/.
#pragma once

#include "trim/problem.hpp"

namespace tiltrim {

/// Where ½‖residual‖² is least within the limits, from `start`.
Eigen::VectorXd closest_from(const Problem& problem, const Eigen::VectorXd& start,
                             const TrimOptions& options);
/// Where ½‖excess of the limited outputs‖² is least within the bounds of the unknowns: the closest
/// point to limits that cannot be met together.
Eigen::VectorXd least_excess_from(const Problem& problem, const Eigen::VectorXd& start,
                                  const TrimOptions& options);

}  // namespace tiltrim
