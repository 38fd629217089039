#include "follow/border_pieces.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "dense/dense.hpp"

namespace tiltrim {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

std::optional<VectorXd> in_plane(const Curve& curve, VectorXd y, const VectorXd& direction,
                                 double level, double longest) {
  constexpr int cap = 12;
  constexpr double rounding = std::numeric_limits<double>::epsilon();
  const Index n = y.size();
  VectorXd G, rhs(n);
  MatrixXd slopes, M(n, n);
  for (int i = 0; i < cap; ++i) {
    if (!curve.evaluate(y, G, slopes)) return {};
    M << slopes, direction.transpose();
    rhs << -G, level - direction.dot(y);
    const VectorXd dy = dense::solve(M, rhs);
    if (!(dy.norm() <= longest)) return {};
    y += dy;
    if (dy.norm() <= rounding * (1 + y.norm())) break;
  }
  return y;
}

namespace {

// One direction along the border from a seed, until it leaves the plane, meets a stop or closes.
struct HalfWay {
  std::vector<VectorXd> way;
  std::string end;
  std::optional<Seed> corner;
};

enum BorderEvent : std::size_t { plane_edge, other_limits, folding };

// What ends a piece: the edges of the plane, the other limits, a fold of the sheet.
std::vector<TestFunction> test_functions(const Grid& g, const Stop& stop,
                                         const std::vector<LimitName>& limits) {
  std::vector<TestFunction> all(3);
  all[plane_edge] = [&g](const CurvePoint& p) {
    VectorXd d(4);
    d << p.y.tail<2>() - g.plane.lower, g.plane.upper - p.y.tail<2>();
    return d;
  };
  all[other_limits] = [&](const CurvePoint& p) {
    const Values v = values(g.moving, p.y);
    VectorXd d(std::ssize(limits));
    for (Index k = 0; k < d.size(); ++k) d[k] = distance(limits[std::size_t(k)], p.y, v);
    return d;
  };
  all[folding] = [&g, folds = !stop.limit](const CurvePoint& p) {
    if (folds) return VectorXd();
    const MatrixXd J = jacobians(g.moving, p.y).residual.leftCols(g.n());
    return VectorXd(VectorXd::Constant(1, dense::determinant(dense::lu(J))));
  };
  return all;
}

// If the start lies on the plane's edge or another limit and heads outwards: its name.
std::string leaves_at_once(const CurvePoint& at, const std::vector<TestFunction>& tests,
                           const std::vector<LimitName>& limits) {
  constexpr double ahead = 1e-6, on = 1e-9;
  CurvePoint beyond = at;
  beyond.y += ahead * at.tangent;
  for (const BorderEvent what : {plane_edge, other_limits}) {
    const VectorXd here = tests[what](at), there = tests[what](beyond);
    for (Index k = 0; k < here.size(); ++k)
      if (here[k] <= on && there[k] < here[k])
        return what == plane_edge ? "edge" : Stop{limits[std::size_t(k)]}.name();
  }
  return {};
}

HalfWay half_way(const Grid& g, const Seed& seed, double sign) {
  constexpr double differences = 2e-5;  // extent of finite differences, if the model has no slopes
  constexpr double share = 2.5e-3;  // of the plane's shorter side: a step, however small nominals
  const Curve curve = border(g.plane, seed.stop, seed.y);
  constexpr double first = 0.1;  // of the same, at most: a first step within a small plane
  const double side = (g.plane.upper - g.plane.lower).minCoeff();
  TraceOptions options;
  options.first_step = std::min(options.first_step, first * side);
  options.max_step = std::max(g.options.max_step, share * side);
  options.stop = g.options.stop;
  options.max_points = 2000;
  CurvePoint at;
  if (first_point(curve, seed.y, VectorXd::Zero(seed.y.size()), options, at) != CurveEnd::stopped)
    return {{}, "no boundary here", {}};
  at.tangent *= sign;
  std::vector<LimitName> limits = g.plane.limits();
  std::erase_if(limits, [&](const LimitName& l) {
    return seed.stop.limit && l.signal == seed.stop.limit->signal &&
           l.upper == seed.stop.limit->upper;
  });
  const std::vector<TestFunction> tests = test_functions(g, seed.stop, limits);
  HalfWay half{{at.y}, leaves_at_once(at, tests, limits), {}};
  if (!half.end.empty()) return half;
  const auto visit = [&](const CurvePoint& next, std::vector<LocatedEvent>& found) {
    for (const LocatedEvent& c : found) {
      if (c.which != folding && c.rising) continue;
      half.way.push_back(c.at.y);
      if (c.which == other_limits)
        half.corner = Seed{{limits[std::size_t(c.index)]}, c.at.y, !seed.stop.limit};
      if (c.which == folding) half.corner = Seed{{}, c.at.y};
      half.end = half.corner ? half.corner->stop.name() : "edge";
      return false;
    }
    half.way.push_back(next.y);
    return true;
  };
  const CurveEnd end = trace(curve, at, tests, options, visit);
  if (end == CurveEnd::closed) half.end = "loop";
  if (!half.end.empty()) return half;
  // The model may end at the plane's edge, as at a switch: then no edge can be crossed.
  at.y = half.way.back();
  const bool at_edge = tests[plane_edge](at).minCoeff() < differences;
  half.end = at_edge ? "edge" : end == CurveEnd::points ? cut_off : "lost";
  return half;
}

// The piece through a seed; at a meeting of a limit and a fold, the two pieces that begin there.
std::vector<Followed> pieces(const Grid& g, const Seed& seed, std::deque<Seed>& seeds) {
  HalfWay back = half_way(g, seed, -1.0);
  HalfWay ahead = back.end == "loop" ? HalfWay{{}, "loop", {}} : half_way(g, seed, 1.0);
  for (const HalfWay* half : {&back, &ahead})
    if (half->corner) seeds.push_back(*half->corner);
  const std::string name = seed.stop.name();
  std::ranges::reverse(back.way);
  if (seed.on_fold)
    return {{{name, {}, back.end, "fold"}, seed.stop, back.way},
            {{name, {}, "fold", ahead.end}, seed.stop, ahead.way}};
  if (!ahead.way.empty()) back.way.insert(back.way.end(), ahead.way.begin() + 1, ahead.way.end());
  return {{{name, {}, back.end, ahead.end}, seed.stop, back.way}};
}

// Measures the way of a piece and returns its length.
double measure(Followed& f) {
  if (f.way.empty()) return 0.0;
  double length = 0.0;
  f.low = f.high = f.way.front();
  for (std::size_t k = 0; k + 1 < f.way.size(); ++k) {
    const double step = (f.way[k + 1] - f.way[k]).norm();
    length += step;
    f.longest_step = std::max(f.longest_step, step);
    f.low = f.low.cwiseMin(f.way[k + 1]);
    f.high = f.high.cwiseMax(f.way[k + 1]);
  }
  f.mean_step = length / double(f.way.size() - 1);
  return length;
}

// Whether a piece passes through the seed. The arc over a chord may be as far from it as another
// piece: Newton from the chord finds the piece's own point across from the seed. All distances are
// relative to the piece's steps, whatever its size.
bool passes(const Grid& g, const Followed& f, const Seed& seed) {
  constexpr double same = 0.01;              // of the mean step
  constexpr double arc = 0.25, bend = 0.05;  // of a chord; where Newton does not converge
  if (f.piece.name != seed.stop.name()) return false;
  const double apart = same * f.mean_step, reach = std::max(apart, arc * f.longest_step);
  if ((f.low - seed.y).maxCoeff() > reach || (seed.y - f.high).maxCoeff() > reach) return false;
  for (std::size_t k = 0; k + 1 < f.way.size(); ++k) {
    const VectorXd chord = f.way[k + 1] - f.way[k], along = chord.normalized();
    const double size = chord.norm(), ahead = along.dot(seed.y - f.way[k]);
    const VectorXd foot = f.way[k] + std::clamp(ahead, 0.0, size) * along;
    const double away = (seed.y - foot).norm();
    if (away <= apart) return true;
    if (away > arc * size || ahead < -apart || ahead > size + apart) continue;
    const Curve curve = border(g.plane, seed.stop, seed.y);
    const auto own = in_plane(curve, foot, along, along.dot(seed.y), size);
    if (own ? (*own - seed.y).norm() <= apart : away <= bend * size) return true;
  }
  return false;
}

// True if no other trim within the limits exists at the border point's parameters.
bool alone(const Grid& g, const VectorXd& y) {
  constexpr double other = 1e-4;  // scaled: farther than the border's own trim
  const std::vector<VectorXd> starts = around(g, y.tail<2>());
  g.put(y.tail<2>());
  return std::ranges::none_of(starts, [&](VectorXd z) {
    return settle(g, z, 20) == Settled::trim &&
           (z - y.head(g.n())).lpNorm<Eigen::Infinity>() > other;
  });
}

}  // namespace

BorderPiece::Point reported(const Grid& g, const VectorXd& y) {
  BorderPiece::Point b;
  const Values v = values(g.moving, y);
  b.x = y[g.n()] * g.moving.nominal[g.n()];
  b.y = y[g.n() + 1] * g.moving.nominal[g.n() + 1];
  b.point = point_of(g.moving, y);
  b.outputs = outputs(g.moving, b.point);
  b.residual = v.residual.lpNorm<Eigen::Infinity>();
  b.outer = alone(g, y);
  return b;
}

void follow_border(const Grid& g, std::deque<Seed>& seeds, std::vector<Followed>& all) {
  // Shorter pieces are an artifact of a corner.
  const double shortest = 1e-4 * std::min(1.0, (g.plane.upper - g.plane.lower).minCoeff());
  while (!seeds.empty() && all.size() < most_border_pieces && !g.options.stop.stop_requested()) {
    const Seed seed = std::move(seeds.front());
    seeds.pop_front();
    if (std::ranges::any_of(all, [&](const Followed& f) { return passes(g, f, seed); })) continue;
    for (Followed& f : pieces(g, seed, seeds))
      if (measure(f) > shortest) all.push_back(std::move(f));
  }
}

}  // namespace tiltrim
