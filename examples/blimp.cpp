// A blimp with a pitch damper, through every verb: trim, linearize, margins, sensitivities, follow,
// envelope, sweep, tune, simulate. A vehicle is a function that returns a Model; the library
// contains nothing specific to this one.
#include <algorithm>
#include <cstdio>
#include <map>
#include <numbers>

#include "follow/envelope.hpp"
#include "follow/follow.hpp"
#include "follow/sensitivity.hpp"
#include "linearize/margins.hpp"
#include "model/exact.hpp"
#include "simulate/simulate.hpp"
#include "tune/tune.hpp"

using Eigen::VectorXd;

// Longitudinal motion in body axes about the centre of buoyancy. Added mass makes the hull heavier
// across than along, mz > mx, so that it tends to turn broadside (the Munk moment); the centre of
// gravity is low.
//   mx u' = T - mz w q - Du u|u| - N sin θ
//   mz w' = mx u q - Dw w|w| - L u w + N cos θ - Zδ u² δ
//   Jy q' = (mz - mx) u w - Dq u q - G sin θ + Mδ u² δ,   δ = trim - k_theta θ - k_q q
tiltrim::Model blimp() {
  tiltrim::Model m;
  m.name = "blimp";
  m.states = {{"u", "m/s", 1.0}, {"w", "m/s", 1.0}, {"pitch", "rad", 0.1}, {"q", "rad/s", 0.1}};
  m.inputs = {{"thrust", "N", 10.0}, {"trim_tab", "rad", 0.1}};
  m.outputs = {{"climb_angle", "rad", 0.1}, {"law", "rad", 0.1}};
  m.parameters = {{"heaviness", "N", 1.0}, {"k_theta", "", 0.1}, {"k_q", "s", 0.1}};
  const auto law = [](auto x, auto p) { return -(p[1] * x[2] + p[2] * x[3]); };
  const auto f = [law](auto x, auto u, auto p, auto rates) {
    constexpr double mx = 24, mz = 40, Jy = 60, G = 80;
    const auto along = x[0], across = x[1], pitch = x[2], q = x[3], N = p[0];
    const auto elevator = u[1] + law(x, p);
    rates[0] = (u[0] - mz * across * q - 0.9 * along * abs(along) - N * sin(pitch)) / mx;
    rates[1] = (mx * along * q - 9 * across * abs(across) - 6 * along * across + N * cos(pitch) -
                0.4 * along * along * elevator) /
               mz;
    rates[2] = q;
    rates[3] = ((mz - mx) * along * across - 20 * along * q - G * sin(pitch) +
                3.0 * along * along * elevator) /
               Jy;
  };
  const auto h = [law](auto x, auto, auto p, auto outputs) {
    outputs[0] = x[2] - atan2(x[1], x[0]);
    outputs[1] = law(x, p);
  };
  m.mode_names = std::make_shared<const std::vector<tiltrim::ModeName>>(
      std::vector<tiltrim::ModeName>{{"pendulum", {"pitch", "q"}, true}, {"surge", {"u"}}});
  return exact_model(m, f, h);
}

// Level flight at a given speed u; the tab, the thrust and the attitude follow.
const tiltrim::TrimSpec level{.free = {"w", "pitch", "thrust", "trim_tab"},
                              .steady = {"u", "w", "q"},
                              .bounds = {{"climb_angle", {0, 0}}, {"trim_tab", {-0.4, 0.4}}},
                              .implied = {"pitch"}};

tiltrim::OperatingPoint at_speed(double u) {
  return point_of(blimp(), {{"u", u}, {"thrust", 50}, {"heaviness", 6}});  // the others are zero
}

int main() {
  const tiltrim::Model m = blimp();
  const tiltrim::TrimResult cruise = trim(m, level, at_speed(8));
  std::printf("trim: %s, thrust %.3f N, tab %.4f rad\n", to_string(cruise.status).c_str(),
              value_of(m, cruise.point, "thrust"), value_of(m, cruise.point, "trim_tab"));
  const tiltrim::LinearModel linear = linearize(m, cruise.point);
  const tiltrim::Modes found = modes(linear);
  for (const tiltrim::Mode& mode : found.modes)
    std::printf("mode: %.4f %+.4fi %s\n", mode.eigenvalue.real(), mode.eigenvalue.imag(),
                mode.name.c_str());
  std::printf("linearize: %s\n", to_string(found.verdict).c_str());

  const tiltrim::Sensitivities s = sensitivities(m, level, cruise.point);
  std::printf("sensitivities: %zu parameters\n", s.parameters.size());
  const tiltrim::Branch slower = follow(m, level, cruise.point, "u", 1.0);
  std::printf("follow: %s at u = %.3f m/s, %s\n", to_string(slower.end).c_str(),
              slower.events.back().at.parameter, slower.events.back().which.c_str());
  const tiltrim::Envelope flown =
      envelope(m, level, cruise.point, {"u", {1, 12}, 23}, {"heaviness", {0, 20}, 21});
  std::printf("envelope: trims at %lld of %lld points\n",
              (long long)(flown.count.array() > 0).count(), (long long)flown.count.size());

  tiltrim::SweepAxis gain{"k_q", {{"k_q", "s", "k_q", {0, 0.5, 1, 1.5}, {0, 0.5, 1, 1.5}}}};
  tiltrim::SweepAxis speed{"u", {{"u", "m/s", "u", {4, 6, 8, 10}, {4, 6, 8, 10}}}};
  const tiltrim::SweepRequest request{"level", m, level, cruise.point, {"trim_tab"}};
  const tiltrim::SweepMap map = tiltrim::sweep({request}, {gain, speed});
  std::printf("sweep: %lld of %zu points stable\n",
              (long long)std::ranges::count(map.verdict, std::int8_t(tiltrim::Verdict::stable)),
              map.points());

  tiltrim::TuneProblem problem;
  for (const double u : {4.0, 8.0, 10.0})
    problem.points.push_back({"level", m, level, at_speed(u), {"trim_tab"}});
  problem.gains = {{"k_theta", 0.01, 5.0}, {"k_q", 0.01, 5.0}};
  problem.limits = {{tiltrim::Measure::damping, 0.5}};
  const tiltrim::TuneResult best = tune(problem, {.evaluations = 400});
  std::printf("tune: %s, decay %.3f 1/s\n", to_string(best.status).c_str(), best.goal);

  const std::map<std::string, double> gains{{"k_theta", best.gains[0]}, {"k_q", best.gains[1]}};
  const tiltrim::TrimResult held = trim(m, level, changed(m, cruise.point, gains));
  const tiltrim::Margins margin = margins(opened(linearize(m, held.point), "trim_tab", "law"));
  std::printf("margins: phase %.1f degrees\n", margin.phase * 180 / std::numbers::pi);
  const tiltrim::Simulation motion =
      simulate(m, held.point, 60.0, {{.signal = "trim_tab", .size = 0.05, .from = 1, .to = 3}});
  const VectorXd off = motion.x.col(motion.x.cols() - 1) - held.point.x;
  std::printf("simulate: %s, back to trim within %.0e\n", to_string(motion.status).c_str(),
              off.cwiseAbs().maxCoeff());
}
