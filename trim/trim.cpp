#include "trim/trim.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <optional>
#include <stdexcept>

#include "model/lookup.hpp"
#include "model/time_limit.hpp"
#include "runtime/rounding.hpp"
#include "trim/newton.hpp"
#include "trim/no_answer.hpp"
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
  TrimSearch first(problem, options), all(problem, options);
  all.proof = known;
  const bool ends =
      !known.proved && !options.others && problem.square() && problem.n() > 0 && first_found(first);
  if (!ends && !known.proved && options.method == TrimMethod::ipopt)
    all.proof = short_proof(problem, options);
  if (!ends && !all.proof.proved) search(all);
  TrimSearch& s = ends ? first : all;
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
