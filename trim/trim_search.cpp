#include "trim/trim_search.hpp"

#include <algorithm>
#include <cmath>
#include <tuple>
#include <utility>

#include "trim/approach.hpp"
#include "trim/closest.hpp"
#include "trim/newton.hpp"
#include "trim/nlp.hpp"
#include "trim/optimality.hpp"
#include "trim/verdict.hpp"

namespace tiltrim {

using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

constexpr int further_optimizations = 4;  // Ipopt from further starts: 1000 Newton runs each

}  // namespace

void TrimSearch::add(const VectorXd& z, bool optimal, const MatrixXd& undetermined) {
  TrimResult r = verify(p, z, optimal, options);
  if (r.status == TrimStatus::converged && undetermined.cols() > 0) {
    r.status = TrimStatus::singular;
    r.message = "neither the equations nor the cost determine " + free_directions(p, undetermined);
  }
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
void TrimSearch::from_newton(VectorXd z0, const TrimOptions& with) {
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

void TrimSearch::from_ipopt(const VectorXd& z0, const TrimOptions& with) {
  ++starts;
  polish(run_ipopt(p, trim_nlp(p), z0, options), with);
}

void TrimSearch::polish(const VectorXd& z, const TrimOptions& with) {
  if (p.square()) return add(newton(p, z, with).z, true);
  const Optimum optimum = polish_optimum(p, z, with);
  if (optimum.verified)
    add(optimum.z, true, optimum.undetermined);
  else
    add(newton(p, z, with).z, false);
}

void search(TrimSearch& s) {
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

bool first_found(TrimSearch& s) {
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

TrimResult best_answer(TrimSearch& s) {
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

TrimResult closest_to(TrimSearch& s) {
  constexpr double nearly = 1e-3;
  const Problem& p = s.p;
  const VectorXd guess = unknowns_of(p, p.base);
  const bool searched = s.closest.size() > 0;  // not if proved before
  TrimResult best = verify(p, searched ? s.closest : guess, true, s.options);
  const bool nowhere_finite = searched && !std::isfinite(s.closest_residual);
  if (!s.options.closest || s.options.stop.stop_requested() || nowhere_finite) return best;
  TrimOptions quiet = s.options;
  quiet.observe = {};
  constexpr double infinity = std::numeric_limits<double>::infinity();
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

}  // namespace tiltrim
