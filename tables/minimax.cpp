// Minimax by NLopt: DIRECT over the box, then SLSQP on the form without kinks.
#include "tables/minimax.hpp"

#include <algorithm>
#include <cmath>
#include <nlopt.hpp>
#include <stdexcept>

namespace tiltrim::minimax {

namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();

// NLopt ends by exception where it meets rounding or we run out; our own best point stands anyway.
void run(nlopt::opt& optimizer, std::vector<double>& v) {
  double value = 0.0;
  try {
    optimizer.optimize(v, value);
  } catch (const nlopt::roundoff_limited&) {
  } catch (const nlopt::forced_stop&) {
    throw OutOfEvaluations{};
  } catch (const std::runtime_error&) {
  }
}

// Calls `f`; an exhausted budget stops the optimizer, exceptions do not cross its C frames.
template <class F>
double guarded(nlopt::opt& optimizer, F f) {
  try {
    return f();
  } catch (const OutOfEvaluations&) {
    optimizer.force_stop();
    return infinity;
  }
}

struct GlobalGoal {
  Search& search;
  const Box& box;
  nlopt::opt& optimizer;

  static double value(const std::vector<double>& v, std::vector<double>&, void* self) {
    auto& goal = *static_cast<GlobalGoal*>(self);
    return guarded(goal.optimizer, [&] {
      Pair z = goal.box.lower;
      for (std::size_t j = 0; j < v.size(); ++j) z[goal.box.free[j]] = v[j];
      return std::log1p(largest(goal.search.evaluate(z)));  // the misses span five decades
    });
  }
};

// min cost·(y, t) subject to |missᵢ| <= t <= t_max, where z = z0 + scale y: the minimax without
// kinks.
struct LocalGoal {
  Search& search;
  const Box& box;
  nlopt::opt& optimizer;
  Pair origin, scale;
  std::vector<double> cost;

  Pair at(const double* v) const {
    Pair z = origin;
    for (std::size_t j = 0; j < box.free.size(); ++j) {
      const std::size_t at = box.free[j];
      z[at] = std::clamp(origin[at] + scale[at] * v[j], box.lower[at], box.upper[at]);
    }
    return z;
  }

  static double value(const std::vector<double>& v, std::vector<double>& slope, void* self) {
    const auto& cost = static_cast<LocalGoal*>(self)->cost;
    if (!slope.empty()) slope = cost;
    double sum = 0.0;
    for (std::size_t j = 0; j < v.size(); ++j) sum += cost[j] * v[j];
    return sum;
  }

  // Rows i and i + 6: ±missᵢ - t <= 0
  static void limits(unsigned, double* result, unsigned n, const double* v, double* slope,
                     void* self) {
    auto& goal = *static_cast<LocalGoal*>(self);
    const auto& free = goal.box.free;
    guarded(goal.optimizer, [&] {
      Slopes slopes;
      const Misses misses = goal.search.evaluate(goal.at(v), &slopes);
      for (std::size_t i = 0; i < 12; ++i) {
        const double sign = i < 6 ? 1.0 : -1.0;
        result[i] = sign * misses[i % 6] - v[free.size()];
        if (!slope) continue;
        for (std::size_t j = 0; j < free.size(); ++j)
          slope[i * n + j] = sign * slopes[i % 6][free[j]] * goal.scale[free[j]];
        slope[i * n + free.size()] = -1.0;
      }
      return 0.0;
    });
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

// `direction` of the cost over Ep and k; with none of them the cost is t itself.
void descend(Search& search, const Box& box, const Pair& from, const Pair& direction,
             double t_max) {
  constexpr int evaluations = 300;
  const std::size_t n = box.free.size();
  nlopt::opt optimizer(nlopt::LD_SLSQP, static_cast<unsigned>(n + 1));
  LocalGoal goal{search, box, optimizer, from, natural_scale(search, from), {}};
  std::vector<double> v(n + 1, 0.0), low, high;
  for (std::size_t j : box.free) {
    goal.cost.push_back(direction[j]);
    low.push_back((box.lower[j] - from[j]) / goal.scale[j]);
    high.push_back((box.upper[j] - from[j]) / goal.scale[j]);
  }
  goal.cost.push_back(direction == Pair{0.0, 0.0} ? 1.0 : 0.0);
  low.push_back(0.0);
  high.push_back(t_max);
  v[n] = std::min(t_max, largest(search.evaluate(from)));
  optimizer.set_min_objective(LocalGoal::value, &goal);
  optimizer.add_inequality_mconstraint(LocalGoal::limits, &goal, std::vector<double>(12, 1e-13));
  optimizer.set_lower_bounds(low);
  optimizer.set_upper_bounds(high);
  optimizer.set_xtol_rel(1e-14);
  optimizer.set_maxeval(evaluations);
  run(optimizer, v);
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
  constexpr int evaluations = 4000;
  std::vector<double> v, low, high;
  for (std::size_t j : box.free) {
    low.push_back(box.lower[j]);
    high.push_back(box.upper[j]);
    v.push_back(0.5 * (box.lower[j] + box.upper[j]));
  }
  search.evaluate(box.lower);
  if (v.empty()) return;
  nlopt::opt optimizer(nlopt::GN_DIRECT_L, static_cast<unsigned>(v.size()));
  GlobalGoal goal{search, box, optimizer};
  optimizer.set_min_objective(GlobalGoal::value, &goal);
  optimizer.set_lower_bounds(low);
  optimizer.set_upper_bounds(high);
  optimizer.set_maxeval(evaluations);
  run(optimizer, v);
}

// Least worst miss in the box, from a start; repeated about the new point until it settles.
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

// SLSQP may stop on the way where two limits meet. A pair found beyond is where it starts again.
RangeEnd range_end(Search& search, const Box& box, const Pair& centre, std::size_t j, double side) {
  constexpr int passes = 50;
  constexpr double beyond = 1e-4;  // of the range: where it is shown to have ended
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
