/// @file
/// Linearization: δx' = A δx + B δu, δy = C δx + D δu at an operating point, with error bounds.
#pragma once

#include <limits>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "model/model.hpp"

namespace tiltrim {

/// Status of a linearization.
enum class LinearizeStatus {
  linear,           ///< at an equilibrium
  not_equilibrium,  ///< the remaining rates exceed the tolerance: not linearized
  not_finite,       ///< a rate, an output or a derivative is not finite
  model_threw,      ///< the model threw an exception; `message` contains its text
  not_repeatable,   ///< the model returns different values for the same point
  time_limit,       ///< the time limit passed
};
std::string to_string(LinearizeStatus status);  ///< as in JSON

/// Source of the derivatives.
enum class Method {
  exact,        ///< the model's own derivatives if it has them, otherwise differences
  differences,  ///< central differences in every case
};

/// Options of linearize().
struct LinearizeOptions {
  Method method = Method::exact;          ///< source of the derivatives
  std::vector<std::string> inputs{};      ///< inputs of the linear model; empty: the model's inputs
  std::map<std::string, Range> bounds{};  ///< finite differences stay inside
  double tolerance = 1e-6;  ///< largest rate over nominal size accepted at an equilibrium [1/s]
  /// States whose rates need not vanish (ground track, height). All others must.
  std::vector<std::string> moving{};
  /// s of wall-clock time; a model call is not interrupted.
  double time_limit = std::numeric_limits<double>::infinity();
};

/// A linear model with its signals, its operating point, and an error bound of each entry.
struct LinearModel {
  LinearizeStatus status = LinearizeStatus::not_equilibrium;  ///< whether it exists
  Signals states, inputs, outputs;                            ///< of x, u, y
  OperatingPoint point;                                       ///< operating point
  Eigen::VectorXd rates;                                      ///< rates at the point
  /// Largest remaining rate over its nominal size [1/s]; NaN if the model returns no rates.
  double residual = std::numeric_limits<double>::quiet_NaN();
  Eigen::MatrixXd A, B, C, D;  ///< nx x nx, nx x nu, ny x nx, ny x nu; SI or the signals' units
  Eigen::MatrixXd A_error, B_error, C_error, D_error;  ///< estimated error bounds, for each entry
  Method method = Method::exact;                       ///< source of A, B, C, D
  /// Finite differences for comparison with an exact A, with their error estimates.
  std::optional<Estimate> A_differences;
  /// Kinks found, one-sided differences used, differences between exact and finite-difference
  /// Jacobians, and entries of C and D that could not be determined and are NaN.
  std::vector<std::string> remarks;
  std::string message;                                      ///< why there is no linear model
  std::shared_ptr<const std::vector<ModeName>> mode_names;  ///< from the model
  /// True if there is a linear model.
  explicit operator bool() const { return status == LinearizeStatus::linear; }
};

/// Throws std::invalid_argument for unknown names, points of the wrong size, and results of the
/// model whose size does not match its signals.
[[nodiscard]] LinearModel linearize(const Model& model, const OperatingPoint& point,
                                    const LinearizeOptions& options = {});

}  // namespace tiltrim
