#include "follow/envelope.hpp"

#include <fmt/core.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <deque>
#include <stdexcept>

#include "follow/grid.hpp"

namespace tiltrim {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::Vector2d;
using Eigen::VectorXd;

namespace {

// ---- the border ----

struct Seed {
  Stop stop;
  VectorXd y;
};

// A point lies on a piece already followed if a chord passes it by less than the piece bends.
bool on(const BorderPiece& piece, const std::vector<VectorXd>& way, const Seed& seed) {
  constexpr double least = 2e-3, bend = 0.05;  // scaled; of the chord
  if (piece.name != seed.stop.name()) return false;
  for (std::size_t k = 0; k + 1 < way.size(); ++k) {
    const VectorXd along = way[k + 1] - way[k], to = seed.y - way[k];
    const double t = std::clamp(to.dot(along) / along.squaredNorm(), 0.0, 1.0);
    if ((to - t * along).norm() <= std::max(least, bend * along.norm())) return true;
  }
  return false;
}

struct Followed {
  BorderPiece piece;
  std::vector<VectorXd> way;
};

// One way along the border from a seed, until it leaves the plane, meets another stop or closes.
struct HalfWay {
  std::vector<VectorXd> way;
  std::string end;
  std::optional<Seed> corner;
};

enum Watched : std::size_t { plane_edge, other_limits, folding };

HalfWay half_way(const Grid& g, const Seed& seed, double sign) {
  const Curve curve = border(g.plane, seed.stop, seed.y);
  TraceOptions options;
  options.max_step = g.options.max_step;
  options.stop = g.options.stop;
  options.max_points = 2000;
  HalfWay half;
  CurvePoint at;
  if (first_point(curve, seed.y, VectorXd::Zero(seed.y.size()), options, at) != CurveEnd::stopped) {
    half.end = "no border here";
    return half;
  }
  at.tangent *= sign;
  std::vector<LimitName> limits = g.plane.limits();
  std::erase_if(limits, [&](const LimitName& l) {
    return seed.stop.limit && l.signal == seed.stop.limit->signal &&
           l.upper == seed.stop.limit->upper;
  });
  const bool folds = !seed.stop.limit;
  std::vector<Watch> watches(3);
  watches[plane_edge] = [&g](const CurvePoint& p) {
    VectorXd d(4);
    d << p.y.tail<2>() - g.plane.lower, g.plane.upper - p.y.tail<2>();
    return d;
  };
  watches[other_limits] = [&](const CurvePoint& p) {
    const Values v = values(g.moving, p.y);
    VectorXd d(std::ssize(limits));
    for (Index k = 0; k < d.size(); ++k) d[k] = distance(limits[std::size_t(k)], p.y, v);
    return d;
  };
  watches[folding] = [&](const CurvePoint& p) {
    if (folds) return VectorXd();
    const MatrixXd J = slopes(g.moving, p.y).residual.leftCols(g.n());
    return VectorXd(VectorXd::Constant(1, J.determinant()));
  };
  half.way.push_back(at.y);
  // On the plane's edge or another limit already, and outwards.
  constexpr double ahead = 1e-6, on = 1e-9;
  CurvePoint beyond = at;
  beyond.y += ahead * at.tangent;
  for (const Watched what : {plane_edge, other_limits}) {
    const VectorXd here = watches[what](at), there = watches[what](beyond);
    for (Index k = 0; k < here.size(); ++k) {
      if (!(here[k] <= on && there[k] < here[k])) continue;
      half.end = what == plane_edge ? "edge" : Stop{limits[std::size_t(k)]}.name();
      return half;
    }
  }
  const CurveEnd end =
      trace(curve, at, watches, options, [&](const CurvePoint& next, std::vector<Crossing>& found) {
        for (const Crossing& c : found) {
          if (c.watch == other_limits && c.rising) continue;
          if (c.watch == plane_edge && c.rising) continue;
          half.way.push_back(c.at.y);
          half.end = "edge";
          if (c.watch == other_limits) half.corner = Seed{{limits[std::size_t(c.index)]}, c.at.y};
          if (c.watch == folding) half.corner = Seed{{}, c.at.y};
          if (half.corner) half.end = half.corner->stop.name();
          return false;
        }
        half.way.push_back(next.y);
        return true;
      });
  if (end == CurveEnd::closed) half.end = "loop";
  if (!half.end.empty()) return half;
  // The model may end where the plane does, as at a switch: then no edge can be crossed.
  CurvePoint last = at;
  last.y = half.way.back();
  constexpr double differences = 2e-5;  // a fold's slopes reach this far
  const bool at_edge = watches[plane_edge](last).minCoeff() < differences;
  half.end = at_edge ? "edge" : end == CurveEnd::points ? "too many points" : "lost";
  return half;
}

// Whether another trim within the limits lies just across the border, away from `inside`.
bool alone(const Grid& g, const VectorXd& y) {
  const Vector2d p = y.tail<2>();
  const Vector2d cell =
      (g.plane.upper - g.plane.lower).cwiseQuotient(Vector2d(g.x.count - 1, g.y.count - 1));
  const Vector2d at = (p - g.plane.lower).cwiseQuotient(cell);
  const int i0 = std::clamp(int(at[0]), 0, g.x.count - 2),
            j0 = std::clamp(int(at[1]), 0, g.y.count - 2);
  for (int i = std::max(0, i0 - 1); i <= std::min(g.x.count - 1, i0 + 2); ++i)
    for (int j = std::max(0, j0 - 1); j <= std::min(g.y.count - 1, j0 + 2); ++j)
      for (const VectorXd& t : g.trims[g.node(i, j)]) {
        g.put(p);
        VectorXd z = t.head(g.n());
        if (settle(g, z, 20) != Settled::trim) continue;
        constexpr double other = 1e-4;  // scaled: not the border's own trim
        if ((z - y.head(g.n())).lpNorm<Eigen::Infinity>() > other) return false;
      }
  return true;
}

BorderPoint reported(const Grid& g, const VectorXd& y) {
  BorderPoint b;
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
  constexpr std::size_t most = 400;  // pieces
  while (!seeds.empty() && all.size() < most && !g.options.stop.stop_requested()) {
    const Seed seed = std::move(seeds.front());
    seeds.pop_front();
    if (std::ranges::any_of(all, [&](const Followed& f) { return on(f.piece, f.way, seed); }))
      continue;
    HalfWay back = half_way(g, seed, -1.0);
    HalfWay ahead = back.end == "loop" ? HalfWay{{}, "loop", {}} : half_way(g, seed, 1.0);
    Followed f;
    f.piece.name = seed.stop.name();
    f.piece.from = back.end;
    f.piece.to = ahead.end;
    f.way.assign(back.way.rbegin(), back.way.rend());
    if (!ahead.way.empty()) f.way.insert(f.way.end(), ahead.way.begin() + 1, ahead.way.end());
    for (const HalfWay* half : {&back, &ahead})
      if (half->corner) seeds.push_back(*half->corner);
    if (f.way.size() > 1) all.push_back(std::move(f));
  }
}

// ---- rows ----

// The intervals of x at one y in which some sheet has a trim, every end located.
EnvelopeRow row_at(const Grid& g, double y) {
  EnvelopeRow row{y * g.moving.nominal[g.n() + 1], {}};
  const double share = (y - g.plane.lower[1]) / (g.plane.upper[1] - g.plane.lower[1]);
  const int j = std::clamp(int(std::lround(share * (g.y.count - 1))), 0, g.y.count - 1);
  const double nominal = g.moving.nominal[g.n()];
  std::vector<EnvelopeInterval> found;
  for (int i = 0; i < g.x.count; ++i)
    for (const VectorXd& t : g.trims[g.node(i, j)]) {
      Vector2d p = g.place(i, j);
      p[1] = y;
      g.put(p);
      VectorXd z = t.head(g.n());
      if (settle(g, z, 12) != Settled::trim) continue;
      const double x = p[0] * nominal;
      const bool inside = std::ranges::any_of(
          found, [&](const EnvelopeInterval& k) { return x >= k.from.x && x <= k.to.x; });
      if (inside) continue;  // some trim is there: this one adds nothing but where it reaches
      VectorXd from(z.size() + 2);
      from << z, p;
      const auto end = [&](double to) -> EnvelopeEnd {
        if (p[0] == to) return {to * nominal, "edge"};
        const Way way = go(g.plane, from, Vector2d(to, y));
        if (way.met) return {way.met->y[g.n()] * nominal, way.met->stop.name()};
        return {way.arrived ? to * nominal : x, way.arrived ? "edge" : "lost"};
      };
      found.push_back({end(g.plane.lower[0]), end(g.plane.upper[0])});
    }
  std::ranges::sort(found, {}, [](const EnvelopeInterval& k) { return k.from.x; });
  for (const EnvelopeInterval& k : found) {
    if (row.intervals.empty() || k.from.x > row.intervals.back().to.x)
      row.intervals.push_back(k);
    else if (k.to.x > row.intervals.back().to.x)
      row.intervals.back().to = k.to;
  }
  return row;
}

TrimSpec over_plane(const Model& model, const TrimSpec& spec, const EnvelopeAxis& x,
                    const EnvelopeAxis& y) {
  for (const EnvelopeAxis* axis : {&x, &y}) {
    if (!(axis->range.lower < axis->range.upper && std::isfinite(axis->range.lower) &&
          std::isfinite(axis->range.upper)))
      throw std::invalid_argument(fmt::format("the range of '{}' is not a range: [{}, {}]",
                                              axis->signal, axis->range.lower, axis->range.upper));
    if (axis->count < 2)
      throw std::invalid_argument(
          fmt::format("'{}' needs two grid points at least, not {}", axis->signal, axis->count));
  }
  if (x.signal == y.signal)
    throw std::invalid_argument(fmt::format("both axes are '{}'", x.signal));
  return with_parameter(model, with_parameter(model, spec, x.signal), y.signal);
}

}  // namespace

Envelope envelope(const Model& model, const TrimSpec& spec, const OperatingPoint& guess,
                  const EnvelopeAxis& x, const EnvelopeAxis& y, const EnvelopeOptions& options) {
  const TrimSpec over = over_plane(model, spec, x, y);
  TrimSpec fixed = over;
  fixed.free.resize(fixed.free.size() - 2);
  Grid g(model, fixed, over, guess, x, y, options);
  if (!g.fixed.square())
    throw std::invalid_argument(
        fmt::format("an envelope needs as many unknowns as equations, not {} and {}", g.fixed.n(),
                    g.fixed.m()));
  std::deque<Front> front;
  seed(g, front);
  std::vector<Followed> border;
  std::deque<Seed> seeds;
  while (!front.empty() &&
         !options.stop.stop_requested()) {  // ends: a grid point's trims are finite
    for (const Edge& edge : spread(g, front)) {
      if (options.stop.stop_requested()) break;
      const Way way = go(g.plane, edge.from, g.place(edge.i, edge.j));
      if (way.arrived) add(g, edge.i, edge.j, way.arrived->head(g.n()), front);
      if (way.back) add(g, edge.at_i, edge.at_j, way.back->head(g.n()), front);
      if (!way.met) continue;
      seeds.push_back({way.met->stop, way.met->y});
      follow_border(g, seeds, border);
    }
  }

  Envelope e;
  e.x = x;
  e.y = y;
  e.count.resize(x.count, y.count);
  for (int i = 0; i < x.count; ++i)
    for (int j = 0; j < y.count; ++j) e.count(i, j) = int(g.trims[g.node(i, j)].size());
  for (Followed& f : border) {
    for (const VectorXd& at : f.way) f.piece.points.push_back(reported(g, at));
    e.pieces.push_back(std::move(f.piece));
  }
  const bool stopped = options.stop.stop_requested();
  for (const double at : stopped ? std::vector<double>() : options.rows)
    e.rows.push_back(row_at(g, at / g.moving.nominal[g.n() + 1]));
  e.evaluations = g.fixed.evaluations + g.moving.evaluations;
  if (e.count.maxCoeff() == 0) e.status = EnvelopeStatus::empty;
  if (stopped) e.status = EnvelopeStatus::interrupted;
  return e;
}

}  // namespace tiltrim
