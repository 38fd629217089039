// A study's conditions as requests.
#include "study/sweep_requests.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <stdexcept>

#include "flight/closed_loop_sweep.hpp"
#include "study/answer.hpp"

namespace tiltrim {

namespace {

SweepRequest airframe_request(const Vehicle& vehicle, const Condition& condition) {
  const TrimProblem problem = problem_of(vehicle, condition);
  return {condition.name, problem.model, problem.spec, problem.guess, names(problem.model.inputs)};
}

SweepRequest user_request(const Condition& condition) {
  const TrimProblem problem = user_problem(condition);
  return {condition.name, problem.model, problem.spec, problem.guess, names(problem.model.inputs)};
}

SweepRequest request_of(const Study& study, const Condition& condition,
                        const std::vector<SweepAxis>& axes) {
  switch (condition.formulation) {
    case Formulation::closed_loop:
      return closed_loop_request(vehicle_at(study, condition), condition.name, condition.command,
                                 axes);
    case Formulation::airframe:
      return airframe_request(study.vehicle, condition);
    case Formulation::user:
      return user_request(condition);
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
