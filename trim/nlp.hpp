/// The optimization problems of a trim, for Ipopt. Internal to trim/.
#pragma once

#include "trim/ipopt.hpp"
#include "trim/problem.hpp"

namespace tiltrim {

/// Minimizes the cost (zero if the equations determine the trim) with residual = 0 and the limits.
Nlp trim_nlp(const Problem& problem);
/// Minimizes ½‖residual‖² within the limits: the closest point if no equilibrium is found.
Nlp closest_nlp(const Problem& problem);
/// By how much each limited output is above its upper limit or, negative, below its lower one;
/// scaled.
Eigen::VectorXd beyond_limits(const Problem& problem, const Values& values);
/// Minimizes ½‖excess of the limited outputs‖² within the bounds of the unknowns: the closest point
/// to limits that cannot be met together.
Nlp least_excess_nlp(const Problem& problem);

/// Ipopt's last point from `start`, which is first moved into the bounds.
Eigen::VectorXd run_ipopt(const Problem& problem, Nlp nlp, const Eigen::VectorXd& start,
                          const TrimOptions& options);

}  // namespace tiltrim
