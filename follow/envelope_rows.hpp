/// Rows of an envelope: where trims are along one of its axes. Internal to follow/.
#pragma once

#include "follow/border_pieces.hpp"

namespace tiltrim {

/// The intervals of x at one y (scaled) in which at least one sheet has a trim.
EnvelopeRow row_at(const Grid& grid, const std::vector<Followed>& border, double y);

}  // namespace tiltrim
