#include "tune/many_starts.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
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

// Local searches from the start's best, with and without coalescing eigenvalues kept together.
void polish_once(Search& search) {
  constexpr int steps = 100;
  for (const double radius : {0.2, 0.02})
    for (const double within : {0.02, 0.1}) search_coalesced(search, within, radius, steps);
  search_locally(search, search.own.y, LocalSearch::slsqp, 0.1, steps);
}

constexpr int polishings = 12;  // of a start, at most

// Until there is no further gain.
void polish(Search& search) {
  for (int round = 0; round < polishings; ++round) {
    const double before = search.own.merit.value();
    polish_once(search);
    if (search.own.merit.value() <= before + settled) return;
  }
}

// The algorithm of NLopt that goes with it: where no kink is near, slsqp is faster than bfgs.
LocalSearch smooth(LocalSearch local) {
  return local == LocalSearch::bfgs ? LocalSearch::slsqp : local;
}

// A local search from y, and another from its end: with many tuned values the first often stalls at
// a kink.
Search::Seen quick_search(Search& search, const VectorXd& y) {
  search.own = search.last = {};
  search.evaluate(y);
  for (int i = 0; i < 2; ++i)
    search_locally(search, search.own.y, smooth(search.options.local), 1.0, local_steps);
  return search.own;
}

// All tuned values moved a little or far, or two of them drawn anew: many optima lie at bounds and
// differ in which.
VectorXd moved(const VectorXd& from, bool all, std::mt19937_64& random) {
  std::uniform_real_distribution<double> magnitude(-3.0, -0.5), uniform(0.0, 1.0);
  std::normal_distribution<double> normal(0.0, 1.0);
  VectorXd y = from;
  if (all) {
    const double far = std::pow(10.0, magnitude(random));  // relative to each gain's range
    for (double& v : y) v = std::clamp(v + far * normal(random), 0.0, 1.0);
  } else {
    std::uniform_int_distribution<Eigen::Index> which(0, y.size() - 1);
    for (int i = 0; i < 2; ++i) y[which(random)] = uniform(random);
  }
  return y;
}

// Monotonic basin hopping: local searches from random points around the start's best until as many
// as `patience` in a row have not bettered it.
// R.H. Leary, Global optimization on funneling landscapes, J. Global Optim. 18 (2000) 367-383.
void hop(Search& search, double weight, std::mt19937_64& random) {
  const int patience = 10 + int(search.variables());
  for (int without = 0; without < patience; ++without) {
    const Merit before = search.own.merit;
    const VectorXd y = moved(search.own.y, without % 3 < 2, random);
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

// What follows a local search: returns the last weight of the penalty on violations.
double deep_search(Search& search, std::mt19937_64& random) {
  double weight = 0.0;
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
    const Search::Seen& seen = search.evaluate(random_point(random, search.variables()));
    if (start.y.size() == 0 || start.merit < seen.merit) start = seen;
  }
  return start.y;
}

// The given start, the middle, and the best of the global search: then random points.
std::vector<VectorXd> first_starts(Search& search) {
  std::vector<VectorXd> starts;
  if (search.options.start.size() > 0) starts.push_back(search.place_of(search.options.start));
  for (const VectorXd& start : search.options.starts) starts.push_back(search.place_of(start));
  starts.push_back(VectorXd::Constant(search.variables(), 0.5));
  for (const VectorXd& y : starts) search.evaluate(y);
  search_globally(search);
  if (search.options.global != GlobalSearch::multistart)
    for (const Search::Seen& seen : search.kept) starts.push_back(seen.y);
  return starts;
}

void best_first(std::vector<Search::Seen>& found) {
  std::ranges::stable_sort(found, [](const auto& a, const auto& b) { return b.merit < a.merit; });
}

// A search that has ended: its value, and how nearly it is stationary if it is the best.
void completed(Search& search, Ends& ends, double weight) {
  ends.merits.push_back(search.own.merit);
  ++search.starts;
  if (search.own.merit < search.best.merit || !search.best.merit.trimmed()) return;
  ends.weight = weight;
  search.stationary = stationarity_at_best(search, weight);
}

// Each round goes to the best of the starts whose last round has clearly bettered them, so that
// none spends the others' candidates on its last digits. Then the best end until there is no
// further gain.
void polish_by_rounds(Search& search, std::vector<Search::Seen>& found, Ends& ends) {
  struct Running {
    Search::Seen seen;
    int rounds = 0;
  };
  std::vector<Running> running;
  for (const Search::Seen& start : found) running.push_back({start});
  found.clear();
  while (!running.empty()) {
    const auto best = std::ranges::max_element(running, std::less<>(),
                                               [](const Running& r) { return r.seen.merit; });
    search.own = best->seen;
    const Merit before = search.own.merit;
    polish_once(search);
    best->seen = search.own;
    if (clearly_better(search.own.merit, before) && ++best->rounds < polishings) continue;
    completed(search, ends, 0.0);
    found.push_back(search.own);
    running.erase(best);
  }
  best_first(found);
  search.own = found.front();
  polish(search);
  found.front() = search.own;
}

}  // namespace

double stationarity_at_best(Search& search, double weight) {
  const Search::Seen best = search.best, own = search.own;
  if (weight == 0) weight = first_weight(best.merit);
  if (!best.merit.feasible) weight = std::numeric_limits<double>::infinity();
  double measured = std::numeric_limits<double>::quiet_NaN();
  search.beyond_budget([&] {
    measured = stationarity(penalty(search, weight), best.y, TuneResult::stationarity_radius,
                            search.options.seed);
  });
  search.best = best;  // what is measured is not a candidate
  search.own = own;
  return measured;
}

void from_many_starts(Search& search, Ends& ends) {
  const auto quick = std::size_t(search.options.searches);
  const int deep = std::min(2, search.options.agreeing);
  std::mt19937_64 random(search.options.seed);
  const std::vector<VectorXd> starts = first_starts(search);
  std::vector<Search::Seen> found;
  for (std::size_t k = 0; k < quick; ++k)
    found.push_back(
        quick_search(search, k < starts.size() ? starts[k] : random_start(search, random)));
  polish_by_rounds(search, found, ends);
  // Deeper from the best end, the best that differs from it, and so on: then from further starts.
  int done = 0;
  for (std::size_t k = 0; done < deep || ends.agreeing(search.best.merit) < search.options.agreeing;
       ++k) {
    const bool further = k >= quick;
    if (further) {
      quick_search(search, random_start(search, random));
      polish(search);
    } else if (k > 0 && !clearly_better(search.best.merit, found[k].merit)) {
      continue;
    } else {
      search.own = found[k];
    }
    const double weight = deep_search(search, random);
    completed(search, ends, weight);
    ++done;
  }
}

}  // namespace tiltrim
