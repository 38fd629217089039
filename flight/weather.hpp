/// @file
/// Wind and disturbances of a flight.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "flight/flight.hpp"

namespace tiltrim {

/// A change of a command or an actuator for a time.
struct DisturbanceTable {
  /// Its course over time.
  enum class Kind {
    step,                       ///< `size` from `at` on, for `duration` (0: to the end)
    doublet,                    ///< `size` for `duration`, then its opposite for as long
  } kind = Kind::step;          ///< which
  std::string on = "gamma";     ///< V, gamma, theta0, a1s or delta_e
  double at = 0.0, size = 0.0;  ///< s; SI, radians
  double duration = 0.0;        ///< s
};

/// Wind over the ground.
struct GustTable {
  /// Its course over time.
  enum class Kind {
    steady,            ///< `size` all the time
    one_minus_cosine,  ///< up to `size` and back, (1 - cos)/2 from `at` for `duration` [53]
    dryden,            ///< turbulence of standard deviation `size`, by a sum of waves [53]
  } kind = Kind::one_minus_cosine;  ///< which
  bool up = false;                  ///< else forward
  double size = 0.0;                ///< m/s
  double at = 0.0;                  ///< s
  double duration = 1.0;            ///< s
  double length = 50.0;             ///< m, scale of the turbulence
  double speed = 15.0;              ///< m/s at which it is flown through
  std::uint64_t seed = 1;           ///< of the turbulence
};

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
