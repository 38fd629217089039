#include "vehicles/xv15/rotor.hpp"

#include <fmt/core.h>

#include <cmath>

namespace tiltrim::xv15 {

using Slopes = DualOf<double, 3>;

// The residual and its derivatives with respect to inflow and flapping.
static std::array<Slopes, 3> residual(const RotorInput<double>& in, const RotorMotion<double>& y,
                                      const Data& d, double tip_speed,
                                      std::optional<double> given) {
  const auto moved = [](double value, Eigen::Index k, double scale) {
    Slopes at(value);
    at.slopes[k] = scale;
    return at;
  };
  const RotorInput<Slopes> input{in.V_e,   in.V_n,     in.q,     in.theta_75, in.B1,
                                 in.omega, in.density, in.sound, in.gradient};
  const RotorMotion<Slopes> at{moved(y.v, 0, tip_speed), moved(y.a1, 1, 1.0), moved(y.b1, 2, 1.0)};
  const Blade blade = blade_of(d);
  return rotor_residual(input, at, blade_forces(input, at, blade, PrintedSections{&d.airfoils}),
                        blade, d.radius, given);
}

// By the adjugate: three unknowns of the same size.
static Eigen::Matrix3d inverse_of(const Eigen::Matrix3d& J) {
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
  constexpr double lift_slope = 5.73, twist = -0.7, small = 0.15;
  const double tip = in.omega * d.radius, mu = in.V_e / tip, climb = in.V_n / tip;
  if (std::abs(climb) > small) return {0.01 * tip, 0, 0};
  const SimpleBlade blade{lift_slope, 0.01, in.theta_75 - 0.75 * twist, twist, d.solidity, 3.8};
  double inflow = 0.05;
  ClosedForm at{};
  for (int step = 0; step < 10; ++step) {
    at = closed_form(blade, mu, climb + inflow, in.q / in.omega, in.B1, std::tan(d.delta3));
    const double wanted = at.CT / (2 * std::hypot(mu, climb + inflow) + 1e-3);
    inflow += 0.5 * (std::max(wanted, 0.0) - inflow);
  }
  return {inflow * tip, at.a1, at.b1};
}

RotorBalance balance(const RotorInput<double>& in, const Data& d, std::optional<double> given) {
  constexpr int most_steps = 50;
  constexpr double largest_inflow = 0.03, largest_flapping = 0.1;  // of one step
  const double tip = in.omega * d.radius;
  RotorMotion<double> y = start(in, d);
  for (int step = 0; step < most_steps; ++step) {
    const auto r = residual(in, y, d, tip, given);
    Eigen::Matrix3d J;
    Eigen::Vector3d value;
    for (Eigen::Index k = 0; k < 3; ++k) {
      value[k] = r[std::size_t(k)].value;
      J.row(k) = r[std::size_t(k)].slopes.matrix().transpose();
    }
    Eigen::Matrix3d inverse = inverse_of(J);
    const Eigen::Vector3d move = inverse * value;
    if (!move.allFinite()) break;
    if (value.cwiseAbs().maxCoeff() < 1e-14 || move.cwiseAbs().maxCoeff() < 1e-14) {
      inverse.row(0) *= tip;
      return {y, inverse};
    }
    const double size =
        std::max({1.0, std::abs(move[0]) / largest_inflow, std::abs(move[1]) / largest_flapping,
                  std::abs(move[2]) / largest_flapping});
    y = {y.v - move[0] / size * tip, y.a1 - move[1] / size, y.b1 - move[2] / size};
  }
  throw std::domain_error(
      fmt::format("the rotor's inflow and flapping have no balance near the start at V_e {:.4g} "
                  "m/s, V_n {:.4g} m/s, collective {:.4g} degrees",
                  in.V_e, in.V_n, in.theta_75 / degree));
}

namespace {

// An annulus of the rotor in hover at lambda = v/(Omega R):
//   4 F lambda² x = thrust coefficient of the blades per dx
struct Annulus {
  double from_blades, from_momentum;
};

Annulus annulus(const Data& d, const Element& e, double collective, double lambda, double tip) {
  const double x = e.r / d.radius, phi = std::atan2(lambda, x), U = std::hypot(x, lambda);
  const PrintedSections sections{&d.airfoils};
  const SectionAt at = sections(e.section, collective + e.twist - phi, U * tip / 340.294);
  const double cl = at.value[0], cd = at.value[1];
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
