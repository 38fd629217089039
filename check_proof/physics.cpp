#include "check_proof/physics.hpp"

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

Affine Numbers::*find_number(std::string_view name) {
  const auto found = std::ranges::find(names(), name, &Named::name);
  return found == names().end() ? nullptr : found->member;
}

const std::array<Affine Numbers::*, gain_count>& gains() {
  using N = Numbers;
  static const std::array<Affine Numbers::*, gain_count> all{
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

Ball Spline::second(std::size_t column, const Ball& a) const {
  const auto [first, last] = pieces(a);
  if (first > last) return no_number();
  const auto at = [&](std::size_t i, const Ball& angle) {
    const Piece& p = pieces_[column][i];
    return Ball(2) * p.half_second + Ball(6) * p.sixth_third * (angle - Ball(alpha_[i]));
  };
  Ball all = hull(at(first, lower(a)), at(last, upper(a)));
  for (std::size_t i = first + 1; i <= last; ++i) all = hull(all, at(i, Ball(alpha_[i])));
  return all;
}

Affine Spline::at(std::size_t column, const Affine& alpha) const {
  const Ball m = midpoint(alpha.value);
  const auto [first, last] = pieces(m);
  if (first > last) return {no_number()};
  // A knot may lie within the rounding of m to a double: the pieces' values agree there.
  const Piece& p = pieces_[column][first];
  const Ball t = m - Ball(alpha_[first]);
  const Ball f = p.y + t * (p.slope + t * (p.half_second + t * p.sixth_third));
  const Ball slope = p.slope + t * (Ball(2) * p.half_second + Ball(3) * t * p.sixth_third);
  return composed(alpha, f, slope, second(column, range(alpha)));
}

Affine Spline::slope(std::size_t column, const Affine& alpha) const {
  const Ball m = midpoint(alpha.value), all = range(alpha);
  const auto [from, to] = pieces(all);
  const std::size_t here = pieces(m).first;
  if (from > to) return {no_number()};
  Ball third = pieces_[column][from].sixth_third;
  for (std::size_t i = from + 1; i <= to; ++i) third = hull(third, pieces_[column][i].sixth_third);
  const Piece& p = pieces_[column][here];
  const Ball t = m - Ball(alpha_[here]);
  const Ball f = p.slope + t * (Ball(2) * p.half_second + Ball(3) * t * p.sixth_third);
  const Ball bend = Ball(2) * p.half_second + Ball(6) * t * p.sixth_third;
  return composed(alpha, f, bend, Ball(6) * third);
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

Commanded corridor(const Affine& h, int piece) {
  constexpr double climb = 2, cruise = 15;  // m/s
  if (piece == 0) return {{climb}, {halved(pi())}};
  const Ball m = midpoint(h.value), all = range(h);
  // (16): π (h³/1728000 - h²/9600 + 1/2), which is 0 at 120 m
  const Ball f = pi() * (m * m * m / Ball(1728000) - m * m / Ball(9600) + Ball(0.5));
  const Ball slope = pi() * (m * m / Ball(576000) - m / Ball(4800));
  const Ball second = pi() * (all / Ball(288000) - Ball(1) / Ball(4800));
  const Affine angle = piece == 3 ? Affine(0.0) : composed(h, f, slope, second);
  if (piece == 1) return {{climb}, angle};
  if (piece == 3) return {{cruise}, angle};
  // 2 + 13 (3t² - 2t³),  t = (h - 20)/100
  const Ball rise(cruise - climb), hundred(100);
  const Ball t = (m - Ball(20)) / hundred, over = (all - Ball(20)) / hundred;
  return {composed(h, Ball(climb) + rise * t * t * (Ball(3) - Ball(2) * t),
                   Ball(6) * rise * t * (Ball(1) - t) / hundred,
                   Ball(6) * rise * (Ball(1) - Ball(2) * over) / (hundred * hundred)),
          angle};
}

}  // namespace tiltrim::checking
