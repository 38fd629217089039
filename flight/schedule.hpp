/// @file
/// What a flight is commanded, over height or over time. docs/simulate.md draws them.
#pragma once

#include <vector>

#include "flight/flight.hpp"

namespace tiltrim {

/// One command all the way.
Schedule held(const Command& command);

/// Commands between which each number is a monotone cubic (Fritsch and Carlson [56]), held beyond
/// the ends.
struct Commands {
  std::vector<double> at;       ///< heights [m] or times [s], rising; two at least
  std::vector<Command> values;  ///< at each
};
/// By height [m]. Throws std::invalid_argument where they are fewer than two, not rising, or not as
/// many.
Schedule over_height(const Commands& commands);
/// By time [s]; throws as over_height().
Schedule over_time(const Commands& commands);

/// The corridor (16) against time: the tilt falls at a constant rate; path angle and speed are
/// those of the height at which (16) has that tilt.
struct SteadyTilt {
  double begins = 0.0;                           ///< s
  double rate = std::numbers::pi / 180;          ///< rad/s, > 0
  double from = std::numbers::pi / 2, to = 0.0;  ///< rad, falling
  /// s
  double ends() const { return begins + (from - to) / rate; }
};
/// Throws std::invalid_argument for a rate that is not above zero, or tilts that do not fall.
Schedule corridor_at_tilt_rate(const SteadyTilt& tilt);
/// The height at which (16) has a tilt, 0 to 120 m.
double corridor_height(double eta);

/// The corridor (16) backwards: its tilt and speed from top to foot over time on a level path, then
/// the path turns down, and the aircraft sinks to the ground at the foot's speed.
struct Reconversion {
  double begins = 5.0;                     ///< s
  double lasts = 120.0;                    ///< s, from airplane to helicopter
  double hovers = 10.0;                    ///< s, level at the foot's speed
  double turns = 20.0;                     ///< s, until the path is down
  double descent = -std::numbers::pi / 6;  ///< rad, the path's angle from there on
};
/// That schedule.
Schedule reconversion(const Reconversion& times = {});

}  // namespace tiltrim
