#include "check_proof/equations.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace tiltrim::checking {

const std::vector<Named>& names() {
  using N = Numbers;
  static const std::vector<Named> all{
      {"V", &N::V},
      {"gamma", &N::gamma},
      {"eta", &N::eta},
      {"aircraft.mass", &N::mass},
      {"aircraft.inertia_yy", &N::inertia_yy},
      {"aircraft.chord", &N::chord},
      {"aircraft.wing_area", &N::wing_area},
      {"aircraft.air_density", &N::air_density},
      {"aircraft.gravity", &N::gravity},
      {"aircraft.rotor_x", &N::rotor_x},
      {"aircraft.rotor_z", &N::rotor_z},
      {"aircraft.thrust_excess", &N::thrust_excess},
      {"aircraft.rotor_speed_rpm", &N::rotor_speed_rpm},
      {"aircraft.rotor_radius", &N::rotor_radius},
      {"aircraft.blade_count", &N::blade_count},
      {"aircraft.blade_chord", &N::blade_chord},
      {"aircraft.blade_lift_slope", &N::blade_lift_slope},
      {"aircraft.pitch_scale", &N::pitch_scale},
      {"aircraft.wake_immersion", &N::wake_immersion},
      {"aircraft.CL_q", &N::CL_q},
      {"aircraft.CL_de", &N::CL_de},
      {"aircraft.CM_q", &N::CM_q},
      {"aircraft.CM_de", &N::CM_de},
      {"aircraft.cyclic_off", &N::cyclic_off},
      {"aircraft.cyclic_blend", &N::cyclic_blend},
      {"gains.k_V", &N::k_V},
      {"gains.K_Ep", &N::K_Ep},
      {"gains.K_Ei", &N::K_Ei},
      {"gains.K_Lp", &N::K_Lp},
      {"gains.K_Li", &N::K_Li},
      {"gains.k_pa", &N::k_pa},
      {"gains.k_da", &N::k_da},
      {"gains.k_pe", &N::k_pe},
      {"gains.k_de", &N::k_de},
  };
  return all;
}

Form Numbers::*find_number(std::string_view name) {
  const auto found = std::ranges::find(names(), name, &Named::name);
  return found == names().end() ? nullptr : found->member;
}

const std::array<Form Numbers::*, gain_count>& gains() {
  using N = Numbers;
  static const std::array<Form Numbers::*, gain_count> all{
      &N::k_V, &N::K_Ep, &N::K_Ei, &N::K_Lp, &N::K_Li, &N::k_pa, &N::k_da, &N::k_pe, &N::k_de};
  return all;
}

namespace {

// A matrix with `off` beside the diagonal [i: between i and i + 1] by elimination without pivoting,
// which diagonal dominance permits.
std::vector<Ball> solve_tridiagonal(std::vector<Ball> diagonal, const std::vector<Ball>& off,
                                    std::vector<Ball> rhs) {
  const std::size_t n = rhs.size();
  for (std::size_t i = 1; i < n; ++i) {
    const Ball by = off[i - 1] / diagonal[i - 1];
    diagonal[i] -= by * off[i - 1];
    rhs[i] -= by * rhs[i - 1];
  }
  for (std::size_t i = n; i-- > 0;) {
    if (i + 1 < n) rhs[i] -= off[i] * rhs[i + 1];
    rhs[i] /= diagonal[i];
  }
  return rhs;
}

// h₋ M₋ + 2 (h₋ + h₊) M + h₊ M₊ = 6 ((y₊ - y)/h₊ - (y - y₋)/h₋) around the circle, as a
// tridiagonal matrix and a product of two vectors (Sherman-Morrison).
std::vector<Ball> curvatures(const std::vector<Ball>& h, const std::vector<double>& y) {
  const std::size_t n = h.size();
  std::vector<Ball> diagonal(n), rhs(n), corner(n);
  for (std::size_t i = 0; i < n; ++i) {
    const std::size_t before = (i + n - 1) % n;
    const Ball ahead = (Ball(y[(i + 1) % n]) - Ball(y[i])) / h[i];
    const Ball behind = (Ball(y[i]) - Ball(y[before])) / h[before];
    diagonal[i] = Ball(2) * (h[before] + h[i]);
    rhs[i] = Ball(6) * (ahead - behind);
  }
  const Ball c = h[n - 1], g = -diagonal[0];
  diagonal[0] -= g;
  diagonal[n - 1] -= c * c / g;
  corner[0] = g;
  corner[n - 1] = c;
  std::vector<Ball> M = solve_tridiagonal(diagonal, h, rhs);
  const std::vector<Ball> z = solve_tridiagonal(diagonal, h, corner);
  const Ball share = (M[0] + c / g * M[n - 1]) / (Ball(1) + z[0] + c / g * z[n - 1]);
  for (std::size_t i = 0; i < n; ++i) M[i] -= share * z[i];
  return M;
}

// The two points whose hull a ball is.
Ball clipped(const Ball& a, double from, double to) {
  Ball low = lower(a), high = upper(a);
  if (less(low, Ball(from))) low = Ball(from);
  if (less(Ball(to), high)) high = Ball(to);
  return hull(low, high);
}

}  // namespace

Spline::Spline(std::vector<double> alpha, const std::array<std::vector<double>, 3>& y)
    : alpha_(std::move(alpha)) {
  if (alpha_.size() < 4) throw std::invalid_argument("the polar has fewer than 4 nodes");
  const std::size_t n = alpha_.size() - 1;
  for (std::size_t i = 0; i < n; ++i)
    if (!(alpha_[i] < alpha_[i + 1]))
      throw std::invalid_argument("alpha of the polar does not ascend");
  if (!less(abs(Ball(alpha_[n]) - Ball(alpha_[0]) - Ball(2) * pi()), Ball(1e-9)))
    throw std::invalid_argument("alpha of the polar does not span a full turn");
  std::vector<Ball> h(n);
  for (std::size_t i = 0; i < n; ++i) h[i] = Ball(alpha_[i + 1]) - Ball(alpha_[i]);
  for (std::size_t k = 0; k < 3; ++k) {
    if (y[k].size() != n + 1 || y[k].front() != y[k].back())
      throw std::invalid_argument("the polar's columns are not as long as alpha, or not periodic");
    const std::vector<Ball> M = curvatures(h, y[k]);
    for (std::size_t i = 0; i < n; ++i) {
      const Ball rise = (Ball(y[k][i + 1]) - Ball(y[k][i])) / h[i];
      const Ball& next = M[(i + 1) % n];
      pieces_[k].push_back({Ball(y[k][i]), rise - h[i] / Ball(6) * (Ball(2) * M[i] + next),
                            halved(M[i]), (next - M[i]) / (Ball(6) * h[i])});
    }
  }
}

std::pair<std::size_t, std::size_t> Spline::pieces(const Ball& a) const {
  const double low = double_below(a), high = double_above(a);
  if (!(low >= alpha_.front() && high <= alpha_.back())) return {1, 0};
  const auto piece = [&](double at) {
    const auto above = std::ranges::upper_bound(alpha_, at);
    return std::min(std::size_t(above - alpha_.begin()), alpha_.size() - 1) - 1;
  };
  return {piece(low), piece(high)};
}

static Ball no_number() {
  Ball r;
  arb_indeterminate(r.get());
  return r;
}

Ball Spline::value_at(std::size_t column, const Ball& a) const {
  const auto [first, last] = pieces(a);
  if (first > last) return no_number();
  Ball all;
  for (std::size_t i = first; i <= last; ++i) {
    const Piece& p = pieces_[column][i];
    const Ball t = clipped(a, alpha_[i], alpha_[i + 1]) - Ball(alpha_[i]);
    const Ball value = p.y + t * (p.slope + t * (p.half_second + t * p.sixth_third));
    all = i == first ? value : hull(all, value);
  }
  return all;
}

Ball Spline::slope_at(std::size_t column, const Ball& a) const {
  const auto [first, last] = pieces(a);
  if (first > last) return no_number();
  Ball all;
  for (std::size_t i = first; i <= last; ++i) {
    const Piece& p = pieces_[column][i];
    const Ball t = clipped(a, alpha_[i], alpha_[i + 1]) - Ball(alpha_[i]);
    const Ball slope = p.slope + t * (Ball(2) * p.half_second + Ball(3) * t * p.sixth_third);
    all = i == first ? slope : hull(all, slope);
  }
  return all;
}

Form Spline::at(std::size_t column, const Form& alpha) const {
  const auto [first, last] = pieces(range(alpha));
  if (first > last) return {no_number()};
  Ball third = pieces_[column][first].sixth_third;
  for (std::size_t i = first + 1; i <= last; ++i)
    third = hull(third, pieces_[column][i].sixth_third);
  return composed(
      alpha, [&](const Ball& a) { return value_at(column, a); }, Ball(6) * third);
}

// The slope is a parabola on each piece; by one through three nodes, and how far they are apart.
Form Spline::slope(std::size_t column, const Form& alpha) const {
  const Ball all = range(alpha), m = midpoint(all), r = magnitude(all - m);
  const auto [first, last] = pieces(all);
  if (first > last) return {no_number()};
  if (alpha.n == 0 || r.is_zero()) return {slope_at(column, all)};
  const Ball f0 = slope_at(column, m), a = midpoint(r * Ball(0.8660254));
  const Ball below = slope_at(column, m - a), above = slope_at(column, m + a);
  const Ball b1 = (above - below) / (a + a), b2 = (halved(above + below) - f0) / (a * a);
  Ball most;
  for (std::size_t i = first; i <= last; ++i) {
    const Piece& p = pieces_[column][i];
    const Ball part = clipped(all, alpha_[i], alpha_[i + 1]), c = midpoint(part), u = part - c;
    const Ball t = c - m, s = c - Ball(alpha_[i]);
    const Ball e0 = p.slope + s * (Ball(2) * p.half_second + Ball(3) * s * p.sixth_third) -
                    (f0 + t * (b1 + t * b2));
    const Ball e1 = Ball(2) * p.half_second + Ball(6) * s * p.sixth_third - (b1 + Ball(2) * t * b2);
    const Ball e2 = Ball(3) * p.sixth_third - b2;
    most = upper(hull(most, magnitude(e0 + u * (e1 + u * e2))));
  }
  const Form t = alpha - Form(m);
  Form fit = t * (Form(b1) + Form(b2) * t) + Form(f0);
  fit.rest = upper(fit.rest + most);
  return fit;
}

Polars<Ball> Spline::ranges(const Ball& a) const {
  const auto [first, last] = pieces(a);
  if (first > last) return {no_number(), no_number(), no_number()};
  std::array<Ball, 3> all;
  for (std::size_t k = 0; k < 3; ++k)
    for (std::size_t i = first; i <= last; ++i) {
      const Ball part = clipped(a, alpha_[i], alpha_[i + 1]);
      const Piece& p = pieces_[k][i];
      const Ball m = midpoint(part), t = m - Ball(alpha_[i]), off = part - m;
      const Ball slope = p.slope + t * (Ball(2) * p.half_second + Ball(3) * t * p.sixth_third);
      const Ball bend =
          Ball(2) * p.half_second + Ball(6) * (part - Ball(alpha_[i])) * p.sixth_third;
      const Ball values = p.y + t * (p.slope + t * (p.half_second + t * p.sixth_third)) +
                          slope * off + halved(bend * off * off);
      all[k] = i == first ? values : hull(all[k], values);
    }
  return {all[0], all[1], all[2]};
}

Commanded corridor(const Form& h, int piece) {
  constexpr double climb = 2, cruise = 15;  // m/s
  if (piece == 0) return {{climb}, {halved(pi())}};
  // (16): π (h³/1728000 - h²/9600 + 1/2), which is 0 at 120 m
  const auto tilt = [](const Ball& at) {
    return pi() * (at * at * at / Ball(1728000) - at * at / Ball(9600) + Ball(0.5));
  };
  const Form angle = piece == 3 ? Form(0.0) : composed(h, tilt, pi() / Ball(288000));
  if (piece == 1) return {{climb}, angle};
  if (piece == 3) return {{cruise}, angle};
  // 2 + 13 (3t² - 2t³),  t = (h - 20)/100
  const auto speed = [](const Ball& at) {
    const Ball t = (at - Ball(20)) / Ball(100);
    return Ball(climb) + Ball(cruise - climb) * t * t * (Ball(3) - Ball(2) * t);
  };
  return {composed(h, speed, Ball(-12 * (cruise - climb)) / Ball(1e6)), angle};
}

}  // namespace tiltrim::checking
