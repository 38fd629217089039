// Theorems hold at points; how a proof ends.
#include "prove/prove.hpp"

#include <fmt/format.h>

#include <Eigen/Eigenvalues>
#include <filesystem>
#include <random>

#include "flight/closed_loop_proof.hpp"
#include "linearize/linearize.hpp"
#include "model/jet.hpp"
#include "model/lookup.hpp"
#include "model/provable.hpp"
#include "runtime/log.hpp"
#include "runtime/threads.hpp"
#include "study/study.hpp"
#include "tests/check.hpp"
#include "tests/quadratics.hpp"
#include "vehicles/tiltrotor/corridor.hpp"
#include "vehicles/tiltrotor/formulations.hpp"

using namespace tiltrim;

namespace prove_test {

namespace {

// x' = 2p - x; y is unstable for |p - c| < w, or decays at 1 1/s without a window.
ProveProblem windowed(double c, double w, bool window = true) {
  Model m;
  m.name = "windowed";
  m.states = {{"x", "", 1}, {"y", "", 1}};
  m.parameters = {{"p", "", 1}};
  m.outputs = {{"out", "", 1}};
  const auto f = [c, w, window](auto x, auto, auto p, auto rates) {
    const auto d = p[0] - c;
    rates[0] = 2.0 * p[0] - x[0];
    if (window)
      rates[1] = (w * std::abs(w) - d * d) * x[1];
    else
      rates[1] = -1.0 * x[1];
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

TEST_CASE("a wide window is proved unstable" * thorough) {
  const Theorem t = prove(windowed(0.4, 0.2), few());
  CHECK(t.status() == ProofStatus::refuted);
  CHECK(t.unstable > 0.3);
}

TEST_CASE("the corridor's proof holds at random points and does not depend on threads" * thorough) {
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

TEST_CASE("a proof that is stopped at any box goes on from its log, with the same tree") {
  const ProveProblem problem = windowed(0.3, 0.01);
  const Theorem whole = prove(problem, few());
  const std::filesystem::path file = "prove_test.log";
  std::filesystem::remove(file);
  ProveOptions options = few();
  for (const std::size_t boxes : {1, 2, 5, 20, 21, 60, 150}) {
    Log log(file, "windowed");
    options.log = &log;
    options.max_boxes = boxes;
    const Theorem t = prove(problem, options);
    CHECK(log.recovered().empty() == (boxes == 1));
    if (boxes < 150) continue;
    REQUIRE(t.tree.size() == whole.tree.size());
    for (std::size_t i = 0; i < t.tree.size(); ++i) {
      const ProofNode &a = t.tree[i], &b = whole.tree[i];
      CHECK(a.verdict == b.verdict);
      CHECK(a.cause == b.cause);
      REQUIRE(a.sides.size() == b.sides.size());
      for (std::size_t k = 0; k < a.sides.size(); ++k) {
        CHECK(a.sides[k].z == b.sides[k].z);
        CHECK(a.sides[k].Z == b.sides[k].Z);
        CHECK(a.sides[k].w == b.sides[k].w);
        CHECK(a.sides[k].v == b.sides[k].v);
        CHECK(a.sides[k].roots == b.sides[k].roots);
      }
    }
    options.log_part = 1;  // another proof's answers are not taken
    options.max_boxes = 1;
    CHECK(prove(windowed(0.3, none), options).boxes == 1);
    log.remove();
  }
}

TEST_CASE("the largest margin is the slowest decay rate, from below") {
  const Theorem t = prove_largest_margin(windowed(0.3, none, false), few());
  CHECK(t.status() == ProofStatus::proved);
  CHECK(t.margin < 1.0);  // of x' = 2 p - x, y' = -y
  CHECK(t.margin > 0.97);
  const Theorem unstable = prove_largest_margin(windowed(0.4, 0.2), few());
  CHECK(unstable.status() != ProofStatus::proved);
  CHECK(unstable.margin == 0);
}

TEST_CASE("where the trim lies beyond a limit, its absence is proved") {
  ProveProblem problem = windowed(0.3, none, false);
  problem.limits = {{"x", {-1, 0.8}}};  // x = 2 p: within the limit up to p = 0.4
  ProveProblem::NecessarySystem system{problem.model, {"x"}, {{"x", {-1, 0.8}}}, {}};
  system.at = [](const std::vector<Jet>& c) {
    return ProveProblem::NecessarySystem::Values{std::vector<Jet>(2), {}, {c[0]}, {}};
  };
  problem.necessary = system;
  const Theorem t = prove(problem, few());
  CHECK(t.status() == ProofStatus::partly);
  CHECK(t.undecided < 1e-6);
  CHECK(std::abs(t.stable - 0.4) < 1e-6);  // the undecided share
  CHECK(std::abs(t.no_trim - 0.6) < 1e-6);
  for (const ProofNode& r : t.regions) {
    if (r.verdict == ProofVerdict::stable) CHECK(r.box[0].upper < 0.4);
    if (r.verdict == ProofVerdict::no_trim) CHECK(r.box[0].lower > 0.4);
  }
}

TEST_CASE("quadratic forms contain what they stand for") {
  std::mt19937_64 draw(5);
  std::uniform_real_distribution<double> any(-1, 1);
  const auto on = [](const auto& a, const auto& b) {
    const auto s = sqrt(2.0 + a * b) / (3.0 - a);
    return sin(s + a) * exp(b * a) - cos(b) * atan(s) + tanh(a) * (b / (2.0 + s));
  };
  for (int i = 0; i < 2000; ++i) {
    const double m = any(draw), n = any(draw), r = 0.3 * std::abs(any(draw)), s = 0.3 * r;
    const Jet form = on(Jet::number(m, r, 0, 2), Jet::number(n, s, 1, 2));
    const double d = any(draw), e = any(draw);
    const Quadratic q = form.value();
    const double exact = on(Plain(m + r * d), Plain(n + s * e)).value;
    REQUIRE(std::abs(exact - value_at(q, d, e)) <= q.rest() + 1e-14);
    REQUIRE(form.range().lower() <= exact + 1e-14);
    REQUIRE(exact - 1e-14 <= form.range().upper());
  }
}

TEST_CASE("the derivative of a power that is not whole contains the true one") {
  // At 1e72 the rounding of -0.12 - 1 is 1.8e-14 of the slope.
  const Jet x = Jet::number(1e72, 0, 0, 1).unknown(0, 1);
  const Interval slope = pow(x, -0.12).slope(0).range();
  const long double exponent = -0.12, exact = exponent * std::pow(1e72L, exponent - 1);
  const long double rounding = 1e-17L * std::abs(exact);
  CHECK(slope.lower() <= exact + rounding);
  CHECK(exact - rounding <= slope.upper());
  CHECK(slope.upper() - slope.lower() < 1e-13 * std::abs(exact));
}

TEST_CASE("what a quadratic form leaves out is of third order") {
  const auto rest = [](double r) {
    const Jet a = Jet::number(0.4, r, 0, 1);
    return (sin(a) * sqrt(1.0 + a) / (2.0 + a)).value().rest();
  };
  CHECK(std::abs(std::log2(rest(2e-2) / rest(1e-2)) - 3) < 0.05);
}

TEST_CASE("a model without ranges is refused") {
  ProveProblem problem = windowed(0.3, none);
  problem.model.jets = nullptr;
  CHECK_THROWS_AS((void)prove(problem, few()), CallerMistake);
}

}  // namespace prove_test
