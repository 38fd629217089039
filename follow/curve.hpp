/// Pseudo-arclength continuation of a curve. Internal to follow/.
#pragma once

#include <Eigen/Core>
#include <functional>
#include <stop_token>
#include <string>
#include <vector>

namespace tiltrim {

/// G(y) = 0, one equation fewer than unknowns; both scaled so that one is a change that matters.
struct Curve {
  /// Writes G and its slopes, (N - 1) x N; false where they are not finite.
  std::function<bool(const Eigen::VectorXd& y, Eigen::VectorXd& G, Eigen::MatrixXd& slopes)>
      evaluate;
};

/// A verified point of the curve.
struct CurvePoint {
  Eigen::VectorXd y;
  Eigen::VectorXd tangent;  ///< slopes · tangent = 0, of length one, along the way taken
  double s = 0.0;           ///< length of the way so far
  double turn = 0.0;        ///< det [slopes; tangentᵀ]: changes sign at a branch point
  double residual = 0.0;    ///< largest |G|
  double step = 0.0;        ///< what Newton would still move it
};

/// Functions watched along the curve; a sign change of one is an event.
using Watch = std::function<Eigen::VectorXd(const CurvePoint&)>;

/// Component `index` of watch `watch` changes sign at the point.
struct LocatedEvent {
  std::size_t watch;
  Eigen::Index index;
  bool rising;
  CurvePoint at;
  double slope = 0.0;   ///< of the component along the way, there
  double within = 0.0;  ///< it lies no further off along the way; 0: to round-off
};

enum class CurveEnd {
  stopped,     ///< by the visitor
  closed,      ///< back at the first point
  points,      ///< as many as were allowed
  stuck,       ///< no next point, however short the step
  not_finite,  ///< no finite values ahead, however short the step
  singular,    ///< the equations leave more than one direction
  interrupted,
};

struct TraceOptions {
  double first_step = 0.05, max_step = 0.5, min_step = 1e-9;
  int max_points = 5000;
  double tolerance = 1e-10, step_tolerance = 1e-9;
  std::stop_token stop{};
};

/// The curve's point next to `y`, with the tangent that has towards · tangent >= 0. `stopped` if
/// there is one, else why there is none.
CurveEnd first_point(const Curve& curve, const Eigen::VectorXd& y, const Eigen::VectorXd& towards,
                     const TraceOptions& options, CurvePoint& point);

/// Moves a point of the curve that lies next to a simple branch point onto it. `slope_error` is
/// that of the curve's slopes. Returns how far component `parameter` may be off; infinite, and the
/// point as it was, where there is no branch point next to it.
double refine_branch_point(const Curve& curve, Eigen::Index parameter, double slope_error,
                           CurvePoint& at);

/// Takes a step's end point and the crossings on the way to it, in order, each located to
/// round-off; returns whether to go on.
using Visit = std::function<bool(const CurvePoint& next, std::vector<LocatedEvent>& crossings)>;

/// Follows the curve from `start` in steps that adapt to how it turns and to Newton's iterations.
/// A step is taken again, shorter, where a pair of crossings may hide in it.      [25, ch. 6]
CurveEnd trace(const Curve& curve, const CurvePoint& start, const std::vector<Watch>& watches,
               const TraceOptions& options, const Visit& visit);

}  // namespace tiltrim
