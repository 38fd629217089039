/// The differences between two maps.
#pragma once

#include <cstddef>
#include <vector>

#include "sweep/map.hpp"

namespace tiltrim {

/// A point at which two maps differ.
struct PointDifference {
  std::size_t point;                       ///< number in both maps
  TrimStatus status_before, status_after;  ///< of the trims
  int verdict_before, verdict_after;       ///< Verdict, or -1 if there is no equilibrium
  double abscissa_before, abscissa_after;  ///< largest real part, 1/s; NaN without an equilibrium
};

/// The differences of two maps.
struct MapDifference {
  std::vector<PointDifference> changed;          ///< points with a different status or verdict
  double largest_abscissa_change = 0.0;          ///< over points with an equilibrium in both, 1/s
  std::size_t largest_at = 0;                    ///< its point
  std::size_t compared = 0;                      ///< number of points
  std::vector<AxisCrossing> appeared, vanished;  ///< crossings in one map only
  /// A crossing that has moved.
  struct Moved {
    AxisCrossing before, after;  ///< in the two maps
  };
  /// Crossings in both maps, of the same kind and on the same line, matched to the nearest,
  /// whose coordinates or numbers of unstable eigenvalues differ.
  std::vector<Moved> moved;
};

/// Compares point by point and crossing by crossing. Equal maps give empty lists and 0. Throws
/// std::invalid_argument, naming the difference, unless conditions, axes and states are the same.
[[nodiscard]] MapDifference difference(const SweepMap& before, const SweepMap& after);

}  // namespace tiltrim
