/// @file
/// Classical names of the modes of an aircraft.
#pragma once

#include "model/model.hpp"

namespace tiltrim {

/// Longitudinal modes in wind axes (V, gamma, theta, q), in body axes (u, w, theta, q) and in error
/// states of the tiltrotor's closed loop. Assign to Model::mode_names.      [2, ch. 6; 3]
std::shared_ptr<const std::vector<ModeName>> longitudinal_modes();

}  // namespace tiltrim
