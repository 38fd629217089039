/// @file
/// What changed between two maps.
#pragma once

#include <string>
#include <vector>

#include "sweep/map.hpp"

namespace tiltrim {

/// A point at which two maps differ.
struct PointDifference {
  std::size_t point;                       ///< number in both maps
  TrimStatus status_before, status_after;  ///< of its trim
  int verdict_before, verdict_after;       ///< Verdict, or -1 without an equilibrium
  double abscissa_before, abscissa_after;  ///< largest real part, 1/s; NaN without one
};

/// All that is another.
struct MapDifference {
  std::vector<PointDifference> changed;          ///< status or verdict is another
  double largest_abscissa_change = 0.0;          ///< over points with an equilibrium in both, 1/s
  std::size_t largest_at = 0;                    ///< the point where
  std::size_t compared = 0;                      ///< points
  std::vector<AxisCrossing> appeared, vanished;  ///< crossings in one map alone
  /// A crossing that is elsewhere.
  struct Moved {
    AxisCrossing before, after;  ///< in the two maps
  };
  /// Crossings in both, of the same kind and on the same line, the nearest being taken for the
  /// same, where the place or the numbers of unstable eigenvalues are others.
  std::vector<Moved> moved;
};

/// Point by point and crossing by crossing. A map without any change gives empty lists and 0.
/// Throws std::invalid_argument, saying what is another, unless both have the same conditions, axes
/// and states.
[[nodiscard]] MapDifference difference(const SweepMap& before, const SweepMap& after);

}  // namespace tiltrim
