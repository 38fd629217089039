/// Figures of merit of whole flights, for tuning. Internal to study/.
#pragma once

#include "study/study.hpp"
#include "tune/tune.hpp"

namespace tiltrim {

/// Figures of the study's flight with the aircraft parameters and gains of a closed loop: "flight",
/// the largest ratio of a deviation to its tolerance (10 to 100 if it ends early), and "tracking",
/// the root mean square of its errors relative to 1 m/s and 0.1 rad. Throws std::invalid_argument
/// if the study's flight cannot start.
decltype(TuneProblem::figures) flight_figures(const Study& study);

}  // namespace tiltrim
