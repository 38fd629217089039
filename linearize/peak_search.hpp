/// Margins with a given cap on their searches for peaks. Internal to linearize/.
#pragma once

#include "linearize/margins.hpp"

namespace tiltrim {

/// Levels of a search for a peak at most; two or three suffice.
inline constexpr int peak_levels = 30;

/// margins() with at most this many levels in each search for a peak.
[[nodiscard]] Margins margins(const LoopTransfer& loop, int max_levels);

}  // namespace tiltrim
