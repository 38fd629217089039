/// The border of a sheet of trims over two parameters: limits and folds. Internal to follow/.
#pragma once

#include <optional>

#include "follow/curve.hpp"
#include "follow/path.hpp"

namespace tiltrim {

/// A trim problem whose last two unknowns are the parameters of the plane: y = (z, x, y).
struct Plane {
  const Problem& problem;
  Eigen::VectorXd lower, upper;  ///< of the two parameters, scaled

  Eigen::Index n() const { return problem.n() - 2; }  ///< number of unknowns of the trim
  std::vector<LimitName> limits() const;              ///< the limits of the trim
};

/// Distance to a limit, positive inside; `values` are those at y.
double distance(const LimitName& limit, const Eigen::VectorXd& y, const Values& values);

/// What ends a sheet: a limit of the plane's problem, or a fold.
struct Stop {
  std::optional<LimitName> limit;  ///< empty: a fold
  std::string name() const;
};

/// The straight path from a trim at `from` to another point of the plane.
struct Met {
  Stop stop;
  Eigen::VectorXd y;
};
struct Way {
  std::optional<Met> met;                  ///< the first stop on the path
  std::optional<Eigen::VectorXd> arrived;  ///< or the trim reached
  /// If it stops at a fold: the other trim over `from`, on the branch after the fold.
  std::optional<Eigen::VectorXd> back;
};
Way go(const Plane& plane, const Eigen::VectorXd& from, const Eigen::Vector2d& to);

/// The curve of trims on the stop, through a given point.
Curve border(const Plane& plane, const Stop& stop, const Eigen::VectorXd& at);

/// The column b and row c that border the Jacobian: the last singular vectors at a point. With
/// them a test function is zero at folds of the trim's equations, and smooth there. [27, sec. 3.3]
struct FoldTest {
  Eigen::VectorXd b, c;
  FoldTest(const Plane& plane, const Eigen::VectorXd& at);
};

}  // namespace tiltrim
