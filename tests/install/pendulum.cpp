// A damped pendulum held at 0.3 rad by a torque: trimmed, linearized, its modes printed.
#include <cmath>
#include <cstdio>
#include <tiltrim/linearize/linearize.hpp>
#include <tiltrim/linearize/modes.hpp>
#include <tiltrim/model/model.hpp>
#include <tiltrim/trim/trim.hpp>

int main() {
  constexpr double g_over_l = 9.81, damping = 0.5, angle = 0.3;
  tiltrim::Model pendulum;
  pendulum.name = "pendulum";
  pendulum.states = {{"angle", "rad", 0.1}, {"rate", "rad/s", 0.1}};
  pendulum.inputs = {{"torque", "1/s²", 1.0}};
  pendulum.f = [=](const auto& x, const auto& u, const auto&) -> Eigen::VectorXd {
    return Eigen::Vector2d{x[1], u[0] - g_over_l * std::sin(x[0]) - damping * x[1]};
  };

  const tiltrim::TrimSpec hold{.free = {"rate", "torque"}, .still = {"angle", "rate"}};
  const tiltrim::OperatingPoint guess{Eigen::Vector2d{angle, 0.0}, Eigen::VectorXd::Zero(1), {}};
  const tiltrim::TrimResult held = tiltrim::trim(pendulum, hold, guess);
  const double torque = held.point.u[0];
  std::printf("%s: torque %.6f\n", to_string(held.status).c_str(), torque);
  if (!held || std::abs(torque - g_over_l * std::sin(angle)) > 1e-9) return 1;

  const tiltrim::Modes found = tiltrim::modes(tiltrim::linearize(pendulum, held.point));
  for (const tiltrim::Mode& mode : found.modes)
    std::printf("%.6f rad/s, damping %.6f\n", mode.frequency(), mode.damping());
  // λ² + c λ + (g/l) cos θ = 0
  const double frequency = std::sqrt(g_over_l * std::cos(angle));
  const bool right = found.modes.size() == 2 && found.verdict == tiltrim::Verdict::stable &&
                     std::abs(found.modes[0].frequency() - frequency) < 1e-6;
  return right ? 0 : 1;
}
