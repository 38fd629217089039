/// Whole flights as something to be tuned for. Internal to tune/.
#pragma once

#include "model/study.hpp"
#include "tune/tune.hpp"

namespace tiltrim {

/// The figures Measure::flight and Measure::tracking of the study's flight, with the aircraft and
/// gains that a closed loop's parameters have. Throws std::invalid_argument where the study's
/// flight cannot begin.
FlightFigure flight_figure(const Study& study);

}  // namespace tiltrim
