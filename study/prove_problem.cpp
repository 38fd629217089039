// A condition of a study and its [prove] as a problem of prove().
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>

#include "flight/closed_loop_proof.hpp"
#include "model/among.hpp"
#include "model/jet.hpp"
#include "model/lookup.hpp"
#include "study/problems.hpp"
#include "trim/trim.hpp"

namespace tiltrim {

using Eigen::Index;
using Eigen::VectorXd;

namespace {

using Jets = std::vector<Jet>;

// States whose rates a condition holds.
std::vector<std::string> held_states(const TrimProblem& trim) {
  std::vector<std::string> held;
  for (const Signal& s : trim.model.states)
    if (among(trim.spec.steady, s.name) || trim.spec.rates.contains(s.name)) held.push_back(s.name);
  return held;
}

// A proof is about as many unknowns as equations, which are not parameters.
void check_provable(const Condition& condition, const TrimProblem& trim,
                    const std::vector<Uncertain>& parameters) {
  const TrimSpec& spec = trim.spec;
  for (const Uncertain& varied : parameters)
    if (among(spec.free, varied.name))
      throw error_in(condition,
                     fmt::format("'{}' is unknown here, so a proof cannot vary it; expected a "
                                 "value for it, or --only with other conditions",
                                 varied.name));
  for (const std::string& name : spec.free)
    if (find(trim.model.parameters, name) >= 0)
      throw error_in(
          condition,
          fmt::format("the parameter '{}' is unknown here; a proof needs its value", name));
  if (!spec.implied.empty())
    throw error_in(
        condition,
        fmt::format("the rate of '{}' is implied, which a proof cannot verify", spec.implied[0]));
  for (const auto& [name, range] : spec.bounds)
    if (range.lower == range.upper)
      throw error_in(condition,
                     fmt::format("'{}' is held at a value, which a proof cannot do; expected "
                                 "[lower, upper]",
                                 name));
  const std::vector<std::string> held = held_states(trim);
  if (spec.free.size() != held.size())
    throw error_in(
        condition,
        fmt::format("a proof needs as many unknowns as equations; there are {} ({}) for the "
                    "rates of {} ({})",
                    spec.free.size(), fmt::join(spec.free, ", "), held.size(),
                    fmt::join(held, ", ")));
}

// The jets less the prescribed rates, so that a condition's equations are rates that vanish.
decltype(Model::jets) less_rates(const Model& model, const std::map<std::string, double>& rates) {
  std::map<std::size_t, double> shifts;
  for (const auto& [state, rate] : rates)
    if (rate != 0) shifts[std::size_t(index_of(model.states, state, "state"))] = rate;
  if (shifts.empty()) return model.jets;
  return [jets = model.jets, shifts](const Jets& x, const Jets& u, const Jets& p) {
    Jets all = jets(x, u, p);
    for (const auto& [row, rate] : shifts) all[row] -= rate;
    return all;
  };
}

// The unknowns of a trim at values c of the varied parameters, from the guess and further starts.
std::optional<VectorXd> trimmed(TrimProblem problem, const std::vector<Uncertain>& parameters,
                                const VectorXd& c, int starts) {
  for (std::size_t k = 0; k < parameters.size(); ++k)
    set_value(problem.guess, variable(problem.model, parameters[k].name), c[Index(k)]);
  TrimOptions options;
  options.method = TrimMethod::newton;
  options.starts = starts;
  options.max_boxes = 0;
  options.closest = false;
  const TrimResult found = trim(problem.model, problem.spec, problem.guess, options);
  if (!is_equilibrium(found.status)) return {};
  VectorXd z(std::ssize(problem.spec.free));
  for (Index j = 0; j < z.size(); ++j)
    z[j] = value_of(found.point, variable(problem.model, problem.spec.free[std::size_t(j)]));
  return z;
}

// If all unknowns are bounded: the equations within the bounds.
std::optional<ProveProblem::NecessarySystem> within_bounds(const ProveProblem& problem) {
  ProveProblem::NecessarySystem system{problem.model, problem.equations, {}, {}};
  for (const std::string& name : problem.unknowns) {
    const auto bounded = problem.limits.find(name);
    if (bounded == problem.limits.end() || !std::isfinite(bounded->second.lower) ||
        !std::isfinite(bounded->second.upper))
      return {};
    system.unknowns.emplace_back(name, bounded->second);
  }
  std::vector<Index> places;
  for (const Uncertain& varied : problem.parameters)
    places.push_back(variable(problem.model, varied.name));
  system.at = [guess = problem.guess, places](const Jets& c) {
    ProveProblem::NecessarySystem::Values at;
    at.x.assign(guess.x.begin(), guess.x.end());
    at.u.assign(guess.u.begin(), guess.u.end());
    at.p.assign(guess.p.begin(), guess.p.end());
    for (std::size_t k = 0; k < places.size(); ++k) {
      const std::size_t place = std::size_t(places[k]), nx = at.x.size(), nu = at.u.size();
      (place < nx        ? at.x[place]
       : place < nx + nu ? at.u[place - nx]
                         : at.p[place - nx - nu]) = c[k];
    }
    return at;
  };
  return system;
}

// Starts at a trim in the middle of the box, if there is one.
void start_at_middle(TrimProblem& trim, const std::vector<Uncertain>& parameters) {
  const VectorXd middle = VectorXd::NullaryExpr(std::ssize(parameters), [&](Index k) {
    const Uncertain& p = parameters[std::size_t(k)];
    return 0.5 * (p.lower + p.upper);
  });
  const auto z = trimmed(trim, parameters, middle, TrimOptions{}.starts);
  for (std::size_t j = 0; z && j < trim.spec.free.size(); ++j)
    set_value(trim.guess, variable(trim.model, trim.spec.free[j]), (*z)[Index(j)]);
}

ProveProblem user_proof(const Condition& condition, const std::vector<Uncertain>& parameters) {
  TrimProblem trim = user_problem(*condition.user());
  check_provable(condition, trim, parameters);
  start_at_middle(trim, parameters);
  ProveProblem problem;
  problem.name = condition.name;
  problem.model = trim.model;
  problem.model.jets = less_rates(trim.model, trim.spec.rates);
  problem.unknowns = trim.spec.free;
  problem.equations = held_states(trim);
  problem.limits = trim.spec.bounds;
  problem.guess = trim.guess;
  problem.parameters = parameters;
  problem.necessary = within_bounds(problem);
  problem.start = [trim, parameters](const VectorXd& c) {
    constexpr int starts = 0;  // a box has its parent's trim too
    return trimmed(trim, parameters, c, starts);
  };
  return problem;
}

}  // namespace

ProveProblem prove_problem(const Study& study, const Condition& condition) {
  std::vector<Uncertain> parameters;
  for (const ProveTable::Parameter& p : study.prove->parameters) {
    const std::string& signal = p.key.signal.empty() ? p.key.name : p.key.signal;
    parameters.push_back({signal, p.from, p.to});
  }
  if (condition.user()) return user_proof(condition, parameters);
  return closed_loop_proof(study.vehicle, study.schedule, condition.name, *condition.command(),
                           parameters);
}

}  // namespace tiltrim
