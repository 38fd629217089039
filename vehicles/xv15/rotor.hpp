/// One gimballed rotor: blade elements with uniform or linear inflow, and their closed form.
/// Internal to vehicles/xv15/.
///
/// Blade azimuth psi = 0 aft; flap beta = -a1 cos psi - b1 sin psi, a1 > 0 tilts the disc aft.
#pragma once

#include <Eigen/Core>
#include <array>
#include <optional>

#include "vehicles/xv15/data.hpp"
#include "vehicles/xv15/scalar_functions.hpp"

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

/// A blade: its elements, and what all share.
struct Blade {
  const std::vector<Element>* elements;
  std::array<SectionView, 4> sections;
  int blades;
  double flap_inertia, tan_delta3, radius;
};

/// What the blades' forces depend on.
enum Cause { by_V_e, by_level, by_cosine, by_theta, by_B1, by_omega, by_a1, by_b1, causes };
/// Sums over the disc before density: thrust, in-plane force, torque and the two flap moments, with
/// their slopes. `level` is V_n + v, `cosine` the share of U_P that is r cos psi.
struct DiscSums {
  Eigen::Matrix<double, 5, 1> value;
  Eigen::Matrix<double, 5, causes> slope;
  Eigen::Matrix<double, 5, 1> by_sound;
};

/// tan(chi/2) of the wake's skew chi. Along the axis the wake has none, also where it leaves
/// upwards.
template <class S>
S wake_skew(const S& V_e, const S& level) {
  const S along = level + sqrt(V_e * V_e + level * level);
  return real_part(along) > 0 ? S(V_e / along) : S(0.0);
}

/// The part of U_P that grows with r cos psi, less the pitch rate: k_x v/R with
/// k_x = (15 pi/32) tan(chi/2) of the wake's skew chi (Pitt and Peters 1981).
template <class S, class V>
S inflow_cosine(const RotorInput<S>& in, const V& v, double radius) {
  const S skew = wake_skew(in.V_e, S(in.V_n + v));
  return in.gradient * (15 * std::numbers::pi / 32 / radius) * skew * v - in.q;
}

/// The mean over the revolution. Throws std::domain_error where the sections' tables are silent.
DiscSums disc_sums(const RotorInput<double>& in, const RotorMotion<double>& y, const Blade& blade);

/// Forces of all blades, flap moments of one. In steady flapping at once per revolution, inertia
/// and centrifugal moment cancel; what remains is the gyroscopic moment -2 I Omega q sin psi.
template <class S>
RotorForces<S> scaled_forces(const RotorInput<S>& in, const std::array<S, 5>& sum,
                             const Blade& blade) {
  const S one = in.density * 0.5, all = one * double(blade.blades);
  return {sum[0] * all, sum[1] * all, sum[2] * all,
          sum[3] * one - 2 * blade.flap_inertia * in.omega * in.q, sum[4] * one};
}

/// Forces at given inflow and flapping.
RotorForces<double> blade_forces(const RotorInput<double>& in, const RotorMotion<double>& y,
                                 const Blade& blade);

// x less its real part: its derivatives.
template <class S>
S moved(const S& x) {
  return x - real_part(x);
}

/// The sums of `disc` on a scalar whose real parts are the point of `disc`; exact to first order.
template <class S>
std::array<S, 5> lifted(const DiscSums& disc, const RotorInput<S>& in, const RotorMotion<double>& y,
                        double radius) {
  if constexpr (without_slopes<S>)
    return {disc.value[0], disc.value[1], disc.value[2], disc.value[3], disc.value[4]};
  const std::array<S, by_a1> move{
      moved(in.V_e),      moved(in.V_n), moved(inflow_cosine(in, y.v, radius)),
      moved(in.theta_75), moved(in.B1),  moved(in.omega)};
  const S sound = moved(in.sound);
  std::array<S, 5> sum;
  for (Eigen::Index i = 0; i < 5; ++i) {
    S& at = sum[std::size_t(i)] = S(disc.value[i]);
    for (Eigen::Index j = 0; j < by_a1; ++j) at = at + disc.slope(i, j) * move[std::size_t(j)];
    at = at + disc.by_sound[i] * sound;
  }
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

/// By the adjugate: three unknowns of about the same size.
Eigen::Matrix3d inverse_of(const Eigen::Matrix3d& J);

/// Inflow and flapping in balance, with the inverse Jacobian of the residual and the slopes of
/// thrust, in-plane force and torque with inflow and flapping.
struct RotorBalance {
  RotorMotion<double> motion;
  DiscSums disc;
  Eigen::Matrix3d inverse, forces;
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

Blade blade_of(const Data& data);

/// The rotor on any scalar: the balance by Newton's method in double, then its derivatives by the
/// implicit function theorem, exact to first order.
template <class S>
RotorAnswer<S> rotor(const RotorInput<S>& in, const Data& d, std::optional<double> given = {}) {
  const RotorBalance at =
      balance({real_part(in.V_e), real_part(in.V_n), real_part(in.q), real_part(in.theta_75),
               real_part(in.B1), real_part(in.omega), real_part(in.density), real_part(in.sound),
               real_part(in.gradient)},
              d, given);
  const Blade blade = blade_of(d);
  RotorMotion<S> y{S(at.motion.v), S(at.motion.a1), S(at.motion.b1)};
  RotorForces<S> forces = scaled_forces(in, lifted(at.disc, in, at.motion, d.radius), blade);
  if constexpr (!without_slopes<S>) {
    auto r = rotor_residual(in, y, forces, blade, d.radius, given);
    for (S& value : r) value = moved(value);
    const auto times = [](const Eigen::Matrix3d& A, Eigen::Index k, const std::array<S, 3>& b) {
      return S(A(k, 0) * b[0] + A(k, 1) * b[1] + A(k, 2) * b[2]);
    };
    const std::array<S, 3> step{times(at.inverse, 0, r), times(at.inverse, 1, r),
                                times(at.inverse, 2, r)};
    y = {y.v - step[0], y.a1 - step[1], y.b1 - step[2]};
    forces.thrust = forces.thrust - times(at.forces, 0, step);
    forces.in_plane = forces.in_plane - times(at.forces, 1, step);
    forces.torque = forces.torque - times(at.forces, 2, step);
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
/// The XV-15's blade by its mean lift slope and twist, for start values.
SimpleBlade simple_blade(const Data& data, double theta_75);
/// Largest climb speed over tip speed at which start values come from the closed form.
constexpr double closed_form_inflow = 0.15;
/// Leading terms for small angles: thrust coefficient, flapping, in-plane force over
/// rho A (Omega R)².
struct ClosedForm {
  double CT, a1, b1, CH;
};
/// `mu`, `lambda`: over the tip speed; `q` over Omega. Johnson, Helicopter Theory, ch. 5.
ClosedForm closed_form(const SimpleBlade& blade, double mu, double lambda, double q, double B1,
                       double tan_delta3);

}  // namespace tiltrim::xv15
