/// The closed loop at several points at once: its kernel, compiled once for each instruction set.
/// Internal to vehicles/tiltrotor/.
#pragma once

#include <cstddef>

#include "model/model.hpp"

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

namespace lanes_scalar {
void wind_loop(const WindLoopTask& task);
}
namespace lanes_baseline {
void wind_loop(const WindLoopTask& task);
}
#ifdef TILTRIM_X86
namespace lanes_avx2 {
void wind_loop(const WindLoopTask& task);
}
namespace lanes_avx512 {
void wind_loop(const WindLoopTask& task);
}
#else  // never selected there
namespace lanes_avx2 = lanes_baseline;
namespace lanes_avx512 = lanes_baseline;
#endif

}  // namespace tiltrim
