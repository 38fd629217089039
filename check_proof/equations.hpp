/// The closed loop of docs/model.md in wind axes, consistent equations, written a second time for
/// the checker on its own scalars. Internal to check_proof/. Numbers in brackets are equations of
/// the paper [1].
#pragma once

#include <array>
#include <string_view>
#include <utility>
#include <vector>

#include "check_proof/form.hpp"

namespace tiltrim::checking {

/// The parameters of the loop; each may depend on the box.
struct Numbers {
  // clang-format off
  Form V, gamma, eta;
  Form mass, inertia_yy, chord, wing_area, air_density, gravity, rotor_x, rotor_z, thrust_excess,
      rotor_speed_rpm, rotor_radius, blade_count, blade_chord, blade_lift_slope, pitch_scale,
      wake_immersion, CL_q, CL_de, CM_q, CM_de, cyclic_off, cyclic_blend;
  Form k_V, K_Ep, K_Ei, K_Lp, K_Li, k_pa, k_da, k_pe, k_de;
  // clang-format on
  Form authority;  ///< the cyclic's share of pitch control (12)
};

struct Named {
  std::string_view name;
  Form Numbers::*member;
};
const std::vector<Named>& names();  ///< of all but the authority
/// Null if there is no such number.
Form Numbers::*find_number(std::string_view name);
inline constexpr std::size_t gain_count = 9;
/// In the order of a schedule.
const std::array<Form Numbers::*, gain_count>& gains();

template <class S>
struct Polars {
  S CL, CD, CM;
};

/// The exact periodic C² cubic spline through the nodes of a polar.
class Spline {
 public:
  /// y: CL, CD, CM at ascending alpha, which span 2π. Throws std::invalid_argument otherwise.
  Spline(std::vector<double> alpha, const std::array<std::vector<double>, 3>& y);

  /// Not a number for angles outside the nodes.
  Form at(std::size_t column, const Form& alpha) const;
  Form slope(std::size_t column, const Form& alpha) const;

  Polars<Form> operator()(const Form& a) const { return {at(0, a), at(1, a), at(2, a)}; }
  Polars<Dual> operator()(const Dual& a) const {
    const auto of = [&](std::size_t k) { return chained(a, at(k, a.value), slope(k, a.value)); };
    return {of(0), of(1), of(2)};
  }
  /// The ranges over all angles of a, the least possible.
  Polars<Ball> ranges(const Ball& a) const;

 private:
  struct Piece {
    Ball y, slope, half_second, sixth_third;
  };
  // The first and last piece that have an angle in common with the ball; {1, 0} if it leaves the
  // nodes.
  std::pair<std::size_t, std::size_t> pieces(const Ball& a) const;
  Ball value_at(std::size_t column, const Ball& a) const;
  Ball slope_at(std::size_t column, const Ball& a) const;
  std::vector<double> alpha_;
  std::array<std::vector<Piece>, 3> pieces_;
};

template <class S>
S induced_velocity(const Numbers& a, const S& theta0) {
  const Form tip_speed = a.rotor_speed_rpm * Form(pi() / Ball(30)) * a.rotor_radius;
  const Form c1 =
      a.blade_lift_slope * a.blade_count * a.blade_chord / (Form(pi()) * a.rotor_radius);
  const S x = S(a.pitch_scale) * theta0;
  // (3), without the singular form at zero: ΩR c₁/16 (√(1 + 32|x|/c₁) - 1) sgn x
  return S(Form(2.0) * tip_speed) * x / (sqrt(S(1.0) + S(Form(32.0) / c1) * abs(x)) + S(1.0));
}

template <class S>
struct Rates {
  S V, gamma, q;
};

/// (2), and q' of (14).
template <class S>
Rates<S> airframe(const Numbers& a, const Polars<S>& polar, const S& V, const S& gamma,
                  const S& alpha, const S& q, const S& theta0, const S& a1s, const S& delta_e,
                  const S& V_rate) {
  const S W = V + S(a.wake_immersion) * induced_velocity(a, theta0);
  const S rho_W_S = S(Form(0.5) * a.air_density * a.wing_area) * W;
  const S Q = rho_W_S * W;
  const S Q_qh = S(Form(0.5) * a.chord) * rho_W_S * q;           // Q q c̄/(2W)
  const S T = S(a.thrust_excess * a.mass * a.gravity) * theta0;  // (4)
  const S phi = alpha + S(a.eta) - a1s;
  const S deflected = delta_e * cos(alpha);
  const S L = Q * (polar.CL + S(a.CL_de) * deflected) + S(a.CL_q) * Q_qh;
  const S Ma = S(a.chord) * (Q * (polar.CM + S(a.CM_de) * deflected) + S(a.CM_q) * Q_qh);
  const S hub = S(a.rotor_x) * sin(S(a.eta) - a1s) - S(a.rotor_z) * sin(a1s);
  return {V_rate, (T * sin(phi) + L - S(a.mass * a.gravity) * cos(gamma)) / (S(a.mass) * V),
          (hub * T + Ma) / S(a.inertia_yy)};
}

/// V' of (2); it does not depend on the elevator.
template <class S>
S speed_rate(const Numbers& a, const Polars<S>& polar, const S& V, const S& gamma, const S& alpha,
             const S& theta0, const S& a1s) {
  const S W = V + S(a.wake_immersion) * induced_velocity(a, theta0);
  const S D = S(Form(0.5) * a.air_density * a.wing_area) * W * W * polar.CD;
  const S T = S(a.thrust_excess * a.mass * a.gravity) * theta0;
  return (T * cos(alpha + S(a.eta) - a1s) - D) / S(a.mass) - S(a.gravity) * sin(gamma);
}

template <class S>
struct Loop {
  Rates<S> rates;
  S theta0, a1s, delta_e;
};

/// theta0 and the deflection of the actuator that controls pitch, at a trim.
struct Held {
  Form theta0, deflection;
};

/// A command at this value: only its derivatives remain.
inline Form about(Form value, const Form&) { return value; }
inline Dual about(Form value, const Dual& command) {
  Dual r{std::move(value)};
  r.slopes = command.slopes;
  return r;
}

/// States V_err, gamma_err, theta, q, x1, x2. At a trim with the actuators `held` the integrals,
/// which enter the commands linearly, are what they must be for these.
template <class S>
Loop<S> closed_loop(const Numbers& a, const Spline& spline, const std::array<S, 6>& x,
                    const Held* held = nullptr) {
  const auto& [V_err, gamma_err, theta, q, x1, x2] = x;
  const S V = S(a.V) - V_err;
  const S gamma = S(a.gamma) - gamma_err;
  const S alpha = theta - gamma;
  const Polars<S> polar = spline(alpha);
  const Form weight = a.mass * a.gravity;
  const S drag = S(Form(0.5) * a.air_density * a.wing_area / weight) * V * V * polar.CD;
  const S common = S(a.k_V / a.gravity) * V_err + sin(gamma) + drag;
  const S turned = sin(gamma_err);
  S theta0 = (S(a.K_Ep) * (common + turned) + S(a.K_Ei) * x1) *
             S(inverse(Form(1.0) + a.thrust_excess * a.K_Ep));  // (13)
  const S a_hat = (S(a.K_Lp) * (common - turned) + S(a.K_Li) * x2) * S(inverse(Form(1.0) + a.K_Lp));
  S a1s = S(a.authority) * (a_hat + S(a.k_pa) * theta + S(a.k_da) * q);  // (12)
  if (held) {
    theta0 = about(held->theta0, theta0);
    a1s = about(a.authority * held->deflection, a1s);
  }
  const S V_rate = speed_rate(a, polar, V, gamma, alpha, theta0, a1s);
  const S Le = (S(a.k_V) * V_err - V_rate) * S(inverse(a.gravity)) - turned;  // (7)
  S delta_e = S(Form(1.0) - a.authority) *
              (S(a.K_Lp) * Le + S(a.K_Li) * x2 + S(a.k_pe) * theta + S(a.k_de) * q);  // (9)
  if (held) delta_e = about((Form(1.0) - a.authority) * held->deflection, delta_e);
  return {airframe(a, polar, V, gamma, alpha, q, theta0, a1s, delta_e, V_rate), theta0, a1s,
          delta_e};
}

/// The airframe at the command with theta, theta0 and the deflection in the places of theta, x1,
/// x2.
template <class S>
Loop<S> without_law(const Numbers& a, const Spline& spline, const std::array<S, 6>& x) {
  const S &theta = x[2], &theta0 = x[4];
  const S V(a.V), gamma(a.gamma), q(0.0), alpha = theta - gamma;
  const S a1s = S(a.authority) * x[5], delta_e = S(Form(1.0) - a.authority) * x[5];
  const Polars<S> polar = spline(alpha);
  const S V_rate = speed_rate(a, polar, V, gamma, alpha, theta0, a1s);
  return {airframe(a, polar, V, gamma, alpha, q, theta0, a1s, delta_e, V_rate), theta0, a1s,
          delta_e};
}

/// Commanded speed, path and tilt at a height (16), on one of the pieces between
/// 0, 20 m and 120 m: 0 below, 1, 2, 3 above.
struct Commanded {
  Form V, angle;
};
Commanded corridor(const Form& h, int piece);

}  // namespace tiltrim::checking
