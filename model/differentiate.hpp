/// Derivatives of a model by central differences, each with an estimate of its error.
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "model/model.hpp"

namespace tiltrim {

/// A matrix and, entry by entry, an estimated bound of its error.
struct Estimate {
  Eigen::MatrixXd value, error;
};

struct Differences {
  Estimate jacobian;                ///< ∂[f; h]/∂variables, (nx + ny) rows
  std::vector<std::string> remarks; ///< kinks met and one-sided differences taken, in words
};

/// Central differences with the step ∛ε · nominal size, compared with those of twice the step; an
/// entry's error estimate is the truncation their difference shows and the round-off of the
/// evaluations. Where `bounds` (one per variable asked, or empty) or a kink leaves only one side,
/// differences to that side, of second order, and a remark.
Differences difference(const Model& model, const OperatingPoint& point,
                       const std::vector<Eigen::Index>& variables,
                       const std::vector<Range>& bounds = {});

/// The model's own derivatives where it has them, differences elsewhere. Error estimates either way:
/// of exact derivatives, the round-off of their evaluation.
Estimate derivatives(const Model& model, const OperatingPoint& point,
                     const std::vector<Eigen::Index>& variables);

}  // namespace tiltrim
