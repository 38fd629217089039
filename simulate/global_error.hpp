/// How far a motion may be off, by a second run at a tenth of the tolerance. Internal to tiltrim.
#pragma once

#include "simulate/integrate.hpp"

namespace tiltrim {

/// Whether a second run is asked for and can tell anything.
bool has_estimate(const IntegrateOptions& options, const Trajectory& found);

/// The options of the second run.
IntegrateOptions finer(IntegrateOptions options);

/// Largest difference of each state on the samples that both share. Where a state's exceeds a tenth
/// of its largest value `found` is cut there, and ends `inaccurate`. No numbers where the second
/// run was interrupted.
Eigen::VectorXd with_error(const Signals& states, const Trajectory& second, Trajectory& found);

}  // namespace tiltrim
