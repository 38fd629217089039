/// Whole flights as something to be tuned for. Internal to study/.
#pragma once

#include "study/study.hpp"
#include "tune/tune.hpp"

namespace tiltrim {

/// What the study's flight is worth, with the aircraft and gains that a closed loop's parameters
/// have: "flight", what it misses its aims by over what is allowed (10 to 100: it ends early), and
/// "tracking", the root mean square of its errors, 1 m/s and 0.1 rad each one. Throws
/// std::invalid_argument where the study's flight cannot begin.
std::map<std::string, FigureOfMerit> flight_figures(const Study& study);

}  // namespace tiltrim
