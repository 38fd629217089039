// A planar VTOL: hover trim by thrust and moment, then a position loop swept over its attitude
// gain. Both are written once for any scalar, so that the loop has exact derivatives.
#include <cmath>
#include <cstdio>

#include "linearize/modes.hpp"
#include "model/exact.hpp"
#include "model/feedback.hpp"
#include "sweep/sweep.hpp"

constexpr double mass = 4.0, inertia = 0.5, g = 9.81;

// m x" = -T sin θ,   m z" = T cos θ - m g,   I θ" = M
tiltrim::Model vtol() {
  tiltrim::Model model;
  model.name = "planar VTOL";
  model.states = {{"x", "m", 1},    {"vx", "m/s", 1},      {"z", "m", 1},
                  {"vz", "m/s", 1}, {"theta", "rad", 0.1}, {"q", "rad/s", 0.1}};
  model.inputs = {{"thrust", "N", 10}, {"moment", "N m", 1}};
  return exact_model(model, [](auto x, auto u, auto, auto rates) {
    rates[0] = x[1];
    rates[1] = -u[0] / mass * sin(x[4]);
    rates[2] = x[3];
    rates[3] = u[0] / mass * cos(x[4]) - g;
    rates[4] = x[5];
    rates[5] = u[1] / inertia;
  });
}

// M = -I (k_q q + k_theta (θ - θc)),  g θc = k_x x + k_v vx,  T = m (g - 2 z - 3 vz)
tiltrim::Model hold() {
  tiltrim::Model law;
  law.name = "position hold";
  law.inputs = vtol().states;
  law.outputs = vtol().inputs;
  law.parameters = {
      {"k_theta", "1/s²", 1}, {"k_q", "1/s", 1}, {"k_x", "1/s²", 1}, {"k_v", "1/s", 1}};
  return exact_model(law, {}, [](auto, auto x, auto k, auto outputs) {
    const auto aim = (k[2] * x[0] + k[3] * x[1]) / g;
    outputs[0] = mass * (g - 2 * x[2] - 3 * x[3]);
    outputs[1] = -inertia * (k[1] * x[5] + k[0] * (x[4] - aim));
  });
}

int main() {
  const tiltrim::TrimSpec hover{.free = {"theta", "thrust", "moment"}, .steady = {"vx", "vz", "q"}};
  const tiltrim::Model craft = vtol();
  const tiltrim::TrimResult held = trim(craft, hover, point_of(craft, {}));
  std::printf("%s: thrust %.4f N, moment %.4f N m\n", to_string(held.status).c_str(),
              value_of(craft, held.point, "thrust"),
              std::abs(value_of(craft, held.point, "moment")));
  if (!held) return 1;

  const tiltrim::Model loop = feedback(vtol(), hold());
  const auto states = names(loop.states);
  const tiltrim::SweepRequest request{
      .name = "hover",
      .model = loop,
      .spec = {.free = states, .steady = states},
      .guess = point_of(loop, {{"k_theta", 6}, {"k_q", 4}, {"k_x", 0.75}, {"k_v", 1}}),
      .inputs = {}};
  const std::vector<double> gains = {1.5, 2.5, 3.5, 4.5, 5.5, 6.5};
  const tiltrim::SweepAxis axis{.name = "k_theta",
                                .columns = {{"k_theta", "1/s²", "k_theta", gains, gains}}};
  const tiltrim::SweepMap map = tiltrim::sweep({request}, {axis});
  for (std::size_t i = 0; i < gains.size(); ++i)
    std::printf(
        "k_theta %.1f: %s\n", gains[i],
        map.verdict[i] < 0 ? "no trim" : to_string(tiltrim::Verdict(map.verdict[i])).c_str());
  for (const tiltrim::AxisCrossing& c : map.crossings)  // Routh: k_q² k_x/(k_v (k_q - k_v)) = 4
    std::printf("%s at k_theta = %.6f, %.6f rad/s\n", to_string(c.kind).c_str(), c.at[0],
                c.frequency);
}
