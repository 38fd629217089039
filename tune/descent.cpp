#include "tune/descent.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace tiltrim {

using Eigen::Index;
using Eigen::VectorXd;

namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();

// [0, 1] repeated with mirrored copies on either side; `sign` is its derivative.
double folded(double y, double& sign) {
  const double r = std::abs(std::remainder(y, 2.0));
  sign = std::remainder(y, 2.0) < 0 ? -1.0 : 1.0;
  return r;
}

VectorXd folded(const VectorXd& y, VectorXd& signs) {
  VectorXd inside(y.size());
  signs.resize(y.size());
  for (Index j = 0; j < y.size(); ++j) inside[j] = folded(y[j], signs[j]);
  return inside;
}

VectorXd inside(const VectorXd& y) {
  VectorXd signs;
  return folded(y, signs);
}

// Derivative with respect to y of the score that decides: the goal's, or that of the limit with the
// largest violation, relative to its size.
VectorXd decisive_slope(const Search& search, const Search::Seen& seen, bool goal) {
  double largest = -infinity;
  VectorXd slope = VectorXd::Zero(search.variables());
  for (const PlaceModes& place : seen.places)
    for (std::size_t i = 0; i < search.asked().size(); ++i) {
      if (search.candidates.is_goal(i) != goal) continue;
      const Requirement& r = search.asked()[i];
      const double own = worst(i, r, place).score;
      const double size = goal ? 1.0 / goal_slope(search.problem, r) : size_of(r);
      const double missed =
          goal ? -goal_score(search.problem, r, own) : (score_of(r.measure, r.limit) - own) / size;
      if (!(missed > largest)) continue;
      largest = missed;
      slope = score_slope(i, r, place).transpose() / size;
    }
  return slope.cwiseProduct(search.scales_at(seen.y));
}

}  // namespace

Nonsmooth penalty(Search& search, double weight) {
  return [&search, weight](const VectorXd& y, VectorXd* gradient) {
    VectorXd signs;
    const Search::Seen& seen = search.evaluate(folded(y, signs), gradient != nullptr);
    const Merit& m = seen.merit;
    if (!m.trimmed() || !std::isfinite(m.goal)) return infinity;
    const bool limits_only = std::isinf(weight);
    if (gradient) {
      *gradient = VectorXd::Zero(y.size());
      if (!limits_only) *gradient -= decisive_slope(search, seen, true);
      if (m.missed > 0)
        *gradient -= (limits_only ? 1.0 : weight) * decisive_slope(search, seen, false);
      *gradient = gradient->cwiseProduct(signs);
    }
    return limits_only ? m.missed : -m.goal + weight * m.missed;
  };
}

double descend(Search& search, const VectorXd& start) {
  constexpr double small = 1e-6;
  constexpr int weights = 5;
  VectorXd y = start;
  if (!search.evaluate(y, false).merit.feasible)
    y = inside(minimize_nonsmooth(penalty(search, infinity), y).x);
  double weight = 10 * std::max(std::abs(search.evaluate(y, false).merit.goal), 1e-3);
  for (int i = 0; i < weights; ++i, weight *= 10) {
    y = inside(minimize_nonsmooth(penalty(search, weight), y).x);
    if (search.evaluate(y, false).merit.missed <= small) break;
  }
  return weight;
}

void descend_near(Search& search, const VectorXd& y, double weight) {
  (void)minimize_nonsmooth(penalty(search, weight), y,
                           {.first_step = 0.02, .tolerance = 1e-4, .steps = 60});
}

}  // namespace tiltrim
