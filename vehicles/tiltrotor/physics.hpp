/// The flight mechanics, written once for every scalar: numbers, dual numbers, ranges.
/// Internal to vehicles/tiltrotor/. Equation numbers are the paper's [1]; docs/theory.md derives
/// each line.
///
/// S is the scalar of states, inputs and results; P that of parameters: S, or double if no
/// derivative with respect to a parameter is needed.
#pragma once

#include <cmath>
#include <numbers>

#include "model/scalar.hpp"
#include "vehicles/tiltrotor/coefficients.hpp"
#include "vehicles/tiltrotor/vehicle.hpp"

namespace tiltrim::physics {

// Velocity induced by the rotors (3), odd in theta0, differentiable at zero:
//   (ΩR c₁/16) (√(1 + 32|x|/c₁) - 1) sgn x  =  2 ΩR x / (√(1 + 32|x|/c₁) + 1)
template <class S, class P>
S induced_velocity(const S& theta0, const AircraftOf<P>& a) {
  constexpr double pi = std::numbers::pi;
  const P tip_speed = a.rotor_speed_rpm * (2 * pi / 60) * a.rotor_radius;
  const P c1 = a.blade_lift_slope * a.blade_count * a.blade_chord / (pi * a.rotor_radius);
  const S x = a.pitch_scale * theta0;
  const S root = sqrt(1.0 + 32.0 / c1 * abs(x));
  return 2.0 * tip_speed * x / (root + 1.0);
}

// The forces on the airframe without elevator: dynamic pressure, coefficients, thrust.
template <class S>
struct Flow {
  S Q, Q_qh;                 // ½ρW²S and Q q c̄/(2W), the latter finite at W = 0
  const SinCos<S>& alpha;    // the caller's, as are the coefficients
  SinCos<S> disc, a1s, phi;  // disc = η - a1s: from body x to the disc normal; φ = α + disc
  const CoefficientsOf<S>& C;
  S thrust;
};

template <class S, class P, class E>
Flow<S> flow(const S& V, const SinCos<S>& alpha, const CoefficientsOf<S>& C, const S& q,
             const S& theta0, const S& a1s, const E& eta, const AircraftOf<P>& a) {
  const S W = V + a.wake_immersion * induced_velocity(theta0, a);
  const S Q = 0.5 * a.air_density * a.wing_area * W * W;
  const S Q_qh = 0.25 * a.air_density * a.wing_area * a.chord * W * q;
  const S T = a.thrust_excess * a.mass * a.gravity * theta0;  // (4)
  const SinCos<S> disc = sin_cos(eta - a1s);
  return {Q, Q_qh, alpha, disc, sin_cos(a1s), alpha + disc, C, T};
}

template <class S>
S drag(const Flow<S>& air) {
  return air.Q * air.C.CD;
}

template <class S, class P>
S lift(const Flow<S>& air, const S& delta_e, const AircraftOf<P>& a) {
  return air.Q * (air.C.CL + a.CL_de * delta_e * air.alpha.cos) + a.CL_q * air.Q_qh;
}

// q' from the hub offset and the aerodynamic moment about the centre of gravity (14).
template <class S, class P>
S pitch_acceleration(const Flow<S>& air, const S& delta_e, const AircraftOf<P>& a) {
  const S hub = a.rotor_x * air.disc.sin - a.rotor_z * air.a1s.sin;
  const S tail = air.Q * (air.C.CM + a.CM_de * delta_e * air.alpha.cos) + a.CM_q * air.Q_qh;
  return (hub * air.thrust + a.chord * tail) / a.inertia_yy;
}

// (2), first row:  V' = (T cos φ - D)/m - g sin γ
template <class S, class P>
S speed_rate(const Flow<S>& air, const S& sin_gamma, const AircraftOf<P>& a) {
  return (air.thrust * air.phi.cos - drag(air)) / a.mass - a.gravity * sin_gamma;
}

// (2), second row:  γ' = (T sin φ + L - m g cos γ)/(m V); as printed, lift and thrust act down.
template <class S, class P>
S path_rate(const Flow<S>& air, const S& V, const S& cos_gamma, const S& delta_e,
            const AircraftOf<P>& a, Equations equations) {
  const double up = equations == Equations::printed ? -1.0 : 1.0;
  const S lifting = up * (air.thrust * air.phi.sin + lift(air, delta_e, a));
  return (lifting - a.mass * a.gravity * cos_gamma) / (a.mass * V);
}

template <class S>
struct BodyAcceleration {
  S u, w;
};

// (1) in its consistent form: gravity once, lift and thrust upwards.
template <class S, class P>
BodyAcceleration<S> body_acceleration(const Flow<S>& air, const S& u, const S& w,
                                      const SinCos<S>& theta, const S& q, const S& delta_e,
                                      const AircraftOf<P>& a) {
  const S L = lift(air, delta_e, a);
  const S D = drag(air);
  const S X = air.thrust * air.disc.cos + L * air.alpha.sin - D * air.alpha.cos;
  const S Z = -air.thrust * air.disc.sin - L * air.alpha.cos - D * air.alpha.sin;
  return {X / a.mass - a.gravity * theta.sin - q * w, Z / a.mass + a.gravity * theta.cos + q * u};
}

// Airspeed and angle of attack from body velocities. At rest the angle of attack is undefined:
// it is taken as zero, without derivative.
template <class S>
struct Airspeed {
  S V, alpha;
};

template <class S>
Airspeed<S> airspeed(const S& u, const S& w) {
  const S square = u * u + w * w;
  if (square <= 0.0) return {vanished(u, w), vanished(u, w)};
  return {sqrt(square), atan2(w, u)};
}

// Cyclic's share of pitch control at a tilt (12): 1 helicopter, 0 airplane; a smoothstep between.
template <class P>
P authority_at(const P& eta, const AircraftOf<P>& a) {
  if (!(a.cyclic_blend > 0.0)) return eta >= a.cyclic_off ? P(1.0) : P(0.0);
  const P t = (eta - a.cyclic_off) / a.cyclic_blend + 0.5;
  if (t <= 0.0) return P(0.0);
  if (t >= 1.0) return P(1.0);
  return t * t * (3.0 - 2.0 * t);
}

// The measurements of the control law.
template <class S>
struct Sensed {
  const S &V, &V_err, &sin_gamma, &sin_gamma_err, &theta, &q, &x1, &x2;
};

template <class S>
struct RotorCommand {
  S theta0, a1s;
};

// Thrust and cyclic from errors and attitude, with V' substituted from (10): (11)-(13).
template <class S, class P>
RotorCommand<S> rotor_command(const Sensed<S>& at, const S& CD, const P& s, const AircraftOf<P>& a,
                              const GainsOf<P>& k) {
  // The control law's own drag estimate: the polar at V, without wake.
  const S drag_estimate = 0.5 * a.air_density * a.wing_area * at.V * at.V * CD;
  const S common =
      k.k_V / a.gravity * at.V_err + at.sin_gamma + drag_estimate / (a.mass * a.gravity);
  const S theta0 = (k.K_Ep * (common + at.sin_gamma_err) + k.K_Ei * at.x1) /
                   (1.0 + a.thrust_excess * k.K_Ep);                                         // (13)
  const S a_hat = (k.K_Lp * (common - at.sin_gamma_err) + k.K_Li * at.x2) / (1.0 + k.K_Lp);  // (13)
  return {theta0, s * (a_hat + k.k_pa * at.theta + k.k_da * at.q)};                          // (12)
}

template <class S>
struct EnergyErrors {
  S He, Le;
};

// Errors of the total energy rate and of the energy distribution rate (7).
template <class S, class P>
EnergyErrors<S> energy_errors(const Sensed<S>& at, const S& V_rate, const AircraftOf<P>& a,
                              const GainsOf<P>& k) {
  const S speeding = (k.k_V * at.V_err - V_rate) / a.gravity;
  return {speeding + at.sin_gamma_err, speeding - at.sin_gamma_err};
}

// Elevator (9), with the share that the cyclic leaves. It does not affect V': nothing is implicit.
template <class S, class P>
S elevator_command(const Sensed<S>& at, const S& Le, const P& s, const GainsOf<P>& k) {
  return (1.0 - s) * (k.K_Lp * Le + k.K_Li * at.x2 + k.k_pe * at.theta + k.k_de * at.q);
}

}  // namespace tiltrim::physics
