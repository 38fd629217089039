/// Several lines of the grid walked forward at once, in SIMD lanes. Internal to sweep/.
#pragma once

#include <functional>
#include <vector>

#include "sweep/line_modes.hpp"

namespace tiltrim {

/// True if the model evaluates points in lanes and this trim is one that lanes can solve: as many
/// equations as unknowns, no more than a lane's matrix takes, all of them states or inputs.
bool has_lanes(const Prepared& sweep);

/// The trims at all points of up to `Model::model_lanes` lines of one condition. `alone(l, k)`
/// finds and stores that of point k of line l by the scalar path: at the first point, after a point
/// without equilibrium, and wherever a lane fails. What is found for a line does not depend on the
/// others.
void walk_side_by_side(const std::vector<LineTracker*>& lines,
                       const std::function<GridTrim(std::size_t l, std::size_t k)>& alone);

}  // namespace tiltrim
