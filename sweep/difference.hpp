/// The differences between two maps.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "sweep/map.hpp"
#include "sweep/verdict_map.hpp"

namespace tiltrim {

/// A point at which two maps differ.
struct PointDifference {
  std::size_t point;                       ///< number in both maps
  TrimStatus status_before, status_after;  ///< of the trims
  int verdict_before, verdict_after;       ///< Verdict, or -1 if there is no equilibrium
  double abscissa_before, abscissa_after;  ///< largest real part, 1/s; NaN without an equilibrium
};

/// Crossings of two maps of the same grid.
struct CrossingDifferences {
  std::vector<AxisCrossing> appeared, vanished;  ///< in one map only
  /// A crossing that has moved.
  struct Moved {
    AxisCrossing before, after;  ///< in the two maps
  };
  /// Crossings in both maps, of the same kind and on the same line, matched to the nearest,
  /// whose coordinates or numbers of unstable eigenvalues differ.
  std::vector<Moved> moved;
};

/// The differences of two maps.
struct MapDifference {
  std::vector<PointDifference> changed;  ///< points with a different status or verdict
  double largest_abscissa_change = 0.0;  ///< over points with an equilibrium in both, 1/s
  std::size_t largest_at = 0;            ///< its point
  std::size_t compared = 0;              ///< number of points
  CrossingDifferences crossings;         ///< of all lines
};

/// Compares point by point and crossing by crossing. Equal maps give empty lists and 0. Throws
/// std::invalid_argument, naming the difference, unless conditions, axes and states are the same.
[[nodiscard]] MapDifference difference(const SweepMap& before, const SweepMap& after);

/// Points in a row along the last axis, all of which changed from one verdict to another.
struct VerdictStretch {
  std::size_t line;      ///< number of the line in both maps
  std::size_t from, to;  ///< first and last point of the stretch on its line
  int before, after;     ///< Verdict, or -1 if there is no equilibrium
};

/// The differences of two maps of verdicts.
struct VerdictDifference {
  /// [before][after]: points by their two verdicts, as in VerdictCounts.
  std::array<VerdictCounts, 4> counts{};
  std::vector<VerdictStretch> stretches;  ///< all points that changed, line by line
  std::size_t lines_not_located = 0;  ///< lines whose crossings are not all located in both maps
  CrossingDifferences crossings;      ///< of the other lines

  std::uint64_t compared() const;  ///< number of points
  std::uint64_t changed() const;   ///< number of points with another verdict
};

/// The same for maps of verdicts. Crossings are compared on the lines where both maps have located
/// all of them. Throws as the other does.
[[nodiscard]] VerdictDifference difference(const VerdictMap& before, const VerdictMap& after);

}  // namespace tiltrim
