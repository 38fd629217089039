/// Angles are in radians internally and in degrees for input and output; speeds in m/s. Internal to
/// tiltrim.
#pragma once

#include <numbers>

namespace tiltrim {

inline constexpr double degrees = 180 / std::numbers::pi;  ///< per radian
inline constexpr double kt = 0.514444;                     ///< m/s

}  // namespace tiltrim
