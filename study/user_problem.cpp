// Conditions of a study with [model].
#include <algorithm>
#include <cmath>

#include "model/among.hpp"
#include "model/lookup.hpp"
#include "study/analyses.hpp"

namespace tiltrim {

using Eigen::Index;

namespace {

// Default start of an unknown: its own value, moved into its bounds.
double between(const Range& range, double own) {
  if (std::isfinite(range.lower) && std::isfinite(range.upper))
    return 0.5 * (range.lower + range.upper);
  return std::clamp(own, range.lower, range.upper);
}

}  // namespace

TrimProblem user_problem(const UserCondition& condition) {
  const UserModel& own = *condition.model;
  const Model& model = own.model;
  TrimProblem problem{model, {}, {}};
  OperatingPoint& guess = problem.guess;
  guess = {Eigen::VectorXd::Zero(std::ssize(model.states)),
           Eigen::VectorXd::Zero(std::ssize(model.inputs)), own.parameters};
  const auto ask = [&](const Signals& signals, bool free) {
    for (const Signal& s : signals) {
      const auto given = condition.values.find(s.name);
      if (given == condition.values.end() && !free) continue;
      const Range range = given == condition.values.end() ? Range{} : given->second;
      const Index at = variable(model, s.name);
      set_value(guess, at, between(range, value_of(guess, at)));
      if (const auto start = condition.guess.find(s.name); start != condition.guess.end())
        set_value(guess, at, start->second);
      if (range.lower == range.upper) {
        set_value(guess, at, range.lower);
        continue;
      }
      problem.spec.free.push_back(s.name);
      if (std::isfinite(range.lower) || std::isfinite(range.upper))
        problem.spec.bounds[s.name] = range;
    }
  };
  ask(model.states, true);
  ask(model.inputs, false);
  ask(model.parameters, false);
  for (const Signal& s : model.outputs)
    if (const auto given = condition.values.find(s.name); given != condition.values.end())
      problem.spec.bounds[s.name] = given->second;
  for (const Signal& s : model.states)
    if (!condition.rates.contains(s.name) && !among(condition.moving, s.name) &&
        !among(condition.implied, s.name))
      problem.spec.steady.push_back(s.name);
  problem.spec.rates = condition.rates;
  problem.spec.moving = condition.moving;
  problem.spec.implied = condition.implied;
  problem.spec.effort = condition.effort;
  return problem;
}

}  // namespace tiltrim
