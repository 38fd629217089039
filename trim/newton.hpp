/// Newton's method on a trim problem. Internal to trim/.
#pragma once

#include "trim/problem.hpp"

namespace tiltrim {

struct NewtonResult {
  Eigen::VectorXd z;      ///< the iterate with the smallest residual
  double residual = 0.0;  ///< its largest scaled residual; infinite if never finite
  double step = 0.0;      ///< last full Newton step, largest component
  int iterations = 0;
};

/// Damped Newton from `start`, with minimum-norm steps if there are more unknowns than equations,
/// until the residual no longer decreases.
NewtonResult newton(const Problem& problem, const Eigen::VectorXd& start,
                    const TrimOptions& options);
/// The same from where `problem.memory` holds the values.
NewtonResult newton_from_here(const Problem& problem, const TrimOptions& options);

}  // namespace tiltrim
