/// Motions that are stiff: an implicit method. Internal to simulate/.
#pragma once

#include <Eigen/Core>
#include <functional>
#include <vector>

#include "simulate/integrate.hpp"

namespace tiltrim {

/// ∂rates/∂states at a time and state.
using RateSlopes = std::function<Eigen::MatrixXd(double t, const double* x)>;

/// As integrate(), by Rosenbrock's method of order 4 with its dense output, whose steps are as long
/// as the motion allows and not as its fastest decay does.                      [70, sec. IV.7]
/// Events change nothing but are located on the dense output; those that end or move are not for
/// it.
Trajectory integrate_stiff(const Motion& motion, const RateSlopes& slopes,
                           const std::vector<double>& x0, double from, double to,
                           const IntegrateOptions& options);

}  // namespace tiltrim
