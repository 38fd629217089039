// Slips in the control law and the closed loop, (7)-(15).
#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "linearize/modes.hpp"
#include "model/lookup.hpp"
#include "tables/slips.hpp"
#include "vehicles/tiltrotor/corridor.hpp"
#include "vehicles/tiltrotor/formulations.hpp"
#include "vehicles/tiltrotor/numbers.hpp"

namespace tiltrim::slips {

namespace {

using Eigen::Index;
using Eigen::VectorXd;

using std::numbers::pi;
constexpr double rounding = 1e-9;  // of sums that vanish identically, relative

// The law with γ̃ = γ - γd and the airframe unchanged: f at (-γ_err, γd - 2 γ_err) has the same γ,
// and the law sees the opposite sign.
Model with_path_error_turned(const Model& loop) {
  const Index error = index_of(loop.states, "gamma_err", "state");
  const Index command = index_of(loop.parameters, "gamma", "parameter");
  const auto turned = [error, command](const decltype(Model::f)& g) -> decltype(Model::f) {
    return [g, error, command](const VectorXd& x, const VectorXd& u, const VectorXd& p) {
      VectorXd x2 = x, p2 = p;
      p2[command] -= 2 * x[error];
      x2[error] = -x[error];
      return g(x2, u, p2);
    };
  };
  Model model = loop;
  model.name += ", path error as printed in (7)";
  model.f = turned(loop.f);
  model.h = turned(loop.h);
  model.derivatives = nullptr;
  model.enclosure = nullptr;
  return model;
}

Slip path_error_sign(const Source& s) {
  Slip slip{"(7), definition of the path error",
            "gamma - gamma_d",
            "gamma_d - gamma, as (14) uses it",
            "the closed loop of the first is unstable with gains that stabilize the second",
            {}};
  for (const CorrectedColumn& column : s.free_pitch.columns) {
    if (!column.trim) continue;
    const Model loop = closed_loop(s.vehicle);
    const LinearModel linear = linearize(with_path_error_turned(loop), column.trim.point);
    if (!linear) continue;
    const Modes found = modes(linear);
    slip.evidence.push_back({"largest real part with gamma - gamma_d, " + column.name,
                             found.spectral_abscissa, "1/s", found.verdict == Verdict::unstable});
  }
  return slip;
}

Slip sine_of_difference() {
  constexpr double error = 0.1;  // rad
  const double gamma_d = corridor(0.0).gamma;
  const double energy = std::sin(gamma_d) - std::sin(gamma_d - error);
  return {
      "(7) next to (6)",
      "He, Le with sin(gamma_d - gamma)",
      "sin(gamma_d) - sin(gamma), which (6) divided by m g V gives",
      "the two agree near level flight only; in the climb the energy rate depends on a path error "
      "to second order, He to first (kept as printed in the model)",
      {{"energy-rate error of 0.1 rad off a vertical climb, by (6)", energy, "", energy < 0.006},
       {"the same by (7)", std::sin(error), "", std::sin(error) > 0.09}}};
}

Slip commanded_acceleration(const Source& s) {
  return {"after (13), the commanded acceleration",
          "Vd' = kV (Vd - V)/g",
          "Vd' = kV (Vd - V)",
          "(13) and (14) have Vd'/g = kV (Vd - V)/g, which is the second; the first is smaller by "
          "g and "
          "has other units",
          {{"factor between the two", s.vehicle.aircraft.gravity, "m/s²",
            s.vehicle.aircraft.gravity > 1}}};
}

// At an equilibrium He = Le = 0: (8) is then â1s = K_Li x2.
Slip cyclic_not_solved(const Source& s) {
  Slip slip{"(13), cyclic",
            "[KLp (... + D/(m g)) + KLi x2]/(1 + KLp)",
            "KLp Le + KLi x2 with Le of (11), in which cyclic acts through cos(alpha + eta - a1s)",
            "(8) and (11) give (13) only if Ep theta0 cos(...) is replaced by a1s itself; the loop "
            "still has equilibria, with another x2 (kept as printed in the model)",
            {}};
  const CorrectedColumn& climb = s.free_pitch.columns[0];
  if (!climb.trim) return slip;
  const Gains& k = s.vehicle.gains;
  const double x2 = climb.trim.point.x[5];
  const double printed = *climb.a1s - k.k_pa * *climb.theta;
  slip.evidence = {{"cyclic without pitch feedback by (13), reference climb", printed, "rad",
                    std::isfinite(printed)},
                   {"the same by (8)", k.K_Li * x2, "rad", std::abs(k.K_Li * x2 - printed) > 0.1}};
  return slip;
}

// Non-equilibrium points at which identities of the closed loop are tested.
std::vector<OperatingPoint> trial_points(const Vehicle& vehicle) {
  std::vector<OperatingPoint> points;
  for (const Command& c :
       {Command{2, pi / 2, pi / 2}, Command{6, pi / 4, pi / 4}, Command{15, 0, 0}}) {
    VectorXd x(6);
    x << 0.3, -0.2, 0.1, 0.05, 0.7, -1.1;
    points.push_back({x, VectorXd(0), closed_loop_parameters(vehicle, c)});
  }
  return points;
}

// Largest |x1' + x2' - 2 V_err'/g| over the trial points.
double drift_of_integrals(const Vehicle& vehicle) {
  const Model loop = closed_loop(vehicle);
  double largest = 0.0;
  for (const OperatingPoint& at : trial_points(vehicle)) {
    const VectorXd rate = evaluate(loop, at).rates;
    largest =
        std::max(largest, std::abs(rate[4] + rate[5] - 2 * rate[0] / vehicle.aircraft.gravity));
  }
  return largest;
}

double smallest_eigenvalue(const Vehicle& vehicle) {
  const Model loop = closed_loop(vehicle);
  double largest = 0.0;
  for (const OperatingPoint& at : trial_points(vehicle)) {
    const Eigen::MatrixXd A = loop.derivatives(at, {0, 1, 2, 3, 4, 5}).topRows(6);
    double smallest = std::numeric_limits<double>::infinity();
    for (const Mode& m : modes(A).modes) smallest = std::min(smallest, m.frequency());
    largest = std::max(largest, smallest);
  }
  return largest;
}

Slip conserved(const Source& s) {
  Vehicle printed = s.vehicle;
  printed.equations = Equations::printed;
  const double drift = drift_of_integrals(printed);
  const double consistent = drift_of_integrals(s.vehicle);
  const double zero = smallest_eigenvalue(printed);
  return {
      "(14), first row, and the claim of stability",
      "(Vd - V)' = kV (Vd - V) - V'",
      "(Vd - V)' = -V' at constant Vd; kV (Vd - V) stays in He and Le as the commanded "
      "acceleration",
      "as printed the fifth and sixth rows add up to 2/g times the first, so x1 + x2 - 2 (Vd - "
      "V)/g "
      "never changes: one eigenvalue is zero for any gains, at any condition, and not all are in "
      "the left half plane",
      {{"largest |x1' + x2' - 2 (Vd - V)'/g| of (14) as printed, at three points", drift, "",
        drift < rounding},
       {"the same of the consistent loop", consistent, "", consistent > 0.01},
       {"smallest |eigenvalue| of (14) as printed, the largest of three points", zero, "1/s",
        zero < 1e-6}}};
}

// Row five is row one over -g wherever the errors vanish.
Slip repeated_row(const Source& s) {
  const Model loop = closed_loop(s.vehicle);
  double largest = 0.0;
  for (OperatingPoint at : trial_points(s.vehicle)) {
    at.x[0] = at.x[1] = 0.0;
    const VectorXd rate = evaluate(loop, at).rates;
    for (Index row : {4, 5})
      largest = std::max(largest, std::abs(rate[row] - rate[0] / s.vehicle.aircraft.gravity));
  }
  return {
      "(15)",
      "five rows for the equilibrium",
      "the first, the second and the moment, for theta, x1 and x2; (9) for delta_e",
      "the last row repeats the first divided by -g, and nothing in (15) determines the elevator",
      {{"largest difference of the last rows from the first over g, at three points", largest, "",
        largest < rounding}}};
}

Slip moving_command(const Source& s) {
  constexpr double h = 60.0, step = 0.01;  // m
  const CorrectedColumn& transition = s.free_pitch.columns[1];
  const double slope = (corridor(h + step).gamma - corridor(h - step).gamma) / (2 * step);
  const double rate = slope * transition.condition.V * std::sin(transition.condition.gamma);
  return {"(15), second row, at Table 1's transition",
          "gamma_d' in the row of an equilibrium",
          "gamma_d' = 0: a point of the corridor with constant commands",
          "on (16) the command changes with height, so the transition is not an equilibrium of the "
          "flight; its eigenvalues are those of a frozen command",
          {{"gamma_d' on (16) at h = 60 m and 6 m/s", rate, "rad/s", rate < -0.01}}};
}

}  // namespace

std::vector<Slip> in_control_law(const Source& s) {
  return {path_error_sign(s), sine_of_difference(), commanded_acceleration(s), cyclic_not_solved(s),
          conserved(s),       repeated_row(s),      moving_command(s)};
}

}  // namespace tiltrim::slips
