/// Newton steps of several points at once, in SIMD lanes. Internal to sweep/.
#pragma once

#include <cstddef>

#include "runtime/instruction_set.hpp"

namespace tiltrim {

/// Solves J dz = -r for the `Model::model_lanes` points of Model::lanes, with r the `rows` of
/// `values` less what is `held`, in nominal sizes. Entry (i, k) of point l is
/// J[(i n + k) Model::model_lanes + l].
struct StepTask {
  static constexpr std::size_t largest = 16, lanes = 8;
  std::size_t n;               ///< at most `largest`
  const std::ptrdiff_t* rows;  ///< of each equation
  const double *values, *held, *nominal;
  const double* J;
  double* dz;
  double *residual, *size;  ///< largest |r| and |dz|, or NaN
  double* regular;          ///< 1 where no pivot is too small, otherwise 0
};

template <InstructionSet>
void newton_step(const StepTask& task);

}  // namespace tiltrim
