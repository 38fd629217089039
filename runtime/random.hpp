/// Random numbers that are identical with every standard library. Internal to tiltrim.
#pragma once

#include <random>

namespace tiltrim {

/// Uniform in [0, 1), from the top 53 bits.
inline double uniform(std::mt19937_64& random) { return double(random() >> 11) * 0x1.0p-53; }

}  // namespace tiltrim
