/// Global error of a motion, from a second run at a tenth of the tolerance. Internal to tiltrim.
#pragma once

#include "simulate/integrate.hpp"

namespace tiltrim {

/// True if a second run is requested and can give an estimate.
bool has_estimate(const IntegrateOptions& options, const Trajectory& found);

/// The options of the second run.
IntegrateOptions finer(IntegrateOptions options);

/// Largest difference of each state on the common samples. Where a state's difference exceeds a
/// tenth of its largest value `found` is truncated, with status `inaccurate`. NaN if the second run
/// was interrupted or reached a limit of steps or events.
Eigen::VectorXd with_error(const Signals& states, const Trajectory& second, Trajectory& found);

}  // namespace tiltrim
