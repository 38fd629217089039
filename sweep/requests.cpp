// A study's conditions as requests.
#include <fmt/core.h>

#include <algorithm>
#include <stdexcept>

#include "follow/answer.hpp"
#include "sweep/sweep.hpp"
#include "trim/conditions.hpp"

namespace tiltrim {

using Eigen::Index;

namespace {

// The vehicle and command behind a closed loop's parameters.
std::pair<Vehicle, Command> behind(Vehicle vehicle, const Eigen::VectorXd& p) {
  Index i = 0;
  Command command;
  for (double* value : {&command.V, &command.gamma, &command.eta}) *value = p[i++];
  for (std::size_t k = 0; k < aircraft_signals().size(); ++k)
    aircraft_value(vehicle.aircraft, k) = p[i++];
  for (std::size_t k = 0; k < gain_signals().size(); ++k) gain_value(vehicle.gains, k) = p[i++];
  return {vehicle, command};
}

// The slowest speed asked of the condition.
double slowest(const Condition& condition, const std::vector<SweepAxis>& axes) {
  double V = condition.command.V;
  for (const SweepAxis& axis : axes)
    for (const SweepAxis::Column& column : axis.columns)
      if (column.signal == "V") V = *std::ranges::min_element(column.si);
  return V;
}

bool moves_V(const std::vector<SweepAxis>& axes) {
  for (const SweepAxis& axis : axes)
    for (const SweepAxis::Column& column : axis.columns)
      if (column.signal == "V") return true;
  return false;
}

// In hover, which no axis leaves: without the bounds that hold for one set of gains alone.
TrimProblem problem_at_rest(const Vehicle& vehicle, const Condition& condition) {
  TrimProblem problem = closed_loop_problem(vehicle, condition.command, Axes::body);
  problem.spec.bounds.erase("energy_integral");
  problem.spec.bounds.erase("distribution_integral");
  return problem;
}

SweepRequest closed_loop_request(const Vehicle& vehicle, const Condition& condition,
                                 const std::vector<SweepAxis>& axes) {
  const double V = slowest(condition, axes);
  const bool slow = V < body_axes_below, moves = moves_V(axes);
  if (V == 0 && moves)
    throw std::invalid_argument(
        "V = 0 has no path to follow to its neighbours; expected V above 0 along the axis");
  const TrimProblem problem =
      V == 0 ? problem_at_rest(vehicle, condition) : problem_along(vehicle, condition, V);
  SweepRequest request{
      condition.name, problem.model, problem.spec, problem.guess, {"theta0", "a1s", "delta_e"}};
  request.cold = [vehicle, slow](const OperatingPoint& at, const TrimOptions& options) {
    const auto [v, command] = behind(vehicle, at.p);
    if (!slow) return trim_closed_loop(v, command, options);
    const TrimProblem own = closed_loop_problem(v, command, Axes::body);
    return trim(own.model, own.spec, own.guess, options);
  };
  return request;
}

SweepRequest airframe_request(const Vehicle& vehicle, const Condition& condition) {
  const TrimProblem problem = problem_of(vehicle, condition);
  return {condition.name, problem.model, problem.spec, problem.guess, names(problem.model.inputs)};
}

SweepRequest own_request(const Condition& condition) {
  const TrimProblem problem = own_problem(condition);
  return {condition.name, problem.model, problem.spec, problem.guess, names(problem.model.inputs)};
}

SweepRequest request_of(const Study& study, const Condition& condition,
                        const std::vector<SweepAxis>& axes) {
  switch (condition.formulation) {
    case Formulation::closed_loop:
      return closed_loop_request(vehicle_at(study, condition), condition, axes);
    case Formulation::airframe:
      return airframe_request(study.vehicle, condition);
    case Formulation::own:
      return own_request(condition);
    case Formulation::table:
      break;
  }
  throw std::invalid_argument(
      "formulation table has no linear model to sweep; expected closed_loop or airframe");
}

void check_keys(const Model& model, const std::vector<SweepAxis>& axes) {
  for (const SweepAxis& axis : axes)
    for (const SweepAxis::Column& column : axis.columns) {
      const std::string& s = column.signal;
      if (s.empty() || find(model.states, s) >= 0 || find(model.inputs, s) >= 0 ||
          find(model.parameters, s) >= 0)
        continue;
      throw std::invalid_argument(
          fmt::format("the {} has no variable {}", model.name, column.name));
    }
}

}  // namespace

std::vector<SweepRequest> sweep_requests(const Study& study,
                                         const std::vector<Condition>& conditions,
                                         const std::vector<SweepAxis>& axes) {
  std::vector<SweepRequest> requests;
  for (const Condition& condition : conditions) {
    try {
      requests.push_back(request_of(study, condition, axes));
      check_keys(requests.back().model, axes);
    } catch (const std::invalid_argument& e) {
      throw std::invalid_argument(fmt::format("condition '{}': {}", condition.name, e.what()));
    }
  }
  return requests;
}

}  // namespace tiltrim
