// Tables 1-3 compared with the paper's own equations.
#include "tables/tables.hpp"

#include <fmt/core.h>

#include <cmath>
#include <numbers>

#include "vehicles/tiltrotor/corridor.hpp"

namespace tiltrim {

namespace {

using std::numbers::pi;
constexpr double half_turn = pi;
constexpr double down = -pi / 2;                      // the path angle implied by Table 3
constexpr Columns<double> heights{0.0, 60.0, 120.0};  // m, of Table 1's columns on (16)
constexpr double no_authority = 1e-9;  // |cos alpha| at which the elevator has no moment

Row row(std::string name, std::string unit, const Columns<Printed>& published,
        const Columns<std::optional<double>>& computed) {
  Row r{std::move(name), std::move(unit), {}};
  for (std::size_t i = 0; i < 3; ++i) r.cells[i] = compare(published[i], computed[i]);
  return r;
}

Columns<ForceBalance> table3_balance(const PublishedTables& p, const Identification& identified) {
  Columns<ForceBalance> columns;
  for (std::size_t i = 0; i < 3; ++i)
    columns[i] = solve_forces(identified.thrust_excess, identified.k, p.CL[i].value, p.CD[i].value,
                              down, p.alpha[i].value, p.eta[i].value);
  return columns;
}

std::string elevator_finding(const ElevatorAudit& audit, const PublishedTables& p) {
  const auto& c = audit.columns;
  return fmt::format(
      "M = 0 requires moment increments {:+.4f} ({}), {:+.4f} ({}), {:+.4f} ({}) from the "
      "elevator; divided by the printed deflections these are slopes dCM/dde of {:+.4f}, {:+.4f} "
      "and {:+.4f} /rad, where a linear elevator has a single one. (9) and (13) with theta = 0 "
      "give the printed a1s and delta_e only with K_Lp {:+.3f}, {:+.3f}, {:+.3f}: not a single "
      "positive gain either.",
      c[0].CM_increment, p.columns[0], c[1].CM_increment, p.columns[1], c[2].CM_increment,
      p.columns[2], c[0].slope, c[1].slope, c[2].slope, c[0].K_Lp, c[1].K_Lp, c[2].K_Lp);
}

Row elevator_row(const PublishedTables& published, const ElevatorAudit& elevator) {
  Columns<std::optional<double>> needed;
  for (std::size_t i = 0; i < 3; ++i) needed[i] = elevator.columns[i].delta_e;
  Row r = row("delta_e", "rad", published.delta_e, needed);
  for (std::size_t i = 0; i < 3; ++i) {
    const ElevatorColumn& c = elevator.columns[i];
    r.cells[i].remark = fmt::format(
        "the paper gives no elevator model; its row requires a moment increment of {:+.5f}, {}",
        c.CM_increment,
        c.delta_e ? "which the reference aircraft's elevator produces at the computed angle"
                  : "and at this angle of attack the reference aircraft's elevator produces none");
  }
  return r;
}

}  // namespace

ForceBalance solve_forces(double thrust_excess, double k, double CL, double CD, double gamma,
                          double alpha, double eta) {
  // (15), rows 1, 2:  Ep θ0 cos φ = k CD + sin γ,  Ep θ0 sin φ = -k CL - cos γ,  φ = α + η - a1s
  const double along = k * CD + std::sin(gamma);
  const double across = -k * CL - std::cos(gamma);
  const double thrust = std::hypot(along, across);
  const double a1s = std::remainder(alpha + eta - std::atan2(across, along), 2 * pi);
  if (std::abs(a1s) <= pi / 2) return {thrust / thrust_excess, a1s};
  return {-thrust / thrust_excess, a1s - std::copysign(half_turn, a1s)};
}

Table recompute_table1(const PublishedTables& published) {
  Columns<std::optional<double>> eta, gamma, alpha, V;
  for (std::size_t i = 0; i < 3; ++i) {
    const Command command = corridor(heights[i]);
    eta[i] = command.eta;
    gamma[i] = command.gamma;
    alpha[i] = 0.0 - command.gamma;  // theta = 0
    V[i] = command.V;
  }
  Table t{"Table 1: operation values", {}, {}};
  t.rows = {row("eta", "rad", published.eta, eta), row("gamma", "rad", published.gamma, gamma),
            row("alpha", "rad", published.alpha, alpha), row("V", "m/s", published.V, V)};
  t.rows[1].cells[0].remark =
      "sign slip: (16) starts at +pi/2, and the printed alpha follows from +pi/2 with theta = 0; "
      "with "
      "-pi/2 this is a descent";
  t.rows[3].cells[1].remark =
      "slip: (14) divides by Vd; the computed speed is the corridor's at 60 m, chosen here between "
      "the paper's 2 and 15 m/s";
  t.notes = {
      "computed: schedule (16) at heights 0, 60 and 120 m, and alpha = theta - gamma with theta "
      "= 0"};
  return t;
}

Table recompute_table2(const PublishedTables& published, const Polar& anchored) {
  Columns<std::optional<double>> CL, CD, CM;
  for (std::size_t i = 0; i < 3; ++i) {
    const Coefficients c = anchored.at(published.alpha[i].value);
    CL[i] = c.CL;
    CD[i] = c.CD;
    CM[i] = c.CM;
  }
  return {
      "Table 2: aerodynamic coefficients",
      {row("CL", "", published.CL, CL), row("CD", "", published.CD, CD),
       row("CM", "", published.CM, CM)},
      {"computed: the spline through table2_anchored.csv, a reconstruction of the paper's curves "
       "that is made to pass through these nine numbers, at Table 1's angles of attack"}};
}

Table recompute_table3(const PublishedTables& published, const Identification& identified,
                       const ElevatorAudit& elevator) {
  const auto balance = table3_balance(published, identified);
  Columns<std::optional<double>> theta0, a1s;
  for (std::size_t i = 0; i < 3; ++i) {
    theta0[i] = balance[i].theta0;
    a1s[i] = balance[i].a1s;
  }
  Table t{"Table 3: control inputs", {}, {}};
  t.rows = {row("theta0", "", published.theta0, theta0), elevator_row(published, elevator),
            row("a1s", "rad", published.a1s, a1s)};
  for (std::size_t i = 0; i < 3; ++i) {
    Cell& cell = t.rows[0].cells[i];
    if (cell.agreement == Agreement::opposite_sign)
      cell.remark =
          "sign slip: with the a1s printed next to it, (15) at gamma = -pi/2 has theta0 of the "
          "other sign, as in the other columns";
  }
  t.notes = {
      fmt::format("computed: the first two rows of (15) as printed, at gamma = -pi/2 in all three "
                  "columns, with Ep = {:.4f} and V + vi = {:.4f} m/s",
                  identified.thrust_excess, identified.effective_speed)};
  return t;
}

ElevatorAudit audit_elevator(const PublishedTables& published, const Identification& identified,
                             const Vehicle& vehicle) {
  const Aircraft paper;
  const auto balance = table3_balance(published, identified);
  const double k = identified.k;
  ElevatorAudit audit;
  for (std::size_t i = 0; i < 3; ++i) {
    const auto& [theta0, a1s] = balance[i];
    ElevatorColumn& c = audit.columns[i];
    // (xR sin(η - a1s) - zH sin a1s) Ep m g θ0 + ½ρ(V + vi)² S c̄ CM = 0
    const double arm =
        paper.rotor_x * std::sin(published.eta[i].value - a1s) - paper.rotor_z * std::sin(a1s);
    c.CM_thrust = arm * identified.thrust_excess * theta0 / (k * paper.chord);
    c.CM_required = -c.CM_thrust;
    c.CM_published = published.CM[i].value;
    c.CM_increment = c.CM_required - c.CM_published;
    c.slope = c.CM_increment / published.delta_e[i].value;
    // (13): (1 + K_Lp) a1s = K_Lp (sin γ + D/(m g)) + K_Li x2,  (9): δe = K_Li x2
    const double common = std::sin(down) + k * published.CD[i].value;
    c.K_Lp =
        (published.delta_e[i].value - published.a1s[i].value) / (published.a1s[i].value - common);
    const double per_radian = vehicle.aircraft.CM_de * std::cos(published.alpha[i].value);
    if (std::abs(per_radian) > no_authority) c.delta_e = c.CM_increment / per_radian;
  }
  audit.finding = elevator_finding(audit, published);
  return audit;
}

}  // namespace tiltrim
