#include <cmath>

#include "flight/fly.hpp"
#include "runtime/rounding.hpp"
#include "vehicles/tiltrotor/corridor.hpp"
#include "vehicles/tiltrotor/formulations.hpp"

namespace tiltrim {

void put(const std::map<std::string, double>& states, Axes axes, FlightState& x) {
  const auto given = [&](const char* name, double otherwise) {
    const auto at = states.find(name);
    return at == states.end() ? otherwise : at->second;
  };
  const bool body = axes == Axes::body;
  double V = body ? std::hypot(x.along, x.across) : x.along;
  double gamma = body ? x.theta - std::atan2(x.across, x.along) : x.across;
  V = given("V", V);
  gamma = given("gamma", gamma);
  x.theta = given("theta", x.theta);
  x.q = given("q", x.q);
  x.x1 = given("energy_integral", x.x1);
  x.x2 = given("distribution_integral", x.x2);
  x.along = body ? V * std::cos(x.theta - gamma) : V;
  x.across = body ? V * std::sin(x.theta - gamma) : gamma;
}

TrimmedStart trimmed_start(const Flight& flight, const Command& command, double height,
                           const TrimOptions& options) {
  const RoundToNearest environment;
  Vehicle vehicle = flight.vehicle;
  vehicle.gains = gains_at(flight, command.eta);
  const TrimProblem problem = closed_loop_problem(vehicle, command);
  const TrimResult trim = trim_closed_loop(problem, vehicle, command, options);
  TrimmedStart answer{trim.status, trim.message, {}};
  if (!answer) return answer;
  const Eigen::VectorXd& x = trim.point.x;
  const Evaluation at = evaluate(problem.model, trim.point);
  FlightState& state = answer.start.state;
  state.theta = x[2];
  state.q = x[3];
  state.x1 = x[4];
  state.x2 = x[5];
  state.height = height;
  put({{"V", command.V}, {"gamma", command.gamma}}, flight.axes, state);
  state.eta = command.eta;
  state.theta0 = at.outputs[0];
  state.a1s = at.outputs[1];
  state.delta_e = at.outputs[2];
  return answer;
}

}  // namespace tiltrim
