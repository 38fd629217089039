// Slips in the airframe's equations (1)-(3), each evaluated as printed.
#include <fmt/core.h>

#include <cmath>
#include <numbers>

#include "tables/slips.hpp"

namespace tiltrim {

bool Slip::confirmed() const {
  for (const Evidence& e : evidence)
    if (!e.confirms) return false;
  return !evidence.empty();
}

namespace slips {

namespace {

using std::numbers::pi;

struct Flight {
  double theta, alpha, eta, a1s;
  double T, L, D;  // N
};

// (1) exactly as printed, q = 0.
struct Acceleration {
  double u, w;  // m/s²
};
Acceleration as_printed(const Flight& f) {
  const double Fx = f.T * std::cos(f.eta - f.a1s);
  const double Fz = -f.T * std::sin(f.eta - f.a1s);
  const double g = paper.gravity, s = std::sin(f.alpha), c = std::cos(f.alpha);
  const double X = Fx - weight * std::sin(f.theta) - f.L * s - f.D * c;
  const double Z = -Fz + weight * std::cos(f.theta) + f.L * c - f.D * s;
  return {X / paper.mass - g * std::sin(f.theta), Z / paper.mass + g * std::cos(f.theta)};
}

// The same without the second gravity term.
Acceleration gravity_once(const Flight& f) {
  const Acceleration a = as_printed(f);
  return {a.u + paper.gravity * std::sin(f.theta), a.w - paper.gravity * std::cos(f.theta)};
}

double induced_as_printed(double R, double theta0) {
  const double Omega = paper.rotor_speed_rpm * 2 * pi / 60;
  const double c1 =
      paper.blade_lift_slope * paper.blade_count * paper.blade_chord / (pi * R);  // ab σ
  return Omega * R * c1 / 16 * (-1 + std::sqrt(1 + 32 * theta0 / c1));
}

bool near(double value, double expected) { return std::abs(value - expected) < 1e-9; }

Slip gravity_twice() {
  const Acceleration fall = as_printed({0, 0, 0, 0, 0, 0, 0});
  return {"(1), X and Z",
          "gravity in X and Z, and again in u' and w'",
          "gravity once",
          "a body at rest without thrust falls at 2 g",
          {{"w' at rest, no thrust, no air", fall.w, "m/s²", near(fall.w, 2 * paper.gravity)}}};
}

Slip lift_down(const Source& s) {
  const double V = s.published.V[2].value;
  const double L = 0.5 * paper.air_density * V * V * paper.wing_area * s.published.CL[2].value;
  const double w = gravity_once({0, 0, 0, 0, 0, L, 0}).w;
  return {"(1), lift in X and Z",
          "-L sin(alpha) in X, +L cos(alpha) in Z",
          "+L sin(alpha), -L cos(alpha)",
          "z points down: a positive lift coefficient pushes the aircraft down",
          {{"w' with Table 2's level-flight CL at 15 m/s, alpha = 0, gravity once", w, "m/s²",
            w > paper.gravity}}};
}

Slip thrust_down() {
  const double hover = gravity_once({0, 0, pi / 2, 0, weight, 0, 0}).w;
  return {"(1), thrust in Z",
          "Z = -FTzb with FTzb = -T sin(eta - a1s)",
          "Z = +FTzb",
          "at eta = pi/2 thrust adds to the weight",
          {{"w' in hover, T = m g, gravity once (0 if thrust pushed up)", hover, "m/s²",
            near(hover, 2 * paper.gravity)}}};
}

// V' and V gamma' of (1) and of (2) with thrust only.
Slip thrust_angle(const Source& s) {
  const double alpha = s.published.alpha[1].value, eta = s.published.eta[1].value;
  const Acceleration a = gravity_once({0, alpha, eta, 0, weight, 0, 0});
  const double u = a.u, w = a.w - paper.gravity;  // theta = 0: gravity acts along z only
  const double from_body = (u * std::cos(alpha) + w * std::sin(alpha)) / paper.gravity;
  const double from_wind = std::cos(alpha + eta);
  return {
      "(1) compared with (2), thrust",
      "(1) transformed to wind axes has T cos(eta - a1s - alpha); (2) has T cos(alpha + eta - a1s)",
      "cos(alpha + eta - a1s), as (2): it follows from (1) once Z = +FTzb",
      "(2) does not follow from (1) as printed",
      {{"V' over g from T = m g in (1) at Table 1's transition, a1s = 0", from_body, "",
        near(from_body, 0.0)},
       {"the same in (2)", from_wind, "", near(from_wind, 1.0)}}};
}

Slip hub_moment(const Source& s) {
  Slip slip{"(1), M",
            "-zH sin(eta) FTxb + (xR - zH cos(eta)) FTzb",
            "-zH sin(eta) FTxb - (xR + zH cos(eta)) FTzb = (xR sin(eta - a1s) - zH sin(a1s)) T",
            "hub at (xR + zH cos(eta), -zH sin(eta)); (14) has the consistent arm, (1) the one "
            "with the sign of xR reversed",
            {}};
  for (std::size_t i = 0; i < 2; ++i) {
    const double eta = s.published.eta[i].value, a1s = s.published.a1s[i].value;
    const double Fx = std::cos(eta - a1s), Fz = -std::sin(eta - a1s);
    const double arm_1 =
        -paper.rotor_z * std::sin(eta) * Fx + (paper.rotor_x - paper.rotor_z * std::cos(eta)) * Fz;
    const double arm_14 = paper.rotor_x * std::sin(eta - a1s) - paper.rotor_z * std::sin(a1s);
    slip.evidence.push_back(
        {fmt::format("arm of (1), {}", s.published.columns[i]), arm_1, "m", arm_1 < 0});
    slip.evidence.push_back(
        {fmt::format("arm of (14), {}", s.published.columns[i]), arm_14, "m", arm_14 > 0});
  }
  return slip;
}

Slip quadrant() {
  const double alpha = -100.0 * pi / 180;
  const double folded = std::atan(std::sin(alpha) / std::cos(alpha)) * 180 / pi;
  return {
      "(1), alpha",
      "arctan(w/u)",
      "atan2(w, u)",
      "the polars cover the full circle; arctan folds it, and u = 0 at the climb's angle of attack",
      {{"arctan(w/u) at alpha = -100°", folded, "°", near(folded, 80.0)}}};
}

Slip path_equation() {
  // T = m g at phi = pi/2, L = 0, gamma = 0:  V gamma' = (-T - m g)/m
  const double rate = (-weight - weight) / paper.mass;
  return {"(2), (10), (14), (15), gamma row",
          "m V gamma' = -T sin(phi) - L - m g cos(gamma)",
          "m V gamma' = T sin(phi) + L - m g cos(gamma)",
          "lift and thrust push the path down; at gamma = +-pi/2 the weight drops out and both "
          "forms have the same roots, so Table 3 cannot distinguish them",
          {{"V gamma' at gamma = 0 with T = m g straight up (0 if thrust held the weight)", rate,
            "m/s²", near(rate, -2 * paper.gravity)}}};
}

Slip pitch_or_fraction(const Source& s) {
  const double hover = 1.0 / s.identified.thrust_excess;
  Slip slip{
      "(3) with (4)",
      "one theta0, a blade pitch in (3) and a fraction of full thrust in (4)",
      "(3) uses pitch_scale theta0, and wake_immersion of vi acts on the wing",
      "at hover (Ep theta0 = 1) (3) gives a wake whose momentum is many times the weight, for any "
      "plausible radius; on the whole wing with Table 2's CD it leaves no climb equilibrium",
      {}};
  for (double R : {0.15, 0.25, 0.5}) {
    const double vi = induced_as_printed(R, hover);
    const double thrust = 2 * paper.air_density * (2 * pi * R * R) * vi * vi;  // two discs
    slip.evidence.push_back({fmt::format("vi at hover, R = {:g} m", R), vi, "m/s", vi > 20});
    slip.evidence.push_back(
        {fmt::format("momentum theory's thrust at that vi over the weight, R = {:g} m", R),
         thrust / weight, "", thrust > 5 * weight});
  }
  const double left = s.identified.effective_speed - s.published.V[0].value;
  slip.evidence.push_back({"vi that Table 3 implies in addition to the climb's 2 m/s", left, "m/s",
                           std::abs(left) < 0.05});
  return slip;
}

Slip root_of_negative(const Source& s) {
  Slip slip{"(3) at Table 3's theta0",
            "a square root of 1 + 32 theta0/(ab sigma)",
            "vi odd in theta0",
            "at the printed negative theta0 the root is real only for radii below a few "
            "centimeters: these equilibria have no vi",
            {}};
  for (std::size_t i = 1; i < 3; ++i) {
    const double theta0 = s.published.theta0[i].value;
    // 32 |θ0| = ab σ,  σ = b c/(π R)
    const double R = paper.blade_lift_slope * paper.blade_count * paper.blade_chord /
                     (32 * pi * std::abs(theta0));
    slip.evidence.push_back(
        {fmt::format("largest radius with a real vi, {}", s.published.columns[i]), R, "m",
         theta0 < 0 && R < 0.03});
  }
  return slip;
}

}  // namespace

// The climb's printed signs are those of (1): residual of its two rows over g.
std::vector<Evidence> climb_from_body_axes(const Source& s) {
  std::vector<Evidence> evidence;
  for (std::size_t i = 0; i < 3; ++i) {
    const double k = s.identified.k, alpha = s.published.alpha[i].value;
    const double eta = s.published.eta[i].value, CL = s.published.CL[i].value;
    const ForceBalance b = solve_forces(s.identified.thrust_excess, k, CL, s.published.CD[i].value,
                                        -pi / 2, alpha, eta);
    const double sign = s.published.theta0[i].value < 0 ? -1.0 : 1.0;
    const Acceleration a =
        gravity_once({alpha - pi / 2, alpha, eta, b.a1s,
                      sign * s.identified.thrust_excess * weight * std::abs(b.theta0),
                      k * weight * CL, k * weight * s.published.CD[i].value});
    const double left = std::hypot(a.u, a.w) / paper.gravity;
    const bool solves = i != 1;
    evidence.push_back(
        {fmt::format("residual of (1), gravity once, gamma = -pi/2, signs as printed, {}",
                     s.published.columns[i]),
         left, "g", solves ? left < 1e-9 : left > 0.1});
  }
  return evidence;
}

std::vector<Slip> in_airframe(const Source& s) {
  return {gravity_twice(), lift_down(s),    thrust_down(),        thrust_angle(s),    hub_moment(s),
          quadrant(),      path_equation(), pitch_or_fraction(s), root_of_negative(s)};
}

}  // namespace slips
}  // namespace tiltrim
