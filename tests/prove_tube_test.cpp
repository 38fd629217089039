// Ranges contain what a wider arithmetic computes, and a tube that is accepted is one that the
// Krawczyk test of a plain evaluation accepts too, with the slack that a checker needs.
#include <Eigen/Core>
#include <cmath>
#include <random>

#include "model/provable.hpp"
#include "prove/prove.hpp"
#include "tests/check.hpp"

using namespace tiltrim;

namespace prove_tube_test {

TEST_CASE("ranges contain what a wider arithmetic computes") {
  std::mt19937_64 draw(1);
  std::uniform_real_distribution<double> any(-3, 3);
  for (int i = 0; i < 20000; ++i) {
    const double a = any(draw), b = any(draw);
    const auto holds = [](const Interval& range, long double exact) {
      return range.lower() < exact && exact < range.upper();
    };
    using L = long double;
    REQUIRE(holds(Interval(a) * Interval(b), L(a) * L(b)));
    REQUIRE(holds(Interval(a) / Interval(b), L(a) / L(b)));
    REQUIRE(holds(Interval(a) + Interval(b), L(a) + L(b)));
    REQUIRE(holds(sin(Interval(a)), std::sin(L(a))));
    REQUIRE(holds(exp(Interval(a)), std::exp(L(a))));
    REQUIRE(holds(sqrt(Interval(a * a + 1)), std::sqrt(L(a * a + 1))));
  }
}

namespace {

// x' = p - x - bend x²
ProveProblem bent(double bend) {
  Model m;
  m.name = "bent";
  m.states = {{"x", "", 1}};
  m.parameters = {{"p", "", 1}};
  ProveProblem problem;
  problem.model = provable_model(m, [bend](auto x, auto, auto p, auto rates) {
    rates[0] = p[0] - x[0] - bend * (x[0] * x[0]);
  });
  problem.unknowns = problem.equations = {"x"};
  problem.guess = {Eigen::VectorXd::Constant(1, 0.5), Eigen::VectorXd(0),
                   Eigen::VectorXd::Constant(1, 0.5)};
  problem.parameters = {{"p", 0, 1}};
  return problem;
}

// max |C G(z + S d)| + max |1 - C G_x| Z over Z, for p = 0.5 + 0.5 d. The preconditioner may follow
// the slope of G along the tube to first order: C + 2 bend S C² d.
double image_over_radius(const ProofNode::Record& r, double bend, bool follows) {
  const double z = r.z[0], S = r.S(0, 0), Z = r.Z[0];
  double residual = 0, left = 0;
  for (int i = -100; i <= 100; ++i) {
    const double d = i / 100.0, x = z + S * d;
    const double C = r.C(0, 0) * (1 + (follows ? 2 * bend * S * r.C(0, 0) * d : 0.0));
    residual = std::max(residual, std::abs(C * (0.5 + 0.5 * d - x - bend * x * x)));
    for (const double zeta : {-Z, Z})
      left = std::max(left, std::abs(1 - C * (-1 - 2 * bend * (x + zeta))));
  }
  return residual / Z + left;
}

}  // namespace

TEST_CASE("the image of an accepted tube lies within nine tenths of it") {
  double largest = 0;
  int accepted = 0;
  for (int i = 0; i < 400; ++i) {
    const double bend = 0.02 * i;
    ProveOptions one;
    one.max_boxes = 1;
    const Theorem t = prove(bent(bend), one);
    if (t.status() != ProofStatus::proved) continue;
    ++accepted;
    const ProofNode::Record& r = t.tree.front().sides.front();
    largest = std::max(
        largest, std::min(image_over_radius(r, bend, false), image_over_radius(r, bend, true)));
  }
  CHECK(accepted > 20);
  CHECK(accepted < 400);
  CHECK(largest > 0.8);  // the bound is met
  CHECK(largest <= 0.9 * (1 + 1e-12));
}

}  // namespace prove_tube_test
