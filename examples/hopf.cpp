// Branches of equilibria with known bifurcations: the normal forms of fold and Hopf point [30], and
// the Lorenz equations, whose convection loses stability at r = σ(σ + b + 3)/(σ - b - 1).
#include <cmath>
#include <cstdio>

#include "follow/follow.hpp"

using Eigen::VectorXd;

tiltrim::Model flow(const tiltrim::Signals& states, const char* parameter,
                    const std::function<VectorXd(const VectorXd&, double)>& rates) {
  tiltrim::Model m;
  m.states = states;
  m.parameters = {{parameter, "", 1.0}};
  m.f = [rates](const VectorXd& x, const VectorXd&, const VectorXd& p) { return rates(x, p[0]); };
  return m;
}

// Follows the equilibria of m from near x at p until the parameter reaches `to`.
void walk(const char* name, const tiltrim::Model& m, const VectorXd& x, double p, double to) {
  const auto states = names(m.states);
  const tiltrim::TrimSpec steady{.free = states, .steady = states};
  const tiltrim::TrimResult start = trim(m, steady, {x, VectorXd(0), VectorXd::Constant(1, p)});
  std::printf("%s: %s\n", name, to_string(start.status).c_str());
  if (!start) return;
  const tiltrim::Branch branch = follow(m, steady, start.point, m.parameters[0].name, to);
  for (const tiltrim::BranchEvent& event : branch.events) {
    if (event.kind == tiltrim::EventKind::end) continue;
    const double at = std::round(event.at.parameter * 1e4) / 1e4 + 0.0;  // no -0
    std::printf("  %s at %s = %.4f", to_string(event.kind).c_str(), m.parameters[0].name.c_str(),
                at);
    if (event.kind == tiltrim::EventKind::hopf)
      std::printf(", %.4f rad/s", std::abs(event.eigenvalue->imag()));
    std::printf("\n");
  }
}

int main() {
  walk("fold",
       flow({{"x", "", 1}}, "mu",
            [](const VectorXd& x, double mu) -> VectorXd {
              return VectorXd::Constant(1, mu + x[0] * x[0]);  // two equilibria below 0, none above
            }),
       VectorXd::Constant(1, -1.0), -1, 1);
  walk("Hopf",
       flow({{"x", "", 1}, {"y", "", 1}}, "mu",
            [](const VectorXd& x, double mu) -> VectorXd {
              const double r2 = x.squaredNorm();
              return Eigen::Vector2d{(mu - r2) * x[0] - x[1], x[0] + (mu - r2) * x[1]};
            }),
       Eigen::Vector2d{0.0, 0.0}, -1, 1);
  constexpr double sigma = 10, b = 8.0 / 3;
  walk("Lorenz",
       flow({{"x", "", 1}, {"y", "", 1}, {"z", "", 1}}, "r",
            [](const VectorXd& x, double r) -> VectorXd {
              return Eigen::Vector3d{sigma * (x[1] - x[0]), x[0] * (r - x[2]) - x[1],
                                     x[0] * x[1] - b * x[2]};
            }),
       Eigen::Vector3d{5, 5, 9}, 10, 30);
}
