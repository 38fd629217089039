/// Loads of the airframe and the equations of motion, on any scalar.
/// Internal to vehicles/xv15/.
#pragma once

#include <span>

#include "vehicles/xv15/data.hpp"
#include "vehicles/xv15/rotor.hpp"

namespace tiltrim::xv15 {

template <class S>
struct State {
  S u, w, q, stick, flap, mast;  // m/s, m/s, rad/s, in, rad, rad
  S density, sound, omega, gradient;
};

template <class S>
struct LoadOf {
  S X, Z, M;
};

// Position relative to the centre of gravity: x forward, z down.
template <class S>
struct Arm {
  S x, z;
};

template <class S>
struct Geometry {
  S sin, cos;            // of the mast angle
  S station, waterline;  // of the centre of gravity
  S inertia;
  Arm<S> hub;

  Arm<S> arm(const Point& p) const { return {station - p.station, -(p.waterline - waterline)}; }
};

template <class S>
Geometry<S> geometry(const Data& d, const S& mast) {
  Geometry<S> g;
  g.sin = sin(mast);
  g.cos = cos(mast);
  const double a = d.pylon_share * (d.pivot.station - d.pylon_cg.station);
  const double b = d.pylon_share * (d.pivot.waterline - d.pylon_cg.waterline);
  g.station = d.cg.station + b * g.sin + a * (1.0 - g.cos);
  g.waterline = d.cg.waterline + b * (1.0 - g.cos) - a * g.sin;
  g.inertia = d.inertia + d.inertia_slope * mast;
  g.hub = {g.station - d.pivot.station + d.mast_length * g.sin,
           g.waterline - d.pivot.waterline - d.mast_length * g.cos};
  return g;
}

// X = -D cos a + L sin a, Z = -D sin a - L cos a, M = M0 + z X - x Z, (c, s) along the flow.
template <class S>
LoadOf<S> load(const S& lift, const S& drag, const S& moment, const S& c, const S& s,
               const Arm<S>& at) {
  const S X = lift * s - drag * c, Z = -(drag * s) - lift * c;
  return {X, Z, moment + at.z * X - at.x * Z};
}

/// The free stream at the centre of gravity.
template <class S>
struct Stream {
  S V, alpha, cos, sin, pressure, mach, knots;
  S alpha_degrees, flap_degrees, mast_degrees;
};

template <class S>
Stream<S> stream(const State<S>& s) {
  Stream<S> f;
  // At rest there is no direction; its loads vanish with the pressure.
  const S square = s.u * s.u + s.w * s.w;
  const bool still = real_part(square) < 1e-12;
  f.V = still ? S(0.0) : S(sqrt(square));
  f.alpha = still ? S(0.0) : S(atan2(s.w, s.u));
  f.cos = cos(f.alpha);
  f.sin = sin(f.alpha);
  f.pressure = 0.5 * s.density * square;
  f.mach = f.V / s.sound;
  f.knots = f.V * (1 / kt);
  f.alpha_degrees = f.alpha * (1 / degree);
  f.flap_degrees = s.flap * (1 / degree);
  f.mast_degrees = s.mast * (1 / degree);
  return f;
}

// Flow from behind, of which the tables of fuselage and downwash say nothing.
template <class S>
bool from_behind(const Stream<S>& f, const S& degrees) {
  constexpr double fastest = 20;  // kt: of a hover's drift, where these loads are small
  return std::abs(real_part(degrees)) > 90 && real_part(f.knots) < fastest;
}

// From behind the fuselage is its own image fore and aft, which continues the tables at 90 degrees:
//   L(a) = -L(180° - a),  D(a) = D(180° - a),  M(a) = 2 M(90°) |sin a| - M(180° - a)
template <class S>
LoadOf<S> fuselage(const Data& d, const Stream<S>& f, const Geometry<S>& g) {
  const bool behind = from_behind(f, f.alpha_degrees);
  const double across = real_part(f.alpha_degrees) < 0 ? -90.0 : 90.0;
  const S alpha = behind ? S(2 * across - f.alpha_degrees) : f.alpha_degrees;
  S lift = d.fuselage_lift.at(alpha), moment = d.fuselage_moment.at(alpha);
  if (behind) {
    lift = -lift;
    moment = 2 * d.fuselage_moment.at(across) * (across / 90) * f.sin - moment;
  }
  const S drag = d.fuselage_drag.at(alpha) + d.extra_drag;
  return load(S(f.pressure * lift), S(f.pressure * drag), S(f.pressure * moment), f.cos, f.sin,
              g.arm(d.fuselage));
}

/// The wing's effective incidence: the free stream turned by the rotors.
///   alpha_W = alpha_F - K_XRW X_RW C_RF/max(0.15, mu)²
template <class S>
S wing_alpha(const Data& d, const State<S>& s, const Stream<S>& f, const S& V_e, const S& force) {
  const S tip = s.omega * d.radius;
  const S mu = 0.15 + rounded_ramp(S(V_e / tip - 0.15), 0.01);
  const S C_RF = 2.0 * force / (std::numbers::pi * d.radius * d.radius * s.density * tip * tip);
  const S X_RW = d.X_RW0 + s.mast * (d.X_RW1 + s.mast * d.X_RW2);
  return f.alpha - d.K_XRW * X_RW * C_RF / (mu * mu);
}

// Above Mach 0.2 the wing is given for the airplane with flap 0, and the helicopter's column to
// 0.4. With flaps its values at 0.2 hold to Mach 0.25, on purpose: the published trims go there.
template <class S>
void check_wing(const Stream<S>& f) {
  const double mach = real_part(f.mach);
  if (mach <= 0.25) return;
  if (real_part(f.flap_degrees) > 0 || (real_part(f.mast_degrees) < 90 && mach > 0.4))
    throw std::domain_error(
        "the tables wing_cl and wing_cd are silent above Mach 0.25 with flaps, and above Mach 0.4 "
        "unless mast_angle is 90 degrees");
}

// The same angle within ±180 degrees.
template <class S>
S within_a_turn(const S& degrees) {
  return degrees - 360.0 * std::round(real_part(degrees) / 360.0);
}

// The share of the wing in the rotors' wake at low speed, as an area.
//   S_i = S_max [sin(1.386 n) + cos(3.114 n)](1 - V/V_max), n = pi/2 - mast, never negative
template <class S>
S immersed_area(const Data& d, const S& V, const S& mast) {
  const S n = std::numbers::pi / 2 - mast;
  const S shape = rounded_ramp(S(sin(1.386 * n) + cos(3.114 * n)), 0.05);
  const S share = 1.0 - V * (1 / d.immersed_until);
  return d.immersed_area * shape * rounded_ramp(S(1.05 * share - 0.05), 0.05);
}

template <class S>
LoadOf<S> wing(const Data& d, const State<S>& s, const Stream<S>& f, const Geometry<S>& g,
               const S& alpha, const S& v) {
  check_wing(f);
  const auto coefficients = [&](const S& mast, const S& at) {
    const S degrees = within_a_turn(S(at * (1 / degree)));
    return std::array<S, 2>{d.wing_cl.at(mast, f.flap_degrees, f.mach, degrees),
                            d.wing_cd.at(mast, f.flap_degrees, f.mach, degrees)};
  };
  const Arm<S> at = g.arm(d.wing);
  const S immersed = immersed_area(d, f.V, s.mast);
  const S free = f.pressure * (d.wing_area - immersed);
  const auto [CL, CD] = coefficients(f.mast_degrees, alpha);
  const S Cm = d.wing_cm.at(f.mast_degrees, f.flap_degrees);
  LoadOf<S> sum = load(S(free * CL), S(free * CD), S(f.pressure * d.wing_area * d.wing_chord * Cm),
                       S(cos(alpha)), S(sin(alpha)), at);
  if (vanishes(immersed)) return sum;
  const S u = s.u + d.wake_factor * v * g.sin, w = s.w - d.wake_factor * v * g.cos;
  const S a = atan2(w, u), q_S = 0.5 * s.density * (u * u + w * w) * immersed;
  // By the helicopter's column: the airplane's are silent below -70 degrees.
  const auto [cl, cd] = coefficients(S(0.0), a);
  const LoadOf<S> part = load(S(q_S * cl), S(q_S * cd), S(0.0), S(cos(a)), S(sin(a)), at);
  return {sum.X + part.X, sum.Z + part.Z, sum.M + part.M};
}

// CL over elevator at low Mach; from Mach 0.4 at the incidence that the elevator is worth; linear
// between Mach 0.2 and 0.4, where the report has no entry.
template <class S>
S tail_lift(const Data& d, const S& mach, const S& alpha, const S& elevator, const S& worth) {
  static const Axis over{"htail_cl over mach", {0.0, 0.2, 0.4, 0.5, 0.6}};
  const Weights<S> by = weights(over, mach);
  S sum(0.0);
  for (std::size_t j = 0; j < by.count; ++j) {
    const std::size_t k = by.first + j;
    const S& weight = by.w[j];
    if (vanishes(weight)) continue;
    const std::array<S, 1> turned{alpha + worth};
    sum =
        sum + weight * (k < 2 ? d.tail_cl.at(elevator, alpha) : d.tail_cl_mach.rows[k - 1](turned));
  }
  return sum;
}

// angles of the tables in degrees.
template <class S>
LoadOf<S> tail(const Data& d, const State<S>& s, const Stream<S>& f, const Geometry<S>& g,
               const S& wing_alpha, const S& v) {
  const Arm<S> r = g.arm(d.tail);
  const S k = d.tail_wake.at(f.mast_degrees, f.knots, f.alpha_degrees);
  const S u = s.u + s.q * r.z + k * v * g.sin, w = s.w - s.q * r.x - k * v * g.cos;
  // At ±90 degrees the tables' downwash is zero.
  const S at_wing = wing_alpha * (1 / degree);
  const S epsilon = from_behind(f, at_wing)
                        ? S(0.0)
                        : S(d.downwash.at(f.mast_degrees, f.flap_degrees, at_wing) * degree /
                            sqrt(1.0 - f.mach * f.mach));
  const bool still = real_part(u) * real_part(u) + real_part(w) * real_part(w) < 1e-12;
  const S a = (still ? S(0.0) : S(atan2(w, u))) - epsilon;
  const S alpha = within_a_turn(S(a * (1 / degree)));
  const S elevator = d.elevator_per_stick * (s.stick - d.stick_neutral) * (1 / degree);
  const S size = real_part(elevator) < 0 ? S(-elevator) : elevator;
  const S K_e = d.elevator_mach.at(f.mach) - d.D_Ke / 15 * rounded_ramp(S(size - 15.0), 1.0);
  const S worth = K_e * d.tau_e * elevator;
  const S q_S = d.pressure_factor * d.tail_area * f.pressure *
                d.tail_pressure.at(f.mast_degrees, f.knots, f.alpha_degrees);
  const S lift = q_S * tail_lift(d, f.mach, alpha, elevator, worth);
  const S drag = q_S * d.tail_cd.at(f.mach, within_a_turn(S(alpha + worth)));
  return load(lift, drag, S(0.0), S(cos(a)), S(sin(a)), r);
}

template <class S>
LoadOf<S> pylons(const Data& d, const Stream<S>& f, const Geometry<S>& g) {
  const S drag = f.pressure * d.interference.at(f.mast_degrees);
  return load(S(0.0), drag, S(0.0), f.cos, f.sin, g.arm(d.pivot));
}

template <class S>
LoadOf<S> fins(const Data& d, const Stream<S>& f, const Geometry<S>& g) {
  const S drag = f.pressure * (d.fin_area * d.fin_drag);
  return load(S(0.0), drag, S(0.0), f.cos, f.sin, g.arm(d.fin));
}

// Both spinners, in mast axes: drag area 2 (1.0 + 5.5 sin³ s) along the local flow.
template <class S>
LoadOf<S> spinners(const Data& d, const State<S>& s, const Geometry<S>& g, const S& V_e,
                   const S& V_n, const S& v) {
  const S across = V_e, along = V_n + v;
  const S square = across * across + along * along;
  if (real_part(square) < 1e-12) return {S(0.0), S(0.0), S(0.0)};
  const S speed = sqrt(square);
  const S sine = across * across / square;
  const S cube = sine * sqrt(sine + 1e-12);
  const S area = 2.0 * (d.spinner_axial + d.spinner_cross * cube);
  const S drag = 0.5 * s.density * speed * area;  // per m/s of the flow's components
  const S X = -(drag * (across * g.cos + along * g.sin));
  const S Z = -(drag * (across * g.sin - along * g.cos));
  return {X, Z, g.hub.z * X - g.hub.x * Z};
}

/// Everything at a state.
template <class S>
struct Sums {
  std::array<LoadOf<S>, 7> parts;  // component_names()
  LoadOf<S> total;
  S alpha_wing;
};

template <class S>
struct HubMotion {
  S V_e, V_n;
};

template <class S>
HubMotion<S> hub_motion(const State<S>& s, const Geometry<S>& g) {
  const S u = s.u + s.q * g.hub.z, w = s.w - s.q * g.hub.x;
  return {u * g.cos + w * g.sin, u * g.sin - w * g.cos};
}

template <class S>
RotorInput<S> rotor_input(const Data& d, const State<S>& s, const Geometry<S>& g,
                          const S& collective) {
  const HubMotion<S> at = hub_motion(s, g);
  const S B1 = d.cyclic.at(S(s.mast * (1 / degree))) * degree * (s.stick - d.stick_neutral);
  return {at.V_e, at.V_n, s.q, collective, B1, s.omega, s.density, s.sound, s.gradient};
}

/// `thrust`, `in_plane`: of each rotor; `v`: its induced velocity.
template <class S>
Sums<S> sums(const Data& d, const State<S>& s, const Geometry<S>& g, const S& thrust,
             const S& in_plane, const S& v) {
  const Stream<S> f = stream(s);
  const HubMotion<S> hub = hub_motion(s, g);
  const S force = sqrt(thrust * thrust + in_plane * in_plane + 1e-12);
  Sums<S> all;
  all.alpha_wing = wing_alpha(d, s, f, hub.V_e, force);
  const S X = 2.0 * (thrust * g.sin - in_plane * g.cos);
  const S Z = -2.0 * (thrust * g.cos + in_plane * g.sin);
  all.parts = {wing(d, s, f, g, all.alpha_wing, v),
               fuselage(d, f, g),
               tail(d, s, f, g, all.alpha_wing, v),
               pylons(d, f, g),
               spinners(d, s, g, hub.V_e, hub.V_n, v),
               LoadOf<S>{X, Z, g.hub.z * X - g.hub.x * Z},
               fins(d, f, g)};
  all.total = {S(0.0), S(0.0), S(0.0)};
  for (const LoadOf<S>& part : all.parts)
    all.total = {all.total.X + part.X, all.total.Z + part.Z, all.total.M + part.M};
  return all;
}

/// Order of the model's parameters.
enum Parameter { mass, density, sound, omega, gravity, gradient, airspeed_kt, climb_angle };

template <class S>
State<S> state_of(std::span<const S> x, std::span<const S> u, std::span<const S> p) {
  return {x[0], x[1], x[3], u[1], u[2], u[3], p[density], p[sound], p[omega], p[gradient]};
}

template <class S>
struct Turning {
  State<S> s;
  Geometry<S> g;
  RotorInput<S> input;
  RotorAnswer<S> rotor;
};

template <class S>
Turning<S> turning(const Data& d, std::span<const S> x, std::span<const S> u,
                   std::span<const S> p) {
  Turning<S> all;
  all.s = state_of(x, u, p);
  all.g = geometry(d, all.s.mast);
  all.input = rotor_input(d, all.s, all.g, u[0]);
  all.rotor = rotor(all.input, d);
  return all;
}

/// m (u' + q w) = X - m g sin theta,  m (w' - q u) = Z + m g cos theta,  Iyy q' = M
template <class S>
void rates_of(const Data& d, const Turning<S>& at, std::span<const S> x, std::span<const S> p,
              std::span<S> rates) {
  const RotorForces<S>& rotor = at.rotor.forces;
  const LoadOf<S> F = sums(d, at.s, at.g, rotor.thrust, rotor.in_plane, at.rotor.motion.v).total;
  rates[0] = F.X / p[mass] - p[gravity] * sin(x[2]) - x[3] * x[1];
  rates[1] = F.Z / p[mass] + p[gravity] * cos(x[2]) + x[3] * x[0];
  rates[2] = x[3];
  rates[3] = F.M / at.g.inertia;
}

template <class S>
void rates_on(const Data& d, std::span<const S> x, std::span<const S> u, std::span<const S> p,
              std::span<S> rates) {
  rates_of(d, turning(d, x, u, p), x, p, rates);
}

/// Outputs of the motion and the controls.
template <class S>
void motion_outputs(const Data& d, const State<S>& s, const S& B1, std::span<const S> x,
                    std::span<const S> p, std::span<S> y) {
  const Stream<S> f = stream(s);
  y[0] = f.V;
  y[1] = f.alpha;
  // From the components of the velocity: without the jump of theta - alpha.
  y[2] = x[0] * sin(x[2]) - x[1] * cos(x[2]);
  y[3] = f.knots;
  y[4] = d.elevator_per_stick * (s.stick - d.stick_neutral);
  y[5] = B1;
  // What is left of a commanded airspeed and climb angle; smooth at rest too.
  const S V = p[airspeed_kt] * kt;
  y[10] = x[0] * cos(x[2]) + x[1] * sin(x[2]) - V * cos(p[climb_angle]);
  y[11] = y[2] - V * sin(p[climb_angle]);
  y[13] = std::numbers::pi / 2 - s.mast;
  y[14] = atan2(V * sin(s.mast), S(0.75 * d.radius * p[omega]));
}

/// Outputs of the rotors.
template <class S>
void rotor_outputs(const RotorAnswer<S>& rotor, std::span<S> y) {
  y[6] = rotor.motion.v;
  y[7] = rotor.forces.thrust;
  y[8] = 2.0 * rotor.power;
  y[9] = rotor.motion.a1;
  y[12] = rotor.forces.in_plane;
}

}  // namespace tiltrim::xv15
