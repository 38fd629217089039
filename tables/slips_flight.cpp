// Slips in the schedule (16), the parameters, the text and the figures.
#include <boost/math/tools/toms748_solve.hpp>
#include <cmath>
#include <cstdint>
#include <numbers>

#include "tables/slips.hpp"
#include "vehicles/tiltrotor/corridor.hpp"

namespace tiltrim::slips {

namespace {

using std::numbers::pi;

Slip tilts_before(const Source& s) {
  constexpr double take_off = 55.0;  // m, height of the vertical climb in the text
  constexpr int panels = 550;
  const double off = s.vehicle.aircraft.cyclic_off;
  std::uintmax_t steps = 100;
  const auto [below, above] = boost::math::tools::toms748_solve(
      [off](double h) { return corridor(h).eta - off; }, 0.0, 120.0,
      boost::math::tools::eps_tolerance<double>(40), steps);
  double along = 0.0;  // ∫ cot γd dh, midpoints
  for (int i = 0; i < panels; ++i)
    along += take_off / panels / std::tan(corridor((i + 0.5) * take_off / panels).gamma);
  const double eta = corridor(take_off).eta * 180 / pi;
  return {
      "(16) compared with the text on Figs. 8 and 9",
      "vertical take-off to 55 m, then the transition starts",
      "the transition of (16) starts at the ground and is half done at 60 m",
      "the schedule tilts with height from h = 0",
      {{"nacelle tilt of (16) at 55 m", eta, "°", eta < 60},
       {"height at which (16) switches cyclic off", 0.5 * (below + above), "m", above < take_off},
       {"horizontal distance along gamma_d up to 55 m", along, "m", along > 1}}};
}

Slip velocity_names() {
  constexpr double theta = 0.2, V = 2.0;  // the climb of Fig. 5, Table 1
  const double alpha = theta - pi / 2;
  const double u = V * std::cos(alpha), w = V * std::sin(alpha);
  return {"Fig. 6, axes",
          "horizontal velocity u, vertical velocity w",
          "u and w are body axes in (1), w down",
          "in the plotted climb, body axes give other values than the curves, and w the other sign",
          {{"u of (1) in a vertical climb of 2 m/s at theta = 0.2 rad", u, "m/s", u > 0.3},
           {"w of (1) there", w, "m/s", w < 0}}};
}

Slip error_units(const Source& s) {
  const double weight = s.vehicle.aircraft.mass * s.vehicle.aircraft.gravity;
  const double slow = weight * 2.0, fast = weight * 15.0;
  return {"Fig. 7, axes",
          "Le in N m/s",
          "no unit: (7) is divided by m g V",
          "the power per unit of (7) grows with the speed",
          {{"m g V at 2 m/s", slow, "N m/s", slow > 1},
           {"m g V at 15 m/s", fast, "N m/s", fast > slow}}};
}

Slip inertia() {
  const Aircraft paper;
  const double radius = std::sqrt(paper.inertia_yy / paper.mass);
  const double half_span = 0.5 * paper.wing_area / paper.chord;
  return {"parameters, Iyy",
          "6.076 kg m²",
          "not known (kept as printed)",
          "all of the mass would lie farther from the center of gravity than the wing tips",
          {{"radius of gyration about the pitch axis", radius, "m", radius > half_span},
           {"half span, S/(2 cbar)", half_span, "m", half_span > 1}}};
}

Slip left_out(const Source& s) {
  return {"parameters",
          "Ep, R, g, the nine gains, every derivative in q and delta_e: not given",
          "Ep from Table 3; the rest assumed, with sources (data/README.md)",
          "without them neither Table 3 nor the eigenvalues can be recomputed",
          {{"Ep that Table 3 reveals", s.identified.thrust_excess, "",
            s.identified.status == IdentifyStatus::reproduced}}};
}

}  // namespace

std::vector<Slip> in_flight(const Source& s) {
  return {tilts_before(s), velocity_names(), error_units(s), inertia(), left_out(s)};
}

}  // namespace tiltrim::slips
