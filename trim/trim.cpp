#include "trim/trim.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <stdexcept>
#include <tuple>
#include <utility>

#include "model/differentiate.hpp"
#include "model/lookup.hpp"
#include "model/time_limit.hpp"
#include "runtime/rounding.hpp"
#include "trim/approach.hpp"
#include "trim/closest.hpp"
#include "trim/newton.hpp"
#include "trim/nlp.hpp"
#include "trim/optimality.hpp"
#include "trim/problem.hpp"
#include "trim/proof.hpp"
#include "trim/verdict.hpp"

namespace tiltrim {

using Eigen::VectorXd;

std::string to_string(TrimStatus status) {
  switch (status) {
    case TrimStatus::converged:
      return "converged";
    case TrimStatus::singular:
      return "singular";
    case TrimStatus::not_optimal:
      return "not_optimal";
    case TrimStatus::not_implied:
      return "not_implied";
    case TrimStatus::infeasible:
      return "infeasible";
    case TrimStatus::not_found:
      return "not_found";
    case TrimStatus::not_finite:
      return "not_finite";
    case TrimStatus::model_threw:
      return "model_threw";
    case TrimStatus::not_repeatable:
      return "not_repeatable";
    case TrimStatus::interrupted:
      return "interrupted";
    case TrimStatus::time_limit:
      return "time_limit";
  }
  return "unknown";
}

namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();
constexpr int further_optimizations = 4;  // Ipopt from further starts: 1000 Newton runs each

// ---- the search ----

// Distinct verified solutions, and the closest point if there are none.
struct Search {
  // As an aggregate it would be filled with zeros first.
  Search(const Problem& problem, const TrimOptions& with) : p(problem), options(with) {}

  const Problem& p;
  const TrimOptions& options;
  std::vector<TrimResult> answers;
  std::optional<TrimResult> not_repeatable;
  std::optional<TrimResult> output_not_finite;
  VectorXd closest;
  double closest_residual = infinity;
  bool none_within = false;  // no point within the limits was found
  Proof proof;               // before the search
  int starts = 0;

  void add(const VectorXd& z, bool optimal) {
    TrimResult r = verify(p, z, optimal, options);
    if (r.status == TrimStatus::not_repeatable) not_repeatable = r;
    if (r.status == TrimStatus::not_finite && std::isfinite(r.residual)) output_not_finite = r;
    if (r.status > TrimStatus::not_implied) {
      if (r.residual < closest_residual) closest = z, closest_residual = r.residual;
      return;
    }
    for (TrimResult& other : answers) {
      if (!same_solution(unknowns_of(p, other.point), z)) continue;
      if (r.status < other.status) other = r;
      return;
    }
    answers.push_back(std::move(r));
  }

  // If the model is not finite at the start, the start is moved back towards the guess.
  void from_newton(VectorXd z0, const TrimOptions& with) {
    constexpr int halvings = 30;
    ++starts;
    NewtonResult found = newton(p, z0, with);
    const VectorXd guess = std::isfinite(found.residual) ? VectorXd{} : unknowns_of(p, p.base);
    for (int i = 0; i < halvings && !std::isfinite(found.residual) && z0 != guess; ++i) {
      z0 = 0.5 * (z0 + guess);
      if (values(p, z0).finite) found = newton(p, z0, with);
    }
    add(found.z, true);
  }

  void from_ipopt(const VectorXd& z0, const TrimOptions& with) {
    ++starts;
    polish(run_ipopt(p, trim_nlp(p), z0, options), with);
  }

  void polish(const VectorXd& z, const TrimOptions& with) {
    if (p.square()) return add(newton(p, z, with).z, true);
    const Optimum optimum = polish_optimum(p, z, with);
    add(optimum.verified ? optimum.z : newton(p, z, with).z, optimum.verified);
  }
};

void search(Search& s) {
  const Problem& p = s.p;
  VectorXd guess = unknowns_of(p, p.base);
  const bool newton_only = s.options.method == TrimMethod::newton;
  if (newton_only) {
    s.from_newton(std::move(guess), s.options);
  } else if (values(p, guess).finite) {
    s.from_ipopt(guess, s.options);
  }
  if (newton_only && s.options.starts <= 0) return;
  TrimOptions quiet = s.options;
  quiet.observe = {};
  const auto stopped = [&] {
    return s.options.stop.stop_requested() || p.over() || s.not_repeatable;
  };
  if (p.square())
    for (int i = 1; i <= s.options.starts && !stopped(); ++i) s.from_newton(start(p, i), quiet);
  if (newton_only || (p.square() && !s.answers.empty())) return;
  for (int i = 1; i <= std::min(further_optimizations, s.options.starts) && !stopped(); ++i)
    if (const VectorXd z = start(p, i); values(p, z).finite) s.from_ipopt(z, quiet);
  // Along a direction that neither equations nor cost determine, Ipopt may diverge; minimum-norm
  // Newton does not.
  for (int i = 1; !p.square() && s.answers.empty() && i <= s.options.starts && !stopped(); ++i) {
    ++s.starts;
    s.polish(newton(p, start(p, i), quiet).z, quiet);
  }
}

// Whether the search ends with the first verified equilibrium, from the guess or else a further
// start, after few evaluations.
bool first_found(Search& s) {
  const Problem& p = s.p;
  const Problem equations = equations_of(p);
  TrimOptions options = s.options;
  for (int i = 0; i <= s.options.starts && !options.stop.stop_requested() && !p.over(); ++i) {
    ++s.starts;
    const auto z =
        few_evaluations(p, equations, i == 0 ? unknowns_of(p, p.base) : start(p, i), options);
    options.observe = {};
    if (!z) continue;
    s.add(*z, true);
    if (!s.answers.empty() && s.answers.back()) return true;
  }
  return false;
}

// By status, then cost; among costs equal to rounding the nearest to the guess, and among equal
// distances the one found first.
TrimResult best_answer(Search& s) {
  constexpr double equal = 1e-9;  // relative
  if (s.answers.size() == 1) return std::move(s.answers.front());
  const auto key = [](const TrimResult& r) { return std::tuple(r.status, r.effort); };
  std::ranges::stable_sort(s.answers, {}, key);
  const TrimResult& least = s.answers.front();
  const auto ties = [&](const TrimResult& r) {
    return r.status == least.status && r.effort - least.effort <= equal * std::abs(r.effort);
  };
  const VectorXd guess = unknowns_of(s.p, s.p.base);
  const auto away = [&](const TrimResult& r) { return (unknowns_of(s.p, r.point) - guess).norm(); };
  const auto last = std::ranges::find_if_not(s.answers, ties);
  auto nearest = s.answers.begin();
  for (auto r = s.answers.begin(); r != last; ++r)
    if (away(*r) < away(*nearest) * (1 - equal)) nearest = r;
  std::rotate(s.answers.begin(), nearest, nearest + 1);
  TrimResult best = s.answers.front();
  for (std::size_t i = 1; i < s.answers.size(); ++i)
    if (s.answers[i].status == TrimStatus::converged) best.others.push_back(s.answers[i].point);
  return best;
}

// ---- no solution found ----

// The least residual within the limits, from several starts. A point with a small residual may be
// an equilibrium that the search missed: it is refined and added to the solutions. If no point is
// within the limits, the one that exceeds those of the outputs least.
TrimResult closest_to(Search& s) {
  constexpr double nearly = 1e-3;
  const Problem& p = s.p;
  const VectorXd guess = unknowns_of(p, p.base);
  const bool searched = s.closest.size() > 0;  // not if proved before
  TrimResult best = verify(p, searched ? s.closest : guess, true, s.options);
  const bool nowhere_finite = searched && !std::isfinite(s.closest_residual);
  if (!s.options.closest || s.options.stop.stop_requested() || nowhere_finite) return best;
  TrimOptions quiet = s.options;
  quiet.observe = {};
  std::pair least{infinity, infinity};
  const auto consider = [&](const VectorXd& z) {
    const Values v = values(p, z);
    if (!v.finite || excess(z, p.lower, p.upper) > bound_slack) return;
    const bool within = excess(v.limited, p.limited_lower, p.limited_upper) <= bound_slack;
    const std::pair key(within ? 0.0 : beyond_limits(p, v).norm(), v.residual.norm());
    if (!(key < least)) return;
    least = key;
    best = verify(p, z, true, s.options);
    if (within && v.residual.norm() < nearly) s.polish(z, quiet);
  };
  std::vector<VectorXd> from{guess};
  if (searched) from.insert(from.begin(), s.closest);
  for (int i = 1; i <= std::min(further_optimizations, s.options.starts); ++i)
    from.push_back(start(p, i));
  std::erase_if(from, [&](const VectorXd& z0) { return !values(p, z0).finite; });
  for (const VectorXd& z0 : from) {
    consider(z0);
    consider(closest_from(p, z0, s.options));
  }
  if (!p.limited.empty() && least.first > 0)
    for (const VectorXd& z0 : from) consider(least_excess_from(p, z0, s.options));
  s.none_within = least.first > 0;
  return best;
}

const char* residuals_in_words(const Problem& p) {
  const bool one = p.equations.size() == 1;
  const auto is_rate = [&](Eigen::Index row) { return row < std::ssize(p.model.states); };
  return std::ranges::all_of(p.equations, is_rate) ? (one ? "residual rate" : "residual rates")
                                                   : (one ? "residual" : "residuals");
}

// What the model gave at the guess, where nothing was finite, as text.
std::string no_numbers(const Problem& p) {
  if (!p.thrown.empty()) return "the model threw: " + p.thrown;
  const VectorXd rates = rates_of(p, values(p, unknowns_of(p, p.base)));
  return "at the guess " + not_finite_in_words(p, rates, outputs(p, p.base));
}

// The closest point of a search without result, as text.
std::string closest_in_words(const Search& s, const TrimResult& r) {
  const Problem& p = s.p;
  if (r.rates.size() == 0)  // not finite
    return "the model is not finite at any point tried; " + no_numbers(p);
  std::string words = fmt::format("the closest point has {} {}, {}", residuals_in_words(p),
                                  left_over(p, p.equations, r), limits_in_words(p, r));
  if (!p.thrown.empty()) words += "; at some points the model threw: " + p.thrown;
  return words;
}

// Only what was evaluated in the time allowed.
TrimResult out_of_time(const Search& s) {
  const Problem& p = s.p;
  const auto& [z, at, residual] = p.nearest;
  TrimResult r;
  r.status = TrimStatus::time_limit;
  r.point = z.size() == p.n() ? point_of(p, z) : p.base;
  r.rates = rates_of(p, at);
  r.outputs = outputs(p, r.point);
  r.residual = residual;
  r.effort = at.effort;
  r.message =
      out_of_time_in_words(s.options.time_limit) + ": " + counted(int(p.evaluations), "evaluation");
  if (std::isfinite(residual))
    r.message += fmt::format("; the closest point has a residual of {:.3g} 1/s", residual);
  return r;
}

// Wrong derivatives lead a search astray: one of those that disagree with differences, as text.
std::string doubtful_derivatives(const Problem& p, const OperatingPoint& at) {
  if (!p.model.derivatives) return "";
  try {
    const Differences d = difference(p.model, at, p.unknowns);
    const auto wrong =
        disagreements(p.model, p.unknowns, exact(p.model, at, p.unknowns), d.jacobian);
    if (wrong.empty() || !d.remarks.empty()) return "";  // at a kink both may be right
    return fmt::format("; the model's derivatives may be wrong: {}{}", wrong.front().text,
                       wrong.size() > 1 ? fmt::format(", and {} more", wrong.size() - 1) : "");
  } catch (...) {  // the model's exception, whatever it is: there is no comparison
    return "";
  }
}

TrimResult no_answer(Search& s) {
  const Problem& p = s.p;
  if (s.not_repeatable) return *s.not_repeatable;
  TrimResult r = closest_to(s);
  if (s.not_repeatable) return *s.not_repeatable;
  if (!s.answers.empty()) return best_answer(s);
  if (p.over()) return out_of_time(s);
  if (s.options.stop.stop_requested()) {
    r.status = TrimStatus::interrupted;
    r.message = "stopped by the caller after " + counted(s.starts, "start");
  } else if (!s.proof.proved && !std::isfinite(s.closest_residual)) {
    r.status = p.thrown.empty() ? TrimStatus::not_finite : TrimStatus::model_threw;
    r.message = p.thrown.empty() ? fmt::format("the model is not finite at any of {}; {}",
                                               counted(s.starts, "start"), no_numbers(p))
                                 : no_numbers(p);
  } else if (s.output_not_finite) {
    r = *s.output_not_finite;
  } else {
    const Proof proof = s.proof.proved ? s.proof : prove_no_solution(p, s.options);
    if (p.over()) return out_of_time(s);
    r.status = proof.proved ? TrimStatus::infeasible : TrimStatus::not_found;
    std::string none = proof.proved ? "no point within the limits is an equilibrium"
                                    : "no equilibrium found from " + counted(s.starts, "start");
    if (proof.boxes > 0 && proof.proved)
      none += fmt::format(" (proved over {} box{})", proof.boxes, proof.boxes == 1 ? "" : "es");
    r.message = fmt::format(
        "{}{}; {}", none,
        s.none_within && r.rates.size() > 0 ? ", and no point within all limits was found" : "",
        closest_in_words(s, r));
    if (!proof.proved) r.message += doubtful_derivatives(p, r.point);
  }
  return r;
}

// A variable fixed outside its own bounds needs no search.
std::optional<TrimResult> refused(const Problem& p, const TrimOptions& options) {
  for (const auto& [variable, range] : p.fixed_bounds) {
    const double at = value_of(p.base, variable);
    if (at >= range.lower && at <= range.upper) continue;
    TrimResult r = verify(p, unknowns_of(p, p.base), true, options);
    r.status = TrimStatus::infeasible;
    r.message = fmt::format("{} is fixed at {:.6g}, outside its limits [{:.6g}, {:.6g}]",
                            signal_of(p.model, variable).name, at, range.lower, range.upper);
    return r;
  }
  return {};
}

void check(const TrimOptions& options) {
  const auto at_least = [](int least, const char* name, int count) {
    if (count < least)
      throw std::invalid_argument(fmt::format("{} {}; expected at least {}", count, name, least));
  };
  check_positive("tolerance", options.tolerance);
  check_positive("step tolerance", options.step_tolerance);
  at_least(0, "starts", options.starts);
  at_least(0, "boxes", options.max_boxes);
  at_least(1, "iterations", options.max_iterations);
}

}  // namespace

// Before a search that would end without result: Ipopt takes 50 ms for it, and as long again for
// the closest point; a thousand boxes take less than a tenth of that. Where Newton's method finds a
// solution at once, there is nothing to prove.
static Proof short_proof(const Problem& p, TrimOptions options) {
  options.observe = {};
  options.max_boxes = std::min(options.max_boxes,
                               options.closest ? boxes_before_search : boxes_before_short_search);
  if (options.max_boxes == 0 || !can_be_proved(p)) return {};
  const VectorXd found = newton(p, unknowns_of(p, p.base), options).z;
  if (is_equilibrium(verify(p, found, true, options).status)) return {};
  return prove_no_solution(p, options);
}

static TrimResult answer_to(const Problem& problem, const TrimOptions& options,
                            const Proof& known) {
  check(options);
  if (options.method == TrimMethod::newton && !problem.square())
    throw std::invalid_argument(
        fmt::format("method newton needs as many unknowns as equations, not {} and {}", problem.n(),
                    problem.m()));
  if (auto r = refused(problem, options)) return *r;
  Search first(problem, options), all(problem, options);
  all.proof = known;
  const bool ends =
      !known.proved && !options.others && problem.square() && problem.n() > 0 && first_found(first);
  if (!ends && !known.proved && options.method == TrimMethod::ipopt)
    all.proof = short_proof(problem, options);
  if (!ends && !all.proof.proved) search(all);
  Search& s = ends ? first : all;
  TrimResult result = s.answers.empty() ? no_answer(s) : best_answer(s);
  if (problem.over() && result.message.empty())
    result.message = fmt::format(
        "the time limit of {:.6g} s was reached after {}: further starts were not tried",
        options.time_limit, counted(s.starts, "start"));
  result.thrown = problem.thrown;
  result.starts = s.starts;
  result.evaluations = problem.evaluations;
  return result;
}

TrimResult solution_of(const Problem& problem, const TrimOptions& options) {
  return answer_to(problem, options, {});
}

bool proved_infeasible(const Model& model, const TrimSpec& spec, const OperatingPoint& guess,
                       const TrimOptions& options) {
  const RoundToNearest environment;
  check(options);
  return prove_no_solution(make_problem(model, spec, guess), options).proved;
}

static TrimResult answer_in_time(const Model& model, const TrimSpec& spec,
                                 const OperatingPoint& guess, const TrimOptions& options,
                                 const Proof& known) {
  const RoundToNearest environment;
  std::optional<TimedModel> limited;
  if (options.time_limit != unlimited) limited = timed(model, options.time_limit);
  Problem problem =
      make_problem(limited ? limited->model : model, spec, guess, limited.has_value());
  if (limited) problem.out_of_time = limited->over;
  return answer_to(problem, options, known);
}

TrimResult trim(const Model& model, const TrimSpec& spec, const OperatingPoint& guess,
                const TrimOptions& options) {
  return answer_in_time(model, spec, guess, options, {});
}

TrimResult closest_point(const Model& model, const TrimSpec& spec, const OperatingPoint& guess,
                         const TrimOptions& options) {
  return answer_in_time(model, spec, guess, options, {true, 0});
}

}  // namespace tiltrim
