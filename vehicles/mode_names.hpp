/// @file
/// What flight mechanics calls the modes of an aircraft.
#pragma once

#include "model/model.hpp"

namespace tiltrim {

/// Modes of longitudinal motion, in wind axes (V, gamma, theta, q), in body axes (u, w, theta, q)
/// and as errors of the tiltrotor's closed loop. Set as Model::mode_names.   [2, ch. 6; 3]
ModeNames longitudinal_modes();

}  // namespace tiltrim
