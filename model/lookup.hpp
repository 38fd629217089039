/// Look-ups of signals and checks of a model's answers, for the algorithms.
#pragma once

#include <Eigen/Core>
#include <cstddef>
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

/// Throws CallerMistake with the model's name and both sizes if the size of f's result is wrong.
void check_rates(const Model& model, const Eigen::VectorXd& rates);
/// The same for h.
void check_outputs(const Model& model, const Eigen::VectorXd& outputs);
/// The same for `derivatives` with respect to this many variables.
void check_derivatives(const Model& model, const Eigen::MatrixXd& J, std::size_t variables);

/// The signal of a variable.
const Signal& signal_of(const Model& model, Eigen::Index variable);

}  // namespace tiltrim
