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
  Eigen::Array2d value, alpha, mach;
};
/// Those of the printed section tables.
struct PrintedSections {
  const std::array<Pair, 4>* airfoils;
  SectionAt operator()(std::size_t section, double alpha, double mach) const {
    const Pair::Sloped at = (*airfoils)[section].at(mach, alpha * (1 / degree));
    return {at.value, at.slope_y * (1 / degree), at.slope_x};
  }
};

/// A blade: its elements, and what all share.
struct Blade {
  const std::vector<Strip>* strips;
  int blades;
  double flap_inertia, tan_delta3, radius;
  int azimuths = 8;
};

/// atan2(y, x) of each, for y and x that do not both vanish.
Strip::Values angles_of(const Strip::Values& y, const Strip::Values& x);

/// Sums over the elements of a blade at one azimuth: forces F_z, F_x over rho/2 times powers of r,
/// and their slopes with U_T, U_P and pitch.
struct RadialSums {
  std::array<std::array<double, 2>, 2> force;           // [r^0, r^1][z, x]
  std::array<std::array<double, 2>, 3> along, through;  // r^0 to r^2
  std::array<std::array<double, 2>, 2> pitch;
};

/// U_T = rotation r + along,  U_P = through + swing r
struct Flow {
  double rotation, along, through, swing, pitch, sound;
};

// Forces over rho/2 of eight elements, along the thrust and against the rotation:
//   F_z = U (cl U_T - cd U_P) c dr,  F_x = U (cl U_P + cd U_T) c dr,  alpha = theta - phi
template <class Sections>
void add_strip(const Strip& e, const Flow& f, const Sections& sections, RadialSums& sum) {
  using Values = Strip::Values;
  constexpr double pi = std::numbers::pi;
  const Values T = f.rotation * e.r + f.along, P = f.through + f.swing * e.r;
  const Values square = T * T + P * P, U = square.sqrt(), mach = U * (1 / f.sound);
  const Values alpha = e.twist + f.pitch - angles_of(P, T);
  std::array<Values, 2> c, c_alpha, c_mach;  // lift, drag
  for (Eigen::Index k = 0; k < e.count; ++k) {
    const double a =
        std::abs(alpha[k]) > pi ? alpha[k] - std::copysign(2 * pi, alpha[k]) : alpha[k];
    const SectionAt at = sections(e.section[std::size_t(k)], a, mach[k]);
    for (std::size_t j = 0; j < 2; ++j) {
      c[j][k] = at.value[Eigen::Index(j)];
      c_alpha[j][k] = at.alpha[Eigen::Index(j)];
      c_mach[j][k] = at.mach[Eigen::Index(j)];
    }
  }
  for (auto* all : {&c, &c_alpha, &c_mach})
    for (Values& each : *all) each.tail(Strip::size - e.count).setZero();
  const Values size = e.area * U, share = e.area / U, per_a = U * (1 / f.sound);
  for (std::size_t j = 0; j < 2; ++j) {
    // The other coefficient comes in by the inflow angle: -cd for F_z, cl for F_x.
    const double sign = j == 0 ? -1 : 1;
    const auto turned = [&](const std::array<Values, 2>& by) -> Values {
      return by[j] * T + sign * by[1 - j] * P;
    };
    // alpha' = (P, -T)/U²,  Mach' = (T, P)/(U a)
    const Values force = turned(c), by_alpha = turned(c_alpha), by_mach = turned(c_mach) * per_a;
    const Values along = share * (T * (force + by_mach) + P * by_alpha) + size * c[j];
    const Values through = share * (P * (force + by_mach) - T * by_alpha) + sign * size * c[1 - j];
    const Values all = size * force, pitch = size * by_alpha;
    const auto add = [&](auto& sums, const Values& G) {
      sums[0][j] += G.sum();
      sums[1][j] += (e.r * G).sum();
      if constexpr (std::tuple_size_v<std::remove_cvref_t<decltype(sums)>> == 3)
        sums[2][j] += (e.r2 * G).sum();
    };
    add(sum.force, all);
    add(sum.along, along);
    add(sum.through, through);
    add(sum.pitch, pitch);
  }
}

/// What the blades' forces depend on.
enum Cause { by_V_e, by_level, by_cosine, by_theta, by_B1, by_omega, by_a1, by_b1, causes };
/// Sums over the disc before density: thrust, in-plane force, torque and the two flap moments, with
/// their slopes. `level` is V_n + v, `cosine` the share of U_P that is r cos psi.
struct DiscSums {
  Eigen::Matrix<double, 5, 1> value;
  Eigen::Matrix<double, 5, causes> slope;
  Eigen::Matrix<double, 5, 1> by_sound;
};

/// The part of U_P that grows with r cos psi, less the pitch rate: k_x v/R with
/// k_x = (15 pi/32) tan(chi/2) of the wake's skew chi (Pitt and Peters 1981).
template <class S, class V>
S inflow_cosine(const RotorInput<S>& in, const V& v, double radius) {
  const S level = in.V_n + v;
  const S skew = in.V_e / (level + sqrt(in.V_e * in.V_e + level * level));
  return in.gradient * (15 * std::numbers::pi / 32 / radius) * skew * v - in.q;
}

// Adds one azimuth:
//   U_T = Omega r + V_e sin psi
//   U_P = V_n + v (1 + k_x r/R cos psi) + r (beta' - q cos psi) + V_e beta cos psi
template <class Sections>
void add_azimuth(const RotorInput<double>& in, const RotorMotion<double>& y, double cosine,
                 double psi, const Blade& blade, const Sections& sections, DiscSums& disc) {
  const double s = std::sin(psi), c = std::cos(psi), k = blade.tan_delta3;
  const double flap = -(y.a1 * c) - y.b1 * s, tilt = y.a1 * s - y.b1 * c;
  const Flow flow{in.omega,
                  in.V_e * s,
                  in.V_n + y.v + in.V_e * flap * c,
                  in.omega * tilt + cosine * c,
                  in.theta_75 - in.B1 * s - k * flap,
                  in.sound};
  RadialSums sum{};
  for (const Strip& e : *blade.strips) add_strip(e, flow, sections, sum);
  // Thrust and in-plane force, or flap moments and torque, of [z, x].
  const auto add = [&](std::size_t m, double z, double x, auto&& to) {
    if (m == 0) {
      to[0] += z;
      to[1] += x * s - z * (flap * c);
    } else {
      to[2] += x;
      to[3] += z * (2 * s);
      to[4] += z * (2 * c);
    }
  };
  for (std::size_t m = 0; m < 2; ++m) {
    add(m, sum.force[m][0], sum.force[m][1], disc.value);
    std::array<std::array<double, causes>, 2> by;
    for (std::size_t j = 0; j < 2; ++j) {
      const double along = sum.along[m][j], through = sum.through[m][j], pitch = sum.pitch[m][j],
                   swing = sum.through[m + 1][j];
      const double flapped = through * (in.V_e * c) - pitch * k;  // with the flap angle
      by[j] = {along * s + through * (flap * c),
               through,
               swing * c,
               pitch,
               -pitch * s,
               sum.along[m + 1][j] + swing * tilt,
               swing * (in.omega * s) - flapped * c,
               -swing * (in.omega * c) - flapped * s};
    }
    for (Eigen::Index i = 0; i < causes; ++i)
      add(m, by[0][std::size_t(i)], by[1][std::size_t(i)], disc.slope.col(i));
  }
  const double z = sum.force[0][0];
  disc.slope(1, by_a1) += z * c * c;
  disc.slope(1, by_b1) += z * s * c;
}

/// The mean over the revolution.
template <class Sections>
DiscSums disc_sums(const RotorInput<double>& in, const RotorMotion<double>& y, const Blade& blade,
                   const Sections& sections) {
  DiscSums disc{Eigen::Matrix<double, 5, 1>::Zero(), Eigen::Matrix<double, 5, causes>::Zero(), {}};
  const double cosine = inflow_cosine(in, y.v, blade.radius);
  for (int k = 0; k < blade.azimuths; ++k)
    add_azimuth(in, y, cosine, 2 * std::numbers::pi * k / blade.azimuths, blade, sections, disc);
  disc.value /= blade.azimuths;
  disc.slope /= blade.azimuths;
  // A force is quadratic in all speeds, that of sound included: a F_a = 2 F - sum of v F_v.
  disc.by_sound = (2 * disc.value - disc.slope.col(by_V_e) * in.V_e -
                   disc.slope.col(by_level) * (in.V_n + y.v) - disc.slope.col(by_cosine) * cosine -
                   disc.slope.col(by_omega) * in.omega) /
                  in.sound;
  return disc;
}

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
template <class Sections>
RotorForces<double> blade_forces(const RotorInput<double>& in, const RotorMotion<double>& y,
                                 const Blade& blade, const Sections& sections) {
  const DiscSums at = disc_sums(in, y, blade, sections);
  return scaled_forces<double>(
      in, {at.value[0], at.value[1], at.value[2], at.value[3], at.value[4]}, blade);
}

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

inline Blade blade_of(const Data& d) {
  return {&d.strips, d.blades, d.flap_inertia, std::tan(d.delta3), d.radius};
}

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
