#include "follow/border.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "dense/dense.hpp"

namespace tiltrim {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::Vector2d;
using Eigen::VectorXd;

std::vector<LimitName> Plane::limits() const {
  std::vector<LimitName> names = limit_names(Path{problem});
  std::erase_if(names, [&](const LimitName& l) { return l.of_unknown && l.as.position >= n(); });
  return names;
}

std::string Stop::name() const {
  return limit ? limit->signal + (limit->upper ? " upper" : " lower") : "fold";
}

double distance(const LimitName& limit, const VectorXd& y, const Values& v) {
  const double at = limit.of_unknown ? y[limit.as.position] : v.limited[limit.as.position];
  return (limit.as.bound - at) * limit.as.side;
}

namespace {

constexpr double not_a_number = std::numeric_limits<double>::quiet_NaN();

// Gradient of the scaled distance to a limit.
Eigen::RowVectorXd distance_slope(const LimitName& limit, const Jacobians& s, Index size) {
  if (!limit.of_unknown) return -limit.as.side * s.limited.row(limit.as.position);
  return -limit.as.side * VectorXd::Unit(size, limit.as.position).transpose();
}

// The equations, and one additional function of y with its gradient.
template <class More>
Curve with(const Plane& plane, const More& more) {
  return {[&plane, more](const VectorXd& y, VectorXd& G, MatrixXd& J) {
    const Values v = values(plane.problem, y);
    if (!v.finite) return false;
    const Jacobians s = jacobians(plane.problem, y);
    if (!s.finite) return false;
    const Index m = v.residual.size();
    G.resize(m + 1);
    J.resize(m + 1, y.size());
    G.head(m) = v.residual;
    J.topRows(m) = s.residual;
    G[m] = more(y, v, s, J);
    return std::isfinite(G[m]) && J.allFinite();
  }};
}

MatrixXd bordered_jacobian(const MatrixXd& J, const VectorXd& b, const VectorXd& c) {
  const Index n = c.size();
  MatrixXd M(n + 1, n + 1);
  M << J.leftCols(n), b, c.transpose(), 0.0;
  return M;
}

}  // namespace

FoldTest::FoldTest(const Plane& plane, const VectorXd& at) {
  const Index n = plane.n();
  const Jacobians s = jacobians(plane.problem, at);
  const dense::SVD svd = dense::svd(s.residual.leftCols(n));
  b = svd.U.col(n - 1);
  c = svd.V.col(n - 1);
}

namespace {

// [J b; cᵀ 0] [v; g] = [0; 1]: g = 0 if and only if J is singular.              [27, sec. 3.3]
// With [wᵀ g] [J b; cᵀ 0] = [0 1], its slope, the last row of J, is -wᵀ (∂J/∂y) v:
// one difference of J along v.
double fold_value(const FoldTest& fold, const Plane& plane, const VectorXd& y, const Jacobians& s,
                  MatrixXd& J) {
  constexpr double step = 1e-5;  // of a nominal size
  const Index n = plane.n();
  const MatrixXd M = bordered_jacobian(s.residual, fold.b, fold.c);
  const VectorXd last = VectorXd::Unit(n + 1, n);
  const VectorXd vg = dense::solve(M, last), v = vg.head(n);
  const VectorXd w = dense::solve(MatrixXd(M.transpose()), last).head(n);
  const double size = v.norm();
  VectorXd along = VectorXd::Zero(y.size());
  along.head(n) = v * (step / size);
  const Jacobians ahead = jacobians(plane.problem, y + along);
  const Jacobians behind = jacobians(plane.problem, y - along);
  if (!ahead.finite || !behind.finite) return not_a_number;
  J.bottomRows(1) = -w.transpose() * (ahead.residual - behind.residual) * (size / (2 * step));
  return vg[n];
}

}  // namespace

Curve border(const Plane& plane, const Stop& stop, const VectorXd& at) {
  if (stop.limit) {
    const LimitName limit = *stop.limit;
    return with(plane,
                [limit](const VectorXd& y, const Values& v, const Jacobians& s, MatrixXd& J) {
                  J.bottomRows(1) = distance_slope(limit, s, y.size());
                  return distance(limit, y, v);
                });
  }
  const FoldTest fold(plane, at);
  return with(plane, [fold, &plane](const VectorXd& y, const Values&, const Jacobians& s,
                                    MatrixXd& J) { return fold_value(fold, plane, y, s, J); });
}

namespace {

// The straight line in the plane from one point to another.
struct Line {
  Vector2d start, to, direction, across;
  double length;

  Line(const Vector2d& a, const Vector2d& b)
      : start(a), to(b), direction((b - a).normalized()), length((b - a).norm()) {
    across = {-direction[1], direction[0]};
  }
};

VectorXd distances(const Plane& plane, const std::vector<LimitName>& limits, const VectorXd& y) {
  const Values v = values(plane.problem, y);
  VectorXd d(std::ssize(limits));
  for (Index i = 0; i < d.size(); ++i)
    d[i] = v.finite ? distance(limits[std::size_t(i)], y, v) : not_a_number;
  return d;
}

// Test functions on the way to the border, by position in test_functions().
struct OnWay {
  enum : std::size_t { fold, target, origin, limit };
};

std::vector<TestFunction> test_functions(const Plane& plane, const std::vector<LimitName>& limits,
                                         const Line& line) {
  const auto along = [&line](const Vector2d& v) {
    return VectorXd(VectorXd::Constant(1, line.direction.dot(v)));
  };
  std::vector<TestFunction> all(4);
  all[OnWay::fold] = [along](const CurvePoint& p) { return along(p.tangent.tail<2>()); };
  all[OnWay::target] = [along, &line](const CurvePoint& p) {
    return along(p.y.tail<2>() - line.to);
  };
  all[OnWay::origin] = [along, &line](const CurvePoint& p) {
    return along(p.y.tail<2>() - line.start);
  };
  all[OnWay::limit] = [&](const CurvePoint& p) { return distances(plane, limits, p.y); };
  return all;
}

}  // namespace

Way go(const Plane& plane, const VectorXd& from, const Vector2d& to) {
  constexpr double slack = 1e-9;
  const Line line(from.tail<2>(), to);
  const Curve curve =
      with(plane, [&](const VectorXd& y, const Values&, const Jacobians&, MatrixXd& J) {
        J.bottomRows(1).setZero();
        J.bottomRows(1).rightCols(2) = line.across.transpose();
        return line.across.dot(y.tail<2>() - line.start);
      });
  TraceOptions options;
  options.max_step = std::min(line.length, 0.5);
  options.first_step = std::min(line.length, 0.2);
  options.max_points = 2000;
  VectorXd towards = VectorXd::Zero(from.size());
  towards.tail<2>() = line.direction;
  CurvePoint at;
  Way way;
  if (first_point(curve, from, towards, options, at) != CurveEnd::stopped) return way;
  const std::vector<LimitName> limits = plane.limits();
  // Returns whether to continue: past a fold, to find where the branch turns back to.
  const auto meet = [&](const LocatedEvent& c) {
    if (c.which == OnWay::target && !way.met) {
      // Starting outwards on a limit gives no crossing: the line stops at the start.
      Index worst = 0;
      if (limits.empty() || distances(plane, limits, c.at.y).minCoeff(&worst) >= -slack)
        way.arrived = c.at.y;
      else
        way.met = Met{{limits[std::size_t(worst)]}, from};
      return false;
    }
    if (c.which == OnWay::fold && way.met) return false;  // a second fold: do not go back
    if (c.which == OnWay::fold) way.met = Met{{}, c.at.y};
    if (c.which == OnWay::origin && !c.rising) way.back = c.at.y;
    if (c.which == OnWay::limit && !c.rising && !way.met)
      way.met = Met{{limits[std::size_t(c.index)]}, c.at.y};
    return c.rising || c.which == OnWay::fold || c.which == OnWay::target;
  };
  trace(curve, at, test_functions(plane, limits, line), options,
        [&](const CurvePoint&, std::vector<LocatedEvent>& found) {
          return std::ranges::all_of(found, meet);
        });
  return way;
}

}  // namespace tiltrim
