#include <stdexcept>

#include "runtime/rounding.hpp"
#include "study/analyses.hpp"
#include "vehicles/tiltrotor/table_trim.hpp"

namespace tiltrim {

TrimProblem problem_of(const Vehicle& vehicle, const Condition& condition) {
  const RoundToNearest environment;
  if (const Command* command = condition.command()) return closed_loop_problem(vehicle, *command);
  if (const AirframeCondition* airframe = condition.airframe())
    return airframe_problem(vehicle, *airframe);
  if (const UserCondition* user = condition.user()) return user_problem(*user);
  throw std::invalid_argument(
      "formulation table gives coefficients, not a flight condition; expected closed_loop or "
      "airframe");
}

Answer answer(const Vehicle& vehicle, const Condition& condition, const TrimOptions& options) {
  const RoundToNearest environment;
  if (const TableCondition* coefficients = condition.table()) {
    const TableTrim table = trim_table(vehicle, *coefficients, options);
    return {condition, table_model(*coefficients, vehicle.aircraft.thrust_excess), table.trim,
            table};
  }
  const TrimProblem p = problem_of(vehicle, condition);
  if (const Command* command = condition.command())
    return {condition, p.model, trim_closed_loop(p, vehicle, *command, options), {}};
  return {condition, p.model, trim(p.model, p.spec, p.guess, options), {}};
}

}  // namespace tiltrim
