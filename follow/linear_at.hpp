/// Linear models at trims whose states may move. Internal to follow/.
#pragma once

#include <string>
#include <vector>

#include "linearize/linearize.hpp"
#include "trim/trim.hpp"

namespace tiltrim {

/// States that need not be at rest: those that the trim leaves moving, and those whose rates it
/// holds at a value other than zero.
std::vector<std::string> unsteady_states(const Model& model, const TrimSpec& spec);

/// The linear model at a trim. There is none, not_equilibrium, if a rate depends on a state whose
/// own rate is held at a value other than zero.
LinearModel linear_at(const Model& model, const TrimSpec& spec, const OperatingPoint& trimmed);

}  // namespace tiltrim
