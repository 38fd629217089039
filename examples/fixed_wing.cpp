// The Boeing 747-100 at 40,000 ft, Mach 0.8, from its published longitudinal derivatives.
// B. Etkin, L. D. Reid: Dynamics of Flight, 3rd ed., Wiley, 1996, section 6.2.               [2]
#include <cmath>
#include <cstdio>

#include "linearize/modes.hpp"
#include "trim/trim.hpp"
#include "vehicles/mode_names.hpp"

using Eigen::VectorXd;

// Small perturbations of level flight, in ft, s, rad:
// u' = X_u u + X_w w - g θ,  w' = Z_u u + Z_w w + Z_q q,  q' = M_u u + M_w w + M_q q,  θ' = q
tiltrim::Model longitudinal() {
  tiltrim::Model m;
  m.name = "Boeing 747-100";
  m.mode_names = tiltrim::aircraft_modes();
  m.states = {{"u", "ft/s", 10}, {"w", "ft/s", 10}, {"q", "rad/s", 0.1}, {"theta", "rad", 0.1}};
  m.parameters = {{"X_u", "1/s", 0.01},      {"X_w", "1/s", 0.01},      {"g", "ft/s²", 10},
                  {"Z_u", "1/s", 0.1},       {"Z_w", "1/s", 0.1},       {"Z_q", "ft/s", 100},
                  {"M_u", "1/(ft s)", 1e-4}, {"M_w", "1/(ft s)", 1e-3}, {"M_q", "1/s", 0.1}};
  m.f = [](const VectorXd& x, const VectorXd&, const VectorXd& p) -> VectorXd {
    return Eigen::Vector4d{p[0] * x[0] + p[1] * x[1] - p[2] * x[3],
                           p[3] * x[0] + p[4] * x[1] + p[5] * x[2],
                           p[6] * x[0] + p[7] * x[1] + p[8] * x[2], x[2]};
  };
  return m;
}

int main() {
  const tiltrim::Model m = longitudinal();
  const auto states = names(m.states);
  const tiltrim::OperatingPoint guess = point_of(m, {{"u", 10},
                                                     {"w", 5},
                                                     {"q", 0.1},
                                                     {"theta", 0.1},
                                                     {"X_u", -0.006868},
                                                     {"X_w", 0.01395},
                                                     {"g", 32.2},
                                                     {"Z_u", -0.09055},
                                                     {"Z_w", -0.3151},
                                                     {"Z_q", 773.98},
                                                     {"M_u", 0.0001187},
                                                     {"M_w", -0.001026},
                                                     {"M_q", -0.4285}});
  const tiltrim::TrimResult level = trim(m, {.free = states, .steady = states}, guess);
  std::printf("%s\n", to_string(level.status).c_str());
  if (!level) return 1;
  // The book prints -0.3719 ± 0.8875i and -0.003289 ± 0.06723i.
  for (const tiltrim::Mode& mode : modes(linearize(m, level.point)).modes)
    if (mode.eigenvalue.imag() > 0)
      std::printf("%s: %.4g +- %.4gi, period %.1f s, half in %.1f s\n", mode.name.c_str(),
                  mode.eigenvalue.real(), mode.eigenvalue.imag(),
                  2 * std::acos(-1.0) / mode.eigenvalue.imag(), mode.time_to_half());
}
