/// Axes of a grid over numbers of a study. Internal to study/ and cli/.
#pragma once

#include <vector>

#include "study/study.hpp"

namespace tiltrim {

/// `count` values from the first to the last, both exactly.
std::vector<double> spaced(double from, double to, std::size_t count, bool logarithmic = false);

/// A number of the study at these values, in its unit.
SweepAxis::Column column_of(const Key& key, const std::vector<double>& values);

/// To an axis whose own column is a height: what the corridor (16) sets at each, and between them.
void add_corridor(SweepAxis& axis);
/// To an axis that moves the tilt: the gains of the schedule there, and between.
void add_schedule(const GainSchedule& schedule, SweepAxis& axis);

/// The height along the corridor (16) [m], scheduled gains moving with it.
SweepAxis corridor_axis(const std::vector<double>& heights, const GainSchedule& schedule);
/// The key in studies for it.
Key height_key();

}  // namespace tiltrim
