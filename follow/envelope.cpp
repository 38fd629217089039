#include "follow/envelope.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <deque>
#include <limits>
#include <stdexcept>

#include "dense/dense.hpp"
#include "follow/grid.hpp"
#include "runtime/rounding.hpp"
#include "runtime/threads.hpp"

namespace tiltrim {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::Vector2d;
using Eigen::VectorXd;

namespace {

constexpr double same_break = 1e-9;  // scaled: closer breaks of a row are the same
constexpr const char* cut_off = "too many points";

// ---- the border ----

struct Seed {
  Stop stop;
  VectorXd y;
  bool on_fold = false;  // where a limit meets a fold: the limits of two sheets begin here
};

struct Followed {
  BorderPiece piece;
  Stop stop;
  std::vector<VectorXd> way;
  VectorXd low{}, high{};  // of the way
  double mean_step = 0.0, longest_step = 0.0;
};

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

// The curve's point in the plane direction · y = level, by Newton from y; none if a step is long.
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

// ---- rows ----

struct Break {
  double x;  // scaled
  std::string name;
};

// Where a piece of border crosses a row between two of its points, to round-off; less accurate
// next to a switch, where Newton does not converge.
Break crossing(const Grid& g, const Followed& f, const VectorXd& a, const VectorXd& b, double row) {
  const Index n = a.size();
  const double rise = b[n - 1] - a[n - 1];
  const double share = rise != 0 ? std::clamp((row - a[n - 1]) / rise, 0.0, 1.0) : 0.0;
  const VectorXd y = a + share * (b - a);
  const auto at =
      in_plane(border(g.plane, f.stop, y), y, VectorXd::Unit(n, n - 1), row, (b - a).norm() + 1e-3);
  return {at.value_or(y)[n - 2], f.piece.name};
}

std::vector<Break> breaks(const Grid& g, const std::vector<Followed>& border, double row) {
  constexpr double on_row =
      2e-5;  // a piece that ends at the plane's edge may stop this far before it
  std::vector<Break> all{{g.plane.lower[0], "edge"}, {g.plane.upper[0], "edge"}};
  for (const Followed& f : border) {
    const auto above = [&](const VectorXd& y) { return y[y.size() - 1] - row; };
    for (std::size_t k = 0; k + 1 < f.way.size(); ++k)
      if ((above(f.way[k]) < 0) != (above(f.way[k + 1]) < 0))
        all.push_back(crossing(g, f, f.way[k], f.way[k + 1], row));
    for (const VectorXd* end : {&f.way.front(), &f.way.back()})
      if (std::abs(above(*end)) <= on_row) all.push_back(crossing(g, f, *end, *end, row));
  }
  std::ranges::stable_sort(all, {}, &Break::x);
  return all;
}

// A trim within the limits at the point, if one is found, starting from nearby trims and from the
// border. Near a fold its two trims are close to each other and are started away from the fold.
std::optional<VectorXd> somewhere(const Grid& g, const std::vector<Followed>& border,
                                  const Vector2d& p) {
  constexpr int cap = 20;
  const Vector2d cell =
      (g.plane.upper - g.plane.lower).cwiseQuotient(Vector2d(g.x.count - 1, g.y.count - 1));
  std::vector<VectorXd> starts = around(g, p);
  for (const Followed& f : border)
    for (const VectorXd& y : f.way) {
      if ((y.tail<2>() - p).cwiseAbs().cwiseQuotient(cell).maxCoeff() > 1.0) continue;
      starts.push_back(y.head(g.n()));
      if (f.stop.limit) continue;
      const VectorXd c = FoldTest(g.plane, y).c;
      for (const double off : {-0.3, -0.05, 0.05, 0.3}) starts.push_back(y.head(g.n()) + off * c);
    }
  g.put(p);
  for (VectorXd& z : starts) {
    if (settle(g, z, cap) != Settled::trim) continue;
    VectorXd y(g.n() + 2);
    y << z, p;
    return y;
  }
  return {};
}

// Where trims end on a row between x with a trim and x without: at a stop not found as a piece, or
// where the values are not finite; in that case bisection finds the last trim.
Break last_between(const Grid& g, const std::vector<Followed>& border, VectorXd with,
                   double without, double row) {
  constexpr int halvings = 40;
  constexpr double beyond = 1e-6;
  const Index at_x = g.n();
  const double way_out = without > with[at_x] ? 1.0 : -1.0;
  const Way way = go(g.plane, with, Vector2d(without, row));
  if (way.met) {
    const double x = way.met->y[at_x];
    if (!somewhere(g, border, Vector2d(x + way_out * beyond, row)))
      return {x, way.met->stop.name()};
  }
  for (int i = 0; i < halvings; ++i) {
    const double middle = 0.5 * (with[at_x] + without);
    if (auto y = somewhere(g, border, Vector2d(middle, row)))
      with = *y;
    else
      without = middle;
  }
  return {with[at_x], "lost"};
}

// x at which a row is tested between two of its breaks: grid values, or the middle.
std::vector<double> samples(const Grid& g, double a, double b) {
  std::vector<double> xs{0.5 * (a + b)};
  for (int i = 0; i < g.x.count; ++i)
    if (const double x = g.place(i, 0)[0]; x > a + same_break && x < b - same_break)
      xs.push_back(x);
  std::ranges::sort(xs);
  return xs;
}

// The intervals of x at one y in which at least one sheet has a trim.
EnvelopeRow row_at(const Grid& g, const std::vector<Followed>& border, double y) {
  const double nominal = g.moving.nominal[g.n()];
  EnvelopeRow row{y * g.moving.nominal[g.n() + 1], {}};
  bool open = false;  // the last interval may continue
  const auto add_piece = [&](const Break& from, const Break& to) {
    if (!open) row.intervals.push_back({{from.x * nominal, from.name}, {}});
    row.intervals.back().to = {to.x * nominal, to.name};
    open = true;
  };
  const std::vector<Break> all = breaks(g, border, y);
  for (std::size_t k = 0; k + 1 < all.size(); ++k) {
    if (!(all[k + 1].x - all[k].x > same_break)) continue;
    const std::vector<double> xs = samples(g, all[k].x, all[k + 1].x);
    Break from = all[k];
    auto last = somewhere(g, border, Vector2d(xs.front(), y));
    open = open && last;
    for (std::size_t i = 1; i < xs.size(); ++i) {
      const auto next = somewhere(g, border, Vector2d(xs[i], y));
      if (last && !next) {
        add_piece(from, last_between(g, border, *last, xs[i], y));
        open = false;
      }
      if (!last && next) from = last_between(g, border, *next, xs[i - 1], y);
      last = next;
    }
    if (last) add_piece(from, all[k + 1]);
  }
  return row;
}

TrimSpec over_plane(const Model& model, const TrimSpec& spec, const EnvelopeAxis& x,
                    const EnvelopeAxis& y) {
  for (const EnvelopeAxis* axis : {&x, &y}) {
    if (!(axis->range.lower < axis->range.upper && std::isfinite(axis->range.lower) &&
          std::isfinite(axis->range.upper)))
      throw std::invalid_argument(fmt::format("the range of '{}' is empty: [{}, {}]", axis->signal,
                                              axis->range.lower, axis->range.upper));
    if (axis->count < 2)
      throw std::invalid_argument(
          fmt::format("'{}' needs at least two grid points, not {}", axis->signal, axis->count));
  }
  if (x.signal == y.signal)
    throw std::invalid_argument(fmt::format("both axes are '{}'", x.signal));
  return with_parameter(model, with_parameter(model, spec, x.signal), y.signal);
}

}  // namespace

// Sheets to where they end, and the border from there, until nothing new is found.
static void explore(Grid& g, std::vector<Followed>& border, std::deque<Seed>& seeds) {
  const auto stopped = [&] { return g.options.stop.stop_requested(); };
  std::deque<Front> front;
  seed(g, front);
  while (!front.empty() && !stopped()) {  // ends: most_sheets trims at a point
    const std::vector<Edge> edges = spread(g, front);
    std::vector<Way> ways(edges.size());
    for_all(g, edges.size(), [&](const Grid& own, std::size_t k) {
      if (!stopped()) ways[k] = go(own.plane, edges[k].from, g.place(edges[k].i, edges[k].j));
    });
    for (std::size_t k = 0; k < edges.size() && !stopped(); ++k) {
      const Edge& edge = edges[k];
      const Way& way = ways[k];
      if (way.arrived) add(g, edge.i, edge.j, way.arrived->head(g.n()), true, front);
      if (way.back) add(g, edge.at_i, edge.at_j, way.back->head(g.n()), true, front);
      if (!way.met) continue;
      seeds.push_back({way.met->stop, way.met->y});
      follow_border(g, seeds, border);
    }
  }
}

static Envelope explored(Grid& g) {
  std::vector<Followed> border;
  std::deque<Seed> seeds;
  explore(g, border, seeds);
  Envelope e;
  e.x = g.x;
  e.y = g.y;
  e.count.resize(g.x.count, g.y.count);
  for (int i = 0; i < g.x.count; ++i)
    for (int j = 0; j < g.y.count; ++j) e.count(i, j) = int(g.sheets.trims[g.node(i, j)].size());
  const auto stopped = [&] { return g.options.stop.stop_requested(); };
  for (Followed& f : border) {
    if (stopped()) break;
    f.piece.points.resize(f.way.size());
    for_all(g, f.way.size(),
            [&](const Grid& own, std::size_t k) { f.piece.points[k] = reported(own, f.way[k]); });
    e.pieces.push_back(f.piece);
  }
  e.rows.resize(stopped() ? 0 : g.options.rows.size());
  for_all(g, e.rows.size(), [&](const Grid& own, std::size_t k) {
    e.rows[k] = row_at(own, border, g.options.rows[k] / g.moving.nominal[g.n() + 1]);
  });
  e.evaluations = g.fixed.evaluations + g.moving.evaluations;
  if (e.count.maxCoeff() == 0) e.status = EnvelopeStatus::empty;
  const auto ends_early = [](const BorderPiece& p) { return p.from == cut_off || p.to == cut_off; };
  if (!seeds.empty() || g.sheets.more || std::ranges::any_of(e.pieces, ends_early))
    e.status = EnvelopeStatus::incomplete;
  if (stopped()) e.status = EnvelopeStatus::interrupted;
  return e;
}

Envelope envelope(const Model& model, const TrimSpec& spec, const OperatingPoint& guess,
                  const EnvelopeAxis& x, const EnvelopeAxis& y, const EnvelopeOptions& options) {
  const RoundToNearest environment;
  const TrimSpec over = over_plane(model, spec, x, y);
  TrimSpec fixed = over;
  fixed.free.resize(fixed.free.size() - 2);
  Sheets sheets;
  Grid g(model, fixed, over, guess, x, y, options, sheets);
  if (!g.fixed.square())
    throw std::invalid_argument(
        fmt::format("an envelope needs as many unknowns as equations, not {} and {}", g.fixed.n(),
                    g.fixed.m()));
  if (options.threads == 1) return explored(g);
  Envelope e;
  with_threads(options.threads, [&] { e = explored(g); });
  return e;
}

std::string to_string(EnvelopeStatus status) {
  switch (status) {
    case EnvelopeStatus::complete:
      return "complete";
    case EnvelopeStatus::empty:
      return "empty";
    case EnvelopeStatus::interrupted:
      return "interrupted";
    case EnvelopeStatus::incomplete:
      break;
  }
  return "incomplete";
}

}  // namespace tiltrim
