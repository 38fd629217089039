/// Grid lines with the middles of their steps. Internal to sweep/.
#pragma once

#include <vector>

#include "sweep/grid_line.hpp"
#include "sweep/line_tracking.hpp"

namespace tiltrim {

/// A sweep with the middles of one axis's steps as points: its point i is at position i/2.
struct Halved {
  Halved(const Prepared& sweep, std::size_t axis);

  std::vector<SweepAxis> axes;
  Prepared sweep;  ///< refers to `axes`
};

/// A line's equilibria, matrices and eigenvalues at those points, found where the map has the same.
struct Halves {
  LineTracker line;
  const BatchEigenvalues& batch;

  bool found(std::size_t i) const { return line.valid[i] != 0; }
  dense::SmallMatrix A(std::size_t i) const;
  PerMode<Complex> eigenvalues(std::size_t i) const;  ///< as in Sample
  int unstable(std::size_t i) const;                  ///< number of eigenvalues right of the axis
  Sample sample(std::size_t i) const;
  dense::SmallMatrix bend(std::size_t i) const;  ///< second difference of the matrices
  std::vector<double> bends() const;  ///< Frobenius norms of all; NaN without three equilibria
  /// Distance between two equilibria, in nominal sizes.
  double apart(std::size_t i, std::size_t k) const;
};

/// Those of up to `Model::model_lanes` lines of one condition along one axis, side by side if the
/// model has lanes. `rooms` and the lines must outlive the result.
std::vector<Halves> walk_halves(const Halved& halved, const std::vector<const GridLine*>& lines,
                                std::vector<Room>& rooms);

}  // namespace tiltrim
