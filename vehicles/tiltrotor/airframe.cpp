// The bare airframe: (2) in wind axes, (1) in body axes.
#include <stdexcept>

#include "model/differentiable.hpp"
#include "vehicles/mode_names.hpp"
#include "vehicles/tiltrotor/numbers.hpp"
#include "vehicles/tiltrotor/parameters.hpp"
#include "vehicles/tiltrotor/physics.hpp"
#include "vehicles/tiltrotor/vehicle.hpp"

namespace tiltrim {

namespace {

using namespace physics;

constexpr Sizes airframe_sizes{
    .states = 4, .inputs = 4, .parameters = aircraft_fields<double>().size(), .outputs = 4};
enum Input { theta0, a1s, delta_e, eta };

template <class P>
AircraftOf<P> aircraft(const P* p) {
  return unpack<AircraftOf<P>, aircraft_fields<P>>(p);
}

struct WindAirframe {
  static constexpr Sizes sizes = airframe_sizes;

  std::shared_ptr<const Polar> polar;
  Equations equations;

  template <class S, class P>
  void operator()(const S* x, const S* u, const P* p, S* rates, S* outputs) const {
    const AircraftOf<P> a = aircraft(p);
    const S &V = x[0], &gamma = x[1], &theta = x[2], &q = x[3];
    const S alpha = theta - gamma;
    const SinCos<S> incidence = sin_cos(alpha);
    const CoefficientsOf<S> C = coefficients(*polar, alpha);
    const Flow<S> air = flow(V, incidence, C, q, u[theta0], u[a1s], u[eta], a);
    if (rates) {
      const SinCos<S> path = sin_cos(gamma);
      rates[0] = speed_rate(air, path.sin, a);
      rates[1] = path_rate(air, V, path.cos, u[delta_e], a, equations);
      rates[2] = q;
      rates[3] = pitch_acceleration(air, u[delta_e], a);
    }
    if (outputs) {
      outputs[0] = V;
      outputs[1] = gamma;
      outputs[2] = alpha;
      outputs[3] = air.thrust;
    }
  }
};

struct BodyAirframe {
  static constexpr Sizes sizes = airframe_sizes;

  std::shared_ptr<const Polar> polar;

  template <class S, class P>
  void operator()(const S* x, const S* u, const P* p, S* rates, S* outputs) const {
    const AircraftOf<P> a = aircraft(p);
    const S &theta = x[2], &q = x[3];
    const auto [V, alpha] = airspeed(x[0], x[1]);
    const SinCos<S> incidence = sin_cos(alpha);
    const CoefficientsOf<S> C = coefficients(*polar, alpha);
    const Flow<S> air = flow(V, incidence, C, q, u[theta0], u[a1s], u[eta], a);
    if (rates) {
      const auto body = body_acceleration(air, x[0], x[1], sin_cos(theta), q, u[delta_e], a);
      rates[0] = body.u;
      rates[1] = body.w;
      rates[2] = q;
      rates[3] = pitch_acceleration(air, u[delta_e], a);
    }
    if (outputs) {
      outputs[0] = V;
      outputs[1] = theta - alpha;
      outputs[2] = alpha;
      outputs[3] = air.thrust;
    }
  }
};

}  // namespace

Model airframe(const Vehicle& vehicle, Axes axes) {
  if (!vehicle.polar) throw std::invalid_argument("the vehicle has no polar");
  if (axes == Axes::body && vehicle.equations == Equations::printed)
    throw std::invalid_argument("the printed equations exist in wind axes only");
  const bool wind = axes == Axes::wind;
  Model model;
  model.mode_names = aircraft_modes();
  model.name = wind ? "airframe, wind axes" : "airframe, body axes";
  if (wind)
    model.states = {{"V", "m/s", 1.0}, {"gamma", "rad", 0.1}};
  else
    model.states = {{"u", "m/s", 1.0}, {"w", "m/s", 1.0}};
  model.states.push_back({"theta", "rad", 0.1});
  model.states.push_back({"q", "rad/s", 0.1});
  model.inputs = {
      {"theta0", "", 0.1}, {"a1s", "rad", 0.1}, {"delta_e", "rad", 0.1}, {"eta", "rad", 0.1}};
  model.outputs = {{"airspeed", "m/s", 1.0},
                   {"flight_path", "rad", 0.1},
                   {"alpha", "rad", 0.1},
                   {"thrust", "N", 1.0}};
  model.parameters = aircraft_signals();
  const auto add = [&](const auto& physics) {
    set_functions(model, physics);
    set_derivatives(model, physics);
  };
  if (wind) {
    const WindAirframe physics{vehicle.polar, vehicle.equations};
    add(physics);
    set_enclosure(model, physics);
    set_jets(model, physics);
  } else {
    add(BodyAirframe{vehicle.polar});
  }
  return model;
}

}  // namespace tiltrim
