// Slips in Tables 1-3.
#include <fmt/core.h>

#include <cmath>
#include <numbers>

#include "tables/slips.hpp"
#include "vehicles/tiltrotor/corridor.hpp"

namespace tiltrim::slips {

namespace {

using std::numbers::pi;

Slip climb_descends(const Source& s) {
  const double gamma = s.published.gamma[0].value, alpha = s.published.alpha[0].value;
  const double V = s.published.V[0].value;
  return {
      "Table 1, climb",
      "gamma_d = -pi/2",
      "gamma_d = +pi/2",
      "theta = alpha + gamma: the printed pair is inverted flight, and with theta = 0 a path angle "
      "of -pi/2 is a descent; (16) starts at +pi/2",
      {{"vertical speed at the printed gamma", V * std::sin(gamma), "m/s", V * std::sin(gamma) < 0},
       {"theta of the printed alpha and gamma", alpha + gamma, "rad", alpha + gamma < -3},
       {"gamma_d of (16) at h = 0", corridor(0).gamma, "rad", corridor(0).gamma > 1.57}}};
}

Slip no_speed(const Source& s) {
  const double V = s.published.V[1].value;
  return {"Table 1, transition",
          "Vd = 0",
          "an airspeed of the corridor",
          "the second row of (14) and (15) divides by Vd",
          {{"Vd printed", V, "m/s", V == 0.0},
           {"airspeed chosen here for the corrected table", s.free_pitch.columns[1].condition.V,
            "m/s", s.free_pitch.columns[1].condition.V > 0}}};
}

Slip level_attitude(const Source& s) {
  Slip slip{"Table 1 compared with Fig. 5",
            "alpha_d = -gamma_d: theta = 0 at every point",
            "theta of the equilibrium",
            "the paper's own flight settles near 0.2 rad in the climb and 0.15 rad in level "
            "flight; the reference aircraft does not trim at zero either",
            {}};
  for (const CorrectedColumn& c : s.free_pitch.columns)
    if (c.theta)
      slip.evidence.push_back({"theta of the reference aircraft, " + c.name, *c.theta, "rad",
                               std::abs(*c.theta) > 0.01});
  return slip;
}

Slip lift_convention(const Source& s) {
  const double steep = s.section.at(s.published.alpha[1].value).CL;
  const double level = s.section.at(s.published.alpha[2].value).CL;
  const double CL1 = s.published.CL[1].value, CL2 = s.published.CL[2].value;
  return {"Table 2, CL",
          "CL(-45°) = 1.3229 with CL(0) = 0.1792",
          "one sign convention",
          "the NACA 8-H-12 polar changes sign between the two angles; the printed pair does not",
          {{"CL printed at -45°", CL1, "", CL1 > 0},
           {"CL of the polar at -45°, positive up", steep, "", steep < 0},
           {"CL printed at 0", CL2, "", CL2 > 0},
           {"CL of the polar at 0, positive up", level, "", level > 0}}};
}

Slip moment_convention(const Source& s) {
  const double steep = s.section.at(s.published.alpha[1].value).CM;
  const double climb = s.section.at(s.published.alpha[0].value).CM;
  const double CM0 = s.published.CM[0].value, CM1 = s.published.CM[1].value;
  return {
      "Table 2, CM",
      "CM(-90°) = 0.6145 with CM(-45°) = -0.1707",
      "one sign beyond the stall",
      "in the NACA 8-H-12 polar the moment about the quarter chord keeps its sign between the two "
      "angles",
      {{"product of the printed pair", CM0 * CM1, "", CM0 * CM1 < 0},
       {"product of the polar's pair", climb * steep, "", climb * steep > 0}}};
}

Slip drag_of_wing(const Source& s) {
  const double printed = s.published.CD[0].value;
  const double section = s.section.at(s.published.alpha[0].value).CD;
  return {
      "Table 2, CD",
      "CD(-90°) = 3.4994",
      "about 2 for a section in a free stream",
      "published values for airfoils normal to the flow lie between 1.8 and 2.1 (data/README.md)",
      {{"printed over the polar's", printed / section, "", printed > 1.5 * section}}};
}

Slip one_condition(const Source& s) {
  const Identification& id = s.identified;
  Slip slip{"Table 3, rows theta0 and a1s",
            "three flight conditions",
            "one: gamma = -pi/2 and one V + vi, with Table 2's coefficients changed",
            "two constants reproduce six numbers to every printed digit, and each column alone "
            "gives the same two",
            {}};
  slip.evidence.push_back(
      {"largest distance from the middle of the interval of the digits (0.5 allowed)", id.worst,
       "units of the last digit", id.status == IdentifyStatus::reproduced});
  for (std::size_t i = 0; i < 3; ++i) {
    const ColumnConstants& c = id.columns[i];
    slip.evidence.push_back(
        {fmt::format("Ep from {} alone, middle", s.published.columns[i]),
         0.5 * (c.thrust_excess.lower + c.thrust_excess.upper), "",
         c.thrust_excess.lower <= id.thrust_excess && id.thrust_excess <= c.thrust_excess.upper});
    slip.evidence.push_back({fmt::format("k from {} alone, middle", s.published.columns[i]),
                             0.5 * (c.k.lower + c.k.upper), "",
                             c.k.lower <= id.k && id.k <= c.k.upper});
  }
  return slip;
}

// (15), rows 1 and 2, at the column's gamma, phi = -a1s as printed; L up or down.
struct Own {
  double k, thrust;  // ½ρ(V + vi)²S/(m g), Ep θ0
};
Own at_own_condition(const PublishedTables& p, std::size_t i, double gamma, double up) {
  // Ep θ0 (cos φ, sin φ) = (k CD + sin γ, up cos γ - k CL),  up = -1 as printed
  const double slope = std::tan(-p.a1s[i].value);
  const double k =
      (up * std::cos(gamma) - slope * std::sin(gamma)) / (p.CL[i].value + slope * p.CD[i].value);
  return {k, (k * p.CD[i].value + std::sin(gamma)) / std::cos(p.a1s[i].value)};
}

Slip not_own_condition(const Source& s) {
  Slip slip{"Table 3, transition and level flight",
            "equilibria at gamma_d = pi/4 and 0",
            "not equilibria there: they are at gamma = -pi/2",
            "at their gamma_d the first two rows of (15) with the printed a1s need a negative "
            "dynamic pressure; with lift up, L/D of Table 2 determines the thrust, and at gamma = "
            "0 it is far from the printed one",
            {}};
  for (std::size_t i : {1u, 2u}) {
    const Own own = at_own_condition(s.published, i, s.published.gamma[i].value, -1.0);
    slip.evidence.push_back(
        {fmt::format("½ρ(V + vi)²S/(m g) that (15) needs, {}", s.published.columns[i]), own.k, "",
         own.k < 0});
  }
  const double printed = std::abs(s.published.theta0[2].value);
  const double thrust = std::abs(at_own_condition(s.published, 2, 0.0, 1.0).thrust);
  slip.evidence.push_back(
      {"Ep |theta0| at gamma = 0 with lift up, V and vi free", thrust, "", thrust < 0.2 * printed});
  slip.evidence.push_back(
      {"Ep |theta0| printed, at least with Ep = 1", printed, "", printed > 0.7});
  return slip;
}

Slip lift_and_weight(const Source& s) {
  const double V = s.published.V[2].value;
  const double share =
      0.5 * paper.air_density * V * V * paper.wing_area * s.published.CL[2].value / weight;
  return {
      "Tables 1 and 2, level flight",
      "Vd = 15 m/s with CL = 0.1792, theta = 0",
      "a faster flight, or theta > 0",
      "the wing supports less than half the weight, and the nacelles point forward",
      {{"lift over weight at 15 m/s without wake", share, "", share < 0.5},
       {"airspeed at which that CL supports the weight", V / std::sqrt(share), "m/s", share < 1}}};
}

Slip climb_sign(const Source& s) {
  Slip slip{
      "Table 3, theta0 of the climb",
      "+0.60807",
      "-0.60807 with a1s = -0.002555, with (15) as printed",
      "the other two columns follow (15). The climb's pair solves (1) as printed instead, in which "
      "thrust at eta = pi/2 points down; level flight solves both, the transition only (15)",
      {}};
  const ForceBalance b = solve_forces(s.identified.thrust_excess, s.identified.k,
                                      s.published.CL[0].value, s.published.CD[0].value, -pi / 2,
                                      s.published.alpha[0].value, s.published.eta[0].value);
  slip.evidence.push_back({"theta0 of (15) in the climb", b.theta0, "", b.theta0 < 0});
  slip.evidence.push_back({"a1s with it", b.a1s, "rad", b.a1s < 0});
  for (const Evidence& e : climb_from_body_axes(s)) slip.evidence.push_back(e);
  return slip;
}

Slip thrust_backwards(const Source& s) {
  Slip slip{"Table 3, negative theta0",
            "-0.66627 and -0.71378",
            "theta0 between 0 and 1",
            "by (4) the rotors push backwards with nearly the whole weight: reversed thrust "
            "balances the descent at gamma = -pi/2",
            {}};
  for (std::size_t i : {1u, 2u}) {
    const double thrust = s.identified.thrust_excess * s.published.theta0[i].value;
    slip.evidence.push_back(
        {fmt::format("thrust over weight, {}", s.published.columns[i]), thrust, "", thrust < -0.9});
  }
  return slip;
}

Slip elevator_row(const Source& s) {
  const ElevatorAudit audit = audit_elevator(s.published, s.identified, s.vehicle);
  Slip slip{"Table 3, row delta_e",
            "-0.5245, -0.2376, 0.07832",
            "an elevator model",
            "neither one linear elevator nor the control law (9) gives the three values",
            {}};
  double least = audit.columns[0].slope, most = least;
  for (const ElevatorColumn& c : audit.columns) {
    least = std::min(least, c.slope);
    most = std::max(most, c.slope);
  }
  for (std::size_t i = 0; i < 3; ++i) {
    const ElevatorColumn& c = audit.columns[i];
    slip.evidence.push_back({fmt::format("dCM/dde implied, {}", s.published.columns[i]), c.slope,
                             "1/rad", most - least > 1});
    slip.evidence.push_back(
        {fmt::format("K_Lp implied by (9) and (13), {}", s.published.columns[i]), c.K_Lp, "",
         c.K_Lp < 0 || i == 2});
  }
  return slip;
}

}  // namespace

std::vector<Slip> in_tables(const Source& s) {
  return {climb_descends(s),    no_speed(s),     level_attitude(s),   lift_convention(s),
          moment_convention(s), drag_of_wing(s), one_condition(s),    not_own_condition(s),
          lift_and_weight(s),   climb_sign(s),   thrust_backwards(s), elevator_row(s)};
}

}  // namespace tiltrim::slips
