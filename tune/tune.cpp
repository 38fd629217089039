#include "tune/tune.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>
#include <numbers>
#include <vector>

#include "linearize/modes.hpp"
#include "model/lookup.hpp"
#include "optimize/nonsmooth.hpp"
#include "optimize/optimize.hpp"
#include "runtime/rounding.hpp"
#include "runtime/threads.hpp"
#include "tune/many_starts.hpp"
#include "tune/measures.hpp"
#include "tune/requirement.hpp"
#include "tune/search.hpp"

namespace tiltrim {

using Complex = std::complex<double>;
using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

constexpr double not_applicable = std::numeric_limits<double>::quiet_NaN();
constexpr double active = 1e-4;  // relative to the limit's size
constexpr double near = 0.01;    // coalescing eigenvalues, relative to the goal

// The value of every requirement at every place.
std::vector<Achieved> achieved(const Search& search, const std::vector<PlaceModes>& places,
                               const Merit& found) {
  std::vector<Achieved> all;
  for (std::size_t p = 0; p < places.size(); ++p)
    for (std::size_t i = 0; i < search.asked().size(); ++i) {
      const Requirement& r = search.asked()[i];
      const Worst w = worst(i, r, places[p]);
      constexpr double none = std::numeric_limits<double>::quiet_NaN();
      const bool goal = search.candidates.is_goal(i);
      const double apart = goal ? goal_score(search.problem, r, w.score) - found.goal
                                : w.score - score_of(r.measure, r.limit);
      const double size = goal ? std::max(std::abs(found.goal), 1e-3) : size_of(r);
      all.push_back({search.candidates.places()[p].where, i, r, value_of(r.measure, w.score),
                     w.eigenvalue >= 0 ? places[p].eigenvalues[w.eigenvalue] : Complex(none, none),
                     std::abs(apart) <= active * size});
      if (goal && search.problem.goals.empty()) all.back().requirement.limit = none;
    }
  return all;
}

std::string in_words(const TuneProblem& problem, const Achieved& a) {
  const std::string& point = problem.points[a.place.point].name;
  const std::string of = a.requirement.of.empty() ? "" : " of " + a.requirement.of;
  return fmt::format("{}{} at '{}'{}{}", name_of(a.requirement), of, point,
                     a.place.scatter.empty() ? "" : " with ", a.place.scatter);
}

// True for measures of which a stable loop always has a finite value.
bool finite_if_stable(Measure what) {
  return what == Measure::response_use || what == Measure::quadratic_cost ||
         what == Measure::overshoot || what == Measure::settling_time;
}

// A value; or that it is not finite, and why.
std::string value_in_words(const Achieved& a, const PlaceModes& there) {
  if (!std::isinf(a.value) || !may_be_unbounded(a.requirement.measure))
    return fmt::format("{:.6g}", a.value);
  if (!(there.eigenvalues.real().maxCoeff() < 0)) return "infinite, as the loop is not stable";
  return finite_if_stable(a.requirement.measure) ? "not determined" : "infinite";
}

std::string missed_in_words(const Search& search, const std::vector<PlaceModes>& places,
                            const std::vector<Achieved>& all) {
  const TuneProblem& problem = search.problem;
  const auto least = [&](const Achieved& a) {
    const double reserve = a.asked < goals_of(problem) ? not_applicable : a.reserve();
    return std::isnan(reserve) ? std::numeric_limits<double>::infinity() : reserve;
  };
  const auto found = std::ranges::min_element(all, {}, least);
  const Achieved& most = *found;
  const PlaceModes& there = places[std::size_t(found - all.begin()) / search.asked().size()];
  const std::string_view of_unit = unit(most.requirement.measure);
  return fmt::format("{}: the best found is {}, required is {} {:.6g}{}{}", in_words(problem, most),
                     value_in_words(most, there),
                     more_is_better(most.requirement.measure) ? "at least" : "at most",
                     most.requirement.limit, of_unit.empty() ? "" : " ", of_unit);
}

// The first place whose modes are not stable by more than their error bounds.
std::string not_stable(const Search& search, const std::vector<PlaceModes>& places) {
  for (std::size_t p = 0; p < places.size(); ++p) {
    const Verdict verdict = modes(places[p].A).verdict;
    if (verdict == Verdict::stable) continue;
    const Place& place = search.candidates.places()[p];
    return fmt::format("decay at '{}'{}{}: it is {}", place.request.name,
                       place.where.scatter.empty() ? "" : " with ", place.where.scatter,
                       to_string(verdict));
  }
  return {};
}

std::string name_of(const TuneProblem& problem, std::size_t variable) {
  const std::size_t each = problem.variables() / problem.gains.size();
  const std::string& gain = problem.gains[variable / each].name;
  if (problem.schedule.empty()) return gain;
  const Model& model = problem.points.front().model;
  const bool angle =
      signal_of(model, tiltrim::variable(model, problem.schedule_over)).unit == "rad";
  constexpr double degree = std::numbers::pi / 180;
  return fmt::format("{} at {} = {:.6g}{}", gain, problem.schedule_over,
                     problem.schedule[variable % each] / (angle ? degree : 1.0),
                     angle ? " deg" : "");
}

// Derivatives of the decisive values, and the results with each tuned value 10 % less and more.
std::vector<TuneResult::GainEffect> effects(Search& search, const VectorXd& numbers) {
  const std::vector<PlaceModes> here = search.candidates.at(numbers, true);
  const auto slope = [&](std::size_t i, Index j) {
    const Requirement& r = search.asked()[i];
    const auto own = [&](const PlaceModes& place) {
      if (!place.valid()) return std::numeric_limits<double>::infinity();
      const double score = worst(i, r, place).score;
      return std::isnan(score) ? std::numeric_limits<double>::infinity() : score;
    };
    const PlaceModes& place = *std::ranges::min_element(here, {}, own);
    if (!place.valid()) return std::numeric_limits<double>::quiet_NaN();  // no derivatives
    const Worst w = worst(i, r, place);
    const double of_score = w.eigenvalue < 0
                                ? place.score_slopes(Index(i), j)
                                : (std::conj(score(r, place.eigenvalues[w.eigenvalue]).slope) *
                                   place.slopes(w.eigenvalue, j))
                                      .real();
    return value_slope(r.measure, w.score) * of_score * numbers[j];
  };
  std::vector<TuneResult::GainEffect> all;
  for (Index j = 0; j < numbers.size(); ++j) {
    TuneResult::GainEffect effect{
        name_of(search.problem, std::size_t(j)), numbers[j], {}, 0, 0, false, false};
    for (std::size_t i = 0; i < search.asked().size(); ++i) effect.slopes.push_back(slope(i, j));
    const auto with = [&](double factor) {
      VectorXd other = numbers;
      other[j] *= factor;
      return merit(search.candidates, search.candidates.at(other, false));
    };
    const Merit less = with(0.9), more = with(1.1);
    const auto goal = [&](const Merit& m) {
      return m.trimmed() ? goal_value(search.problem, m.goal)
                         : std::numeric_limits<double>::quiet_NaN();
    };
    effect.goal_less = goal(less);
    effect.goal_more = goal(more);
    effect.limits_less = less.feasible;
    effect.limits_more = more.feasible;
    all.push_back(effect);
  }
  std::ranges::stable_sort(all, std::greater<>(), [](const TuneResult::GainEffect& e) {
    return std::abs(e.slopes.front());
  });
  return all;
}

// The first goal of responses that has no finite value at a place.
std::string infinite_in_words(const Search& search, const std::vector<PlaceModes>& places,
                              const std::vector<Achieved>& all) {
  const auto infinite = [&](const Achieved& a) {
    return a.asked < goals_of(search.problem) && may_be_unbounded(a.requirement.measure) &&
           std::isinf(a.value);
  };
  const auto found = std::ranges::find_if(all, infinite);
  if (found == all.end()) return {};
  const PlaceModes& there = places[std::size_t(found - all.begin()) / search.asked().size()];
  return fmt::format("{} is {} for every candidate", in_words(search.problem, *found),
                     value_in_words(*found, there));
}

// Directions in which the decay of each eigenvalue next to the axis rises, of all places.
MatrixXd ways_off_axis(const Search& search, const std::vector<PlaceModes>& places) {
  constexpr double small = 1e-6;  // of the largest eigenvalue
  std::vector<VectorXd> ways;
  for (const PlaceModes& place : places) {
    if (!place.has_slopes()) continue;
    const double beside = -small * place.eigenvalues.cwiseAbs().maxCoeff();
    for (Index i = 0; i < place.eigenvalues.size(); ++i) {
      if (place.eigenvalues[i].real() < beside || place.eigenvalues[i].imag() < 0) continue;
      const VectorXd slope =
          -place.slopes.row(i).real().transpose().cwiseProduct(search.scales_at(search.best.y));
      if (slope.allFinite() && !slope.isZero(0)) ways.push_back(slope.normalized());
    }
  }
  MatrixXd all(search.best.y.size(), std::ssize(ways));
  for (Index k = 0; k < all.cols(); ++k) all.col(k) = ways[std::size_t(k)];
  return all;
}

// A goal may lead to the boundary of stability, where rounding decides: from there to the nearest
// candidate that is stable by more than its error bounds, along a way off all that meet there.
void step_off_boundary(Search& search) {
  if (!search.best.merit.feasible || not_stable(search, search.best.places).empty()) return;
  const Search::Seen best = search.best;
  const std::vector<PlaceModes> places = search.candidates.at(search.numbers_at(best.y), true);
  if (!std::ranges::all_of(places, &PlaceModes::valid)) return;
  const MatrixXd ways = ways_off_axis(search, places);
  if (ways.cols() == 0) return;
  const VectorXd slope = least_in_hull(ways);
  if (!slope.allFinite() || slope.isZero(0)) return;
  const VectorXd direction = slope / slope.cwiseAbs().maxCoeff();
  for (double step = 1e-12; step < 1e-3; step *= 10) {  // of each gain's range
    const VectorXd y = (best.y + step * direction).cwiseMax(0.0).cwiseMin(1.0);
    const Search::Seen& seen = search.evaluate(y);
    if (!seen.merit.feasible || !not_stable(search, seen.places).empty()) continue;
    search.best = seen;
    return;
  }
}

// Evaluates the result again, with new trims.
TuneResult verified(Search& search) {
  const TuneProblem& problem = search.problem;
  search.beyond_budget([&] { step_off_boundary(search); });
  TuneResult result;
  result.gains = search.numbers_at(search.best.y);
  const std::vector<PlaceModes> places = search.candidates.anew(result.gains);
  const auto lost = std::ranges::find_if_not(places, &PlaceModes::valid);
  if (lost != places.end()) {
    const Place& place = search.candidates.places()[std::size_t(lost - places.begin())];
    result.message = fmt::format("no equilibrium at '{}'{}{}, which {} needs: {}",
                                 place.request.name, place.where.scatter.empty() ? "" : " with ",
                                 place.where.scatter, goal_name(problem),
                                 lost->message.empty() ? to_string(lost->status) : lost->message);
    return result;
  }
  const Merit found = merit(search.candidates, places);
  result.goal = goal_value(problem, found.goal);
  result.achieved = achieved(search, places, found);
  search.own = search.best;  // the last start may have ended elsewhere
  result.coalescing = !meetings_at(search, near * std::abs(found.goal)).empty();
  result.message = applies_nowhere(search.candidates, places);
  if (result.message.empty() && !found.feasible)
    result.message = missed_in_words(search, places, result.achieved);
  if (result.message.empty()) result.message = infinite_in_words(search, places, result.achieved);
  result.status = result.message.empty() ? TuneStatus::tuned : TuneStatus::limits_unmet;
  if (result.status == TuneStatus::tuned) {
    result.message = not_stable(search, places);
    if (!result.message.empty()) result.status = TuneStatus::unstable;
  }
  result.effects = effects(search, result.gains);
  return result;
}

}  // namespace

std::string to_string(TuneStatus status) {
  switch (status) {
    case TuneStatus::tuned:
      return "tuned";
    case TuneStatus::limits_unmet:
      return "limits_unmet";
    case TuneStatus::unstable:
      return "unstable";
    case TuneStatus::no_trim:
      return "no_trim";
  }
  return "unknown";
}

std::string to_string(TuneEnd end) {
  switch (end) {
    case TuneEnd::locally_optimal:
      return "locally_optimal";
    case TuneEnd::stagnated:
      return "stagnated";
    case TuneEnd::budget_spent:
      return "budget_spent";
    case TuneEnd::no_influence:
      return "no_influence";
  }
  return "unknown";
}

double Achieved::reserve() const {
  if (std::isnan(requirement.limit) || std::isnan(value))
    return std::numeric_limits<double>::quiet_NaN();
  return -missed_by(requirement, score_of(requirement.measure, value));
}

namespace {

// How nearly the best is stationary; NaN if it is interrupted, has no trim, or was evaluated only.
double stationarity_of(Search& search, double weight) {
  constexpr double none = std::numeric_limits<double>::quiet_NaN();
  const Merit& best = search.best.merit;
  if (search.interrupted || search.out_of_time || search.evaluations <= 1) return none;
  if (search.best.y.size() == 0 || !best.trimmed()) return none;
  return stationarity_at_best(search, weight);
}

TuneEnd how_it_ended(const Search& search, const TuneResult& result) {
  constexpr double same = 1e-12, cancelled = 0.05;
  const double size = std::max(std::abs(search.highest_goal), std::abs(search.lowest_goal));
  const bool flat = search.highest_goal - search.lowest_goal <= same * size;
  if (result.evaluations > 1 && search.best.merit.trimmed() && flat) return TuneEnd::no_influence;
  if (search.interrupted || search.out_of_time || search.out_of_evaluations)
    return TuneEnd::budget_spent;
  return result.stationarity <= cancelled ? TuneEnd::locally_optimal : TuneEnd::stagnated;
}

TuneResult searched(const TuneProblem& problem, const TuneOptions& options) {
  Search search(problem, options);
  Ends ends;
  try {
    from_many_starts(search, ends);
  } catch (const EndSearch&) {
  }
  const long evaluations = search.evaluations;
  const double stationary = stationarity_of(search, ends.weight);
  TuneResult result;
  if (search.best.y.size() == 0)
    result.message =
        evaluations == 0
            ? "the search ended before a candidate was evaluated: " + goal_name(problem) +
                  " is unknown"
            : "no candidate could be evaluated: " + goal_name(problem) + " is undefined everywhere";
  else
    result = verified(search);
  result.stationarity = stationary;
  result.starts = search.starts;
  result.agreeing = search.best.y.size() == 0 ? 0 : ends.agreeing(search.best.merit);
  result.evaluations = evaluations;
  result.interrupted = search.interrupted;
  result.out_of_time = search.out_of_time;
  result.out_of_evaluations = search.out_of_evaluations;
  result.end = how_it_ended(search, result);
  return result;
}

}  // namespace

decltype(TuneProblem::figures) figures_together(
    const std::vector<std::string>& names,
    const std::function<std::vector<double>(const VectorXd& parameters)>& all) {
  struct Last {
    long of = 0;
    VectorXd parameters;
    std::vector<double> values;
  };
  static std::atomic<long> made{0};
  const long id = ++made;
  decltype(TuneProblem::figures) figures;
  for (std::size_t k = 0; k < names.size(); ++k)
    figures[names[k]] = [id, k, all](const VectorXd& p) {
      thread_local Last last;  // a thread asks for all figures of a place, one after the other
      const bool known =
          last.of == id && last.parameters.size() == p.size() && last.parameters == p;
      if (!known) last = {id, p, all(p)};
      return last.values.at(k);
    };
  return figures;
}

TuneResult tune(const TuneProblem& problem, const TuneOptions& options) {
  const RoundToNearest environment;
  if (options.start.size() > 0 && options.start.size() != Index(problem.variables()))
    throw std::invalid_argument(fmt::format("a start of {} numbers for a problem that has {}",
                                            options.start.size(), problem.variables()));
  for (const VectorXd& start : options.starts)
    if (start.size() != Index(problem.variables()) || !start.allFinite())
      throw std::invalid_argument("a further start of other or infinite numbers");
  if (!options.start.allFinite())
    throw std::invalid_argument("the start is not finite; expected a number for each gain");
  if (options.searches < 1 || options.agreeing < 1)
    throw std::invalid_argument(
        fmt::format("{} local searches, of which {} must agree; expected at least 1 of each",
                    options.searches, options.agreeing));
  TuneResult result;
  with_threads(options.threads, [&] { result = searched(problem, options); });
  return result;
}

}  // namespace tiltrim
