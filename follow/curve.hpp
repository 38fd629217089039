/// Pseudo-arclength continuation of a curve. Internal to follow/.
#pragma once

#include <Eigen/Core>
#include <functional>
#include <stop_token>
#include <string>
#include <vector>

namespace tiltrim {

/// G(y) = 0, one equation fewer than unknowns; both scaled so that 1 is a significant change.
struct Curve {
  /// Writes G and its Jacobian, (N - 1) x N; false if they are not finite.
  std::function<bool(const Eigen::VectorXd& y, Eigen::VectorXd& G, Eigen::MatrixXd& slopes)>
      evaluate;
};

/// A verified point of the curve.
struct CurvePoint {
  Eigen::VectorXd y;
  Eigen::VectorXd tangent;  ///< slopes · tangent = 0, of unit length, in the direction of travel
  double s = 0.0;           ///< arc length so far
  double turn = 0.0;        ///< det [slopes; tangentᵀ]: changes sign at a branch point
  double residual = 0.0;    ///< largest |G|
  double step = 0.0;        ///< size of a further Newton step
};

/// Test functions along the curve; a sign change of a component is an event.
using TestFunction = std::function<Eigen::VectorXd(const CurvePoint&)>;

/// Component `index` of test function `which` changes sign at the point.
struct LocatedEvent {
  std::size_t which;
  Eigen::Index index;
  bool rising;
  CurvePoint at;
  double slope = 0.0;   ///< derivative of the component with respect to arc length, there
  double within = 0.0;  ///< bound on its error in arc length; 0: round-off
};

enum class CurveEnd {
  stopped,     ///< by the visitor
  closed,      ///< back at the first point
  points,      ///< limit on the number of points
  stuck,       ///< no next point at any step size
  not_finite,  ///< no finite values ahead at any step size
  singular,    ///< the null space has more than one dimension
  interrupted,
};

struct TraceOptions {
  double first_step = 0.05, max_step = 0.5, min_step = 1e-9;
  int max_points = 5000;
  double tolerance = 1e-10, step_tolerance = 1e-9;
  std::stop_token stop{};
};

/// The point of the curve nearest to `y`, with the tangent that has towards · tangent >= 0.
/// Returns `stopped` if it exists, otherwise the reason why not.
CurveEnd first_point(const Curve& curve, const Eigen::VectorXd& y, const Eigen::VectorXd& towards,
                     const TraceOptions& options, CurvePoint& point);

/// The point of the curve ahead of `from`, close to it, at which component `k` has this value.
/// False if there is none.
bool point_at(const Curve& curve, const CurvePoint& from, Eigen::Index k, double value,
              const TraceOptions& options, CurvePoint& point);

/// Moves a point of the curve near a simple branch point onto it. `slope_error` is the error of the
/// curve's Jacobian. Returns the error bound of component `parameter`; if there is no branch point
/// nearby, returns infinity and leaves the point unchanged.
double refine_branch_point(const Curve& curve, Eigen::Index parameter, double slope_error,
                           CurvePoint& at);

/// Receives the end point of a step and the crossings in it, in order, each located to round-off;
/// returns whether to continue.
using Visit = std::function<bool(const CurvePoint& next, std::vector<LocatedEvent>& crossings)>;

/// Follows the curve from `start` with steps adapted to its curvature and to Newton's iterations.
/// A step is repeated with a shorter length if a pair of crossings may lie in it. [25, ch. 6]
CurveEnd trace(const Curve& curve, const CurvePoint& start, const std::vector<TestFunction>& tests,
               const TraceOptions& options, const Visit& visit);

}  // namespace tiltrim
