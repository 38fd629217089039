/// @file
/// Wind and disturbances of a flight.
#pragma once

#include <functional>
#include <vector>

#include "model/simulation.hpp"

namespace tiltrim {

/// All gusts together, and the times at which they have kinks. Turbulence is a sum of waves of the
/// Dryden spectra [53] with random phases [55]: smooth, of exactly the standard deviation asked
/// for, the same for a seed.
struct Weather {
  std::function<Wind(double t)> wind;  ///< empty: calm
  std::vector<double> kink_times;      ///< s, rising
};
/// Of these gusts, added up.
Weather weather(const std::vector<GustTable>& gusts);

/// The Dryden spectrum along the flight or across it, Φ(Ω) [m²/s² per rad/m] at a wave number
/// Ω ≥ 0 [rad/m]; its integral over all of them is sigma².
double dryden_spectrum(double wave_number, double sigma, double length, bool across);

/// Steps and doublets of the commands and actuators, and the times at which they jump.
struct Disturbances {
  std::function<Disturbance(double t)> at;  ///< empty: none
  std::vector<double> kink_times;           ///< s, rising
};
/// Of these, added up.
Disturbances disturbances(const std::vector<DisturbanceTable>& tables);

}  // namespace tiltrim
