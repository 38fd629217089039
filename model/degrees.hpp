/// Angles are in radians internally and in degrees for input and output. Internal to tiltrim.
#pragma once

#include <numbers>

namespace tiltrim {

inline constexpr double degrees = 180 / std::numbers::pi;  ///< per radian

}  // namespace tiltrim
