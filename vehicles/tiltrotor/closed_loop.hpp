/// The closed loop (14) on any scalar: airframe and total-energy control law.
/// Internal to vehicles/tiltrotor/.
#pragma once

#include <memory>

#include "model/differentiable.hpp"
#include "vehicles/tiltrotor/parameters.hpp"
#include "vehicles/tiltrotor/physics.hpp"
#include "vehicles/tiltrotor/vehicle.hpp"

namespace tiltrim::physics {

/// What the inputs of the closed loop are.
enum class LoopInputs {
  nothing,   ///< there are none
  inputs,    ///< added to theta0, a1s and delta_e after the control law, where loops are broken
  trim,      ///< theta0 and the deflection of the actuator that controls pitch; no control law
  feedback,  ///< the same, about which the control law gives the derivatives along the states
};

constexpr Sizes closed_loop_sizes(LoopInputs added) {
  return {.states = 6,
          .inputs = added == LoopInputs::inputs ? 3U : 0U,
          .parameters = command_fields<double>().size() + aircraft_fields<double>().size() +
                        gain_fields<double>().size(),
          .outputs = 6};
}

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
  return {unpack<CommandOf<P>, command_fields<P>>(p),
          unpack<AircraftOf<P>, aircraft_fields<P>>(p + nc),
          unpack<GainsOf<P>, gain_fields<P>>(p + nc + na)};
}

/// The total command at actuator i, which has this share of the control of pitch. Where the inputs
/// are the actuators' values in trim, the integrals are what they must be for these.
template <LoopInputs added, class S, class P>
S behind(const S& command, const S* added_to, std::size_t i, const P& share) {
  if constexpr (added == LoopInputs::inputs)
    return command + added_to[i];
  else if constexpr (added == LoopInputs::trim)
    return i == 0 ? added_to[0] : share * added_to[1];
  else if constexpr (added == LoopInputs::feedback)
    return (i == 0 ? added_to[0] : share * added_to[1]) + command.change();
  else
    return command;
}

template <class S>
void write_outputs(S* outputs, const RotorCommand<S>& rotor, const S& delta_e, const S& V,
                   const S& gamma, const S& alpha) {
  outputs[0] = rotor.theta0;
  outputs[1] = rotor.a1s;
  outputs[2] = delta_e;
  outputs[3] = V;
  outputs[4] = gamma;
  outputs[5] = alpha;
}

template <LoopInputs added = LoopInputs::nothing, class PolarPointer = std::shared_ptr<const Polar>>
struct WindLoop {
  static constexpr Sizes sizes = closed_loop_sizes(added);

  PolarPointer polar;
  Equations equations;

  template <class S, class P>
  void operator()(const S* x, const S* added_to, const P* p, S* rates, S* outputs) const {
    const auto [d, a, k] = numbers(p);
    const S &V_err = x[0], &gamma_err = x[1], &theta = x[2], &q = x[3], &x1 = x[4], &x2 = x[5];
    const S V = d.V - V_err;
    const S gamma = d.gamma - gamma_err;
    const S alpha = theta - gamma;
    const SinCos<S> path = sin_cos(gamma);
    const SinCos<S> path_err = sin_cos(gamma_err);
    const Sensed<S> sensed{V, V_err, path.sin, path_err.sin, theta, q, x1, x2};
    const CoefficientsOf<S> C = coefficients(*polar, alpha);
    const P s = authority_at(d.eta, a);
    const RotorCommand<S> rotor = rotor_command(sensed, C.CD, s, a, k);
    const RotorCommand<S> total{behind<added>(rotor.theta0, added_to, 0, s),
                                behind<added>(rotor.a1s, added_to, 1, s)};
    const SinCos<S> incidence = sin_cos(alpha);
    const Flow<S> air = flow(V, incidence, C, q, total.theta0, total.a1s, d.eta, a);
    const S V_rate = speed_rate(air, path.sin, a);
    const auto [He, Le] = energy_errors(sensed, V_rate, a, k);
    const S commanded_e = elevator_command(sensed, Le, s, k);
    const S delta_e = behind<added>(commanded_e, added_to, 2, 1.0 - s);
    if (rates) {
      // As printed, (14) uses the commanded acceleration in the state equation.
      const double commanded = equations == Equations::printed ? 1.0 : 0.0;
      rates[0] = commanded * k.k_V * V_err - V_rate;
      rates[1] = -path_rate(air, V, path.cos, delta_e, a, equations);
      rates[2] = q;
      rates[3] = pitch_acceleration(air, delta_e, a);
      rates[4] = He;
      rates[5] = Le;
    }
    constexpr bool trimmed = added == LoopInputs::trim || added == LoopInputs::feedback;
    if (outputs)
      write_outputs(outputs, trimmed ? total : rotor, trimmed ? delta_e : commanded_e, V, gamma,
                    alpha);
  }
};

template <LoopInputs added = LoopInputs::nothing>
struct BodyLoop {
  static constexpr Sizes sizes = closed_loop_sizes(added);

  std::shared_ptr<const Polar> polar;

  template <class S, class P>
  void operator()(const S* x, const S* added_to, const P* p, S* rates, S* outputs) const {
    const auto [d, a, k] = numbers(p);
    const S &u = x[0], &w = x[1], &theta = x[2], &q = x[3], &x1 = x[4], &x2 = x[5];
    const auto [V, measured] = airspeed(u, w);
    const S alpha = V > 0.0 ? measured : measured + (theta - d.gamma);
    const S V_err = d.V - V;
    const S gamma = theta - alpha;
    const SinCos<S> pitch = sin_cos(theta);
    const SinCos<S> incidence = sin_cos(alpha);
    const SinCos<S> path = pitch - incidence;
    const SinCos<S> path_err = sin_cos(d.gamma - gamma);
    const Sensed<S> sensed{V, V_err, path.sin, path_err.sin, theta, q, x1, x2};
    const CoefficientsOf<S> C = coefficients(*polar, alpha);
    const P s = authority_at(d.eta, a);
    const RotorCommand<S> rotor = rotor_command(sensed, C.CD, s, a, k);
    const Flow<S> air = flow(V, incidence, C, q, behind<added>(rotor.theta0, added_to, 0, s),
                             behind<added>(rotor.a1s, added_to, 1, s), d.eta, a);
    const auto [He, Le] = energy_errors(sensed, speed_rate(air, path.sin, a), a, k);
    const S commanded_e = elevator_command(sensed, Le, s, k);
    const S delta_e = behind<added>(commanded_e, added_to, 2, 1.0 - s);
    if (rates) {
      const auto body = body_acceleration(air, u, w, pitch, q, delta_e, a);
      rates[0] = body.u;
      rates[1] = body.w;
      rates[2] = q;
      rates[3] = pitch_acceleration(air, delta_e, a);
      rates[4] = He;
      rates[5] = Le;
    }
    if (outputs) write_outputs(outputs, rotor, commanded_e, V, gamma, alpha);
  }
};

}  // namespace tiltrim::physics
