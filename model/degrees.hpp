/// Angles are radians inside and degrees where people read them. Internal to tiltrim.
#pragma once

#include <numbers>

namespace tiltrim {

inline constexpr double degrees = 180 / std::numbers::pi;  ///< in one radian

}  // namespace tiltrim
