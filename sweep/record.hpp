/// Serialization of finished lines, for the log and for other ranks. Internal to sweep/.
#pragma once

#include "runtime/ranks.hpp"
#include "sweep/boundary.hpp"
#include "sweep/line.hpp"

namespace tiltrim {

/// Verdicts of consecutive lines, as in VerdictMap.
struct VerdictLines {
  std::vector<std::uint8_t> runs;
  std::vector<std::int8_t> located;
  std::vector<AxisCrossing> borders;
};

Bytes as_bytes(const LinePoints& line);
Bytes as_bytes(const LineVerdicts& line);
Bytes as_bytes(const VerdictLines& lines);

/// The sizes common to all lines of a sweep.
struct LineSizes {
  std::size_t conditions, axes, points, states, inputs;
};
/// Throw std::runtime_error for bytes that are not a line of this sweep: indices and enumerators
/// must be in range, and lists have the required length.
LinePoints points_from(const Bytes& bytes, const LineSizes& sizes);
LineVerdicts verdicts_from(const Bytes& bytes, const LineSizes& sizes);
VerdictLines verdict_lines_from(const Bytes& bytes, const LineSizes& sizes);

}  // namespace tiltrim
