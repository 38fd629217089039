/// The tiltrotor's closed loop as a problem of prove().
#pragma once

#include "prove/prove.hpp"
#include "vehicles/tiltrotor/corridor.hpp"
#include "vehicles/tiltrotor/vehicle.hpp"

namespace tiltrim {

/// The closed loop in wind axes at a command, over parameters named as in the model, SI. "h" sets
/// the command of the corridor (16). A schedule that is not empty sets the gains by the tilt. Where
/// the bare airframe has no trim, neither has the loop.
[[nodiscard]] ProveProblem closed_loop_proof(const Vehicle& vehicle, const GainSchedule& schedule,
                                             const std::string& name, const Command& command,
                                             const std::vector<Uncertain>& parameters);

}  // namespace tiltrim
