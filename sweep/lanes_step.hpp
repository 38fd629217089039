/// Newton steps of several points at once, in SIMD lanes. Internal to sweep/.
#pragma once

#include <cstddef>

#include "runtime/instruction_set.hpp"

namespace tiltrim {

/// The `Model::model_lanes` points of Model::lanes: number i of point l is [i * lanes + l].
/// Marks are 1 or 0.
struct StepTask {
  static constexpr std::size_t largest = 16, lanes = 8, known = 4;
  std::size_t n;  ///< unknowns and equations, at most `largest`
  double *z, *values, *slopes;
  std::size_t n_values, n_slopes;

  const std::ptrdiff_t* unknowns;  ///< their places in z
  const double* nominal;
  const std::ptrdiff_t* equations;  ///< their places in values
  const double *held, *row_nominal;
  const std::ptrdiff_t* entries;  ///< places in slopes of the n x n derivatives of the equations
  const double* scales;           ///< from these to nominal sizes
  struct Range {
    const double* of;
    double lower, upper;
  };
  const Range* ranges;  ///< that an equilibrium keeps
  std::size_t n_ranges;
  double tolerance, step_tolerance, at_rest;  ///< of residuals and steps, in nominal sizes

  const double* history[known];              ///< unknowns at the points before, nearest first
  const double* weights[known];              ///< their shares of the prediction
  const double *last, *before_last, *share;  ///< Jacobians, and the share of their difference
  double* J;                                 ///< in use, in nominal sizes
  double *residual, *size, *before;  ///< largest |r| and |dz|, or NaN; |dz| of the last step
  double *walks, *moving, *found;    ///< marks
};

/// Unknowns and Jacobian from those of the points before, in the lanes that walk.
using PredictStep = void (*)(const StepTask& task);
/// A step with the Jacobian in use from `values` in the lanes that move, until the next is foreseen
/// to be at round-off; true while some move.
using ApproachStep = bool (*)(const StepTask& task, bool first);
/// The step with the exact Jacobian: `found` where it is at round-off, the residual within the
/// tolerances, every number finite and within its range. Otherwise it is taken, except the last
/// time; true while some move.
using VerifyStep = bool (*)(const StepTask& task, bool last);

struct LaneSteps {
  PredictStep predict;
  ApproachStep approach;
  VerifyStep verify;
};

template <InstructionSet>
LaneSteps lane_steps();

}  // namespace tiltrim
