// The closed loop (14): airframe and total-energy control law.
#include <cmath>
#include <stdexcept>

#include "model/differentiable.hpp"
#include "model/parameters.hpp"
#include "model/physics.hpp"
#include "model/vehicle.hpp"

namespace tiltrim {

namespace {

using namespace physics;

template <class P>
struct Numbers {
  CommandOf<P> d;
  AircraftOf<P> a;
  GainsOf<P> k;
};

template <class P>
Numbers<P> numbers(const P* p) {
  constexpr auto nc = command_fields<P>().size();
  constexpr auto na = aircraft_fields<P>().size();
  return {unpack<CommandOf<P>>(p, command_fields<P>()),
          unpack<AircraftOf<P>>(p + nc, aircraft_fields<P>()),
          unpack<GainsOf<P>>(p + nc + na, gain_fields<P>())};
}

template <class S>
void write_outputs(S* outputs, const Law<S>& law, const S& V, const S& gamma, const S& alpha) {
  outputs[0] = law.theta0;
  outputs[1] = law.a1s;
  outputs[2] = law.delta_e;
  outputs[3] = V;
  outputs[4] = gamma;
  outputs[5] = alpha;
}

struct WindLoop {
  std::shared_ptr<const Polar> polar;
  Equations equations;

  template <class S, class P>
  void operator()(const S* x, const S*, const P* p, S* rates, S* outputs) const {
    const auto [d, a, k] = numbers(p);
    const S &V_err = x[0], &gamma_err = x[1], &theta = x[2], &q = x[3];
    const S V = d.V - V_err;
    const S gamma = d.gamma - gamma_err;
    const S alpha = theta - gamma;
    const Turn<S> path = turn(gamma);
    const S sin_gamma_err = turn(gamma_err).sin;
    const Law<S> law = control_law(V, alpha, path.sin, V_err, sin_gamma_err, theta, q, x[4], x[5],
                                   d.eta, a, k, *polar);
    if (rates) {
      // As printed, (14) puts the commanded acceleration into the state equation itself.
      const double commanded = equations == Equations::printed ? 1.0 : 0.0;
      rates[0] = commanded * k.k_V * V_err - law.V_rate;
      rates[1] = -path_rate(law.air, V, path.cos, law.delta_e, a, equations);
      rates[2] = q;
      rates[3] = pitch_acceleration(law.air, law.delta_e, a);
      rates[4] = law.He;
      rates[5] = law.Le;
    }
    if (outputs) write_outputs(outputs, law, V, gamma, alpha);
  }
};

struct BodyLoop {
  std::shared_ptr<const Polar> polar;

  template <class S, class P>
  void operator()(const S* x, const S*, const P* p, S* rates, S* outputs) const {
    const auto [d, a, k] = numbers(p);
    const S &theta = x[2], &q = x[3];
    const auto [V, alpha] = airspeed(x[0], x[1]);
    const S gamma = theta - alpha;
    const S V_err = d.V - V;
    const S sin_gamma = turn(gamma).sin;
    const S sin_gamma_err = turn(S(d.gamma - gamma)).sin;
    const Law<S> law = control_law(V, alpha, sin_gamma, V_err, sin_gamma_err, theta, q, x[4], x[5],
                                   d.eta, a, k, *polar);
    if (rates) {
      const auto body = body_acceleration(law.air, x[0], x[1], theta, q, law.delta_e, a);
      rates[0] = body.u;
      rates[1] = body.w;
      rates[2] = q;
      rates[3] = pitch_acceleration(law.air, law.delta_e, a);
      rates[4] = law.He;
      rates[5] = law.Le;
    }
    if (outputs) write_outputs(outputs, law, V, gamma, alpha);
  }
};

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
  model.states = wind ? Signals{{"V_err", "m/s", 1.0}, {"gamma_err", "rad", 0.1}}
                      : Signals{{"u", "m/s", 1.0}, {"w", "m/s", 1.0}};
  model.states.push_back({"theta", "rad", 0.1});
  model.states.push_back({"q", "rad/s", 0.1});
  model.states.push_back({"energy_integral", "s", 1.0});
  model.states.push_back({"distribution_integral", "s", 1.0});
  model.outputs = {{"theta0", "", 0.1}, {"a1s", "rad", 0.1},   {"delta_e", "rad", 0.1},
                   {"V", "m/s", 1.0},   {"gamma", "rad", 0.1}, {"alpha", "rad", 0.1}};
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
