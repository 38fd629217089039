#include "study/answer.hpp"

#include <stdexcept>

namespace tiltrim {

namespace {

Answer closed_loop_answer(const Vehicle& vehicle, const Condition& condition,
                          const TrimOptions& options) {
  const TrimProblem problem = problem_of(vehicle, condition);
  return {
      condition, problem.model, trim_closed_loop(problem, vehicle, condition.command, options), {}};
}

Answer solved_answer(const Vehicle& vehicle, const Condition& condition,
                     const TrimOptions& options) {
  const TrimProblem problem = problem_of(vehicle, condition);
  return {condition, problem.model, trim(problem.model, problem.spec, problem.guess, options), {}};
}

Answer table_answer(const Vehicle& vehicle, const Condition& condition,
                    const TrimOptions& options) {
  const auto value = [&](const char* name) { return condition.values.at(name).lower; };
  const TableCondition coefficients{value("gamma"), value("alpha"), value("eta"), value("CL"),
                                    value("CD"),    value("CM"),    value("k")};
  const TableTrim table = trim_table(vehicle, coefficients, options);
  return {condition, table_model(coefficients, vehicle.aircraft.thrust_excess), table.trim, table};
}

}  // namespace

TrimProblem problem_of(const Vehicle& vehicle, const Condition& condition) {
  switch (condition.formulation) {
    case Formulation::closed_loop:
      return closed_loop_problem(vehicle, condition.command);
    case Formulation::airframe:
      return airframe_problem(vehicle, {condition.values, condition.rates, condition.effort});
    case Formulation::user:
      return user_problem(condition);
    case Formulation::table:
      break;
  }
  throw std::invalid_argument(
      "formulation table gives coefficients, not a flight condition; expected closed_loop or "
      "airframe");
}

Answer answer(const Vehicle& vehicle, const Condition& condition, const TrimOptions& options) {
  switch (condition.formulation) {
    case Formulation::closed_loop:
      return closed_loop_answer(vehicle, condition, options);
    case Formulation::airframe:
    case Formulation::user:
      return solved_answer(vehicle, condition, options);
    case Formulation::table:
      return table_answer(vehicle, condition, options);
  }
  throw std::invalid_argument("unknown formulation");
}

}  // namespace tiltrim
