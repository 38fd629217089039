/// The closed loop's trim problem for continuation and sweeps, and the speed that chooses its axes.
#pragma once

#include "vehicles/tiltrotor/formulations.hpp"

namespace tiltrim {

/// Below this airspeed [m/s] problems are in body axes.
inline constexpr double body_axes_below = 0.5;

/// closed_loop_problem() for continuation and sweeps: in body axes if the slowest speed is below
/// body_axes_below, and without_integral_bounds(). Throws std::invalid_argument at rest.
TrimProblem closed_loop_along(const Vehicle& vehicle, const Command& command, double slowest);
/// Removes the bounds on the integrals, which hold only for one condition: its starts are spread
/// over them.
TrimProblem without_integral_bounds(TrimProblem problem);

}  // namespace tiltrim
