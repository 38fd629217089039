/// The F-16 of Stevens, Lewis and Johnson: its longitudinal motion with the book's tables, in the
/// book's units (ft, slug, s; elevator in degrees, all other angles in rad).
///
/// B. L. Stevens, F. L. Lewis, E. N. Johnson: Aircraft Control and Simulation. 3rd ed., Wiley,
/// 2015, appendix A.                                                                       [63]
/// Its tables are those of NASA TP 1538, thinned out and brought to one leading-edge flap.  [64]
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "model/model.hpp"
#include "vehicles/mode_names.hpp"

namespace f16 {

template <std::size_t n>
using Row = std::array<double, n>;
template <std::size_t m, std::size_t n>
using Table = std::array<Row<n>, m>;

// Over α = -10, -5, ..., 45 degrees, and over elevators of -24, -12, ..., 24 degrees.
using OverAlpha = Row<12>;
using OverElevator = Table<5, 12>;

inline constexpr OverElevator C_x = {
    OverAlpha{-.099, -.081, -.081, -.063, -.025, .044, .097, .113, .145, .167, .174, .166},
    OverAlpha{-.048, -.038, -.040, -.021, .016, .083, .127, .137, .162, .177, .179, .167},
    OverAlpha{-.022, -.020, -.021, -.004, .032, .094, .128, .130, .154, .161, .155, .138},
    OverAlpha{-.040, -.038, -.039, -.025, .006, .062, .087, .085, .100, .110, .104, .091},
    OverAlpha{-.083, -.073, -.076, -.072, -.046, .012, .024, .025, .043, .053, .047, .040}};
inline constexpr OverElevator C_m = {
    OverAlpha{.205, .168, .186, .196, .213, .251, .245, .238, .252, .231, .198, .192},
    OverAlpha{.081, .077, .107, .110, .110, .141, .127, .119, .133, .108, .081, .093},
    OverAlpha{-.046, -.020, -.009, -.005, -.006, .010, .006, -.001, .014, .000, -.013, .032},
    OverAlpha{-.174, -.145, -.121, -.127, -.129, -.102, -.097, -.113, -.087, -.084, -.069, -.006},
    OverAlpha{-.259, -.202, -.184, -.193, -.199, -.150, -.160, -.167, -.104, -.076, -.041, -.005}};
inline constexpr OverAlpha C_z = {.770,   .241,   -.100,  -.416,  -.731,  -1.053,
                                  -1.366, -1.646, -1.917, -2.120, -2.248, -2.229};
inline constexpr OverAlpha C_xq = {-.267, -.110, .308, 1.34, 2.08, 2.91,
                                   2.76,  2.05,  1.50, 1.49, 1.83, 1.21};
inline constexpr OverAlpha C_zq = {-8.80, -25.8, -28.9, -31.4, -31.2, -30.7,
                                   -27.7, -28.2, -29.0, -29.8, -38.3, -35.3};
// At -5 degrees the book prints -.540, a tenth of the neighbouring values.
inline constexpr OverAlpha C_mq = {-7.21, -5.40, -5.23, -5.26, -6.11, -6.64,
                                   -5.69, -6.00, -6.20, -6.40, -6.60, -6.00};

// Thrust in lb over Mach 0, 0.2, ..., 1 (rows) and 0, 10,000, ..., 50,000 ft.
using Thrust = Table<6, 6>;
inline constexpr Thrust idle = {
    Row<6>{1060, 670, 880, 1140, 1500, 1860},     Row<6>{635, 425, 690, 1010, 1330, 1700},
    Row<6>{60, 25, 345, 755, 1130, 1525},         Row<6>{-1020, -710, -300, 350, 910, 1360},
    Row<6>{-2700, -1900, -1300, -247, 600, 1100}, Row<6>{-3600, -1400, -595, -342, -200, 700}};
inline constexpr Thrust military = {
    Row<6>{12680, 9150, 6200, 3950, 2450, 1400},  Row<6>{12680, 9150, 6313, 4040, 2470, 1400},
    Row<6>{12610, 9312, 6610, 4290, 2600, 1560},  Row<6>{12640, 9839, 7090, 4660, 2840, 1660},
    Row<6>{12390, 10176, 7750, 5320, 3250, 1930}, Row<6>{11680, 9848, 8050, 6100, 3800, 2310}};
inline constexpr Thrust maximum = {
    Row<6>{20000, 15000, 10800, 7000, 4000, 2500},  Row<6>{21420, 15700, 11225, 7323, 4435, 2600},
    Row<6>{22700, 16860, 12250, 8154, 5000, 2835},  Row<6>{24240, 18910, 13760, 9285, 5700, 3215},
    Row<6>{26070, 21075, 15975, 11115, 6860, 3950}, Row<6>{28886, 23319, 18300, 13484, 8642, 5057}};

// Linear between the entries of a table; the end intervals are extrapolated.
template <std::size_t n>
double between(const Row<n>& row, double at) {
  const double low = std::clamp(std::floor(at), 0.0, double(n - 2));
  const auto k = std::size_t(low);
  return row[k] + (at - low) * (row[k + 1] - row[k]);
}

template <std::size_t m, std::size_t n>
double between(const Table<m, n>& table, double row, double column) {
  Row<m> at_column;
  for (std::size_t i = 0; i < m; ++i) at_column[i] = between(table[i], column);
  return between(at_column, row);
}

inline double at_alpha(double degrees) { return degrees / 5 + 2; }
inline double at_elevator(double degrees) { return degrees / 12 + 2; }

// Thrust at a power in percent: 0 idle, 50 military, 100 maximum.
inline double thrust(double power, double altitude, double mach) {
  const double h = std::max(altitude, 0.0) / 10000, M = mach / 0.2;
  const double from = between(power < 50 ? idle : military, M, h);
  const double to = between(power < 50 ? military : maximum, M, h);
  return from + (to - from) * (power < 50 ? power : power - 50) / 50;
}

inline double commanded_power(double throttle) {
  return throttle <= 0.77 ? 64.94 * throttle : 217.38 * throttle - 117.38;
}

// The engine follows its command at 5 1/s with afterburner; otherwise the rate falls with the
// distance from the command. It enters and leaves the afterburner by way of a power beyond 50.
inline double power_rate(double power, double command) {
  const bool burns = power >= 50, shall_burn = command >= 50;
  const double aim = burns == shall_burn ? command : shall_burn ? 60 : 40;
  const double rate = burns ? 5 : std::clamp(1.9 - 0.036 * (aim - power), 0.1, 1.0);
  return rate * (aim - power);
}

// Density and speed of sound of the book's atmosphere, whose temperature jumps at 35,000 ft.
struct Air {
  double density, sound;
};

inline Air air(double altitude) {
  const double share = 1 - 0.703e-5 * altitude;
  const double temperature = altitude >= 35000 ? 390 : 519 * share;
  return {2.377e-3 * std::pow(share, 4.14), std::sqrt(1.4 * 1716.3 * temperature)};
}

inline constexpr double gravity = 32.17;
inline constexpr double per_mass = 1.57e-3;      // 1/m, as the book rounds it
inline constexpr double per_inertia = 1.792e-5;  // 1/I_yy, likewise
inline constexpr double wing_area = 300, chord = 11.32, reference_xcg = 0.35;

// Forces over mass along the body's axes, moment over inertia.
struct Loads {
  double x, z, pitch;
};

inline Loads loads(const Eigen::VectorXd& v, double elevator, const Eigen::VectorXd& p) {
  const double V = v[0], q = v[3], altitude = p[0], xcg = p[1];
  const double a = at_alpha(v[1] * 180 / std::numbers::pi), e = at_elevator(elevator);
  const Air here = air(altitude);
  const double QS = 0.5 * here.density * V * V * wing_area;
  const double q_hat = chord * q / (2 * V);
  const double Cx = between(C_x, e, a) + q_hat * between(C_xq, a);
  const double Cz = between(C_z, a) - 0.19 * elevator / 25 + q_hat * between(C_zq, a);
  const double Cm = between(C_m, e, a) + q_hat * between(C_mq, a) + Cz * (reference_xcg - xcg);
  return {per_mass * (QS * Cx + thrust(v[4], altitude, V / here.sound)), per_mass * QS * Cz,
          per_inertia * QS * chord * Cm};
}

//   V' = X cos α + Z sin α - g sin γ,   α' = q + (Z cos α - X sin α + g cos γ)/V,   γ = θ - α
inline Eigen::VectorXd rates(const Eigen::VectorXd& v, const Eigen::VectorXd& u,
                             const Eigen::VectorXd& p) {
  const double V = v[0], alpha = v[1], gamma = v[2] - alpha, q = v[3];
  const auto [X, Z, pitch] = loads(v, u[1], p);
  Eigen::VectorXd d(5);
  d << X * std::cos(alpha) + Z * std::sin(alpha) - gravity * std::sin(gamma),
      q + (Z * std::cos(alpha) - X * std::sin(alpha) + gravity * std::cos(gamma)) / V, q, pitch,
      power_rate(v[4], commanded_power(u[0]));
  return d;
}

// Flight path, and the load factor at the pilot's position 15 ft ahead of the centre of gravity
// [g].
inline Eigen::VectorXd outputs(const Eigen::VectorXd& v, const Eigen::VectorXd& u,
                               const Eigen::VectorXd& p) {
  const Loads at = loads(v, u[1], p);
  return Eigen::Vector2d{v[2] - v[1], (15 * at.pitch - at.z) / gravity};
}

// A function with a simple zero at each inner entry of a table of n; `at` counts them from 0.
inline double kinks(double at, double n) {
  return std::sin(std::numbers::pi * std::clamp(at, 0.5, n - 1.5));
}

inline tiltrim::Model longitudinal() {
  tiltrim::Model m;
  m.name = "F-16";
  m.mode_names = tiltrim::aircraft_modes();
  m.states = {{"V", "ft/s", 10},
              {"alpha", "rad", 0.1},
              {"theta", "rad", 0.1},
              {"q", "rad/s", 0.1},
              {"power", "%", 10}};
  m.inputs = {{"throttle", "", 0.1}, {"elevator", "deg", 1}};
  m.outputs = {{"gamma", "rad", 0.1}, {"load", "g", 0.1}};
  m.parameters = {{"altitude", "ft", 1000}, {"xcg", "", 0.1}};
  m.f = rates;
  m.h = outputs;
  using Point = tiltrim::OperatingPoint;
  m.switches = {
      {"an entry of the tables over alpha",
       [](const Point& at) { return kinks(at_alpha(at.x[1] * 180 / std::numbers::pi), 12); }},
      {"an entry of the tables over the elevator",
       [](const Point& at) { return kinks(at_elevator(at.u[1]), 5); }},
      {"an entry of the thrust over Mach",
       [](const Point& at) { return kinks(at.x[0] / air(at.p[0]).sound / 0.2, 6); }},
      {"an entry of the thrust over the altitude",
       [](const Point& at) { return kinks(at.p[0] / 10000, 6); }},
      {"the atmosphere's jump", [](const Point& at) { return at.p[0] - 35000; }},
      {"the afterburner's power", [](const Point& at) { return at.x[4] - 50; }},
      {"the throttle's kink", [](const Point& at) { return at.u[0] - 0.77; }}};
  return m;
}

}  // namespace f16
