/// Global error of a motion, from a second run at a tenth of the tolerance. Internal to tiltrim.
#pragma once

#include <functional>

#include "simulate/integrate.hpp"

namespace tiltrim {

/// The same motion again, to an end time, with other options.
using RunAgain = std::function<Trajectory(double to, const IntegrateOptions&)>;

/// Estimates the error of each state: its largest difference on the common samples of the two runs,
/// times the share by which it is less than the error. NaN if no second run is requested, or it did
/// not reach the last sample. A motion that was completed is truncated, with status `inaccurate`,
/// where a state's error exceeds a tenth of its largest value.
Eigen::VectorXd with_error(const Signals& states, const IntegrateOptions& options,
                           const RunAgain& again, Trajectory& found);

/// The breaks of the same motion again. If it is sampled at its steps, those of the first run are
/// breaks too, so that both have samples there; events are located by each run itself.
std::vector<double> breaks_again(const Trajectory& run, const IntegrateOptions& options,
                                 std::vector<double> breaks);

}  // namespace tiltrim
