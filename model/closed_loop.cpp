// The closed loop (14): airframe and total-energy control law.
#include "model/closed_loop.hpp"

#include <cmath>
#include <stdexcept>

#include "model/differentiable.hpp"
#include "model/parameters.hpp"
#include "model/physics.hpp"
#include "model/vehicle.hpp"

namespace tiltrim {

namespace {

using namespace physics;

Signals closed_loop_parameters_signals() {
  Signals all;
  for (const auto& f : command_fields<double>()) all.push_back({f.name, f.unit, f.nominal});
  for (const Signal& s : aircraft_signals()) all.push_back(s);
  for (const Signal& s : gain_signals()) all.push_back(s);
  return all;
}

// Where the hand-over between cyclic and elevator has a jump (no blend) or a kink's end.
std::vector<Model::Switch> hand_over(const Vehicle& vehicle, const Model& model) {
  if (vehicle.aircraft.cyclic_blend > 0) return {};  // a smoothstep has no kink
  const Eigen::Index eta = find(model.parameters, "eta");
  const Eigen::Index off = find(model.parameters, "aircraft.cyclic_off");
  return {{"the hand-over from cyclic to elevator at eta = cyclic_off",
           [eta, off](const OperatingPoint& at) { return at.p[eta] - at.p[off]; }}};
}

}  // namespace

Model closed_loop(const Vehicle& vehicle, Axes axes) {
  if (!vehicle.polar) throw std::invalid_argument("the vehicle has no polar");
  if (axes == Axes::body && vehicle.equations == Equations::printed)
    throw std::invalid_argument("the printed equations are studied in wind axes only");
  const bool wind = axes == Axes::wind;
  Model model;
  model.name = wind ? "closed loop, wind axes" : "closed loop, body axes";
  if (wind)
    model.states = {{"V_err", "m/s", 1.0}, {"gamma_err", "rad", 0.1}};
  else
    model.states = {{"u", "m/s", 1.0}, {"w", "m/s", 1.0}};
  model.states.push_back({"theta", "rad", 0.1});
  model.states.push_back({"q", "rad/s", 0.1});
  model.states.push_back({"energy_integral", "s", 1.0});
  model.states.push_back({"distribution_integral", "s", 1.0});
  model.outputs = {{"theta0", "", 0.1},      {"a1s", "rad", 0.1},         {"delta_e", "rad", 0.1},
                   {"airspeed", "m/s", 1.0}, {"flight_path", "rad", 0.1}, {"alpha", "rad", 0.1}};
  model.parameters = closed_loop_parameters_signals();
  const auto add = [&](const auto& physics) {
    set_functions(model, physics);
    set_derivatives(model, physics);
  };
  if (wind)
    add(WindLoop{vehicle.polar, vehicle.equations});
  else
    add(BodyLoop{vehicle.polar});
  model.switches = hand_over(vehicle, model);
  return model;
}

}  // namespace tiltrim
