/// The border of a sheet of trims over two parameters: limits and folds. Internal to follow/.
#pragma once

#include <optional>

#include "follow/curve.hpp"
#include "follow/path.hpp"

namespace tiltrim {

/// A trim problem whose last two unknowns are the plane's parameters: y = (z, x, y).
struct Plane {
  const Problem& problem;
  Eigen::VectorXd lower, upper;  ///< of the two parameters, scaled

  Eigen::Index n() const { return problem.n() - 2; }  ///< unknowns of the trim
  std::vector<LimitName> limits() const;              ///< those of the trim
};

/// Of a limit, positive inside; the values are those at y.
double distance(const LimitName& limit, const Eigen::VectorXd& y, const Values& values);

/// What stops a sheet: a limit of the plane's problem, or a fold.
struct Stop {
  std::optional<LimitName> limit;  ///< none: a fold
  std::string name() const;
};

/// The way from a trim at `from` straight to another point of the plane.
struct Met {
  Stop stop;
  Eigen::VectorXd y;
};
struct Way {
  std::optional<Met> met;                  ///< what first stops it
  std::optional<Eigen::VectorXd> arrived;  ///< or the trim it gets to
  /// Where a fold stops it, the other trim over `from` that the branch turns back to.
  std::optional<Eigen::VectorXd> back;
};
Way go(const Plane& plane, const Eigen::VectorXd& from, const Eigen::Vector2d& to);

/// The curve on which trims meet the stop, through a point of it.
Curve border(const Plane& plane, const Stop& stop, const Eigen::VectorXd& at);

/// Zero where the trim's equations fold (their Jacobian is singular), smooth there.   [27,
/// sec. 3.3]
struct FoldTest {
  Eigen::VectorXd b, c;
  FoldTest(const Plane& plane, const Eigen::VectorXd& at);
  double value(const Plane& plane, const Eigen::VectorXd& y) const;  ///< NaN where not finite
};

}  // namespace tiltrim
