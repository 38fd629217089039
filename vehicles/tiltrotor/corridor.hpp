/// What follows from the tilt: scheduled gains, the share of cyclic control; the corridor over
/// height.
#pragma once

#include <vector>

#include "vehicles/tiltrotor/vehicle.hpp"

namespace tiltrim {

/// Gains linear between their values at ascending tilts [rad], and constant beyond the ends.
struct GainSchedule {
  std::vector<double> eta;   ///< rad; empty: the gains do not depend on the tilt
  std::vector<Gains> gains;  ///< one set per tilt
};
/// The gains at a tilt; the schedule must not be empty.
Gains gains_at(const GainSchedule& schedule, double eta);

/// Cyclic's share of pitch control at a tilt: 1 helicopter, 0 airplane (12).
double authority(const Aircraft& aircraft, double eta);

/// m, of (16): from the first height on the aircraft accelerates; at the second the transition
/// ends.
inline constexpr double corridor_rises = 20.0, corridor_top = 120.0;
/// Corridor (16): tilt and path angle, and the speed schedule of docs/model.md, at height h [m].
Command corridor(double h);

}  // namespace tiltrim
