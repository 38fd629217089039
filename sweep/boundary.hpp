/// Between the grid's points: where eigenvalues cross the imaginary axis along a line, and what
/// holds on the intervals between. Internal to sweep/.
#pragma once

#include <functional>
#include <optional>
#include <vector>

#include "sweep/map.hpp"
#include "sweep/neighbour.hpp"

namespace tiltrim {

/// An equilibrium at position t of a line, its matrix and eigenvalues by rising real part.
struct Sample {
  double t = 0.0;
  OperatingPoint at;
  Eigen::MatrixXd A;
  Eigen::VectorXcd eigenvalues;

  int unstable() const;  ///< eigenvalues right of the axis
  double abscissa() const;
};

/// A line of matrices: what is at t, starting from what is near; nothing where there is none.
struct MatrixLine {
  std::function<std::optional<Sample>(double t, const Sample& near)> sample;
  /// How far apart two samples' equilibria are, in nominal sizes.
  std::function<double(const Sample&, const Sample&)> apart;
};

/// Something that happens between two places of a line, as near as they could be brought.
struct LineEvent {
  double left = 0.0, right = 0.0;
  CrossingKind kind = CrossingKind::zero;
  int before = 0, after = 0;  ///< unstable eigenvalues; -1: no equilibrium
  double frequency = 0.0;

  double at() const { return left + 0.5 * (right - left); }
};

/// Finds all that happens between two places of a line, either of which may be without equilibrium,
/// and adds every sample taken to `seen`.
///
/// A piece [a, b] with middle m is clear when no eigenvalue can cross in it: in the eigenvectors of
/// A(m), B(t) = X⁻¹ A(t) X, every Gershgorin disc of B stays off the axis on the polygon A(a),
/// A(m), A(b) (disc by disc, a convex condition, so its ends decide), by more than four times what
/// the second difference says that A(t) may leave the polygon. It holds one crossing at most when
/// one eigenvalue (or pair) alone can reach the axis and its real part is monotone there by the
/// same measure. Every other piece is halved, down to `least`.        [10, ch. 2 sec. 13]
///
/// What this rests on: that the second difference over a piece bounds A'' within a factor of four.
void events_between(const MatrixLine& line, double from, const std::optional<Sample>& a, double to,
                    const std::optional<Sample>& b, double least, std::vector<LineEvent>& events,
                    std::vector<Sample>& seen);

/// Crossings and intervals of one line of the map's grid along `axis`; `place` is its first point.
struct LineVerdicts {
  std::vector<AxisCrossing> crossings;
  std::vector<AxisInterval> intervals;
};
LineVerdicts look_between(const Prepared& sweep, const SweepMap& map, int condition,
                          std::size_t axis, const GridPlace& place);

}  // namespace tiltrim
