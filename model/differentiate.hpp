/// @file
/// Derivatives of a model, each with an estimate of its error.
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "model/model.hpp"

namespace tiltrim {

/// A matrix and, entry by entry, an estimated bound of its error.
struct Estimate {
  Eigen::MatrixXd value, error;  ///< of the same size; no error below zero
};

/// What difference() answers.
struct Differences {
  Estimate jacobian;                 ///< ∂[f; h]/∂variables, (nx + ny) rows
  std::vector<std::string> remarks;  ///< kinks met and one-sided differences taken, in words
};

/// Central differences with the step ∛ε · nominal size, compared with those of twice the step. An
/// entry's error estimate is the difference of the two and the round-off of the evaluations; it is
/// zero where the entry's function does not move at all, and infinite where three steps show that
/// the differences do not settle. Where `bounds` (one per variable asked, or empty), a kink or the
/// edge of the model's domain leaves one side, second-order differences to that side, and a remark.
/// Throws CallerMistake if bounds leave no room for a step.
Differences difference(const Model& model, const OperatingPoint& point,
                       const std::vector<Eigen::Index>& variables,
                       const std::vector<Range>& bounds = {});

/// The model's own derivatives, their error estimated as the round-off of their evaluation. Throws
/// std::invalid_argument if the model has none.
Estimate exact(const Model& model, const OperatingPoint& point,
               const std::vector<Eigen::Index>& variables);

/// For solvers: the model's own derivatives where it has them, else plain central differences.
Eigen::MatrixXd jacobian(const Model& model, const OperatingPoint& point,
                         const std::vector<Eigen::Index>& variables);

}  // namespace tiltrim
