// The closed loop (14): airframe and total-energy control law.
#include "vehicles/tiltrotor/closed_loop.hpp"

#include <cmath>
#include <memory>
#include <stdexcept>
#include <vector>

#include "model/differentiable.hpp"
#include "runtime/instruction_set.hpp"
#include "vehicles/mode_names.hpp"
#include "vehicles/tiltrotor/closed_loop_kernel.hpp"
#include "vehicles/tiltrotor/corridor.hpp"
#include "vehicles/tiltrotor/numbers.hpp"
#include "vehicles/tiltrotor/parameters.hpp"
#include "vehicles/tiltrotor/physics.hpp"
#include "vehicles/tiltrotor/vehicle.hpp"

namespace tiltrim {

// A polar's pieces in the order of PolarTable.
struct physics::PolarRows {
  std::vector<double> rows;
  PolarTable table;

  explicit PolarRows(const Polar& polar) {
    for (const Polar::Piece& piece : polar.pieces_) {
      for (const Polar::Cubic& c : piece.c) rows.insert(rows.end(), {c.c0, c.c1, c.c2, c.c3});
      rows.insert(rows.end(), {piece.start, piece.start - polar.first_, 0.0, 0.0});
    }
    table = {rows.data(), polar.pieces_.size(), polar.first_, polar.per_radian_};
  }
};

namespace {

using Eigen::Index;
using namespace physics;

Signals closed_loop_parameters_signals() {
  Signals all;
  for (const auto& f : command_fields<double>()) all.push_back({f.name, f.unit, f.nominal});
  for (const Signal& s : aircraft_signals()) all.push_back(s);
  for (const Signal& s : gain_signals()) all.push_back(s);
  return all;
}

// Switches at the handover between cyclic and elevator: a jump (no blend), or no switch (blend).
std::vector<Model::Switch> hand_over(const Vehicle& vehicle, const Model& model) {
  if (vehicle.aircraft.cyclic_blend > 0) return {};  // a smoothstep has no kink
  const Eigen::Index eta = find(model.parameters, "eta");
  const Eigen::Index off = find(model.parameters, "aircraft.cyclic_off");
  return {{"the handover from cyclic to elevator at eta = cyclic_off",
           [eta, off](const OperatingPoint& at) { return at.p[eta] - at.p[off]; }}};
}

// If one actuator alone controls pitch, the airframe's trim does not depend on the gains, because
// the integrals compensate for them. The control law then enters ∂f/∂x through
//   theta0 = (1 - w)/Ep (common + ...) + w K_Ei x1,  w = 1/(1 + Ep K_Ep)                     (13)
//   a1s = (1 - w)(common - ...) + w K_Li x2 + k_pa theta + k_da q,  w = 1/(1 + K_Lp)    (12), (13)
//   delta_e = K_Lp Le + K_Li x2 + k_pe theta + k_de q                                          (9)
std::vector<Model::Affine> affine_gains(const Vehicle& vehicle, const Model& model) {
  if (vehicle.equations == Equations::printed) return {};
  const auto at = [&](const char* name) { return find(model.parameters, name); };
  const Index eta = at("eta"), off = at("aircraft.cyclic_off"), blend = at("aircraft.cyclic_blend");
  const Index Ep = at("aircraft.thrust_excess"), K_Ep = at("gains.K_Ep"), K_Lp = at("gains.K_Lp");
  const auto share = [=](const Eigen::VectorXd& p) {
    Aircraft hand_over;
    hand_over.cyclic_off = p[off];
    hand_over.cyclic_blend = p[blend];
    return authority(hand_over, p[eta]);
  };
  std::vector<Model::Affine> affine;
  for (const Signal& gain : gain_signals()) {
    const Index own = find(model.parameters, gain.name);
    affine.push_back({gain.name, [=](const Eigen::VectorXd& p) -> std::optional<double> {
                        const double s = share(p);
                        if (s != 0 && s != 1) return {};  // one integral, two actuators
                        if (1 + p[K_Lp] == 0 || 1 + p[Ep] * p[K_Ep] == 0) return {};  // no law
                        if (own == K_Ep) return 1 / (1 + p[Ep] * p[K_Ep]);
                        if (own == K_Lp && s == 1) return 1 / (1 + p[K_Lp]);
                        return p[own];
                      }});
  }
  return affine;
}

// The kernel of the instruction set; none if TILTRIM_SIMD names one that does not exist, which the
// kernels that need one report.
void set_lanes(Model& model, const Vehicle& vehicle) {
  void (*kernel)(const WindLoopTask&) = nullptr;
  try {
    kernel = chosen([]<InstructionSet set>() { return &wind_loop<set>; });
  } catch (const std::invalid_argument&) {
    return;
  }
  const auto polar = std::make_shared<const PolarRows>(*vehicle.polar);
  const bool printed = vehicle.equations == Equations::printed;
  model.lanes = [kernel, polar, printed](const double* z, const std::vector<Index>& variables,
                                         double* values, double* slopes) {
    kernel({z, variables.data(), variables.size(), values, slopes, &polar->table, printed});
  };
}

template <LoopInputs added>
Model model_of(const Vehicle& vehicle, Axes axes) {
  if (!vehicle.polar) throw std::invalid_argument("the vehicle has no polar");
  if (axes == Axes::body && vehicle.equations == Equations::printed)
    throw std::invalid_argument("the printed equations exist in wind axes only");
  const bool wind = axes == Axes::wind;
  Model model;
  model.mode_names = aircraft_modes();
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
  if (wind) {
    const WindLoop<added> physics{vehicle.polar, vehicle.equations};
    add(physics);
    if constexpr (added == LoopInputs::nothing) {
      set_jets(model, physics);
      set_lanes(model, vehicle);
    }
  } else {
    add(BodyLoop<added>{vehicle.polar});
  }
  if (added == LoopInputs::inputs)
    model.inputs = {
        {"theta0_added", "", 0.1}, {"a1s_added", "rad", 0.1}, {"delta_e_added", "rad", 0.1}};
  model.switches = hand_over(vehicle, model);
  model.affine = affine_gains(vehicle, model);
  return model;
}

}  // namespace

Model closed_loop(const Vehicle& vehicle, Axes axes) {
  return model_of<LoopInputs::nothing>(vehicle, axes);
}

Model closed_loop_with_inputs(const Vehicle& vehicle, Axes axes) {
  return model_of<LoopInputs::inputs>(vehicle, axes);
}

Model closed_loop_with_commands(const Vehicle& vehicle, Axes axes) {
  const Model loop = closed_loop_with_inputs(vehicle, axes);
  const Index nx = std::ssize(loop.states), nu = std::ssize(loop.inputs);
  const std::vector<Index> commands{find(loop.parameters, "V"), find(loop.parameters, "gamma")};
  const Index added = std::ssize(commands);
  const bool errors = axes == Axes::wind;  // the first two states
  const auto total = [=](OperatingPoint at) {
    for (Index k = 0; k < added; ++k) {
      at.p[commands[std::size_t(k)]] += at.u[nu + k];
      if (errors) at.x[k] += at.u[nu + k];
    }
    at.u.conservativeResize(nu);
    return at;
  };
  const auto of_total = [total](const auto& function) {
    return [function, total](const auto& x, const auto& u, const auto& p) {
      const OperatingPoint at = total({x, u, p});
      return function(at.x, at.u, at.p);
    };
  };
  Model model = loop;
  model.name += ", with commands";
  model.inputs.push_back({"V_added", "m/s", 1.0});
  model.inputs.push_back({"gamma_added", "rad", 0.1});
  model.f = of_total(loop.f);
  model.h = of_total(loop.h);
  model.affine.clear();
  model.lanes = nullptr;
  model.jets = nullptr;
  model.derivatives = [=, slopes = loop.derivatives](const OperatingPoint& at,
                                                     const std::vector<Index>& variables) {
    std::vector<Index> own, columns, of_errors;
    for (const Index j : variables) {
      const Index k = j - nx - nu;
      const bool command = k >= 0 && k < added;
      if (command && errors) {
        columns.push_back(std::ssize(own));
        of_errors.push_back(k);
      }
      own.push_back(command ? nx + nu + commands[std::size_t(k)] : k < 0 ? j : j - added);
    }
    Eigen::MatrixXd J = slopes(total(at), own);
    // ∂/∂added = ∂/∂command + ∂/∂error
    if (!columns.empty()) J(Eigen::all, columns) += slopes(total(at), of_errors);
    return J;
  };
  return model;
}

}  // namespace tiltrim
