/// Between the grid points: crossings of eigenvalues with the imaginary axis along a line, and the
/// verdicts of the intervals between. Internal to sweep/.
#pragma once

#include <functional>
#include <optional>
#include <span>
#include <vector>

#include "sweep/basis.hpp"
#include "sweep/map.hpp"
#include "sweep/neighbour.hpp"

namespace tiltrim {

/// An equilibrium at position t of a line, with its matrix and eigenvalues by ascending real part.
struct Sample {
  double t = 0.0;
  OperatingPoint at;
  Eigen::MatrixXd A;
  Eigen::VectorXcd eigenvalues;

  Spectrum spectrum() const;  ///< all eigenvalues; empty if some were left out
  int unstable() const;       ///< number of eigenvalues right of the axis
  double abscissa() const;
};

/// Number of eigenvalues whose error bounds contain the axis.
Eigen::Index on_axis(const Sample& sample);
/// The sample without the `riding` eigenvalues nearest to the axis.
Sample without(Sample sample, Eigen::Index riding);

/// A line of matrices: the sample at t from a nearby sample; empty if there is no equilibrium.
struct MatrixLine {
  std::function<std::optional<Sample>(double t, const Sample& near)> sample;
  /// Distance between the equilibria of two samples, in nominal sizes.
  std::function<double(const Sample&, const Sample&)> apart;
  /// How far a trim that is off by its tolerance moves the matrix, in the Frobenius norm.
  std::function<double(const Sample&)> blur;
};

/// An event between two positions of a line, bracketed as closely as possible.
struct LineEvent {
  double left = 0.0, right = 0.0;
  CrossingKind kind = CrossingKind::zero;
  int before = 0, after = 0;  ///< number of unstable eigenvalues; -1: no equilibrium
  double frequency = 0.0;
  std::optional<double> root{};  ///< the best estimate, if there is one

  double at() const { return root.value_or(left + 0.5 * (right - left)); }
};

/// Finds all events between two positions of a line, either of which may have no equilibrium, and
/// appends every sample taken to `seen`.
///
/// A piece [a, b] with middle m is clear if no eigenvalue can cross in it: in the eigenvectors of
/// A(m), B(t) = X⁻¹ A(t) X, every Gershgorin disk of B stays off the axis on the polygon A(a),
/// A(m), A(b) (for each disk a convex condition, so its ends decide), by more than four times the
/// deviation of A(t) from the polygon estimated from the second difference. It has at most one
/// crossing if only one eigenvalue (or pair) can reach the axis and its real part is monotone there
/// with the same margin. Every other piece is bisected, down to `least`. The disks are those of a
/// diagonal similarity of B that narrows the one nearest to the axis.  [10, ch. 2 sec. 13]
///
/// Assumption: the second differences over a piece and over what it is a part of, at its width,
/// bound A'' within a factor of four. The whole is halved at least once.
///
/// `riding` eigenvalues stay on the axis within their error bounds all along and are left out; the
/// samples, of `line` too, come without() them.
void events_between(const MatrixLine& line, double from, const std::optional<Sample>& a, double to,
                    const std::optional<Sample>& b, double least, std::vector<LineEvent>& events,
                    std::vector<Sample>& seen, Eigen::Index riding = 0);

/// Eigenvectors of a matrix, in its own coordinates.
struct Eigenvectors {
  Basis basis;
  double rounding;  ///< of an eigenvalue
};
/// At its eigenvalues, if known; empty if the matrix is defective.
std::optional<Eigenvectors> eigenvectors(const dense::SmallMatrix& A, Spectrum lambda);

/// True if three equilibria with these distances from the first to the second, to the third, and
/// from the first to the third may lie on one curve: a jump between two makes up all of the bend.
bool continuous(double left, double right, double whole);
/// True if a piece with these matrices is clear by the rule of events_between(), either in the
/// eigenvectors `nearby` or in those of its middle, with eigenvalues `lambda`, which then replace
/// them: the theorem holds in any coordinates. `bend`: a second difference next to the piece, of
/// its width, or empty.
bool is_clear(std::optional<Eigenvectors>& nearby, const dense::SmallMatrix& a,
              const dense::SmallMatrix& m, Spectrum lambda, const dense::SmallMatrix& b,
              const dense::SmallMatrix& bend);

/// Crossings and intervals of one grid line of the map.
struct LineVerdicts {
  std::vector<AxisCrossing> crossings;
  std::vector<AxisInterval> intervals;
};
struct Halved;
/// Those of up to `Model::model_lanes` lines of a condition along `axis`, which is `halved`, given
/// their first points.
void look_between(const Prepared& sweep, const Halved& halved, const SweepMap& map, int condition,
                  std::size_t axis, const std::vector<const GridPlace*>& places,
                  const std::vector<LineVerdicts*>& found);

/// The crossings of a line along the last axis whose matrices are affine, from its polynomial
/// alone, without modes; empty if rounding leaves doubt that they are all.
std::optional<std::vector<AxisCrossing>> affine_borders(const Prepared& sweep, int condition,
                                                        const GridPlace& place,
                                                        const AffineLine& affine,
                                                        std::span<const double> shares);

}  // namespace tiltrim
