// The F-16 in level flight at sea level: trim and modes at each speed. The printed values are in
// data/references/f16.json.
#include "examples/f16.hpp"

#include <cstdio>

#include "linearize/modes.hpp"
#include "trim/trim.hpp"

// Level flight at a speed; one guess serves all of them.
tiltrim::TrimResult level(const tiltrim::Model& m, double V, double xcg) {
  const tiltrim::TrimSpec spec{.free = {"alpha", "theta", "power", "throttle", "elevator"},
                               .steady = {"V", "alpha", "q", "power"},
                               .bounds = {{"gamma", {0, 0}}},
                               .implied = {"theta"}};
  return trim(m, spec,
              point_of(m, {{"V", V},
                           {"alpha", 0.1},
                           {"theta", 0.1},
                           {"power", 10},
                           {"throttle", 0.2},
                           {"xcg", xcg}}));
}

int main() {
  const tiltrim::Model m = f16::longitudinal();
  std::printf("V [ft/s], throttle, alpha [deg], elevator [deg]\n");
  for (const double V : {130, 140, 150, 170, 200, 260, 300, 400, 500, 600, 700, 800}) {
    const tiltrim::TrimResult r = level(m, V, 0.35);
    std::printf("  %.0f %6.3f %5.1f %5.1f  %s\n", V, value_of(m, r.point, "throttle"),
                value_of(m, r.point, "alpha") * 180 / std::numbers::pi,
                value_of(m, r.point, "elevator"), to_string(r.status).c_str());
  }
  for (const double xcg : {0.30, 0.35, 0.38}) {
    const tiltrim::TrimResult r = level(m, 502, xcg);
    if (!r) return 1;
    const tiltrim::Modes found = modes(linearize(m, r.point));
    std::printf("xcg %.2f: %s\n", xcg, to_string(found.verdict).c_str());
    for (const tiltrim::Mode& mode : found.modes)
      if (mode.eigenvalue.imag() >= 0)
        std::printf("  %.4f %+.4fi, %s\n", mode.eigenvalue.real(), mode.eigenvalue.imag(),
                    mode.name.c_str());
  }
}
