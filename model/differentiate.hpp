/// Derivatives of a model, each with an estimate of its error.
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "model/model.hpp"

namespace tiltrim {

/// The result of difference().
struct Differences {
  Estimate jacobian;                 ///< ∂[f; h]/∂variables, (nx + ny) rows
  std::vector<std::string> remarks;  ///< kinks found and one-sided differences used, as text
};

/// Central differences with the step ∛ε · nominal size, compared with those at twice the step. The
/// error estimate of an entry is the difference of the two plus the round-off of the evaluations.
/// It is zero if the entry's function is constant, and infinite if three step sizes prove that the
/// differences do not converge. `bounds` has one range per requested variable, or is empty. At a
/// bound, a kink or the edge of the model's domain, second-order one-sided differences are used and
/// a remark is added. Throws CallerMistake if the bounds leave no room for a step.
Differences difference(const Model& model, const OperatingPoint& point,
                       const std::vector<Eigen::Index>& variables,
                       const std::vector<Range>& bounds = {});

/// The model's own derivatives; the error estimate is the round-off of their evaluation. Throws
/// std::invalid_argument if the model has no derivatives.
Estimate exact(const Model& model, const OperatingPoint& point,
               const std::vector<Eigen::Index>& variables);

/// exact() with errors no smaller than the distance to the exact derivatives at this point: a bound
/// where the model has jets and no kink there, else the estimate of exact(). Takes some ten times
/// as long. Throws as exact().
Estimate exact_bounded(const Model& model, const OperatingPoint& point,
                       const std::vector<Eigen::Index>& variables);

/// An entry at which a model's own derivative and a difference are farther apart than their errors.
struct Disagreement {
  Eigen::Index row = 0, column = 0;
  double apart = 0.0;
  std::string text;  ///< "dq'/dtheta: exact 1 and difference -1 disagree"
};

/// One of the two is wrong at each of these entries, or the model has a kink there. Error estimates
/// are approximate: ten times their sum passes.
std::vector<Disagreement> disagreements(const Model& model,
                                        const std::vector<Eigen::Index>& variables,
                                        const Estimate& exact, const Estimate& differences);

/// What the differences of jacobian() evaluate.
enum class Wanted { rates_and_outputs, rates };

/// For solvers: the model's own derivatives; plain central differences where they are not finite,
/// or if it has none. `exact` receives whether no difference was taken. Differences of the rates
/// alone do not call h; the rows of outputs are then zero.
Eigen::MatrixXd jacobian(const Model& model, const OperatingPoint& point,
                         const std::vector<Eigen::Index>& variables, bool* exact = nullptr,
                         Wanted wanted = Wanted::rates_and_outputs);

}  // namespace tiltrim
