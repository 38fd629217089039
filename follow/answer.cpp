#include "follow/answer.hpp"

#include <fmt/core.h>

#include <algorithm>

namespace tiltrim {

namespace {

// The closed loop at any speed but rest. The command alone says how fast: that the energy errors
// vanish holds speed and path to it, so neither is held a second time.
TrimProblem body_axes_problem(const Vehicle& vehicle, const Command& command) {
  TrimProblem problem = closed_loop_problem(vehicle, command, Axes::body);
  problem.spec.bounds.erase("airspeed");
  problem.spec.bounds.erase("flight_path");
  problem.spec.free = {"u", "w", "theta", "energy_integral", "distribution_integral"};
  problem.spec.still = {"u", "w", "q", "energy_integral", "distribution_integral"};
  problem.spec.implied = {"theta"};
  return problem;
}

TrimProblem problem_along(const Vehicle& vehicle, const Condition& condition, const Key& parameter,
                          double to) {
  const double V = condition.command.V;
  const double slowest = parameter.signal == "V" ? std::min(V, to) : V;
  const bool slow = condition.formulation == Formulation::closed_loop && slowest < body_axes_below;
  if (slow && V == 0)
    throw std::invalid_argument("at rest there is no path to follow from; expected V above 0");
  return slow ? body_axes_problem(vehicle, condition.command) : problem_of(vehicle, condition);
}

}  // namespace

bool BranchAnswer::answered() const {
  return branch.end == BranchEnd::reached || branch.end == BranchEnd::limit ||
         branch.end == BranchEnd::closed || branch.end == BranchEnd::switched;
}

double BranchAnswer::from() const {
  return parameter.in_study(value_of(start.trim.point, variable(start.model, parameter.signal)));
}

BranchAnswer follow(const Vehicle& vehicle, const Condition& condition, const Key& parameter,
                    double to, const FollowOptions& options, const TrimOptions& trimming) {
  const TrimProblem problem = problem_along(vehicle, condition, parameter, to);
  BranchAnswer answer{{condition, problem.model, {}, {}}, parameter, to, {}};
  TrimResult& start = answer.start.trim;
  start = trim(problem.model, problem.spec, problem.guess, trimming);
  const bool found = answer.start.has_equilibrium();
  answer.branch = follow(problem.model, problem.spec, found ? start.point : problem.guess,
                         parameter.signal, to, options);
  if (!found)
    answer.branch.message =
        fmt::format("no trim to start from: {}: {}", to_string(start.status), start.message);
  return answer;
}

}  // namespace tiltrim
