#include "tune/candidate.hpp"

#include <fmt/core.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <new>
#include <numeric>
#include <random>
#include <stdexcept>

#include "dense/products.hpp"
#include "model/lookup.hpp"
#include "runtime/threads.hpp"
#include "tune/check_problem.hpp"
#include "tune/requirement.hpp"
#include "tune/response.hpp"
#include "tune/shift.hpp"

namespace tiltrim {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

const std::vector<SweepAxis> no_axes;

// The nominal case, every corner of the uncertain parameters, and random samples between.
struct Scatter {
  std::string words;
  VectorXd values;
};

std::string in_words(const TuneProblem& problem, const VectorXd& values) {
  std::vector<std::string> words;
  for (std::size_t k = 0; k < problem.uncertain.size(); ++k) {
    const std::string& name = problem.uncertain[k].name;
    words.push_back(fmt::format("{} = {:.6g}", name.substr(name.rfind('.') + 1), values[Index(k)]));
  }
  return fmt::format("{}", fmt::join(words, ", "));
}

std::vector<Scatter> scatter_of(const TuneProblem& problem) {
  constexpr std::size_t most = 12;  // 4096 corners
  const std::size_t count = problem.uncertain.size();
  std::vector<Scatter> all{{"", {}}};
  if (count == 0) return all;
  if (problem.corners && count > most)
    throw std::invalid_argument(
        fmt::format("{} uncertain numbers have 2^{} corners; expected {} at most, or samples",
                    count, count, most));
  const auto add = [&](const auto& share) {
    VectorXd values = VectorXd::Zero(Index(count));
    for (std::size_t k = 0; k < count; ++k) {
      const Uncertain& u = problem.uncertain[k];
      values[Index(k)] = u.lower + share(k) * (u.upper - u.lower);
    }
    all.push_back({in_words(problem, values), values});
  };
  if (problem.corners)
    for (std::size_t corner = 0; corner < std::size_t{1} << count; ++corner)
      add([&](std::size_t k) { return corner >> k & 1 ? 1.0 : 0.0; });
  std::mt19937_64 random(problem.sample_seed);
  std::uniform_real_distribution<double> uniform(0.0, 1.0);
  for (int i = 0; i < problem.samples; ++i) add([&](std::size_t) { return uniform(random); });
  return all;
}

// Hat functions of the schedule's breakpoints at a point.
VectorXd shares_at(const TuneProblem& problem, const SweepRequest& request) {
  const std::vector<double>& s = problem.schedule;
  if (s.empty()) return VectorXd::Ones(1);
  const Index over = variable(request.model, problem.schedule_over);
  const double here = std::clamp(value_of(request.guess, over), s.front(), s.back());
  VectorXd shares = VectorXd::Zero(std::ssize(s));
  const auto after = std::ranges::upper_bound(s, here);
  const Index k = std::min<Index>(after - s.begin(), std::ssize(s) - 1);
  const double lower = s[std::size_t(k - 1)], upper = s[std::size_t(k)];
  shares[k] = (here - lower) / (upper - lower);
  shares[k - 1] = 1 - shares[k];
  return shares;
}

// The model's variable; it must not be free in the trim.
Index given(const Place& place, const std::string& name) {
  const Index found = variable(place.request.model, name);
  const std::vector<Index>& unknowns = place.prepared->problem.unknowns;
  if (std::ranges::find(unknowns, found) != unknowns.end())
    throw std::invalid_argument(
        fmt::format("{} is an unknown of the trim of '{}'; expected a parameter with a given value",
                    name, place.request.name));
  return found;
}

}  // namespace

std::vector<Requirement> asked_of(const TuneProblem& problem) {
  std::vector<Requirement> asked = problem.goals;
  if (asked.empty()) asked.push_back(problem.goal);
  asked.insert(asked.end(), problem.limits.begin(), problem.limits.end());
  const auto asks_stability = [](const Requirement& r) {
    return r.measure == Measure::decay || r.measure == Measure::damping;
  };
  const bool among_goals = problem.goals.empty() && asks_stability(problem.goal);
  if (!among_goals && std::ranges::none_of(problem.limits, asks_stability))
    asked.push_back({.measure = Measure::decay, .limit = 0.0});
  return asked;
}

VectorXd gains_of(const VectorXd& variables, const VectorXd& shares) {
  const Index places = shares.size();
  return variables.reshaped(places, variables.size() / places).transpose() * shares;
}

Candidates::Candidates(const TuneProblem& problem, const TrimOptions& trimming)
    : problem_(problem) {
  check(problem);
  asked_ = asked_of(problem);
  const std::vector<Scatter> scatter = scatter_of(problem);
  places_.resize(problem.points.size() * scatter.size());
  for (std::size_t i = 0; i < places_.size(); ++i) {
    Place& place = places_[i];
    const std::size_t point = i / scatter.size();
    const Scatter& own = scatter[i % scatter.size()];
    place.where = {point, own.words};
    place.request = problem.points[point];
    if (!problem.loops.empty()) place.loops = &problem.loops[point];
    if (!problem.responses.empty()) place.responses = &problem.responses[point];
    for (Index k = 0; k < own.values.size(); ++k)
      set_value(place.request.guess,
                variable(place.request.model, problem.uncertain[std::size_t(k)].name),
                own.values[k]);
    place.prepared = std::make_unique<Prepared>(place.request, no_axes, trimming);
    for (const FreeGain& g : problem.gains) place.gains.push_back(given(place, g.name));
    for (const Uncertain& u : problem.uncertain) place.uncertain.push_back(given(place, u.name));
    if (!problem.schedule.empty()) (void)given(place, problem.schedule_over);
    for (const auto& [state, value] : problem.disturbance)
      (void)index_of(place.request.model.states, state, "state");
    place.shares = shares_at(problem, place.request);
  }
}

GridTrim Candidates::settled(const Place& place, const VectorXd& gains, const VectorXd& uncertain,
                             From from) const {
  const Prepared& sweep = *place.prepared;
  const auto set_numbers = [&](OperatingPoint& at) {
    for (std::size_t j = 0; j < place.gains.size(); ++j)
      set_value(at, place.gains[j], gains[Index(j)]);
    for (Index k = 0; k < uncertain.size(); ++k)
      set_value(at, place.uncertain[std::size_t(k)], uncertain[k]);
  };
  OperatingPoint numbers = sweep.request.guess;
  set_numbers(numbers);
  if (place.nearest && from == From::nearest)
    if (const auto e = settle(sweep, numbers, *place.nearest)) return *e;
  return from_nothing(sweep, numbers);
}

namespace {

// Its derivative is a difference of scores at other gains.
bool differenced(const Requirement& r) {
  return !spectral(r.measure) && (!of_a_response(r.measure) || r.measure == Measure::overshoot ||
                                  r.measure == Measure::settling_time);
}

}  // namespace

// Scores of requirements on the whole system, and their derivatives.
void Candidates::describe(const Place& place, const GridTrim& e, const EigenvalueSlopes& spectrum,
                          bool slopes, PlaceModes& result) const {
  result.scores = VectorXd::Constant(std::ssize(asked_), std::numeric_limits<double>::quiet_NaN());
  result.score_slopes = MatrixXd::Zero(std::ssize(asked_), std::ssize(place.gains));
  for (std::size_t i = 0; i < asked_.size(); ++i) {
    const Requirement& r = asked_[i];
    if (of_a_response(r.measure)) {
      const ResponseScore own =
          response_score(problem_, r, place, e, result.eigenvalues, slopes && !differenced(r));
      result.scores[Index(i)] = own.score;
      if (own.slopes.size() > 0 && own.slopes.allFinite())
        result.score_slopes.row(Index(i)) = own.slopes;
      if (slopes && own.score < -unbounded) {  // not stable: towards the axis
        Index rightmost = 0;
        spectrum.eigenvalues.real().maxCoeff(&rightmost);
        result.score_slopes.row(Index(i)) = -unbounded * spectrum.slopes.row(rightmost).real();
      }
    } else if (!spectral(r.measure)) {
      result.scores[Index(i)] = score(problem_, r, place, e, result.eigenvalues);
    }
  }
  if (slopes && std::ranges::any_of(asked_, differenced)) difference_scores(place, e, result);
}

// Central differences, with a new trim at each end.
void Candidates::difference_scores(const Place& place, const GridTrim& e,
                                   PlaceModes& result) const {
  const auto scores = [&](const GridTrim& there) {
    const Eigen::VectorXcd eigenvalues = spectrum_of(*place.prepared, there, {}).eigenvalues;
    VectorXd all = VectorXd::Constant(std::ssize(asked_), std::numeric_limits<double>::quiet_NaN());
    for (std::size_t i = 0; i < asked_.size(); ++i) {
      if (!differenced(asked_[i])) continue;
      all[Index(i)] =
          of_a_response(asked_[i].measure)
              ? response_score(problem_, asked_[i], place, there, eigenvalues, false).score
              : score(problem_, asked_[i], place, there, eigenvalues);
    }
    return all;
  };
  for (std::size_t j = 0; j < place.gains.size(); ++j) {
    const double gain = value_of(e.at, place.gains[j]);
    const double h = 1e-4 * std::max(std::abs(gain), 1e-3);
    std::array<VectorXd, 2> ends;
    for (const int end : {0, 1}) {
      GridTrim there;
      there.at = e.at;
      set_value(there.at, place.gains[j], gain + (end == 0 ? -h : h));
      if (settle(*place.prepared, there)) ends.at(std::size_t(end)) = scores(there);
    }
    if (ends[0].size() == 0 || ends[1].size() == 0) continue;
    const VectorXd slope = (ends[1] - ends[0]) / (2 * h);
    for (Index i = 0; i < slope.size(); ++i)
      if (std::isfinite(slope[i])) result.score_slopes(i, Index(j)) = slope[i];
  }
}

PlaceModes Candidates::modes(const Place& place, const VectorXd& variables, From from,
                             const VectorXd& uncertain) const {
  try {
    return computed(place, variables, from, uncertain);
  } catch (const CallerMistake&) {
    throw;
  } catch (const std::bad_alloc&) {
    throw;
  } catch (const std::exception& thrown) {  // an exception of the model, between trims
    PlaceModes nothing;
    nothing.status = TrimStatus::model_threw;
    nothing.message = thrown.what();
    return nothing;
  }
}

PlaceModes Candidates::computed(const Place& place, const VectorXd& variables, From from,
                                const VectorXd& uncertain) const {
  auto e = std::make_shared<const GridTrim>(
      settled(place, gains_of(variables, place.shares), uncertain, from));
  PlaceModes result;
  result.status = e->status;
  result.message = e->message;
  if (!e->valid()) return result;
  result.at = e->at;
  result.A = e->A(*place.prepared);
  result.eigenvalues = spectrum_of(*place.prepared, *e, {}).eigenvalues;
  if (!result.valid()) {
    result.message = "the eigenvalues do not converge";
    return result;
  }
  describe(place, *e, {}, false, result);
  result.trim = std::move(e);
  return result;
}

void Candidates::differentiate(const Place& place, PlaceModes& modes) const {
  const EigenvalueSlopes spectrum = spectrum_of(*place.prepared, *modes.trim, place.gains);
  modes.eigenvalues = spectrum.eigenvalues;  // in the order of the slopes
  if (!modes.valid()) {
    modes.message = "the eigenvectors do not converge";
    return;
  }
  describe(place, *modes.trim, spectrum, true, modes);
  // derivative by a gain, distributed to the breakpoints of its schedule
  const Index gains = std::ssize(place.gains), places = place.shares.size();
  MatrixXd onto = MatrixXd::Zero(gains, gains * places);
  for (Index j = 0; j < gains; ++j)
    onto.row(j).segment(j * places, places) = place.shares.transpose();
  modes.slopes = spectrum.slopes * onto.cast<std::complex<double>>();
  modes.score_slopes = (modes.score_slopes * onto).eval();
}

std::vector<PlaceModes> Candidates::at(const VectorXd& variables, bool slopes) {
  std::vector<PlaceModes> all(places_.size());
  in_parallel(places_.size(), [&](std::size_t i) {
    all[i] = modes(places_[i], variables, From::nearest, {});
    if (all[i].valid()) places_[i].nearest = all[i].at;
  });
  std::vector<std::size_t> every(places_.size());
  std::iota(every.begin(), every.end(), 0u);
  if (slopes) add_slopes(all, every);
  return all;
}

void Candidates::add_slopes(std::vector<PlaceModes>& all,
                            const std::vector<std::size_t>& places) const {
  in_parallel(places.size(), [&](std::size_t i) {
    PlaceModes& modes = all[places[i]];
    if (!modes.valid() || modes.has_slopes()) return;
    try {
      differentiate(places_[places[i]], modes);
    } catch (const CallerMistake&) {
      throw;
    } catch (const std::bad_alloc&) {
      throw;
    } catch (const std::exception& thrown) {  // an exception of the model next to its trim
      modes = {};
      modes.status = TrimStatus::model_threw;
      modes.message = thrown.what();
    }
  });
}

std::vector<PlaceModes> Candidates::anew(const VectorXd& variables) {
  std::vector<PlaceModes> all(places_.size());
  in_parallel(places_.size(), [&](std::size_t i) {
    all[i] = modes(places_[i], variables, From::nothing, {});
    if (all[i].valid()) places_[i].nearest = all[i].at;
  });
  return all;
}

PlaceModes Candidates::scattered(std::size_t place, const VectorXd& variables,
                                 const VectorXd& uncertain) const {
  return modes(places_[place], variables, From::nearest, uncertain);
}

}  // namespace tiltrim
