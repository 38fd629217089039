/// Look-ups of signals and checks of a model's answers, for the algorithms.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include "model/model.hpp"

namespace tiltrim {

/// Largest number of states, inputs or outputs of a model: all methods use full matrices.
inline constexpr std::size_t largest_model = 2000;

/// Position of `name`; throws std::invalid_argument with a list of the valid names if not found.
/// `kind` names the kind of signal in the message ("state", "input", ...).
Eigen::Index index_of(const Signals& signals, std::string_view name, std::string_view kind);

/// The candidate nearest to `name` in edit distance; empty if no candidate is close.
std::string nearest_name(std::string_view name, const std::vector<std::string>& candidates);

/// Nominal sizes, one per signal, in its unit.
Eigen::VectorXd nominals(const Signals& signals);

/// An error in the caller's arguments, as opposed to an exception thrown by the model.
struct CallerMistake : std::invalid_argument {
  using std::invalid_argument::invalid_argument;
};

/// Throws std::invalid_argument if the model cannot be used: no f, a duplicate name, a nominal size
/// that is not positive and finite.
void check(const Model& model);
/// Throws std::invalid_argument if a size does not match or a value is not finite.
void check(const Model& model, const OperatingPoint& point);
/// Throws CallerMistake with the model's name and both sizes if the size of f's result is wrong.
void check_rates(const Model& model, const Eigen::VectorXd& rates);
/// The same for h.
void check_outputs(const Model& model, const Eigen::VectorXd& outputs);
/// The same for `derivatives` with respect to this many variables.
void check_derivatives(const Model& model, const Eigen::MatrixXd& J, std::size_t variables);

/// The number of a variable, searched by name among states, inputs and parameters, in that order.
/// Throws std::invalid_argument with the nearest name and all valid names if not found.
Eigen::Index variable(const Model& model, std::string_view name);
/// The value of a variable at the point.
double value_of(const OperatingPoint& point, Eigen::Index variable);
/// Sets the value of a variable.
void set_value(OperatingPoint& point, Eigen::Index variable, double value);
/// The signal of a variable.
const Signal& signal_of(const Model& model, Eigen::Index variable);
/// Name of row i of [f; h]: "q'" for a rate, "airspeed" for an output.
std::string row_name(const Model& model, Eigen::Index row);

}  // namespace tiltrim
