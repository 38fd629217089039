#include "tune/many_starts.hpp"

#include <algorithm>
#include <cmath>
#include <random>

#include "tune/descent.hpp"

namespace tiltrim {

using Eigen::VectorXd;

// By more than rounding and the last digits of a local search.
static bool clearly_better(const Merit& now, const Merit& before) {
  constexpr double share = 1e-3;
  if (now.trimmed() != before.trimmed() || now.feasible != before.feasible) return before < now;
  if (now.feasible) return now.goal > before.goal + share * std::abs(before.goal);
  return now.missed < (1 - share) * before.missed;
}

long Ends::agreeing(const Merit& best) const {
  return std::ranges::count_if(merits, [&](const Merit& m) { return !clearly_better(best, m); });
}

namespace {

constexpr double settled = 1e-7;  // relative change of the goal
constexpr int local_steps = 60;

// Local searches from the start's best, with and without coalescing eigenvalues kept together,
// until there is no further gain.
void polish(Search& search) {
  constexpr int rounds = 12, steps = 100;
  for (int round = 0; round < rounds; ++round) {
    const double before = search.own.merit.value();
    for (const double radius : {0.2, 0.02})
      for (const double within : {0.02, 0.1}) search_coalesced(search, within, radius, steps);
    search_locally(search, search.own.y, LocalSearch::slsqp, 0.1, steps);
    if (search.own.merit.value() <= before + settled) return;
  }
}

// The algorithm of NLopt that goes with it: where no kink is near, slsqp is faster than bfgs.
LocalSearch smooth(LocalSearch local) {
  return local == LocalSearch::bfgs ? LocalSearch::slsqp : local;
}

// Monotonic basin hopping: local searches from random points around the start's best, near and far,
// and every third from anywhere, until as many as `patience` in a row have not bettered it.
// R.H. Leary, Global optimization on funneling landscapes, J. Global Optim. 18 (2000) 367-383.
void hop(Search& search, double weight, std::mt19937_64& random) {
  const int patience = 10 + int(search.variables());
  std::uniform_real_distribution<double> magnitude(-3.0, -0.5), uniform(0.0, 1.0);
  std::normal_distribution<double> normal(0.0, 1.0);
  for (int without = 0; without < patience; ++without) {
    const Merit before = search.own.merit;
    const double far = std::pow(10.0, magnitude(random));  // relative to each gain's range
    const bool anywhere = without % 3 == 2;
    VectorXd y = search.own.y;
    for (double& v : y)
      v = anywhere ? uniform(random) : std::clamp(v + far * normal(random), 0.0, 1.0);
    const bool along_kinks = search.options.local == LocalSearch::bfgs && without % 2 == 1;
    if (!along_kinks)
      search_locally(search, y, smooth(search.options.local), 1.0, local_steps);
    else if (before.feasible)
      descend_near(search, y, weight);
    else
      weight = descend(search, y);
    if (clearly_better(search.own.merit, before)) without = -1;
  }
}

// A local search from y.
Search::Seen quick_search(Search& search, const VectorXd& y) {
  search.own = search.last = {};
  search.evaluate(y, false);
  search_locally(search, y, smooth(search.options.local), 1.0, local_steps);
  return search.own;
}

// What follows it: returns the last weight of the penalty on violations.
double deep_search(Search& search, const Search::Seen& from, std::mt19937_64& random) {
  search.own = from;
  double weight = 0.0;
  polish(search);
  if (search.options.local == LocalSearch::bfgs) weight = descend(search, search.own.y);
  Merit before;
  do {
    before = search.own.merit;
    hop(search, weight, random);
    polish(search);
  } while (clearly_better(search.own.merit, before));
  return weight;
}

// The best of twenty random points.
VectorXd random_start(Search& search, std::mt19937_64& random) {
  constexpr int samples = 20;
  Search::Seen start;
  for (int i = 0; i < samples; ++i) {
    const Search::Seen& seen = search.evaluate(random_point(random, search.variables()), false);
    if (start.y.size() == 0 || start.merit < seen.merit) start = seen;
  }
  return start.y;
}

}  // namespace

void from_many_starts(Search& search, Ends& ends) {
  constexpr std::size_t quick = 10;
  constexpr long enough = 3;
  std::mt19937_64 random(search.options.seed);
  std::vector<VectorXd> starts;
  if (search.options.start.size() > 0) starts.push_back(search.place_of(search.options.start));
  for (const VectorXd& start : search.options.starts) starts.push_back(search.place_of(start));
  starts.push_back(VectorXd::Constant(search.variables(), 0.5));
  for (const VectorXd& y : starts) search.evaluate(y, false);
  search_globally(search);
  if (search.options.global != GlobalSearch::multistart)
    for (const Search::Seen& seen : search.kept) starts.push_back(seen.y);
  std::vector<Search::Seen> ordered;
  for (std::size_t k = 0; k < quick; ++k)
    ordered.push_back(
        quick_search(search, k < starts.size() ? starts[k] : random_start(search, random)));
  std::ranges::stable_sort(ordered, [](const auto& a, const auto& b) { return b.merit < a.merit; });
  for (std::size_t k = 0; ends.agreeing(search.best.merit) < enough; ++k) {
    const Search::Seen from =
        k < quick ? ordered[k] : quick_search(search, random_start(search, random));
    const double weight = deep_search(search, from, random);
    ends.merits.push_back(search.own.merit);
    ++search.starts;
    if (!(search.own.merit < search.best.merit)) ends.weight = weight;
  }
}

}  // namespace tiltrim
