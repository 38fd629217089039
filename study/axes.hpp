/// Axes of a grid over variables of a study. Internal to study/ and cli/.
#pragma once

#include <vector>

#include "study/study.hpp"
#include "vehicles/tiltrotor/corridor.hpp"

namespace tiltrim {

/// `count` values from the first to the last, both ends exact.
std::vector<double> spaced(double from, double to, std::size_t count, bool logarithmic = false);

/// A variable of the study at these values, in its unit.
SweepAxis::Column column_of(const Key& key, const std::vector<double>& values);

/// To an axis over height: adds the commands of the corridor (16) at each value and between.
void add_corridor(SweepAxis& axis);
/// To an axis over tilt: adds the scheduled gains at each value and between.
void add_schedule(const GainSchedule& schedule, SweepAxis& axis);

/// The height along the corridor (16) [m], with scheduled gains.
SweepAxis corridor_axis(const std::vector<double>& heights, const GainSchedule& schedule);
/// The key of height in studies.
Key height_key();

}  // namespace tiltrim
