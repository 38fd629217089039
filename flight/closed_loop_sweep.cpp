#include "flight/closed_loop_sweep.hpp"

#include <algorithm>
#include <stdexcept>

#include "vehicles/tiltrotor/along.hpp"
#include "vehicles/tiltrotor/formulations.hpp"
#include "vehicles/tiltrotor/numbers.hpp"

namespace tiltrim {

namespace {

// The lowest speed of the command over the axes.
double slowest(const Command& command, const std::vector<SweepAxis>& axes) {
  double V = command.V;
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

// Hover at every grid point: without bounds that hold for one set of gains only.
TrimProblem problem_at_rest(const Vehicle& vehicle, const Command& command) {
  TrimProblem problem = closed_loop_problem(vehicle, command, Axes::body);
  problem.spec.bounds.erase("energy_integral");
  problem.spec.bounds.erase("distribution_integral");
  return problem;
}

}  // namespace

SweepRequest closed_loop_request(const Vehicle& vehicle, const std::string& name,
                                 const Command& command, const std::vector<SweepAxis>& axes) {
  const double V = slowest(command, axes);
  const bool slow = V < body_axes_below, moves = moves_V(axes);
  if (V == 0 && moves)
    throw std::invalid_argument(
        "at V = 0 there is no path angle to continue from; expected V above 0 along the axis");
  const TrimProblem problem =
      V == 0 ? problem_at_rest(vehicle, command) : closed_loop_along(vehicle, command, V);
  SweepRequest request{
      name, problem.model, problem.spec, problem.guess, {"theta0", "a1s", "delta_e"}};
  request.cold = [vehicle, slow](const OperatingPoint& at, const TrimOptions& options) {
    const auto [there, asked] = vehicle_from(vehicle, at.p);
    if (!slow) return trim_closed_loop(there, asked, options);
    const TrimProblem own = closed_loop_problem(there, asked, Axes::body);
    return trim(own.model, own.spec, own.guess, options);
  };
  return request;
}

}  // namespace tiltrim
