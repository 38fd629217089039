/// Implicit integration of stiff motions. Internal to simulate/.
#pragma once

#include <Eigen/Core>
#include <functional>
#include <vector>

#include "simulate/integrate.hpp"

namespace tiltrim {

/// ∂rates/∂states at a time and state.
using RateSlopes = std::function<Eigen::MatrixXd(double t, const double* x)>;

/// Same as integrate(), by a Rosenbrock method of order 4 with its dense output; the step size is
/// set by accuracy, not by the fastest decay.                                   [70, sec. IV.7]
/// Events are located on the dense output and change nothing; events that end the motion or change
/// the state are not supported.
Trajectory integrate_stiff(const Motion& motion, const RateSlopes& slopes,
                           const std::vector<double>& x0, double from, double to,
                           const IntegrateOptions& options);

}  // namespace tiltrim
