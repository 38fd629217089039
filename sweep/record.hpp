/// Finished lines as bytes, for the log and for other ranks. Internal to sweep/.
#pragma once

#include "runtime/ranks.hpp"
#include "sweep/boundary.hpp"
#include "sweep/line.hpp"

namespace tiltrim {

Bytes as_bytes(const LinePoints& line);
Bytes as_bytes(const LineVerdicts& line);
/// Throws std::runtime_error for bytes that are no such line.
LinePoints points_from(const Bytes& bytes);
LineVerdicts verdicts_from(const Bytes& bytes);

}  // namespace tiltrim
