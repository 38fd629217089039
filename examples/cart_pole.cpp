// An inverted pendulum on a cart, stabilized by linear state feedback with pole placement.
#include <cmath>
#include <cstdio>

#include "linearize/modes.hpp"
#include "model/feedback.hpp"
#include "trim/trim.hpp"

using Eigen::VectorXd;

constexpr double M = 2.0, m = 0.1, l = 0.5, g = 9.81;  // cart, bob, rod: values of [49]

// (M + m) x" + m l (θ" cos θ - θ'² sin θ) = F,   l θ" + x" cos θ = g sin θ
tiltrim::Model cart_pole() {
  tiltrim::Model model;
  model.name = "cart and pole";
  model.states = {
      {"angle", "rad", 0.1}, {"rate", "rad/s", 0.1}, {"x", "m", 0.1}, {"v", "m/s", 0.1}};
  model.inputs = {{"force", "N", 1.0}};
  model.f = [](const VectorXd& x, const VectorXd& u, const VectorXd&) -> VectorXd {
    const double s = std::sin(x[0]), c = std::cos(x[0]);
    const double a = (u[0] + m * s * (l * x[1] * x[1] - g * c)) / (M + m * s * s);
    return Eigen::Vector4d{x[1], (g * s - a * c) / l, x[3], a};
  };
  return model;
}

// force = -(k1 angle + k2 rate + k3 x + k4 v)
tiltrim::Model state_feedback(const Eigen::Vector4d& k) {
  tiltrim::Model law;
  law.name = "state feedback";
  law.inputs = cart_pole().states;  // by name
  law.outputs = {{"force", "N", 1.0}};
  law.h = [k](const VectorXd&, const VectorXd& u, const VectorXd&) -> VectorXd {
    return VectorXd::Constant(1, -k.dot(u));
  };
  return law;
}

// Linear: θ" = a θ - F/(M l), x" = -(m g/M) θ + F/M; the desired s⁴ + c3 s³ + c2 s² + c1 s + c0
// determines the four gains one by one.
Eigen::Vector4d gains(double c3, double c2, double c1, double c0) {
  const double a = (M + m) * g / (M * l);
  const double k3 = -c0 * M * l / g, k4 = -c1 * M * l / g;
  return {l * k3 - M * l * (c2 + a), l * k4 - M * l * c3, k3, k4};
}

int main() {
  // (s² + 2 s + 4)(s + 5)(s + 6)
  const tiltrim::Model loop = feedback(cart_pole(), state_feedback(gains(13, 56, 104, 120)));
  const tiltrim::OperatingPoint guess = point_of(loop, {{"angle", 0.1}, {"x", 0.2}});
  const auto upright = names(loop.states);
  const tiltrim::TrimResult held = trim(loop, {.free = upright, .steady = upright}, guess);
  std::printf("%s: angle %.6f rad at x = %.6f m\n", to_string(held.status).c_str(),
              std::abs(value_of(loop, held.point, "angle")),
              std::abs(value_of(loop, held.point, "x")));
  if (!held) return 1;
  const tiltrim::Modes found = modes(linearize(loop, held.point));
  for (const tiltrim::Mode& mode : found.modes)
    std::printf("%.5f %+.5fi\n", mode.eigenvalue.real(), mode.eigenvalue.imag());
  std::printf("%s\n", to_string(found.verdict).c_str());
}
