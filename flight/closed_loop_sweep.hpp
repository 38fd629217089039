/// @file
/// The tiltrotor's closed loop as it is swept.
#pragma once

#include <string>
#include <vector>

#include "sweep/sweep.hpp"
#include "vehicles/tiltrotor/vehicle.hpp"

namespace tiltrim {

/// The closed loop at a command, in axes that the slowest point of the grid can have. Throws
/// std::invalid_argument where an axis moves V and passes rest.
[[nodiscard]] SweepRequest closed_loop_request(const Vehicle& vehicle, const std::string& name,
                                               const Command& command,
                                               const std::vector<SweepAxis>& axes);

}  // namespace tiltrim
