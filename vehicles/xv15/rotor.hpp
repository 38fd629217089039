/// One gimballed rotor: blade elements with uniform or linear inflow, and their closed form.
/// Internal to vehicles/xv15/.
///
/// Blade azimuth psi = 0 aft; flap beta = -a1 cos psi - b1 sin psi, a1 > 0 tilts the disc aft.
#pragma once

#include <Eigen/Core>
#include <array>
#include <optional>

#include "vehicles/xv15/data.hpp"
#include "vehicles/xv15/scalar.hpp"

namespace tiltrim::xv15 {

/// Motion and control of a rotor: velocities at the hub in the disc's plane and along the thrust,
/// pitch rate of the mast in space, pitch at 0.75 R, longitudinal cyclic.
template <class S>
struct RotorInput {
  S V_e, V_n, q, theta_75, B1;
  S omega, density, sound;
  S gradient;  ///< 0: uniform inflow; 1: growing aft with the wake's skew
};

/// Induced velocity and flapping.
template <class S>
struct RotorMotion {
  S v, a1, b1;
};

/// Of all blades; residuals of the first harmonic of the flap moment.
template <class S>
struct RotorForces {
  S thrust, in_plane, torque;  ///< N, N (aft), N m
  S flap_sin, flap_cos;        ///< N m per blade
};

/// Lift and drag coefficients [0], [1] and their slopes with incidence [1/rad] and Mach.
struct SectionAt {
  std::array<double, 2> value, alpha, mach;
};
/// Those of the printed section tables.
struct PrintedSections {
  const std::array<Pair, 4>* airfoils;
  SectionAt operator()(std::size_t section, double alpha, double mach) const {
    const Pair::Sloped at = (*airfoils)[section].at(mach, alpha * (1 / degree));
    return {at.value, {at.slope_y[0] / degree, at.slope_y[1] / degree}, at.slope_x};
  }
};

/// A blade: its elements, and what all share.
struct Blade {
  const std::vector<Element>* elements;
  int blades;
  double flap_inertia, tan_delta3, radius;
  int azimuths = 8;
};

template <class S>
struct AtAzimuth {
  double sin, cos;
  S flap, flap_rate, pitch;  // pitch at 0.75 R
};

// A function by its value and slopes at real parts: exact to first order on any scalar.
template <class S>
S lifted(double value, const std::array<double, 4>& slopes, const std::array<S, 4>& moved) {
  if constexpr (std::same_as<S, double>)
    return value;
  else
    return value + slopes[0] * moved[0] + slopes[1] * moved[1] + slopes[2] * moved[2] +
           slopes[3] * moved[3];
}

// Forces over rho/2 of an element, along the thrust and against the rotation:
//   F_z = U (cl U_T - cd U_P) c dr,  F_x = U (cl U_P + cd U_T) c dr,  alpha = theta - phi
template <class S, class Sections>
std::array<S, 2> element_forces(const Element& e, const S& along, const S& through, const S& pitch,
                                const S& sound, const Sections& sections) {
  const double T = real_part(along), P = real_part(through), a = real_part(sound);
  const double square = T * T + P * P, U = std::sqrt(square), theta = real_part(pitch) + e.twist;
  const double s = std::sin(theta), c = std::cos(theta), area = e.chord * e.dr;
  const SectionAt at = sections(e.section, std::atan2(s * T - c * P, c * T + s * P), U / a);
  const double cl = at.value[0], cd = at.value[1];
  const double z = cl * T - cd * P, x = cl * P + cd * T;
  if constexpr (std::same_as<S, double>) return {area * U * z, area * U * x};
  // Slopes with U_T, U_P, pitch and the speed of sound.
  const std::array<double, 4> alpha{P / square, -T / square, 1, 0};
  const std::array<double, 4> mach{T / (U * a), P / (U * a), 0, -U / (a * a)};
  const std::array<double, 4> speed{T / U, P / U, 0, 0};
  const std::array<double, 4> z_own{cl, -cd, 0, 0}, x_own{cd, cl, 0, 0};
  std::array<double, 4> slope_z{}, slope_x{};
  for (std::size_t k = 0; k < 4; ++k) {
    const double dcl = at.alpha[0] * alpha[k] + at.mach[0] * mach[k];
    const double dcd = at.alpha[1] * alpha[k] + at.mach[1] * mach[k];
    slope_z[k] = area * (speed[k] * z + U * (z_own[k] + dcl * T - dcd * P));
    slope_x[k] = area * (speed[k] * x + U * (x_own[k] + dcl * P + dcd * T));
  }
  const std::array<S, 4> moved{along - T, through - P, pitch - real_part(pitch), sound - a};
  return {lifted(area * U * z, slope_z, moved), lifted(area * U * x, slope_x, moved)};
}

// The sums over one azimuth:
//   U_T = Omega r + V_e sin psi
//   U_P = V_n + v (1 + k_x r/R cos psi) + r (beta' - q cos psi) + V_e beta cos psi
template <class S, class Sections>
void add_azimuth(const RotorInput<S>& in, const S& v, const AtAzimuth<S>& at, const Blade& blade,
                 const Sections& sections, RotorForces<S>& sum) {
  const S along = in.V_e * at.sin;
  const S through = in.V_n + v + in.V_e * at.flap * at.cos;
  // Linear over the disc, k_x = (15 pi/32) tan(chi/2) of the wake's skew chi (Pitt and Peters
  // 1981).
  const S level = in.V_n + v;
  const S skew = in.V_e / (level + sqrt(in.V_e * in.V_e + level * level));
  const S uneven = in.gradient * (15 * std::numbers::pi / 32 / blade.radius) * skew * v;
  const S swing = at.flap_rate + (uneven - in.q) * at.cos;
  for (const Element& e : *blade.elements) {
    const S U_T = in.omega * e.r + along;
    const S U_P = through + swing * e.r;
    const auto [F_z, F_x] = element_forces(e, U_T, U_P, at.pitch, in.sound, sections);
    sum.thrust = sum.thrust + F_z;
    sum.torque = sum.torque + F_x * e.r;
    sum.in_plane = sum.in_plane + F_x * at.sin - F_z * at.flap * at.cos;
    sum.flap_sin = sum.flap_sin + F_z * (2.0 * at.sin * e.r);
    sum.flap_cos = sum.flap_cos + F_z * (2.0 * at.cos * e.r);
  }
}

/// Forces at given inflow and flapping. In steady flapping at once per revolution, inertia and
/// centrifugal moment cancel; what remains is the gyroscopic moment -2 I Omega q sin psi.
template <class S, class Sections>
RotorForces<S> blade_forces(const RotorInput<S>& in, const RotorMotion<S>& y, const Blade& blade,
                            const Sections& sections) {
  RotorForces<S> sum{S(0.0), S(0.0), S(0.0), S(0.0), S(0.0)};
  for (int k = 0; k < blade.azimuths; ++k) {
    const double psi = 2 * std::numbers::pi * k / blade.azimuths;
    const double sp = std::sin(psi), cp = std::cos(psi);
    const S flap = -(y.a1 * cp) - y.b1 * sp;
    const S pitch = in.theta_75 - in.B1 * sp - blade.tan_delta3 * flap;
    const S rate = in.omega * (y.a1 * sp - y.b1 * cp);
    add_azimuth(in, y.v, AtAzimuth<S>{sp, cp, flap, rate, pitch}, blade, sections, sum);
  }
  // The mean over the revolution; rho/2; all blades, but flap moments of one.
  const S one = in.density * (0.5 / blade.azimuths), all = one * double(blade.blades);
  sum = {sum.thrust * all, sum.in_plane * all, sum.torque * all, sum.flap_sin * one,
         sum.flap_cos * one};
  sum.flap_sin = sum.flap_sin - 2 * blade.flap_inertia * in.omega * in.q;
  return sum;
}

/// Thrust by momentum theory (Glauert): T = 2 rho A v sqrt(V_e² + (V_n + v)²).
template <class S>
S momentum_thrust(const RotorInput<S>& in, const S& v, double radius) {
  const S through = in.V_n + v;
  const double disc = std::numbers::pi * radius * radius;
  return 2 * disc * in.density * v * sqrt(in.V_e * in.V_e + through * through);
}

/// `given`: the induced velocity, if momentum theory does not determine it.
template <class S>
std::array<S, 3> rotor_residual(const RotorInput<S>& in, const RotorMotion<S>& y,
                                const RotorForces<S>& at, const Blade& blade, double radius,
                                std::optional<double> given = {}) {
  const S tip = in.omega * radius;
  const S scale = 1.0 / (std::numbers::pi * radius * radius * in.density * tip * tip);
  const S per_moment = 1.0 / (blade.flap_inertia * in.omega * in.omega);
  const S inflow =
      given ? S((y.v - *given) / tip) : S((at.thrust - momentum_thrust(in, y.v, radius)) * scale);
  return {inflow, at.flap_sin * per_moment, at.flap_cos * per_moment};
}

/// Inflow and flapping in balance, with the inverse Jacobian of the residual.
struct RotorBalance {
  RotorMotion<double> motion;
  Eigen::Matrix3d inverse;
};
/// Throws std::domain_error if there is none near the start.
RotorBalance balance(const RotorInput<double>& in, const Data& data,
                     std::optional<double> given = {});

template <class S>
struct RotorAnswer {
  RotorMotion<S> motion;
  RotorForces<S> forces;
  S power;  ///< W, with the induced power's factor
};

inline Blade blade_of(const Data& d) {
  return {&d.elements, d.blades, d.flap_inertia, std::tan(d.delta3), d.radius};
}

/// The rotor on any scalar: the balance by Newton's method in double, then one step with the
/// scalar's residual, which is exact to first order in its derivatives.
template <class S>
RotorAnswer<S> rotor(const RotorInput<S>& in, const Data& d, std::optional<double> given = {}) {
  const RotorBalance at =
      balance({real_part(in.V_e), real_part(in.V_n), real_part(in.q), real_part(in.theta_75),
               real_part(in.B1), real_part(in.omega), real_part(in.density), real_part(in.sound),
               real_part(in.gradient)},
              d, given);
  const Blade blade = blade_of(d);
  const PrintedSections sections{&d.airfoils};
  RotorMotion<S> y{S(at.motion.v), S(at.motion.a1), S(at.motion.b1)};
  RotorForces<S> forces = blade_forces(in, y, blade, sections);
  if constexpr (!std::same_as<S, double>) {
    const auto r = rotor_residual(in, y, forces, blade, d.radius, given);
    const auto& J = at.inverse;
    const auto step = [&](Eigen::Index k) -> S {
      return J(k, 0) * r[0] + J(k, 1) * r[1] + J(k, 2) * r[2];
    };
    y = {y.v - step(0), y.a1 - step(1), y.b1 - step(2)};
    forces = blade_forces(in, y, blade, sections);
  }
  const S power = in.omega * forces.torque + (d.induced_factor - 1) * forces.thrust * y.v;
  return {y, forces, power};
}

/// Induced power in hover at this thrust over that of uniform inflow, by annular momentum theory
/// with Prandtl's tip loss. Leishman, Principles of Helicopter Aerodynamics, sec. 3.3.
double induced_factor(const Data& data, double thrust);

/// Sections of the closed form: constant lift slope and drag, linear twist.
struct SimpleBlade {
  double lift_slope, drag, theta_0, twist, solidity, gamma;
};
/// Leading terms for small angles: thrust coefficient, flapping, in-plane force over
/// rho A (Omega R)².
struct ClosedForm {
  double CT, a1, b1, CH;
};
/// `mu`, `lambda`: over the tip speed; `q` over Omega. Johnson, Helicopter Theory, ch. 5.
ClosedForm closed_form(const SimpleBlade& blade, double mu, double lambda, double q, double B1,
                       double tan_delta3);

}  // namespace tiltrim::xv15
