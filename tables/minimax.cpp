// Minimax by NLopt: DIRECT over the box, then SLSQP on the smooth (epigraph) form.
#include "tables/minimax.hpp"

#include <algorithm>
#include <cmath>

#include "optimize/optimize.hpp"

namespace tiltrim::minimax {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();

// Epigraph form: min cost·(y, t) subject to |missᵢ| <= t, where z = origin + scale y.
struct LocalGoal {
  Search& search;
  const Box& box;
  Pair origin, scale;

  Pair at(const VectorXd& v) const {
    Pair z = origin;
    for (std::size_t j = 0; j < box.free.size(); ++j) {
      const std::size_t k = box.free[j];
      z[k] = std::clamp(origin[k] + scale[k] * v[Index(j)], box.lower[k], box.upper[k]);
    }
    return z;
  }

  // Rows i and i + 6: ±missᵢ - t <= 0
  void limits(const VectorXd& v, VectorXd& result, MatrixXd* slope) const {
    const auto& free = box.free;
    const Index t = std::ssize(free);
    Slopes slopes;
    const Misses misses = search.evaluate(at(v), &slopes);
    for (std::size_t i = 0; i < 12; ++i) {
      const double sign = i < 6 ? 1.0 : -1.0;
      result[Index(i)] = sign * misses[i % 6] - v[t];
      if (!slope) continue;
      for (std::size_t j = 0; j < free.size(); ++j)
        (*slope)(Index(i), Index(j)) = sign * slopes[i % 6][free[j]] * scale[free[j]];
      (*slope)(Index(i), t) = -1.0;
    }
  }
};

// One unit of y changes the most sensitive of the six by one unit of its last digit.
Pair natural_scale(Search& search, const Pair& z) {
  Slopes slopes;
  search.evaluate(z, &slopes);
  Pair scale{0.0, 0.0};
  for (const Pair& slope : slopes)
    for (std::size_t j = 0; j < pair_size; ++j) scale[j] = std::max(scale[j], std::abs(slope[j]));
  for (double& s : scale) s = s > 0.0 && std::isfinite(s) ? 1.0 / s : 1.0;
  return scale;
}

// Minimizes `direction`·(Ep, k), or t if the direction is zero.
void descend(Search& search, const Box& box, const Pair& from, const Pair& direction,
             double t_max) {
  const Index n = std::ssize(box.free);
  const LocalGoal goal{search, box, from, natural_scale(search, from)};
  VectorXd cost(n + 1);
  Optimization o;
  o.start = VectorXd::Zero(n + 1);
  o.lower = o.upper = VectorXd(n + 1);
  for (Index j = 0; j < n; ++j) {
    const std::size_t k = box.free[std::size_t(j)];
    cost[j] = direction[k];
    o.lower[j] = (box.lower[k] - from[k]) / goal.scale[k];
    o.upper[j] = (box.upper[k] - from[k]) / goal.scale[k];
  }
  cost[n] = direction == Pair{0.0, 0.0} ? 1.0 : 0.0;
  o.lower[n] = 0.0;
  o.upper[n] = t_max;
  o.start[n] = std::min(t_max, largest(search.evaluate(from)));
  o.objective = [&cost](const VectorXd& v, VectorXd* slope) {
    if (slope) *slope = cost;
    return cost.dot(v);
  };
  o.inequalities = 12;
  o.inequality = [&goal](const VectorXd& v, VectorXd& c, MatrixXd* J) { goal.limits(v, c, J); };
  o.constraint_tolerance = 1e-13;
  o.step_tolerance = 1e-14;
  o.evaluations = 300;
  optimize(o);
}

}  // namespace

double largest(const Misses& misses) {
  double worst = 0.0;
  for (double m : misses) worst = std::max(worst, std::isfinite(m) ? std::abs(m) : infinity);
  return worst;
}

Misses Search::evaluate(const Pair& z, Slopes* slopes) {
  if (evaluations_ == max_) throw OutOfEvaluations{};
  ++evaluations_;
  const Misses misses = six_(z, slopes);
  const double rank = score_(z, largest(misses));
  if (rank < best_score_) best_score_ = rank, best_ = z;
  return misses;
}

void Search::seek(Score by) {
  score_ = std::move(by);
  best_score_ = infinity;
}

Box::Box(const Pair& low, const Pair& high) : lower(low), upper(high) {
  for (std::size_t j = 0; j < pair_size; ++j)
    if (low[j] < high[j]) free.push_back(j);
}

void search_box(Search& search, const Box& box) {
  const Index n = std::ssize(box.free);
  Optimization o;
  o.algorithm = Optimizer::direct;
  o.lower.resize(n);
  o.upper.resize(n);
  for (Index j = 0; j < n; ++j) {
    o.lower[j] = box.lower[box.free[std::size_t(j)]];
    o.upper[j] = box.upper[box.free[std::size_t(j)]];
  }
  o.start = 0.5 * (o.lower + o.upper);
  search.evaluate(box.lower);
  if (n == 0) return;
  o.objective = [&](const VectorXd& v, VectorXd*) {
    Pair z = box.lower;
    for (Index j = 0; j < n; ++j) z[box.free[std::size_t(j)]] = v[j];
    return std::log1p(largest(search.evaluate(z)));  // deviations span five decades
  };
  o.step_tolerance = 0.0;
  o.evaluations = 4000;
  optimize(o);
}

// The minimax in the box, from a start; restarted at the new point until it converges.
double least_miss(Search& search, const Box& box, const Pair& from) {
  constexpr int passes = 20;
  constexpr double settled = 1e-7;  // units
  search.seek([](const Pair&, double worst) { return worst; });
  search.evaluate(from);
  for (int pass = 0; pass < passes; ++pass) {
    const double before = search.best_score();
    descend(search, box, search.best(), {0.0, 0.0}, infinity);
    if (before - search.best_score() <= settled) return search.best_score();
  }
  throw OutOfEvaluations{};
}

// The farthest member j found from a pair that reproduces all six numbers.
static double farthest(Search& search, const Box& box, const Pair& from, std::size_t j,
                       double side) {
  search.seek([j, side](const Pair& z, double worst) {
    return worst <= half_unit + miss_noise ? -side * z[j] : infinity;
  });
  search.evaluate(from);
  Pair direction{0.0, 0.0};
  direction[j] = -side;
  descend(search, box, search.best(), direction, half_unit);
  return search.best()[j];
}

// SLSQP may stop early where two constraints meet; a pair found further out restarts it.
RangeEnd range_end(Search& search, const Box& box, const Pair& centre, std::size_t j, double side) {
  constexpr int passes = 50;
  constexpr double beyond = 1e-4;  // of the range: tested point past the end
  Pair from = centre;
  for (int pass = 0; pass < passes; ++pass) {
    const double end = farthest(search, box, from, j, side);
    const double step = beyond * std::max(std::abs(end - centre[j]), 1e-9 * std::abs(centre[j]));
    const double outside = end + side * step;
    if (!(outside > box.lower[j] && outside < box.upper[j])) return {end, false};
    Pair low = box.lower, high = box.upper;
    from = search.best();
    from[j] = low[j] = high[j] = outside;
    if (least_miss(search, Box(low, high), from) > half_unit) return {end, true};
    from = search.best();
  }
  throw OutOfEvaluations{};
}

}  // namespace tiltrim::minimax
