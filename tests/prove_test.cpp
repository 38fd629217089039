// Theorems hold at points; how a proof ends.
#include "prove/prove.hpp"

#include <fmt/format.h>

#include <Eigen/Eigenvalues>
#include <random>

#include "flight/closed_loop_proof.hpp"
#include "linearize/linearize.hpp"
#include "model/provable.hpp"
#include "runtime/threads.hpp"
#include "study/study.hpp"
#include "tests/check.hpp"
#include "vehicles/tiltrotor/formulations.hpp"

using namespace tiltrim;

namespace {

// x' = 2p - x; y is unstable for |p - c| < w.
ProveProblem windowed(double c, double w) {
  Model m;
  m.name = "windowed";
  m.states = {{"x", "", 1}, {"y", "", 1}};
  m.parameters = {{"p", "", 1}};
  m.outputs = {{"out", "", 1}};
  const auto f = [c, w](auto x, auto, auto p, auto rates) {
    const auto d = p[0] - c;
    rates[0] = 2.0 * p[0] - x[0];
    rates[1] = (w * std::abs(w) - d * d) * x[1];
  };
  ProveProblem problem;
  problem.name = "windowed";
  problem.model = provable_model(m, f, [](auto x, auto, auto, auto out) { out[0] = 0.5 * x[0]; });
  problem.unknowns = problem.equations = {"x", "y"};
  problem.limits = {{"out", {-2, 2}}};
  problem.guess = {Eigen::Vector2d(1, 0), Eigen::VectorXd(0), Eigen::VectorXd::Constant(1, 0.5)};
  problem.parameters = {{"p", 0, 1}};
  return problem;
}

constexpr double none = -0.1;  // width of a window: the rate of y is negative everywhere

ProveOptions few() {
  ProveOptions options;
  options.max_boxes = 150;
  return options;
}

Study corridor_study(const std::string& name) {
  return load_study(fmt::format("{}/studies/{}", TILTRIM_SOURCE_DIR, name));
}

ProveProblem corridor_problem(const Study& study, double from, double to) {
  return closed_loop_proof(study.vehicle, study.schedule, "corridor",
                           *study.conditions[0].command(), {{"h", from, to}});
}

}  // namespace

TEST_CASE("nothing planted: proved") {
  const Theorem t = prove(windowed(0.3, none), few());
  CHECK(t.status() == ProofStatus::proved);
  CHECK(t.stable == 1.0);
}

TEST_CASE("a wide window is proved unstable") {
  const Theorem t = prove(windowed(0.4, 0.2), few());
  CHECK(t.status() == ProofStatus::refuted);
  CHECK(t.unstable > 0.3);
}

TEST_CASE("the corridor's proof holds at random points and does not depend on threads") {
  const Study study = corridor_study("prove_corridor.toml");
  const ProveProblem problem = corridor_problem(study, 46.4, 46.6);  // across the handover
  ProveOptions options;
  Theorem one, two;
  with_threads(1, [&] { one = prove(problem, options); });
  with_threads(2, [&] { two = prove(problem, options); });
  CHECK(one.status() == ProofStatus::proved);
  CHECK(one.boxes == two.boxes);
  REQUIRE(one.tree.size() == two.tree.size());
  std::mt19937_64 draw(3);
  std::uniform_real_distribution<double> height(46.4, 46.6);
  for (int i = 0; i < 20; ++i) {
    const Command command = corridor(height(draw));
    Vehicle vehicle = study.vehicle;
    vehicle.gains = gains_at(study.schedule, command.eta);
    const TrimResult at = trim_closed_loop(vehicle, command);
    REQUIRE(at);
    const Model model = closed_loop(vehicle);
    const Eigen::MatrixXd A = linearize(model, at.point).A;
    CHECK(A.eigenvalues().real().maxCoeff() < 0);
  }
}

TEST_CASE("a stop keeps what is proved, and a bound on boxes ends the search") {
  ProveOptions options = few();
  std::stop_source source;
  source.request_stop();
  options.stop = source.get_token();
  CHECK(prove(windowed(0.4, 0.2), options).interrupted);
  ProveOptions one;
  one.max_boxes = 1;
  CHECK(prove(windowed(0.4, 0.2), one).boxes == 1);
}

TEST_CASE(
    "the polar's extremes that a proof of infeasibility uses are within 1e-13 of the spline's") {
  const Study study = corridor_study("prove_corridor.toml");
  const Polar& polar = *study.vehicle.polar;
  std::mt19937_64 draw(5);
  std::uniform_real_distribution<double> angle(-3.1, 3.1);
  for (int i = 0; i < trials(3000); ++i) {
    const double alpha = angle(draw);
    const auto ordinary = polar.range(alpha, alpha);
    const auto rigorous = polar.ranges(Interval(alpha));
    for (std::size_t k = 0; k < 3; ++k) {
      CHECK(ordinary[k].lower > rigorous[k].value.lower() - 1e-13);
      CHECK(ordinary[k].upper < rigorous[k].value.upper() + 1e-13);
      CHECK(rigorous[k].value.upper() - rigorous[k].value.lower() < 1e-12);
    }
  }
}

TEST_CASE("a model without ranges is refused") {
  ProveProblem problem = windowed(0.3, none);
  problem.model.jets = nullptr;
  CHECK_THROWS_AS((void)prove(problem, few()), CallerMistake);
}
