#include "vehicles/xv15/rotor.hpp"

#include <fmt/core.h>

#include <cmath>
#include <stdexcept>

#include "runtime/instruction_set.hpp"

namespace tiltrim::xv15 {

DiscSums disc_sums(const RotorInput<double>& in, const RotorMotion<double>& y, const Blade& blade) {
  static const auto sums = chosen([]<InstructionSet set>() { return &tiltrim::disc_sums<set>; });
  DiscSums disc;
  const double cosine = inflow_cosine(in, y.v, blade.radius);
  const Silence silent =
      sums({blade.elements->data(), blade.elements->size(), blade.sections.data(), in.V_e,
            in.V_n + y.v, cosine, in.theta_75, in.B1, in.omega, y.a1, y.b1, in.sound,
            blade.tan_delta3, disc.value.data(), disc.slope.data()});
  if (silent.any)
    throw std::domain_error(
        fmt::format("the table of section {} of the blade is silent at the {} {:.6g}",
                    silent.section + 1, silent.of_mach ? "Mach number" : "incidence", silent.at));
  // A force is quadratic in all speeds, that of sound included: a F_a = 2 F - sum of v F_v.
  disc.by_sound = (2 * disc.value - disc.slope.col(by_V_e) * in.V_e -
                   disc.slope.col(by_level) * (in.V_n + y.v) - disc.slope.col(by_cosine) * cosine -
                   disc.slope.col(by_omega) * in.omega) /
                  in.sound;
  return disc;
}

RotorForces<double> blade_forces(const RotorInput<double>& in, const RotorMotion<double>& y,
                                 const Blade& blade) {
  const DiscSums at = disc_sums(in, y, blade);
  return scaled_forces<double>(
      in, {at.value[0], at.value[1], at.value[2], at.value[3], at.value[4]}, blade);
}

Blade blade_of(const Data& d) {
  const auto& of = d.airfoils;
  return {&d.elements,        {of[0].view(), of[1].view(), of[2].view(), of[3].view()},
          d.blades,           d.flap_inertia,
          std::tan(d.delta3), d.radius};
}

Eigen::Matrix3d inverse_of(const Eigen::Matrix3d& J) {
  Eigen::Matrix3d adjugate;
  for (Eigen::Index i = 0; i < 3; ++i)
    for (Eigen::Index j = 0; j < 3; ++j) {
      const Eigen::Index a = (i + 1) % 3, b = (i + 2) % 3, c = (j + 1) % 3, e = (j + 2) % 3;
      adjugate(j, i) = J(a, c) * J(b, e) - J(a, e) * J(b, c);
    }
  return adjugate / J.row(0).dot(adjugate.col(0));
}

// The closed form with its own induced velocity, where inflow angles are small; else no inflow.
static RotorMotion<double> start(const RotorInput<double>& in, const Data& d) {
  const double tip = in.omega * d.radius, mu = in.V_e / tip, climb = in.V_n / tip;
  if (std::abs(climb) > closed_form_inflow) return {0.01 * tip, 0, 0};
  constexpr double most_loading = 0.15;  // C_T/solidity in stall, which the closed form lacks
  const double k = std::tan(d.delta3);
  const SimpleBlade blade = simple_blade(d, in.theta_75);
  double inflow = 0.05;
  ClosedForm at{};
  for (int step = 0; step < 10; ++step) {
    at = closed_form(blade, mu, climb + inflow, in.q / in.omega, in.B1, k);
    const double CT = std::min(at.CT, most_loading * blade.solidity);
    const double wanted = CT / (2 * std::hypot(mu, climb + inflow) + 1e-3);
    inflow += 0.5 * (std::max(wanted, 0.0) - inflow);
  }
  // Inflow that grows aft acts on b1 as a pitch rate does.
  const double v = inflow * tip;
  const double b1 = (inflow_cosine(in, v, d.radius) + in.q) / in.omega / (1 + k * k);
  return {v, at.a1 + k * b1, at.b1 + b1};
}

SimpleBlade simple_blade(const Data& d, double theta_75) {
  constexpr double lift_slope = 5.73, twist = -0.7, drag = 0.01, lock_number = 3.8;
  return {lift_slope, drag, theta_75 - 0.75 * twist, twist, d.solidity, lock_number};
}

// The residual's Jacobian with respect to inflow over tip speed and flapping, and the slopes of
// thrust, in-plane force and torque.
static std::array<Eigen::Matrix3d, 2> slopes_of(const RotorInput<double>& in,
                                                const RotorMotion<double>& y, const DiscSums& disc,
                                                const Data& d, std::optional<double> given) {
  const double tip = in.omega * d.radius, level = in.V_n + y.v;
  const double speed = std::sqrt(in.V_e * in.V_e + level * level);
  // d(skew v)/dv = skew (1 - v/speed)
  const double cosine = in.gradient * (15 * std::numbers::pi / 32 / d.radius) *
                        wake_skew(in.V_e, level) * (1 - y.v / speed);
  Eigen::Matrix<double, 5, 3> by;
  by.col(0) = tip * (disc.slope.col(by_level) + cosine * disc.slope.col(by_cosine));
  by.col(1) = disc.slope.col(by_a1);
  by.col(2) = disc.slope.col(by_b1);
  by *= 0.5 * in.density;
  by.topRows<3>() *= d.blades;
  const double area = std::numbers::pi * d.radius * d.radius;
  const double scale = 1 / (area * in.density * tip * tip);
  const double per_moment = 1 / (d.flap_inertia * in.omega * in.omega);
  Eigen::Matrix3d J;
  J.row(0) = scale * by.row(0);
  J(0, 0) -= scale * tip * 2 * area * in.density * (speed + y.v * level / speed);
  if (given) J.row(0) << 1, 0, 0;
  J.bottomRows<2>() = per_moment * by.bottomRows<2>();
  return {J, by.topRows<3>()};
}

namespace {

// A step of Newton's method at given inflow and flapping.
struct BalanceStep {
  DiscSums disc;
  Eigen::Matrix3d inverse, forces;
  Eigen::Vector3d move;
};

BalanceStep balance_step(const RotorInput<double>& in, const RotorMotion<double>& y,
                         const Blade& blade, const Data& d, std::optional<double> given) {
  BalanceStep at{disc_sums(in, y, blade), {}, {}, {}};
  const auto& s = at.disc.value;
  const RotorForces<double> forces =
      scaled_forces<double>(in, {s[0], s[1], s[2], s[3], s[4]}, blade);
  const auto r = rotor_residual(in, y, forces, blade, d.radius, given);
  const auto slopes = slopes_of(in, y, at.disc, d, given);
  at.inverse = inverse_of(slopes[0]);
  at.forces = slopes[1];
  at.move = at.inverse * Eigen::Vector3d(r[0], r[1], r[2]);
  return at;
}

// Limited in size.
RotorMotion<double> moved_by(const RotorMotion<double>& y, const Eigen::Vector3d& move,
                             double tip) {
  constexpr double largest_inflow = 0.03, largest_flapping = 0.1;
  const double size =
      std::max({1.0, std::abs(move[0]) / largest_inflow, std::abs(move[1]) / largest_flapping,
                std::abs(move[2]) / largest_flapping});
  return {y.v - move[0] / size * tip, y.a1 - move[1] / size, y.b1 - move[2] / size};
}

// Nearer by few elements, unless their steps lead nowhere.
RotorMotion<double> near(const RotorInput<double>& in, const Data& d, std::optional<double> given) {
  constexpr int most_steps = 12;
  constexpr double close = 5e-2, slow = 0.15, stall = 0.25;
  const double tip = in.omega * d.radius;
  Blade blade = blade_of(d);
  blade.elements = &d.few_elements;
  const RotorMotion<double> first = start(in, d);
  const double incidence = in.theta_75 - std::atan2(in.V_n + first.v, 0.75 * tip);
  if (std::abs(in.V_n) < closed_form_inflow * tip && std::abs(in.V_e) < slow * tip &&
      std::abs(incidence) < stall)
    return first;
  RotorMotion<double> y = first;
  for (int step = 0; step < most_steps; ++step) {
    const Eigen::Vector3d move = balance_step(in, y, blade, d, given).move;
    if (!move.allFinite()) return first;
    y = moved_by(y, move, tip);
    if (move.cwiseAbs().maxCoeff() < close) break;
  }
  return y;
}

RotorBalance solved(const RotorInput<double>& in, const Data& d, std::optional<double> given) {
  constexpr int most_steps = 50;
  constexpr double rounding = 1e-13;  // of a step
  const double tip = in.omega * d.radius;
  const Blade blade = blade_of(d);
  RotorMotion<double> y = near(in, d, given);
  for (int step = 0; step < most_steps; ++step) {
    BalanceStep at = balance_step(in, y, blade, d, given);
    if (!at.move.allFinite()) break;
    if (at.move.cwiseAbs().maxCoeff() < rounding) {
      at.inverse.row(0) *= tip;
      at.forces.col(0) /= tip;
      return {y, at.disc, at.inverse, at.forces};
    }
    y = moved_by(y, at.move, tip);
  }
  throw std::domain_error(
      fmt::format("the rotor's inflow and flapping have no balance near the start at V_e {:.4g} "
                  "m/s, V_n {:.4g} m/s, collective {:.4g} degrees",
                  in.V_e, in.V_n, in.theta_75 / degree));
}

}  // namespace

// Rates, outputs and their derivatives are asked for at one point, one after the other.
RotorBalance balance(const RotorInput<double>& in, const Data& d, std::optional<double> given) {
  struct Last {
    std::size_t data = 0;
    std::array<double, 9> input{};
    std::optional<double> given{};
    RotorBalance at{};
  };
  thread_local Last last;
  const std::array<double, 9> input{in.V_e,   in.V_n,     in.q,     in.theta_75, in.B1,
                                    in.omega, in.density, in.sound, in.gradient};
  if (last.data != d.number || last.input != input || last.given != given) {
    const RotorBalance at = solved(in, d, given);
    last = {d.number, input, given, at};
  }
  return last.at;
}

namespace {

// An annulus of the rotor in hover at lambda = v/(Omega R):
//   4 F lambda² x = thrust coefficient of the blades per dx
struct Annulus {
  double from_blades, from_momentum;
};

Annulus annulus(const Data& d, const Element& e, double collective, double lambda, double tip) {
  const double x = e.r / d.radius, phi = std::atan2(lambda, x), U = std::hypot(x, lambda);
  const Eigen::Array2d at =
      d.airfoils[e.section].at(U * tip / 340.294, (collective + e.twist - phi) * (1 / degree));
  const double cl = at[0], cd = at[1];
  const double sigma = d.blades * e.chord / (std::numbers::pi * d.radius);
  const double f = d.blades / 2.0 * (1 - x) / std::max(std::abs(lambda), 1e-9);
  const double F = 2 / std::numbers::pi * std::acos(std::exp(-f));
  return {sigma / 2 * U * (cl * x - cd * lambda), 4 * F * lambda * std::abs(lambda) * x};
}

// Thrust coefficient, and the induced power's.
std::array<double, 2> annuli(const Data& d, double collective, double tip) {
  double CT = 0, CP = 0;
  for (const Element& e : d.elements) {
    double low = -0.3, high = 0.5;
    for (int step = 0; step < 60; ++step) {
      const double middle = (low + high) / 2;
      const Annulus at = annulus(d, e, collective, middle, tip);
      (at.from_blades > at.from_momentum ? low : high) = middle;
    }
    const double dCT = annulus(d, e, collective, low, tip).from_momentum * e.dr / d.radius;
    CT += dCT;
    CP += low * dCT;
  }
  return {CT, CP};
}

}  // namespace

double induced_factor(const Data& d, double thrust) {
  const double tip = d.si.at("rotor_speed_helicopter") * d.radius;
  const double CT =
      thrust / (d.si.at("air_density_trims") * std::numbers::pi * d.radius * d.radius * tip * tip);
  double low = 0, high = 25 * degree;
  for (int step = 0; step < 60; ++step) {
    const double middle = (low + high) / 2;
    (annuli(d, middle, tip)[0] < CT ? low : high) = middle;
  }
  return annuli(d, low, tip)[1] / (std::pow(CT, 1.5) / std::sqrt(2.0));
}

// With k = tan delta3, A1 - k a1 and B1 - k b1 replace A1 = 0 and B1; coning is zero.
//   a1 = [2 mu (4/3 theta_0 + theta_tw - lambda) - (1 + 3/2 mu²)(B1 - k b1)]/(1 - mu²/2)
//        - 16 q/(gamma Omega (1 - mu²/2))
//   b1 = -k a1 - (q/Omega)/(1 + mu²/2)
ClosedForm closed_form(const SimpleBlade& b, double mu, double lambda, double q, double B1,
                       double k) {
  const double fore = 1 - mu * mu / 2, side = 1 + mu * mu / 2, cyclic = (1 + 1.5 * mu * mu) / fore;
  const double driven =
      (2 * mu * (4 * b.theta_0 / 3 + b.twist - lambda) - 16 * q / b.gamma) / fore - cyclic * B1;
  // a1 = driven + cyclic k b1
  const double a1 = (driven - cyclic * k * q / side) / (1 + cyclic * k * k);
  const double b1 = -k * a1 - q / side;
  const double CT = b.solidity * b.lift_slope / 2 *
                    (b.theta_0 * (1.0 / 3 + mu * mu / 2) + b.twist * (1 + mu * mu) / 4 -
                     mu * (B1 - k * b1) / 2 - lambda / 2);
  return {CT, a1, b1, CT * a1 + b.solidity * b.drag * mu / 4};
}

}  // namespace tiltrim::xv15
