#include "tune/descent.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <tuple>

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

// Derivative with respect to the last candidate's y of the score that decides: the goal's, or that
// of the limit with the largest violation, relative to its size.
VectorXd decisive_slope(Search& search, bool goal) {
  double largest = -infinity;
  std::size_t at = 0, asked = 0;
  for (std::size_t p = 0; p < search.last.places.size(); ++p)
    for (std::size_t i = 0; i < search.asked().size(); ++i) {
      if (search.candidates.is_goal(i) != goal) continue;
      const Requirement& r = search.asked()[i];
      const double own = worst(i, r, search.last.places[p]).score;
      const double missed = goal ? -goal_score(search.problem, r, own) : missed_by(r, own);
      if (missed > largest) std::tie(largest, at, asked) = std::tuple(missed, p, i);
    }
  const PlaceModes& place = search.with_slopes({at}).places[at];
  if (largest == -infinity || !place.has_slopes()) return VectorXd::Zero(search.variables());
  const Requirement& r = search.asked()[asked];
  const double relative = goal ? goal_slope(search.problem, r) : 1.0 / size_of(r);
  return relative *
         score_slope(asked, r, place).transpose().cwiseProduct(search.scales_at(search.last.y));
}

}  // namespace

Nonsmooth penalty(Search& search, double weight) {
  return [&search, weight](const VectorXd& y, VectorXd* gradient) {
    VectorXd signs;
    const Search::Seen& seen = search.evaluate(folded(y, signs));
    const Merit m = seen.merit;
    if (!m.trimmed() || !std::isfinite(m.goal)) return infinity;
    const bool limits_only = std::isinf(weight);
    if (gradient) {
      *gradient = VectorXd::Zero(y.size());
      if (!limits_only) *gradient -= decisive_slope(search, true);
      if (m.missed > 0) *gradient -= (limits_only ? 1.0 : weight) * decisive_slope(search, false);
      *gradient = gradient->cwiseProduct(signs);
    }
    return limits_only ? m.missed : -m.goal + weight * m.missed;
  };
}

double first_weight(const Merit& merit) { return 10 * std::max(std::abs(merit.goal), 1e-3); }

double descend(Search& search, const VectorXd& start) {
  constexpr double small = 1e-6;
  constexpr int weights = 5;
  VectorXd y = start;
  if (!search.evaluate(y).merit.feasible)
    y = inside(minimize_nonsmooth(penalty(search, infinity), y).x);
  double weight = first_weight(search.evaluate(y).merit);
  for (int i = 0; i < weights; ++i, weight *= 10) {
    y = inside(minimize_nonsmooth(penalty(search, weight), y).x);
    if (search.evaluate(y).merit.missed <= small) break;
  }
  return weight;
}

void descend_near(Search& search, const VectorXd& y, double weight) {
  (void)minimize_nonsmooth(penalty(search, weight), y,
                           {.first_step = 0.02, .tolerance = 1e-4, .steps = 60});
}

}  // namespace tiltrim
