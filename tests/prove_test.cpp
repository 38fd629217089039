// Proofs cannot be fooled: planted windows, folds, limits; ranges contain; theorems hold at points.
#include "prove/prove.hpp"

#include <doctest/doctest.h>
#include <fmt/format.h>

#include <Eigen/Eigenvalues>
#include <random>

#include "flight/closed_loop_proof.hpp"
#include "linearize/linearize.hpp"
#include "model/jet.hpp"
#include "model/provable.hpp"
#include "runtime/threads.hpp"
#include "study/study.hpp"
#include "vehicles/tiltrotor/formulations.hpp"

using namespace tiltrim;

namespace {

enum class Plant { window, pair, fold, limit, nothing };

// x' = (equation of the trim), y' of rate a(p): a, or y's limit, is violated for |p - c| < w only.
ProveProblem planted(Plant plant, double c, double w) {
  Model m;
  m.name = "planted";
  m.states = {{"x", "", 1}, {"y", "", 1}, {"z", "", 1}};
  m.parameters = {{"p", "", 1}};
  m.outputs = {{"out", "", 1}};
  const auto f = [plant, c, w](auto x, auto, auto p, auto rates) {
    const auto d = p[0] - c;
    const auto bump = w * w - d * d;  // positive within w of c
    rates[0] = plant == Plant::fold ? p[0] - c + w - x[0] * x[0] : 2.0 * p[0] - x[0];
    const bool first = plant == Plant::window, second = plant == Plant::pair;
    rates[1] = first ? bump * x[1] : second ? bump * x[1] + x[2] : -1.0 * x[1];
    rates[2] = second ? bump * x[2] - x[1] : -2.0 * x[2];
  };
  const auto h = [plant, c, w](auto, auto, auto p, auto out) {
    const auto d = p[0] - c;
    out[0] = plant == Plant::limit ? 1.0 + (w * w - d * d) : 0.0 * d;
  };
  ProveProblem problem;
  problem.name = "planted";
  problem.model = provable_model(m, f, [h](auto x, auto u, auto p, auto out) { h(x, u, p, out); });
  problem.unknowns = problem.equations = {"x", "y", "z"};
  problem.limits = {{"out", {-1, 1}}};
  problem.guess = {Eigen::Vector3d(1, 0, 0), Eigen::VectorXd(0), Eigen::VectorXd::Constant(1, 0.5)};
  problem.parameters = {{"p", 0, 1}};
  return problem;
}

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

TEST_CASE("nothing planted: proved") {
  const Theorem t = prove(planted(Plant::nothing, 0.3, 0.1), few());
  CHECK(t.status() == ProofStatus::proved);
  CHECK(t.stable == 1.0);
}

TEST_CASE("a planted window, pair, fold or limit is never certified") {
  std::mt19937_64 draw(7);
  std::uniform_real_distribution<double> place(0.01, 0.99), size(-9, -1);
  for (const Plant plant : {Plant::window, Plant::pair, Plant::fold, Plant::limit})
    for (int i = 0; i < 50; ++i) {
      const double c = place(draw), w = std::pow(10.0, size(draw));
      CAPTURE(int(plant));
      CAPTURE(c);
      CAPTURE(w);
      const Theorem t = prove(planted(plant, c, w), few());
      REQUIRE(t.status() != ProofStatus::proved);
      for (const ProofRegion& r : t.regions)
        REQUIRE_FALSE((r.verdict == ProofVerdict::stable && r.box[0].lower <= c &&
                       c <= r.box[0].upper && plant != Plant::fold));
    }
}

TEST_CASE("a wide window is proved unstable") {
  const Theorem t = prove(planted(Plant::window, 0.4, 0.2), few());
  CHECK(t.status() == ProofStatus::refuted);
  CHECK(t.unstable > 0.3);
}

TEST_CASE("the corridor's proof holds at random points and does not depend on threads") {
  const Study study = corridor_study("prove_corridor.toml");
  const ProveProblem problem = corridor_problem(study, 55, 65);  // across the handover
  ProveOptions options;
  Theorem one, two;
  with_threads(1, [&] { one = prove(problem, options); });
  with_threads(2, [&] { two = prove(problem, options); });
  CHECK(one.status() == ProofStatus::proved);
  CHECK(one.boxes == two.boxes);
  REQUIRE(one.tree.size() == two.tree.size());
  std::mt19937_64 draw(3);
  std::uniform_real_distribution<double> height(55, 65);
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
  CHECK(prove(planted(Plant::window, 0.4, 0.2), options).interrupted);
  ProveOptions one;
  one.max_boxes = 1;
  CHECK(prove(planted(Plant::window, 0.4, 0.2), one).boxes == 1);
}

TEST_CASE("the largest margin is the slowest decay rate, from below") {
  const Theorem t = prove_largest_margin(planted(Plant::nothing, 0.3, 0.1), few());
  CHECK(t.status() == ProofStatus::proved);
  CHECK(t.margin < 1.0);  // of x' = 2 p - x, y' = -y, z' = -2 z
  CHECK(t.margin > 0.97);
  const Theorem none = prove_largest_margin(planted(Plant::window, 0.4, 0.2), few());
  CHECK(none.status() != ProofStatus::proved);
  CHECK(none.margin == 0);
}

TEST_CASE("where the trim lies beyond a limit, its absence is proved") {
  ProveProblem problem = planted(Plant::nothing, 0.3, 0.1);
  problem.limits = {{"x", {-1, 0.8}}};  // x = 2 p: within the limit up to p = 0.4
  NecessarySystem system{problem.model, {"x"}, {{"x", {-1, 0.8}}}, {}};
  system.at = [](const Jets& c) { return NecessarySystem::Values{Jets(3), {}, {c[0]}, {}}; };
  problem.necessary = system;
  const Theorem t = prove(problem, few());
  CHECK(t.status() == ProofStatus::partly);
  CHECK(t.undecided < 1e-6);
  CHECK(std::abs(t.stable - 0.4) < 1e-6);  // the undecided share
  CHECK(std::abs(t.no_trim - 0.6) < 1e-6);
  for (const ProofRegion& r : t.regions) {
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
    const double stored = q.centre() + q.slope(0) * d + q.slope(1) * e + q.bend(0, 0) * d * d +
                          q.bend(1, 0) * d * e + q.bend(1, 1) * e * e;
    const double exact = on(Plain(m + r * d), Plain(n + s * e)).value;
    REQUIRE(std::abs(exact - stored) <= q.rest() + 1e-14);
    REQUIRE(form.range().lower() <= exact + 1e-14);
    REQUIRE(exact - 1e-14 <= form.range().upper());
  }
}

TEST_CASE("what a quadratic form leaves out is of third order") {
  const auto rest = [](double r) {
    const Jet a = Jet::number(0.4, r, 0, 1);
    return (sin(a) * sqrt(1.0 + a) / (2.0 + a)).value().rest();
  };
  CHECK(std::abs(std::log2(rest(2e-2) / rest(1e-2)) - 3) < 0.05);
}

TEST_CASE("a model without ranges is refused") {
  ProveProblem problem = planted(Plant::nothing, 0.3, 0.1);
  problem.model.jets = nullptr;
  CHECK_THROWS_AS((void)prove(problem, few()), CallerMistake);
}
