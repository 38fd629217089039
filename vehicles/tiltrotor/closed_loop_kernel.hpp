/// The closed loop at several points at once: its kernel, compiled once for each instruction set.
/// Internal to vehicles/tiltrotor/.
#pragma once

#include <cstddef>

#include "model/model.hpp"
#include "runtime/instruction_set.hpp"

namespace tiltrim {

namespace physics {

/// The pieces of a Polar, each a row of numbers: four coefficients each of CL, CD and CM; where the
/// piece begins, in alpha and from the first knot.
struct PolarTable {
  static constexpr std::size_t width = 16, start = 12, offset = 13;
  const double* rows;
  std::size_t count;
  double first, per_radian;
};

}  // namespace physics

/// As Model::lanes, for the closed loop in wind axes.
struct WindLoopTask {
  const double* z;
  const Eigen::Index* variables;
  std::size_t count;
  double *values, *slopes;
  const physics::PolarTable* polar;
  bool printed;
};

template <InstructionSet>
void wind_loop(const WindLoopTask& task);

}  // namespace tiltrim
