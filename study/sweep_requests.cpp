// A study's conditions as requests.
#include <stdexcept>

#include "flight/closed_loop_sweep.hpp"
#include "runtime/rounding.hpp"
#include "study/analyses.hpp"
#include "study/problems.hpp"

namespace tiltrim {

namespace {

SweepRequest request_of(const Study& study, const Condition& condition,
                        const std::vector<SweepAxis>& axes) {
  if (condition.table())
    throw std::invalid_argument(
        "formulation table has no linear model to sweep; expected closed_loop or airframe");
  if (const Command* command = condition.command())
    return closed_loop_request(vehicle_at(study, condition), condition.name, *command, axes);
  const TrimProblem problem = problem_of(study.vehicle, condition);
  return {condition.name, problem.model, problem.spec, problem.guess, names(problem.model.inputs)};
}

void check_keys(const Condition& condition, const Model& model,
                const std::vector<SweepAxis>& axes) {
  for (const SweepAxis& axis : axes)
    for (const SweepAxis::Column& column : axis.columns)
      if (!column.signal.empty()) check_moves(condition, model, column.signal, column.name);
}

}  // namespace

std::vector<SweepRequest> sweep_requests(const Study& study,
                                         const std::vector<Condition>& conditions,
                                         const std::vector<SweepAxis>& axes) {
  const RoundToNearest environment;
  std::vector<SweepRequest> requests;
  for (const Condition& condition : conditions) {
    try {
      requests.push_back(request_of(study, condition, axes));
      check_keys(condition, requests.back().model, axes);
    } catch (const std::invalid_argument& e) {
      throw error_in(condition, e.what());
    }
  }
  return requests;
}

}  // namespace tiltrim
