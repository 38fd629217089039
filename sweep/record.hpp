/// Finished lines as bytes, for the log and for other ranks. Internal to sweep/.
#pragma once

#include "runtime/ranks.hpp"
#include "sweep/boundary.hpp"
#include "sweep/line.hpp"

namespace tiltrim {

Bytes as_bytes(const LinePoints& line);
Bytes as_bytes(const LineVerdicts& line);

/// What the lines of a sweep have in common.
struct LineSizes {
  std::size_t conditions, axes, points, states, inputs;
};
/// Throw std::runtime_error for bytes that are no line of this sweep: positions and enumerators are
/// in range, lists as long as they must be.
LinePoints points_from(const Bytes& bytes, const LineSizes& sizes);
LineVerdicts verdicts_from(const Bytes& bytes, const LineSizes& sizes);

}  // namespace tiltrim
