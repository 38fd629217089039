#include "follow/border.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>

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

constexpr double nan = std::numeric_limits<double>::quiet_NaN();

// Scaled slope of the distance to a limit.
Eigen::RowVectorXd distance_slope(const LimitName& limit, const Slopes& s, Index size) {
  if (!limit.of_unknown) return -limit.as.side * s.limited.row(limit.as.position);
  return -limit.as.side * VectorXd::Unit(size, limit.as.position).transpose();
}

// The equations, and one more function of y with its slope.
template <class More>
Curve with(const Plane& plane, const More& more) {
  return {[&plane, more](const VectorXd& y, VectorXd& G, MatrixXd& J) {
    const Values v = values(plane.problem, y);
    if (!v.finite) return false;
    const Slopes s = slopes(plane.problem, y);
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
  const Slopes s = slopes(plane.problem, at);
  const Eigen::JacobiSVD<MatrixXd> svd(s.residual.leftCols(n),
                                       Eigen::ComputeFullU | Eigen::ComputeFullV);
  b = svd.matrixU().col(n - 1);
  c = svd.matrixV().col(n - 1);
}

// [J b; cᵀ 0] [v; g] = [0; 1]: g = 0 where J is singular.
double FoldTest::value(const Plane& plane, const VectorXd& y) const {
  const Slopes s = slopes(plane.problem, y);
  if (!s.finite) return nan;
  const Index n = c.size();
  const VectorXd vg =
      bordered_jacobian(s.residual, b, c).partialPivLu().solve(VectorXd::Unit(n + 1, n));
  return vg[n];
}

Curve border(const Plane& plane, const Stop& stop, const VectorXd& at) {
  if (stop.limit) {
    const LimitName limit = *stop.limit;
    return with(plane, [limit](const VectorXd& y, const Values& v, const Slopes& s, MatrixXd& J) {
      J.bottomRows(1) = distance_slope(limit, s, y.size());
      return distance(limit, y, v);
    });
  }
  const FoldTest fold(plane, at);
  return with(plane, [fold, &plane](const VectorXd& y, const Values&, const Slopes&, MatrixXd& J) {
    constexpr double h = 1e-5;  // of a nominal size
    for (Index k = 0; k < y.size(); ++k) {
      VectorXd ahead = y, behind = y;
      ahead[k] += h;
      behind[k] -= h;
      J(J.rows() - 1, k) =
          (fold.value(plane, ahead) - fold.value(plane, behind)) / (ahead[k] - behind[k]);
    }
    return fold.value(plane, y);
  });
}

Way go(const Plane& plane, const VectorXd& from, const Vector2d& to) {
  const Vector2d start = from.tail<2>();
  const double length = (to - start).norm();
  const Vector2d direction = (to - start) / length;
  const Vector2d across(-direction[1], direction[0]);
  const Curve line = with(plane, [&](const VectorXd& y, const Values&, const Slopes&, MatrixXd& J) {
    J.bottomRows(1).setZero();
    J.bottomRows(1).rightCols(2) = across.transpose();
    return across.dot(y.tail<2>() - start);
  });
  TraceOptions options;
  options.max_step = std::min(length, 0.5);
  options.first_step = std::min(length, 0.2);
  options.max_points = 2000;
  VectorXd towards = VectorXd::Zero(from.size());
  towards.tail<2>() = direction;
  CurvePoint at;
  Way way;
  if (first_point(line, from, towards, options, at) != CurveEnd::stopped) return way;
  const std::vector<LimitName> limits = plane.limits();
  const Watch turning = [&](const CurvePoint& p) {
    return VectorXd::Constant(1, direction.dot(p.tangent.tail<2>()));
  };
  const Watch arriving = [&](const CurvePoint& p) {
    return VectorXd::Constant(1, direction.dot(p.y.tail<2>() - to));
  };
  const Watch returning = [&](const CurvePoint& p) {
    return VectorXd::Constant(1, direction.dot(p.y.tail<2>() - start));
  };
  const Watch distances = [&](const CurvePoint& p) {
    const Values v = values(plane.problem, p.y);
    VectorXd d(std::ssize(limits));
    for (Index i = 0; i < d.size(); ++i)
      d[i] = v.finite ? distance(limits[std::size_t(i)], p.y, v) : nan;
    return d;
  };
  // From a limit straight outwards there is no crossing: the start is where it stopped.
  const auto arrive = [&](Way& w, const CurvePoint& p) {
    constexpr double slack = 1e-9;
    Index worst = 0;
    if (limits.empty() || distances(p).minCoeff(&worst) >= -slack)
      w.arrived = p.y;
    else
      w.met = Met{{limits[std::size_t(worst)]}, from};
  };
  enum : std::size_t { fold, target, origin, limit };
  trace(line, at, {turning, arriving, returning, distances}, options,
        [&](const CurvePoint&, std::vector<Crossing>& found) {
          for (const Crossing& c : found) {
            if (c.watch == target && !way.met) {
              arrive(way, c.at);
              return false;
            }
            if (c.watch == fold && way.met) return false;  // a second one: not back to the start
            if (c.watch == fold) way.met = Met{{}, c.at.y};
            if (c.watch == origin && !c.rising) {
              way.back = c.at.y;
              return false;
            }
            if (c.watch == limit && !c.rising) {
              if (!way.met) way.met = Met{{limits[std::size_t(c.index)]}, c.at.y};
              return false;
            }
          }
          return true;
        });
  return way;
}

}  // namespace tiltrim
