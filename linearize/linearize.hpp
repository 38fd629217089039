/// @file
/// Linearization: x' = A δx + B δu, y = C δx + D δu at an operating point, with error bounds.
#pragma once

#include <limits>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "model/differentiate.hpp"
#include "model/model.hpp"
#include "model/time_limit.hpp"

namespace tiltrim {

/// How a linearization ended.
enum class LinearizeStatus {
  linear,           ///< at an equilibrium
  not_equilibrium,  ///< the rates left over exceed the tolerance: nothing is linearized
  not_finite,       ///< a rate, an output or a derivative is not finite
  model_threw,      ///< the model threw an exception; its words are in the message
  not_repeatable,   ///< the model gives two answers at one point
  time_limit,       ///< the time allowed was over
};
std::string to_string(LinearizeStatus status);  ///< as JSON spells it

/// Where derivatives come from.
enum class Method {
  exact,        ///< the model's own derivatives where it has them, differences elsewhere
  differences,  ///< central differences, whatever the model has
};

/// How linearize() goes about it.
struct LinearizeOptions {
  Method method = Method::exact;          ///< where derivatives come from
  std::vector<std::string> inputs{};      ///< inputs of the linear model; empty: the model's inputs
  std::map<std::string, Range> bounds{};  ///< differences do not step outside
  double tolerance = 1e-6;  ///< largest rate over nominal size at an equilibrium [1/s]
  /// Rates that need not vanish (ground track, height). The others must.
  std::vector<std::string> moving{};
  double time_limit = unlimited;  ///< s of wall clock; a call of the model is not cut short
};

/// A linear model with its names, its point, and how good each entry is.
struct LinearModel {
  LinearizeStatus status = LinearizeStatus::not_equilibrium;  ///< whether there is one
  Signals states, inputs, outputs;                            ///< of x, u, y
  OperatingPoint point;                                       ///< where it was asked
  Eigen::VectorXd rates;                                      ///< left over at the point
  /// Largest left-over rate over its nominal size [1/s]; NaN where the model gives none.
  double residual = std::numeric_limits<double>::quiet_NaN();
  Eigen::MatrixXd A, B, C, D;  ///< nx x nx, nx x nu, ny x nx, ny x nu; SI or the signals' units
  Eigen::MatrixXd A_error, B_error, C_error, D_error;  ///< estimated bounds, entry by entry
  Method method = Method::exact;                       ///< that A, B, C, D come from
  /// The differences beside an exact A, and their own error estimates.
  std::optional<Estimate> A_differences;
  /// Kinks met, one-sided differences taken, exact and difference Jacobians in disagreement; what
  /// of C and D is not determined, and not a number there.
  std::vector<std::string> remarks;
  std::string message;   ///< why there is no linear model
  ModeNames mode_names;  ///< the model's
  /// There is a linear model.
  explicit operator bool() const { return status == LinearizeStatus::linear; }
};

/// Throws std::invalid_argument for names the model does not have, points that do not fit, and
/// answers of the model that do not fit its own signals.
[[nodiscard]] LinearModel linearize(const Model& model, const OperatingPoint& point,
                                    const LinearizeOptions& options = {});

}  // namespace tiltrim
