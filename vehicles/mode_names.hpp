/// @file
/// Classical names of the modes of an aircraft.
#pragma once

#include "model/model.hpp"

namespace tiltrim {

/// Longitudinal modes in wind axes (V, gamma, theta, q), in body axes (u, w, theta, q) and in error
/// states of the tiltrotor's closed loop; lateral modes in beta or v, p, r, phi and psi. Assign to
/// Model::mode_names.      [2, ch. 6; 3]
std::shared_ptr<const std::vector<ModeName>> aircraft_modes();

}  // namespace tiltrim
