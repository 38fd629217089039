/// Newton steps of several points at once, in SIMD lanes. Internal to sweep/.
#pragma once

#include <cstddef>

#include "runtime/instruction_set.hpp"

namespace tiltrim {

/// Solves J dz = -r for the `Model::model_lanes` points of Model::lanes: entry (i, k) of point l is
/// J[(i n + k) Model::model_lanes + l]. `regular` is 1 where no pivot is too small, otherwise 0.
struct StepTask {
  static constexpr std::size_t largest = 16, lanes = 8;
  std::size_t n;  ///< at most `largest`
  const double *J, *r;
  double *dz, *regular;
};

template <InstructionSet>
void newton_step(const StepTask& task);

}  // namespace tiltrim
