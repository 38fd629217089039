#include "follow/curve.hpp"

#include <algorithm>
#include <boost/math/tools/toms748_solve.hpp>
#include <cmath>
#include <cstdint>
#include <limits>
#include <optional>

#include "dense/dense.hpp"

namespace tiltrim {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();
constexpr double epsilon = std::numeric_limits<double>::epsilon();
constexpr int newton_cap = 10;
constexpr double rank_below = 1e-12;  // pivot ratio at which the plane's system counts as singular
constexpr double smooth = 2e-3;       // of a step: deviation of its chord from the mean tangent
constexpr double nearby = 0.3;        // of a step: from the prediction to Newton's solution

enum class Failure { none, not_finite, singular, no_convergence };

// [slopes; directionᵀ], factorized.
dense::LU<MatrixXd> bordered(const MatrixXd& slopes, const VectorXd& direction) {
  MatrixXd M(slopes.cols(), slopes.cols());
  M.topRows(slopes.rows()) = slopes;
  M.bottomRows(1) = direction.transpose();
  return dense::lu(M);
}

bool singular(const dense::LU<MatrixXd>& lu) {
  const auto pivots = lu.pivots().cwiseAbs();
  return !(pivots.minCoeff() > rank_below * std::max(1.0, pivots.maxCoeff()));
}

// Newton on  G(y) = 0,  direction · (y - origin) = s.                           [25, sec. 6.1]
// `fine`: continue until the step no longer decreases.
Failure newton_in_plane(const Curve& curve, const VectorXd& origin, const VectorXd& direction,
                        double s, VectorXd y, bool fine, const TraceOptions& options,
                        CurvePoint& point, int& iterations) {
  const Index n = y.size();
  VectorXd G, rhs(n);
  MatrixXd slopes;
  double last = infinity;
  for (iterations = 1; iterations <= newton_cap; ++iterations) {
    if (!curve.evaluate(y, G, slopes)) return Failure::not_finite;
    const auto lu = bordered(slopes, direction);
    rhs << -G, s - direction.dot(y - origin);
    const VectorXd dy = dense::solve(lu, rhs);
    if (!dy.allFinite()) return Failure::singular;
    const double step = dy.lpNorm<Eigen::Infinity>();
    const double residual = G.size() > 0 ? G.lpNorm<Eigen::Infinity>() : 0.0;
    const bool settled = residual <= options.tolerance && step <= options.step_tolerance;
    const double rounding = 64 * epsilon * (1 + y.lpNorm<Eigen::Infinity>());
    if (settled && (!fine || step <= rounding || step > 0.25 * last)) {
      if (singular(lu)) return Failure::singular;
      VectorXd along = dense::solve(lu, VectorXd::Unit(n, n - 1));
      const double length = along.norm();
      if (!std::isfinite(length)) return Failure::singular;
      point.y = y;
      point.tangent = along / length;
      // det [slopes; tᵀ] = det [slopes; directionᵀ] / (direction · t)
      point.turn = dense::determinant(lu) * length;
      point.residual = residual;
      point.step = step;
      return Failure::none;
    }
    if (iterations > 2 && step > 0.9 * last && !settled) return Failure::no_convergence;
    last = step;
    y += dy;
  }
  return Failure::no_convergence;
}

// Cubic Hermite interpolation between the ends of one step, at length s along the tangent at `a`.
VectorXd between(const CurvePoint& a, const CurvePoint& b, double h, double s) {
  const double t = s / h;
  const VectorXd slope_b = b.tangent * (h / a.tangent.dot(b.tangent));
  const VectorXd slope_a = a.tangent * h;
  const double h00 = (1 + 2 * t) * (1 - t) * (1 - t), h10 = t * (1 - t) * (1 - t);
  const double h01 = t * t * (3 - 2 * t), h11 = t * t * (t - 1);
  return h00 * a.y + h10 * slope_a + h01 * b.y + h11 * slope_b;
}

// True if a parabola through the last three values crosses zero twice between the last two.
bool may_dip(double s0, double g0, double s1, double g1, double s2, double g2) {
  if (!((g1 > 0 && g2 > 0) || (g1 < 0 && g2 < 0))) return false;  // sign change, or zero at an end
  const double d01 = (g1 - g0) / (s1 - s0), d12 = (g2 - g1) / (s2 - s1);
  const double curvature = (d12 - d01) / (s2 - s0);
  if (!(curvature * g1 > 0)) return false;
  const double slope = d12 - curvature * (s2 - s1);  // at s1
  const double at = -slope / (2 * curvature);
  if (!(at > 0 && at < s2 - s1)) return false;
  return (g1 + slope * at + curvature * at * at) * g1 <= 0;
}

struct TestValues {
  CurvePoint point;
  std::vector<VectorXd> values;
};

TestValues test_values(const CurvePoint& point, const std::vector<TestFunction>& tests) {
  TestValues w{point, {}};
  for (const TestFunction& test : tests) w.values.push_back(test(point));
  return w;
}

bool hides_a_dip(const TestValues& before, const TestValues& a, const TestValues& b) {
  for (std::size_t w = 0; w < a.values.size(); ++w)
    for (Index i = 0; i < a.values[w].size(); ++i)
      if (may_dip(before.point.s, before.values[w][i], a.point.s, a.values[w][i], b.point.s,
                  b.values[w][i]))
        return true;
  return false;
}

// Locates one sign change between a and b to round-off in s. If Newton finds no point close to it,
// as at a branch point or a kink, the nearest point found is used.
std::optional<LocatedEvent> located(const Curve& curve, const TestValues& a, const TestValues& b,
                                    const TestFunction& test, std::size_t w, Index i,
                                    const TraceOptions& options) {
  constexpr double jumps = 1e-3;  // share of the function's values that remains if there is no zero
  const double h = b.point.s - a.point.s;
  const bool rising = b.values[w][i] > a.values[w][i];
  CurvePoint best;
  double least = infinity, lost = -1.0;
  const auto g = [&](double s) {
    CurvePoint at;
    int iterations = 0;
    if (newton_in_plane(curve, a.point.y, a.point.tangent, s, between(a.point, b.point, h, s), true,
                        options, at, iterations) != Failure::none) {
      lost = s;
      return 0.0;
    }
    at.s = a.point.s + s;
    const double value = test(at)[i];
    if (std::abs(value) < least) best = at, least = std::abs(value);
    return std::isnan(value) ? 0.0 : value;
  };
  std::uintmax_t iterations = 60;
  const auto close = [h](double low, double high) { return high - low <= 4 * epsilon * h; };
  boost::math::tools::toms748_solve(g, 0.0, h, a.values[w][i], b.values[w][i], close, iterations);
  if (lost < 0) {
    const double before = std::min(std::abs(a.values[w][i]), std::abs(b.values[w][i]));
    if (least > std::max(jumps * before, options.tolerance)) return {};
    const double d = 1e-3 * h, s = std::clamp(best.s - a.point.s, d, h - d);
    const CurvePoint event = best;
    const double slope = (g(s + d) - g(s - d)) / (2 * d);
    return LocatedEvent{w, i, rising, event, slope};
  }
  // Newton fails within the rounding error of G over its derivative, which vanishes there.
  const double at = lost;
  for (const double next_to : {1e-6, 1e-5, 1e-4}) {
    const double low = g(std::max(at - 0.5 * next_to, 0.0)),
                 high = g(std::min(at + 0.5 * next_to, h));
    if (low == 0 || high == 0) continue;  // no point there either
    const bool like = low * high < 0 && std::abs(low) < 100 * std::abs(high) &&
                      std::abs(high) < 100 * std::abs(low);
    if (!like || std::abs(best.s - (a.point.s + at)) > next_to) return {};
    return LocatedEvent{w, i, rising, best, (high - low) / next_to, next_to};
  }
  return {};
}

// All sign changes between a and b in order; empty if one cannot be located.
std::optional<std::vector<LocatedEvent>> crossings(const Curve& curve, const TestValues& a,
                                                   const TestValues& b,
                                                   const std::vector<TestFunction>& tests,
                                                   const TraceOptions& options) {
  std::vector<LocatedEvent> found;
  for (std::size_t w = 0; w < tests.size(); ++w)
    for (Index i = 0; i < a.values[w].size(); ++i) {
      const double from = a.values[w][i], to = b.values[w][i];
      if (!((from > 0 && to <= 0) || (from < 0 && to >= 0))) continue;
      const auto one = to == 0 ? std::optional(LocatedEvent{w, i, to > from, b.point,
                                                            (to - from) / (b.point.s - a.point.s)})
                               : located(curve, a, b, tests[w], w, i, options);
      if (!one) return {};
      found.push_back(*one);
    }
  std::ranges::stable_sort(found, {}, [](const LocatedEvent& c) { return c.at.s; });
  return found;
}

// True if the curve returns to its start between a and b.
bool back_at(const CurvePoint& start, const CurvePoint& a, const CurvePoint& b) {
  constexpr double near = 0.02;  // of the step
  constexpr int halvings = 30;
  const auto beyond = [&](const VectorXd& y) { return start.tangent.dot(y - start.y); };
  if (!(beyond(a.y) < 0 && beyond(b.y) >= 0) || start.tangent.dot(b.tangent) < 0.5) return false;
  const double h = b.s - a.s;
  double low = 0.0, high = h;
  for (int i = 0; i < halvings; ++i) {
    const double middle = 0.5 * (low + high);
    (beyond(between(a, b, h, middle)) < 0 ? low : high) = middle;
  }
  return (between(a, b, h, high) - start.y).norm() <= near * h;
}

CurveEnd end_of(Failure failure) {
  return failure == Failure::not_finite ? CurveEnd::not_finite
         : failure == Failure::singular ? CurveEnd::singular
                                        : CurveEnd::stuck;
}

}  // namespace

CurveEnd first_point(const Curve& curve, const VectorXd& y, const VectorXd& towards,
                     const TraceOptions& options, CurvePoint& point) {
  VectorXd G;
  MatrixXd slopes;
  if (!curve.evaluate(y, G, slopes)) return CurveEnd::not_finite;
  const MatrixXd kernel = dense::kernel(slopes);
  if (kernel.cols() != 1 || !kernel.allFinite()) return CurveEnd::singular;
  VectorXd along = kernel.col(0);
  if (along.dot(towards) < 0) along = -along;
  int iterations = 0;
  const Failure failure =
      newton_in_plane(curve, y, along, 0.0, y, true, options, point, iterations);
  point.s = 0.0;
  return failure == Failure::none ? CurveEnd::stopped : end_of(failure);
}

bool point_at(const Curve& curve, const CurvePoint& from, Index k, double value,
              const TraceOptions& options, CurvePoint& point) {
  const double s = (value - from.y[k]) / from.tangent[k];
  VectorXd y = from.y + s * from.tangent;
  y[k] = value;
  int iterations = 0;
  const VectorXd along = VectorXd::Unit(y.size(), k);
  if (newton_in_plane(curve, y, along, 0.0, y, true, options, point, iterations) != Failure::none)
    return false;
  point.s = from.s + s;
  return (point.y - y).norm() <= std::max(nearby * s, options.step_tolerance);
}

namespace {

// One step along the tangent: its end, or the reason why a step of that length fails.
struct Step {
  Failure failure = Failure::none;
  CurvePoint to;
  double miss = 0.0;  // deviation of the chord from the mean tangent, relative to the step
  int iterations = 0;
};

// On a circle the chord is parallel to the mean tangent; with varying curvature or a jump it is
// not.
Step step(const Curve& curve, const CurvePoint& at, double h, const TraceOptions& options) {
  constexpr double sharp = 1e-6;  // below this step any turn is accepted: a kink
  Step s;
  const VectorXd predicted = at.y + h * at.tangent;
  s.failure =
      newton_in_plane(curve, at.y, at.tangent, h, predicted, false, options, s.to, s.iterations);
  if (s.failure != Failure::none) return s;
  s.to.s = at.s + h;
  const double cosine = at.tangent.dot(s.to.tangent);
  const VectorXd mean = (at.tangent + s.to.tangent) / (1 + cosine);
  s.miss = (s.to.y - at.y - h * mean).norm() / h;
  const double away = (s.to.y - predicted).norm() / h;
  if (away > nearby || cosine < 0 || (s.miss > smooth && h > sharp))
    s.failure = Failure::no_convergence;
  return s;
}

// If a step returns to the start, its end is set to the start.
void close(const CurvePoint& start, const CurvePoint& at, CurvePoint& to) {
  const double length = std::abs(start.tangent.dot(start.y - at.y));
  to = start;
  to.s = at.s + length;
}

// Length of the next step. The deviation grows with the square of the step: aim at a quarter of
// the allowed value.
double next_length(const Step& s, double h, const TraceOptions& options) {
  const double room = std::sqrt(0.25 * smooth / std::max(s.miss, 1e-12));
  const double most = s.iterations > 5 ? 0.5 : 2.0;
  return std::min(options.max_step, h * std::clamp(room, 0.5, most));
}

}  // namespace

CurveEnd trace(const Curve& curve, const CurvePoint& start, const std::vector<TestFunction>& tests,
               const TraceOptions& options, const Visit& visit) {
  constexpr double subtle = 1e-4;  // below this step a hidden pair of crossings is not searched for
  constexpr double crawl = 1e-7;   // a step so short that many of them make no progress
  constexpr int most_crawled = 50;
  int crawled = 0;
  TestValues at = test_values(start, tests);
  std::optional<TestValues> before;
  double h = options.first_step;
  Failure failure = Failure::none;
  for (int points = 1; points < options.max_points;) {
    if (options.stop.stop_requested()) return CurveEnd::interrupted;
    if (!(h >= options.min_step)) return end_of(failure);
    if (crawled > most_crawled) return CurveEnd::stuck;
    Step taken = step(curve, at.point, h, options);
    failure = taken.failure;
    if (failure != Failure::none) {
      h /= 2;
      continue;
    }
    const bool closes = points > 3 && back_at(start, at.point, taken.to);
    if (closes) close(start, at.point, taken.to);
    TestValues next = test_values(taken.to, tests);
    const bool hides = before && h > subtle && !closes && hides_a_dip(*before, at, next);
    auto events = hides ? std::nullopt : crossings(curve, at, next, tests, options);
    if (!events) {
      failure = Failure::no_convergence;
      h /= 2;
      continue;
    }
    ++points;
    crawled = h < crawl ? crawled + 1 : 0;
    if (!visit(next.point, *events)) return CurveEnd::stopped;
    if (closes) return CurveEnd::closed;
    before = std::move(at);
    at = std::move(next);
    h = next_length(taken, h, options);
  }
  return CurveEnd::points;
}

}  // namespace tiltrim
