// Ranges contain what a wider arithmetic computes, and a tube that is accepted is one that the
// Krawczyk test of a plain evaluation accepts too, with the slack that a checker needs. Damping
// ratios.
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

TEST_CASE("a damping ratio holds where the closed form says so, and nowhere else") {
  // x'' + x' + k x = 0: s = (-1 ± √(1 - 4 k)) / 2. A root right of the axis for k < 0; a damping
  // ratio of 1/(2 √k) for k > 1/4, above 1/4 for k < 4.
  Model m;
  m.name = "spring";
  m.states = {{"x", "", 1}, {"y", "", 1}};
  m.parameters = {{"k", "", 1}};
  m.outputs = {{"out", "", 1}};
  const auto f = [](auto x, auto, auto p, auto rates) {
    rates[0] = x[1];
    rates[1] = -1.0 * x[1] - p[0] * x[0];
  };
  ProveProblem problem;
  problem.name = "spring";
  problem.model = provable_model(m, f, [](auto x, auto, auto, auto out) { out[0] = x[0]; });
  problem.unknowns = problem.equations = {"x", "y"};
  problem.guess = {Eigen::Vector2d(0, 0), Eigen::VectorXd(0), Eigen::VectorXd::Constant(1, 2.0)};
  problem.parameters = {{"k", -1, 7}};
  ProveOptions options;
  options.smallest = 1e-6;
  const auto check = [&](double damping, double last) {
    options.damping = damping;
    const Theorem t = prove(problem, options);
    CHECK(t.damping == damping);
    CHECK_NEAR(t.stable, last / 8, 1e-4);
    CHECK_NEAR(t.unstable, 1 - last / 8, 1e-4);
    for (const ProofNode& r : t.regions) {
      if (r.verdict == ProofVerdict::stable) CHECK((r.box[0].lower > 0 && r.box[0].upper < last));
      if (r.verdict == ProofVerdict::unstable) CHECK((r.box[0].upper < 0 || r.box[0].lower > last));
    }
  };
  check(0.25, 4);
  check(0.5, 1);
  check(0.99, 0.25 / (0.99 * 0.99));
  problem.parameters = {{"k", 0.5, 7}};
  options.damping = 0;
  CHECK(prove(problem, options).stable == 1);
  for (const double wrong : {-0.1, 1.0, std::nan("")}) {
    options.damping = wrong;
    CHECK_THROWS_AS((void)prove(problem, options), std::invalid_argument);
  }
}

}  // namespace prove_tube_test
