/// @file
/// The tiltrotor's closed loop as a sweep request.
#pragma once

#include <string>
#include <vector>

#include "sweep/sweep.hpp"
#include "vehicles/tiltrotor/vehicle.hpp"

namespace tiltrim {

/// The closed loop at a command, in axes that are valid at the slowest grid point. Throws
/// std::invalid_argument if an axis varies V through zero.
[[nodiscard]] SweepRequest closed_loop_request(const Vehicle& vehicle, const std::string& name,
                                               const Command& command,
                                               const std::vector<SweepAxis>& axes);

}  // namespace tiltrim
