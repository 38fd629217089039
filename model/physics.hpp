/// The flight mechanics, written once for every scalar: numbers, numbers with derivatives, ranges.
/// Internal to model/. Equation numbers are the paper's [1]; docs/theory.md derives each line.
///
/// S is the scalar of states, inputs and results; P that of parameters: S, or double where no
/// derivative along a parameter is asked.
#pragma once

#include <cmath>
#include <numbers>

#include "model/polar.hpp"
#include "model/scalar.hpp"
#include "model/vehicle.hpp"

namespace tiltrim::physics {

// Velocity induced by the rotors (3), odd in theta0 and smooth at zero:
//   (ΩR c₁/16) (√(1 + 32|x|/c₁) - 1) sgn x  =  2 ΩR x / (√(1 + 32|x|/c₁) + 1)
template <class S, class P>
S induced_velocity(const S& theta0, const AircraftOf<P>& a) {
  using std::abs, std::sqrt;
  constexpr double pi = std::numbers::pi;
  const P tip_speed = a.rotor_speed_rpm * (2 * pi / 60) * a.rotor_radius;
  const P c1 = a.blade_lift_slope * a.blade_count * a.blade_chord / (pi * a.rotor_radius);
  const S x = a.pitch_scale * theta0;
  const S root = sqrt(S(1.0 + 32.0 / c1 * abs(x)));
  return 2.0 * tip_speed * x / (root + 1.0);
}

// All that acts on the airframe but the elevator: dynamic pressure, coefficients, thrust.
template <class S>
struct Flow {
  Turn<S> alpha, disc, a1s;  // disc = η - a1s: from body x to the disc's normal
  S Q, Q_qh;                 // ½ρW²S and Q q c̄/(2W), the latter finite at W = 0
  CoefficientsOf<S> C;
  S thrust;
};

template <class S, class P, class E>
Flow<S> flow(const S& V, const S& alpha, const S& q, const S& theta0, const S& a1s, const E& eta,
             const AircraftOf<P>& a, const Polar& polar) {
  const S W = V + a.wake_immersion * induced_velocity(theta0, a);
  const S Q = 0.5 * a.air_density * a.wing_area * W * W;
  const S Q_qh = 0.25 * a.air_density * a.wing_area * a.chord * W * q;
  const S T = a.thrust_excess * a.mass * a.gravity * theta0;  // (4)
  return {turn(alpha), turn(S(eta - a1s)), turn(a1s), Q, Q_qh, coefficients(polar, alpha), T};
}

template <class S>
S drag(const Flow<S>& air) {
  return air.Q * air.C.CD;
}

template <class S, class P>
S lift(const Flow<S>& air, const S& delta_e, const AircraftOf<P>& a) {
  return air.Q * (air.C.CL + a.CL_de * delta_e * air.alpha.cos) + a.CL_q * air.Q_qh;
}

// q' from the hub's offset and the aerodynamic moment about the centre of gravity (14).
template <class S, class P>
S pitch_acceleration(const Flow<S>& air, const S& delta_e, const AircraftOf<P>& a) {
  const S hub = a.rotor_x * air.disc.sin - a.rotor_z * air.a1s.sin;
  const S tail = air.Q * (air.C.CM + a.CM_de * delta_e * air.alpha.cos) + a.CM_q * air.Q_qh;
  return (hub * air.thrust + a.chord * tail) / a.inertia_yy;
}

// (2), first row:  V' = (T cos φ - D)/m - g sin γ,  φ = α + η - a1s
template <class S, class P>
S speed_rate(const Flow<S>& air, const S& sin_gamma, const AircraftOf<P>& a) {
  const S cos_phi = air.alpha.cos * air.disc.cos - air.alpha.sin * air.disc.sin;
  return (air.thrust * cos_phi - drag(air)) / a.mass - a.gravity * sin_gamma;
}

// (2), second row:  γ' = (T sin φ + L - m g cos γ)/(m V); as printed, lift and thrust push down.
template <class S, class P>
S path_rate(const Flow<S>& air, const S& V, const S& cos_gamma, const S& delta_e,
            const AircraftOf<P>& a, Equations equations) {
  const S sin_phi = air.alpha.sin * air.disc.cos + air.alpha.cos * air.disc.sin;
  const double up = equations == Equations::printed ? -1.0 : 1.0;
  const S lifting = up * (air.thrust * sin_phi + lift(air, delta_e, a));
  return (lifting - a.mass * a.gravity * cos_gamma) / (a.mass * V);
}

template <class S>
struct BodyAcceleration {
  S u, w;
};

// (1) in its consistent form: gravity once, lift and thrust up.
template <class S, class P>
BodyAcceleration<S> body_acceleration(const Flow<S>& air, const S& u, const S& w, const S& theta,
                                      const S& q, const S& delta_e, const AircraftOf<P>& a) {
  const Turn<S> pitch = turn(theta);
  const S L = lift(air, delta_e, a);
  const S D = drag(air);
  const S X = air.thrust * air.disc.cos + L * air.alpha.sin - D * air.alpha.cos;
  const S Z = -air.thrust * air.disc.sin - L * air.alpha.cos - D * air.alpha.sin;
  return {X / a.mass - a.gravity * pitch.sin - q * w, Z / a.mass + a.gravity * pitch.cos + q * u};
}

// Airspeed and angle of attack from body velocities. At rest there is no angle of attack: it is
// taken as zero, and has no derivative.
template <class S>
struct Airspeed {
  S V, alpha;
};

template <class S>
Airspeed<S> airspeed(const S& u, const S& w) {
  using std::atan2, std::sqrt;
  return {sqrt(S(u * u + w * w)), atan2(w, u)};
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

// The control law (7)-(13) and the speed rate it needs.
template <class S>
struct Law {
  S theta0, a1s, delta_e, V_rate, He, Le;
  Flow<S> air;
};

template <class S, class P>
Law<S> control_law(const S& V, const S& alpha, const S& sin_gamma, const S& V_err,
                   const S& sin_gamma_err, const S& theta, const S& q, const S& x1, const S& x2,
                   const P& eta, const AircraftOf<P>& a, const GainsOf<P>& k, const Polar& polar) {
  const P s = authority_at(eta, a);
  const P weight = a.mass * a.gravity;
  // The law's own drag estimate: the polar at V, no wake.
  const S drag_estimate = 0.5 * a.air_density * a.wing_area * V * V * coefficients(polar, alpha).CD;
  const S common = k.k_V / a.gravity * V_err + sin_gamma + drag_estimate / weight;
  const S theta0 =
      (k.K_Ep * (common + sin_gamma_err) + k.K_Ei * x1) / (1.0 + a.thrust_excess * k.K_Ep);  // (13)
  const S a_hat = (k.K_Lp * (common - sin_gamma_err) + k.K_Li * x2) / (1.0 + k.K_Lp);        // (13)
  const S a1s = s * (a_hat + k.k_pa * theta + k.k_da * q);                                   // (12)
  const Flow<S> air = flow(V, alpha, q, theta0, a1s, eta, a, polar);
  const S V_rate = speed_rate(air, sin_gamma, a);
  const S energy = (k.k_V * V_err - V_rate) / a.gravity;
  const S He = energy + sin_gamma_err;                                                       // (7)
  const S Le = energy - sin_gamma_err;                                                       // (7)
  const S delta_e = (1.0 - s) * (k.K_Lp * Le + k.K_Li * x2 + k.k_pe * theta + k.k_de * q);    // (9)
  return {theta0, a1s, delta_e, V_rate, He, Le, air};
}

}  // namespace tiltrim::physics
