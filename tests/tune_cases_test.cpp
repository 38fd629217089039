// Difficult tuning cases: limits violated when the trim moves, models that fail, and every number
// by an independent method.
#include <fmt/format.h>

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <numbers>
#include <optional>
#include <random>
#include <stdexcept>

#include "linearize/eigenvalues.hpp"
#include "linearize/linearize.hpp"
#include "linearize/modes.hpp"
#include "model/differentiate.hpp"
#include "study/problems.hpp"
#include "study/study.hpp"
#include "tests/algebra.hpp"
#include "tests/check.hpp"
#include "tests/toy_models.hpp"
#include "tune/requirement.hpp"
#include "tune/tune.hpp"
#include "vehicles/tiltrotor/formulations.hpp"
#include "vehicles/tiltrotor/numbers.hpp"

using namespace tiltrim;
using Complex = std::complex<double>;
using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXcd;
using Eigen::VectorXd;

namespace tune_cases_test {

namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();
constexpr double not_a_number = std::numeric_limits<double>::quiet_NaN();
constexpr double pi = std::numbers::pi;

struct FlownAt {
  const char* name;
  double V, gamma_deg, eta_deg;
};
constexpr FlownAt climb{"climb", 2.0, 90.0, 90.0};
constexpr FlownAt transition{"transition", 6.0, 45.0, 45.0};
constexpr FlownAt level{"level", 15.0, 0.0, 0.0};

// The reference aircraft, with cyclic and elevator blended within `blend_deg` about 60°.
Study study_of(const std::vector<FlownAt>& flights, double blend_deg = 0.0) {
  std::string text = fmt::format("[aircraft]\ncyclic_blend_deg = {}\n", blend_deg);
  for (const FlownAt& f : flights)
    text += fmt::format("[[condition]]\nname = \"{}\"\nV = {}\ngamma_deg = {}\neta_deg = {}\n",
                        f.name, f.V, f.gamma_deg, f.eta_deg);
  return parse_study(text, "tune_cases_test.toml");
}

// All nine gains, each within a factor of the study's value.
TuneProblem problem_of(const Study& study, double factor) {
  TuneProblem p;
  p.points = sweep_requests(study, study.conditions, {});
  Gains gains = study.vehicle.gains;
  for (std::size_t k = 0; k < gain_signals().size(); ++k) {
    const double g = gain_value(gains, k);
    p.gains.push_back({gain_signals()[k].name, g / factor, g * factor, true});
  }
  return p;
}

// Three conditions, nine gains in [0.02, 10]: the worked problem of docs/tune.md.
TuneProblem problem_a() {
  TuneProblem p = problem_of(study_of({climb, transition, level}), 2.0);
  for (FreeGain& g : p.gains) g.lower = 0.02, g.upper = 10.0;
  p.limits = {{Measure::damping, 0.4}, {Measure::frequency, 20.0}};
  return p;
}

Vehicle with_gains(Vehicle vehicle, const VectorXd& gains) {
  for (Index k = 0; k < gains.size(); ++k) gain_value(vehicle.gains, std::size_t(k)) = gains[k];
  return vehicle;
}

LinearModel linear_at(const Vehicle& vehicle, const Command& command) {
  const TrimResult trimmed = trim_closed_loop(vehicle, command);
  REQUIRE(trimmed.status == TrimStatus::converged);
  const LinearModel linear = linearize(closed_loop(vehicle, Axes::wind), trimmed.point);
  REQUIRE(linear);
  return linear;
}

struct Stability {
  double decay = infinity, damping = infinity, frequency = 0.0;
};

void take(Stability& s, const VectorXcd& lambda) {
  for (const Complex& z : lambda) {
    s.decay = std::min(s.decay, -z.real());
    s.damping = std::min(s.damping, -z.real() / std::abs(z));
    s.frequency = std::max(s.frequency, std::abs(z));
  }
}

// Computed by trim, linearize and modes, none of which tuning uses.
Stability stability_of(const Study& study, const VectorXd& gains) {
  Stability s;
  for (const Condition& c : study.conditions) {
    const LinearModel linear = linear_at(with_gains(study.vehicle, gains), *c.command());
    VectorXcd lambda(std::ssize(linear.states));
    for (Index i = 0; const Mode& m : modes(linear).modes) lambda[i++] = m.eigenvalue;
    take(s, lambda);
  }
  return s;
}

bool says(const TuneResult& result, const std::string& words) {
  return result.message.find(words) != std::string::npos;
}

}  // namespace

// ---- the trim depends on the gains ----

namespace {

// The closed loop about one trim with fixed actuator positions, whatever the gains.
Model frozen(const Vehicle& vehicle, const TrimResult& first) {
  const Model open = closed_loop_with_inputs(vehicle, Axes::wind);
  const auto A = [open, x = first.point.x,
                  actuators = VectorXd(first.outputs.head(3))](const VectorXd& gains) -> MatrixXd {
    VectorXd added = VectorXd::Zero(3);
    added.head(2) = (actuators - open.h(x, added, gains).head(3)).head(2);
    added[2] = actuators[2] - open.h(x, added, gains)[2];  // depends on the other two
    return jacobian(open, {x, added, gains}, {0, 1, 2, 3, 4, 5}).topRows(6);
  };
  Model m;
  m.name = "frozen at the first trim";
  m.states = open.states;
  m.parameters = open.parameters;
  m.f = [A, x0 = first.point.x](const VectorXd& x, const VectorXd&, const VectorXd& p) -> VectorXd {
    return A(p) * (x - x0);
  };
  m.derivatives = [A](const OperatingPoint& at, const std::vector<Index>& along) -> MatrixXd {
    const MatrixXd here = A(at.p);
    MatrixXd J = MatrixXd::Zero(6, std::ssize(along));
    for (std::size_t k = 0; k < along.size(); ++k)
      if (along[k] < 6) J.col(Index(k)) = here.col(along[k]);
    return J;
  };
  return m;
}

struct Moved {
  TuneResult on_frozen, on_truth;
  Stability frozen_gains, true_gains;  // both on the truth
};

Moved tuned_both_ways(const FlownAt& flight, double blend_deg, const Requirement& goal,
                      const std::vector<Requirement>& limits) {
  const Study study = study_of({flight}, blend_deg);
  TuneProblem truth = problem_of(study, 3.0);
  truth.goal = goal;
  truth.limits = limits;
  const TrimResult first = trim_closed_loop(study.vehicle, *study.conditions.front().command());
  REQUIRE(first.status == TrimStatus::converged);
  TuneProblem stale = truth;
  SweepRequest& request = stale.points.front() = {};
  request.name = "frozen";
  request.model = frozen(study.vehicle, first);
  request.spec.free = request.spec.steady = names(request.model.states);
  request.guess = first.point;
  const TuneOptions options{.evaluations = 800, .threads = 1};
  const TuneResult on_frozen = tune(stale, options), on_truth = tune(truth, options);
  return {on_frozen, on_truth, stability_of(study, on_frozen.gains),
          stability_of(study, on_truth.gains)};
}

}  // namespace

TEST_CASE("limits met on models frozen at the first trim, missed once trimmed again") {
  SUBCASE("damping, on the rotors in level flight") {
    const Moved m = tuned_both_ways({"fast", 15.0, 0.0, 80.0}, 60.0, {Measure::decay},
                                    {{Measure::damping, 0.6}, {Measure::frequency, 30.0}});
    REQUIRE(m.on_frozen.status == TuneStatus::tuned);
    REQUIRE(m.on_truth.status == TuneStatus::tuned);
    CHECK(m.frozen_gains.damping < 0.99 * 0.6);
    CHECK(m.true_gains.damping >= 0.6 * (1 - 1e-6));
    CHECK(m.true_gains.frequency <= 30.0 * (1 + 1e-6));
    CHECK_NEAR(m.true_gains.decay, m.on_truth.goal, 1e-6);
  }
  SUBCASE("decay, in a steep climb") {
    const Moved m = tuned_both_ways({"steep", 5.0, 50.0, 47.0}, 30.0, {Measure::damping},
                                    {{Measure::decay, 0.5}, {Measure::frequency, 30.0}});
    REQUIRE(m.on_frozen.status == TuneStatus::tuned);
    REQUIRE(m.on_truth.status == TuneStatus::tuned);
    CHECK(m.frozen_gains.decay < 0.99 * 0.5);
    CHECK(m.true_gains.decay >= 0.5 * (1 - 1e-6));
    CHECK(m.true_gains.frequency <= 30.0 * (1 + 1e-6));
    CHECK_NEAR(m.true_gains.damping, m.on_truth.goal, 1e-6);
  }
}

// ---- failures are no successes ----

namespace {

using Rates = std::function<VectorXd(const VectorXd& x, double p)>;

// Two states at rest at zero, one gain p in [0.1, 10].
TuneProblem planted(const Rates& f) {
  SweepRequest r;
  r.name = "planted";
  r.model.name = "planted";
  r.model.states = {{"a", "", 1.0}, {"b", "", 1.0}};
  r.model.parameters = {{"p", "", 1.0}};
  r.model.f = [f](const VectorXd& x, const VectorXd&, const VectorXd& p) { return f(x, p[0]); };
  r.spec.free = r.spec.steady = {"a", "b"};
  r.guess = {VectorXd::Zero(2), VectorXd(), VectorXd::Ones(1)};
  TuneProblem problem;
  problem.points = {r};
  problem.gains = {{"p", 0.1, 10.0, true}};
  return problem;
}

// Eigenvalues -p and -2 p.
VectorXd faster_with_p(const VectorXd& x, double p) {
  return Eigen::Vector2d{-p * x[0], -2 * p * x[1]};
}

}  // namespace

namespace {

constexpr double edge = 2.0;

VectorXd no_number_beyond(const VectorXd& x, double p) {
  if (p > edge) return VectorXd::Constant(2, not_a_number);
  return faster_with_p(x, p);
}

VectorXd throws_beyond(const VectorXd& x, double p) {
  if (p > edge) throw std::runtime_error("p is too large");
  return faster_with_p(x, p);
}

void check_below_edge(const Rates& f, LocalSearch local) {
  CAPTURE(to_string(local));
  TuneResult found;
  CHECK_NOTHROW(found = tune(planted(f), {.local = local, .evaluations = 200, .threads = 1}));
  REQUIRE(found.status == TuneStatus::tuned);
  CHECK(found.gains[0] <= edge);
  CHECK(found.gains[0] >= 0.9 * edge);
  CHECK_NEAR(found.goal, found.gains[0], 1e-7);
}

}  // namespace

TEST_CASE("a model without numbers for some gains: the answer is among the others") {
  for (const LocalSearch local : {LocalSearch::slsqp, LocalSearch::cobyla, LocalSearch::bobyqa})
    check_below_edge(no_number_beyond, local);
}

// At the edge the gradient is NaN, and MMA continues to gains that are NaN.
TEST_CASE("a model without numbers for some gains, by MMA") {
  check_below_edge(no_number_beyond, LocalSearch::mma);
}

// The gradient's step across the edge throws from tune(), whatever the local search: SLSQP polishes
// all their results.
TEST_CASE("a model that throws for some gains: the answer is among the others") {
  for (const LocalSearch local : {LocalSearch::slsqp, LocalSearch::mma})
    check_below_edge(throws_beyond, local);
}

TEST_CASE("no answer in the middle of the box: found beside it") {
  for (const GlobalSearch global :
       {GlobalSearch::multistart, GlobalSearch::crs2, GlobalSearch::isres, GlobalSearch::esch,
        GlobalSearch::direct, GlobalSearch::mlsl}) {
    CAPTURE(to_string(global));
    const TuneProblem problem = planted([](const VectorXd& x, double p) -> VectorXd {
      if (p > 0.5 && p < 2.0) return VectorXd::Constant(2, not_a_number);
      return faster_with_p(x, p);
    });
    const TuneResult found = tune(problem, {.global = global, .evaluations = 300, .threads = 1});
    REQUIRE(found.status == TuneStatus::tuned);
    CHECK_NEAR(found.gains[0], 10.0, 1e-3);
  }
}

// ---- how it ended ----

namespace {

// A pole on a cart that a motor with inductance drives, about the upright: the trace of its A is
// -R/L whatever the four gains, so no spectrum of five has a decay above R/(5 L) = 10 1/s.
TuneProblem cart_pole(double damping, double frequency) {
  SweepRequest r;
  r.name = "upright";
  r.model.name = "cart-pole";
  for (const char* state : {"x", "v", "phi", "omega", "current"})
    r.model.states.push_back({state, "", 1.0});
  for (const char* gain : {"k_x", "k_v", "k_phi", "k_omega"})
    r.model.parameters.push_back({gain, "", 1.0});
  r.model.f = [](const VectorXd& x, const VectorXd&, const VectorXd& k) -> VectorXd {
    constexpr double M = 1, m = 0.2, l = 0.5, g = 9.81, R = 1, L = 0.02, K = 2;
    const double force = K * x[4], voltage = k.dot(x.head(4));
    return vec({x[1], (force - m * g * x[2]) / M, x[3], ((M + m) * g * x[2] - force) / (l * M),
                (voltage - R * x[4] - K * x[1]) / L});
  };
  r.spec.free = r.spec.steady = {"x", "v", "phi", "omega", "current"};
  r.guess = {VectorXd::Zero(5), VectorXd(), VectorXd(vec({5, 10, 60, 10}))};
  TuneProblem problem;
  problem.points = {r};
  problem.gains = {{"k_x", 0.1, 2000, true},
                   {"k_v", 0.1, 2000, true},
                   {"k_phi", 1, 5000, true},
                   {"k_omega", 0.1, 1000, true}};
  problem.limits = {{Measure::damping, damping}, {Measure::frequency, frequency}};
  return problem;
}

}  // namespace

TEST_CASE("a cart-pole reaches what its trace allows, past eigenvalues that meet in threes") {
  for (const std::uint64_t seed : {1u, 2u}) {
    CAPTURE(seed);
    const TuneResult found =
        tune(cart_pole(0.9, 15), {.seed = seed, .searches = sanitized ? 3 : 10});
    REQUIRE(found.status == TuneStatus::tuned);
    CHECK_NEAR(found.goal, 10, 0.01);
    CHECK(found.goal <= 10 + 1e-6);
    CHECK(found.end == TuneEnd::locally_optimal);
    CHECK(found.stationarity < 0.05);
    CHECK(found.agreeing >= 2);
    if (sanitized) break;
  }
}

TEST_CASE("a larger budget continues the same search: never worse") {
  for (const std::uint64_t seed : {1u, 2u, 3u}) {
    double before = 0;
    for (const long budget : {50L, 200L, 400L, 1000L, 3000L}) {
      if (sanitized && budget > 400) break;
      const TuneResult found = tune(cart_pole(0.5, 40), {.seed = seed, .evaluations = budget});
      CHECK(found.end == TuneEnd::budget_spent);
      CHECK(found.goal >= before);
      before = found.goal;
    }
    CHECK(before > 1);
    if (sanitized) break;
  }
}

TEST_CASE("progress: stationarity of the best once a start has ended") {
  const double none = std::numeric_limits<double>::quiet_NaN();
  double first = 0, last = none;
  TuneOptions options{.searches = 2, .agreeing = 1};
  options.observe = [&](const TuneProgress& at) {
    if (at.starts == 0) first = at.stationarity;
    last = at.stationarity;
  };
  const TuneResult found = tune(planted(faster_with_p), options);
  CHECK(std::isnan(first));
  CHECK(last < 0.05);
  CHECK(found.starts >= 2);
  options.observe = {};
  CHECK(tune(planted(faster_with_p), options).gains == found.gains);  // watching changes nothing
}

TEST_CASE("no starts, or none that must agree, are refused") {
  CHECK_THROWS_WITH_AS((void)tune(planted(faster_with_p), {.searches = 0}),
                       "0 local searches, of which 3 must agree; expected at least 1 of each",
                       std::invalid_argument);
  CHECK_THROWS_AS((void)tune(planted(faster_with_p), {.agreeing = 0}), std::invalid_argument);
}

TEST_CASE("goals and gains without influence are named as such") {
  const TuneResult flat = tune(planted([](const VectorXd& x, double) { return VectorXd(-x); }));
  CHECK(flat.status == TuneStatus::tuned);
  CHECK(flat.end == TuneEnd::no_influence);
  CHECK(flat.evaluations < 1000);
  const TuneResult one = tune(planted(faster_with_p));
  CHECK(one.end == TuneEnd::locally_optimal);
  CHECK_NEAR(one.gains[0], 10, 1e-6);  // at its bound
}

TEST_CASE("forty gains") {
  TuneProblem problem = planted(faster_with_p);
  SweepRequest& r = problem.points.front();
  problem.gains.clear();
  r.model.parameters.clear();
  for (int i = 0; i < 40; ++i) {
    r.model.parameters.push_back({fmt::format("p{}", i), "", 1.0});
    problem.gains.push_back({fmt::format("p{}", i), 0.1, 10.0, true});
  }
  r.guess.p = VectorXd::Ones(40);
  // Of each state half the gains at their mean: both at their upper bounds are fastest.
  r.model.f = [](const VectorXd& x, const VectorXd&, const VectorXd& p) -> VectorXd {
    return vec({-p.head(20).mean() * x[0], -p.tail(20).mean() * x[1]});
  };
  const TuneResult found = tune(problem, {.evaluations = 600});
  CHECK(found.status == TuneStatus::tuned);
  CHECK_NEAR(found.goal, 10, 0.01);
}

TEST_CASE("a model without answers for all gains") {
  const auto refused = [](const Rates& f) {
    const TuneResult found = tune(planted(f), {.evaluations = 3, .threads = 1});
    CHECK(found.status == TuneStatus::no_trim);
    CHECK(says(found, "decay"));
    CHECK(says(found, "planted"));
    return found;
  };
  refused([](const VectorXd&, double) -> VectorXd { return VectorXd::Constant(2, not_a_number); });
  const TuneResult thrown = refused(
      [](const VectorXd&, double) -> VectorXd { throw std::runtime_error("the tank is empty"); });
  CHECK(says(thrown, "the tank is empty"));
  // a state that never rests
  refused([](const VectorXd& x, double p) -> VectorXd { return Eigen::Vector2d{-p * x[0], 1.0}; });
}

TEST_CASE("no candidate at all: the budget is nothing, the time is over") {
  const TuneResult none = tune(problem_a(), {.evaluations = 0});
  CHECK(none.status == TuneStatus::no_trim);
  CHECK(none.out_of_evaluations);
  CHECK(says(none, "decay"));
  const TuneResult late = tune(problem_a(), {.seconds = 1e-9});
  CHECK(late.status == TuneStatus::no_trim);
  CHECK(late.out_of_time);
  CHECK(late.evaluations == 0);
  CHECK(says(late, "decay"));
}

TEST_CASE("limits that contradict each other are named, with the point") {
  const auto unmet = [](const std::vector<Requirement>& limits) {
    TuneProblem p = problem_a();
    p.limits = limits;
    const TuneResult found = tune(p, {.evaluations = trials(200)});
    CHECK(found.status == TuneStatus::limits_unmet);
    const auto named = [&](const auto& r) { return says(found, to_string(r.measure)); };
    CHECK(std::ranges::any_of(limits, named));
    const auto place = [&](const SweepRequest& r) { return says(found, "'" + r.name + "'"); };
    CHECK(std::ranges::any_of(p.points, place));
    // and missed by what is achieved
    const auto missed = [](const Achieved& a) { return a.reserve() < 0; };
    CHECK(std::ranges::any_of(found.achieved, missed));
  };
  unmet({{Measure::damping, 0.99}, {Measure::frequency, 0.1}, {Measure::decay, 1.0}});
  unmet({{Measure::decay, 1.0}, {Measure::frequency, 0.5}});
  unmet({{Measure::damping, 1.01}});
  unmet({{Measure::frequency, -1.0}});
  unmet({{Measure::use, -0.1}});
}

// As a least decay rate it is a negative one, which stable modes have.
TEST_CASE("a half-time that no mode can have is not met") {
  const Study study = study_of({level});
  TuneProblem p = problem_of(study, 1.1);
  const LinearModel linear = linear_at(study.vehicle, *study.conditions.front().command());
  p.limits = {{Measure::half_time, -1.0, modes(linear).modes.back().name}};
  bool met = false;
  try {
    met = bool(tune(p, {.evaluations = 1}));
  } catch (const std::invalid_argument&) {
  }
  CHECK(!met);
}

// value_of() turns "does not apply" into an infinite half-time, so that no limit is violated.
TEST_CASE("a limit that applies at no point is not met, and is named") {
  TuneProblem p = problem_a();
  p.limits = {{Measure::half_time, 1.0, "dutch roll"}};
  const TuneResult found = tune(p, {.evaluations = 50});
  CHECK(found.status == TuneStatus::limits_unmet);
  CHECK(says(found, "half_time of dutch roll applies at no operating point"));
}

TEST_CASE("a goal that applies at no point is not reached") {
  TuneProblem p = problem_a();
  p.goal = {Measure::half_time, not_a_number, "dutch roll"};
  CHECK(tune(p, {.evaluations = 50}).status == TuneStatus::limits_unmet);
}

TEST_CASE("a goal that applies at no point is named") {
  TuneProblem p = problem_a();
  p.goal = {Measure::half_time, not_a_number, "dutch roll"};
  CHECK(
      says(tune(p, {.evaluations = 50}), "half_time of dutch roll applies at no operating point"));
}

TEST_CASE("an actuator that is none is not met, or refused") {
  TuneProblem p = problem_a();
  p.limits.push_back({Measure::use, 0.9, "rudder"});
  bool met = false;
  try {
    const TuneResult found = tune(p, {.evaluations = 50});
    met = bool(found);
    CHECK(says(found, "rudder"));
  } catch (const std::invalid_argument& e) {
    CHECK(std::string(e.what()).find("rudder") != std::string::npos);
  }
  CHECK(!met);
}

TEST_CASE("an unstable plant whose gain has no effect is never tuned") {
  TuneProblem p = planted([](const VectorXd& x, double) -> VectorXd {
    return Eigen::Vector2d{0.1 * x[0], -x[1]};
  });
  const auto tried = [&](const Requirement& goal, const std::vector<Requirement>& limits) {
    p.goal = goal;
    p.limits = limits;
    const TuneResult found = tune(p, {.evaluations = 50, .threads = 1});
    CHECK(!found);
    CHECK(says(found, "'planted'"));
    return found;
  };
  CHECK(tried({Measure::decay}, {}).status == TuneStatus::unstable);
  CHECK(tried({Measure::damping}, {}).status == TuneStatus::unstable);
  CHECK(tried({Measure::decay}, {{Measure::decay, -1.0}}).status == TuneStatus::unstable);
  const TuneResult unasked = tried({Measure::frequency}, {});  // stability is asked all the same
  CHECK(unasked.status == TuneStatus::limits_unmet);
  CHECK(says(unasked, "decay"));
  const TuneResult asked = tried({Measure::frequency}, {{Measure::damping, 0.2}});
  CHECK(asked.status == TuneStatus::limits_unmet);
  CHECK(says(asked, "damping"));
}

// s^3 + (k + m) s^2 + (1 + k m) s + m - 0.03 with k = 0.4 + 0.4 g, m = 1 - g: the pair is damped
// best where a third eigenvalue reaches 0, at g = 0.97.
TEST_CASE(
    "a goal that leads to the boundary of stability ends at a verified candidate next to it") {
  TuneProblem p = planted({});
  Model& model = p.points.front().model;
  model.states.push_back({"c", "", 1.0});
  model.f = [](const VectorXd& x, const VectorXd&, const VectorXd& g) -> VectorXd {
    return Eigen::Vector3d{x[1], -x[0] - (0.4 + 0.4 * g[0]) * x[1] + 0.3 * x[2],
                           0.1 * x[0] - (1 - g[0]) * x[2]};
  };
  p.points.front().spec.free = p.points.front().spec.steady = {"a", "b", "c"};
  p.points.front().guess.x = VectorXd::Zero(3);
  p.gains = {{"p", 0.0, 2.0, false}};
  p.goal = {Measure::damping};
  for (const unsigned seed : {2, 4, 6, 8}) {
    const TuneResult found = tune(p, {.seed = seed, .threads = 1});
    CAPTURE(found.message);
    CHECK(found.status == TuneStatus::tuned);
    CHECK(found.gains[0] < 0.97);
    CHECK_NEAR(found.goal, 0.818 / (2 * std::sqrt(1 + 0.788 * 0.03)), 1e-6);
  }
  // From the boundary itself, without any candidates left: the step is none.
  TuneOptions one{.evaluations = 1, .threads = 1};
  one.start = VectorXd::Constant(1, 0.97);
  const TuneResult found = tune(p, one);
  CHECK(found.status == TuneStatus::tuned);
  CHECK(found.gains[0] < 0.97);
  CHECK(found.evaluations == 1);
  CHECK(found.out_of_evaluations);
}

// kp > -ps at one corner, the third minor of Hurwitz at another.
TEST_CASE("where two boundaries of stability meet, the candidate next to them is off both") {
  const Study study = parse_study(R"([model]
state = [{name = "z", rate = "v"}, {name = "v", rate = "(u - ps*z + 0.48772*v)/m"},
         {name = "u", rate = "(-kp*z - kd*v - u)*2.6493"}]
parameter = [{name = "m", value = 0.505}, {name = "ps", value = -1.93}, {name = "kp", value = 1},
             {name = "kd", value = 1}]
[[condition]]
name = "rest"
[tune]
gain = [{key = "kp", from = 0.2, to = 30}, {key = "kd", from = 0.2, to = 30}]
uncertain = [{key = "m", from = 0.366, to = 0.567}, {key = "ps", from = -3.0243, to = -1.7287}]
second = "none"
evaluations = 1500
goal = {measure = "frequency"}
)",
                                  "tune_cases_test.toml");
  const TuneResult found = tune(tune_problem(study), tune_options(study));
  CHECK(found.status == TuneStatus::tuned);
  CHECK(found.gains[0] > 3.0243);
  CHECK_NEAR(found.gains[0], 3.0243, 1e-6);
}

TEST_CASE("an eigenvalue on the axis is not stable") {
  const TuneProblem p = planted([](const VectorXd& x, double p_) -> VectorXd {
    return Eigen::Vector2d{x[1], -p_ * x[0]};
  });
  const TuneResult found = tune(p, {.evaluations = 50, .threads = 1});
  CHECK(found.status == TuneStatus::unstable);
  CHECK(says(found, "'planted': it is undecided"));
}

TEST_CASE("mistakes are refused with the name") {
  const auto refused = [](auto change, const char* words) {
    TuneProblem p = problem_a();
    change(p);
    CHECK_THROWS_WITH_AS((void)tune(p, {.evaluations = 10}), doctest::Contains(words),
                         std::invalid_argument);
  };
  refused([](auto& p) { std::swap(p.gains[2].lower, p.gains[2].upper); }, "gains.K_Ei");
  refused([](auto& p) { p.gains[2].lower = p.gains[2].upper; }, "gains.K_Ei");
  refused([](auto& p) { p.gains[2].upper = infinity; }, "gains.K_Ei");
  refused([](auto& p) { p.limits[0].limit = not_a_number; }, "damping");
  refused([](auto& p) { p.limits[0].limit = infinity; }, "damping");
  refused([](auto& p) { p.gains[1].name = "gains.K_Epp"; }, "gains.K_Epp");
  refused([](auto& p) { p.gains[1].name = "theta"; }, "theta");
  refused([](auto& p) { p.limits.push_back({Measure::half_time, 1.0}); }, "half_time");
  refused([](auto& p) { p.limits.push_back({Measure::disk_margin, 0.5}); }, "disk_margin");
  refused([](auto& p) { p.limits.push_back({Measure::response_use, 0.5}); }, "response_use");
  refused([](auto& p) { p.limits.push_back({Measure::sensitivity, 0.5}); }, "sensitivity");
  refused([](auto& p) { p.schedule = {0.0}; }, "schedule");
  refused([](auto& p) { p.schedule = {1.0, 0.0}; }, "schedule");
  refused([](auto& p) { p.schedule = {0.0, 1.0}, p.schedule_over = "beta"; }, "beta");
  refused([](auto& p) { p.uncertain = {{"aircraft.mass", 5.0, 4.0}}; }, "aircraft.mass");
  refused(
      [](auto& p) {
        p.points[0].spec.bounds["gains.K_Ei"] = {0, 1e-9};
      },
      "outside its limits in the trim, [0, 1e-09]");
  refused([](auto& p) { p.uncertain = {{"aircraft.masss", 4.0, 5.0}}; }, "aircraft.masss");
}

// The last of the two is taken, the other has no effect.
TEST_CASE("a gain that is listed twice is refused") {
  TuneProblem p = problem_a();
  p.gains.push_back(p.gains.front());
  CHECK_THROWS_AS((void)tune(p, {.evaluations = 10}), std::invalid_argument);
}

// The free value is used at every corner, which then is no corner.
TEST_CASE("a gain both free and uncertain is refused") {
  TuneProblem p = problem_a();
  p.uncertain = {{p.gains.front().name, 1.0, 2.0}};
  CHECK_THROWS_AS((void)tune(p, {.evaluations = 10}), std::invalid_argument);
}

// The guess's value is used for the trim's.
TEST_CASE("a schedule over what the trim finds is refused") {
  TuneProblem p = problem_a();
  p.schedule = {-1.0, 1.0};
  p.schedule_over = "theta";
  CHECK_THROWS_AS((void)tune(p, {.evaluations = 10}), std::invalid_argument);
}

TEST_CASE("a disturbance of a state that is none is refused") {
  TuneProblem p = problem_a();
  p.disturbance = {{"beta", 0.1}};
  p.limits = {{Measure::response_use, 0.9}};
  CHECK_THROWS_WITH_AS((void)tune(p, {.evaluations = 10}), doctest::Contains("beta"),
                       std::invalid_argument);
}

TEST_CASE("one number tuned, by every search") {
  const TuneProblem p = planted(faster_with_p);
  for (const LocalSearch local :
       {LocalSearch::slsqp, LocalSearch::mma, LocalSearch::cobyla, LocalSearch::bobyqa}) {
    const std::string method = to_string(local);
    CAPTURE(method);
    TuneResult found;
    CHECK_NOTHROW(found = tune(p, {.local = local, .evaluations = 200, .threads = 1}));
    CHECK(found.status == TuneStatus::tuned);
    CHECK_NEAR(found.goal, 10.0, 1e-3);
  }
}

TEST_CASE("local searches that mislay their best: ours is kept, and meets the limits") {
  const Study study = study_of({climb, transition, level});
  const TuneProblem p = problem_a();
  // MMA's own arithmetic takes a hundred times longer than the model's.
  for (const auto& [local, evaluations] : {std::pair(LocalSearch::cobyla, 600L),
                                           {LocalSearch::mma, 120L},
                                           {LocalSearch::bobyqa, 600L}}) {
    const std::string method = to_string(local);
    CAPTURE(method);
    double best = -infinity;
    TuneOptions options{.local = local, .evaluations = evaluations, .threads = 1};
    options.observe = [&, &best = best](const TuneProgress& at) {
      if (at.feasible) best = std::max(best, at.best);
    };
    const TuneResult found = tune(p, options);
    REQUIRE(found.status == TuneStatus::tuned);
    CHECK_NEAR(found.goal, best, 1e-9);
    const Stability s = stability_of(study, found.gains);
    CHECK(s.damping >= 0.4 - 1e-8);
    CHECK(s.frequency <= 20.0 + 1e-7);
    CHECK_NEAR(s.decay, found.goal, 1e-6);
  }
}

// ---- gradients, including the shift of the trim ----

namespace {

// The worst value at a place, and the distance of other eigenvalues from the decisive one.
struct Deciding {
  Worst worst;
  Complex eigenvalue;  // the upper one of a pair
  double gap = infinity;
};

Deciding deciding(const Requirement& r, const PlaceModes& place) {
  Deciding d{worst(0, r, place), {}, infinity};
  const VectorXcd& lambda = place.eigenvalues;
  const Complex own = lambda[d.worst.eigenvalue];
  d.eigenvalue = {own.real(), std::abs(own.imag())};
  for (Index k = 0; k < lambda.size(); ++k)
    if (k != d.worst.eigenvalue) d.gap = std::min(d.gap, std::abs(lambda[k] - own));
  return d;
}

constexpr double step_share = 5e-4;  // of the gain

// A gain two steps and one step less, one and two more.
std::array<std::vector<PlaceModes>, 4> beside(Candidates& candidates, const VectorXd& at, Index j) {
  std::array<std::vector<PlaceModes>, 4> around;
  for (std::size_t k = 0; const double steps : {-2.0, -1.0, 1.0, 2.0}) {
    VectorXd there = at;
    there[j] += steps * step_share * at[j];
    around.at(k++) = candidates.at(there, false);
  }
  return around;
}

}  // namespace

TEST_CASE("slopes of the worst decay and damping agree with trimming again") {
  // The second is in the blending range, where the attitude depends on the gains.
  const Study study = study_of({climb, {"steep", 5.0, 50.0, 47.0}, level}, 30.0);
  const TuneProblem problem = problem_of(study, 3.0);
  Candidates candidates(problem, TrimOptions{.starts = 2, .max_boxes = 100, .closest = false});
  const Index gains = std::ssize(problem.gains);
  constexpr double simple = 0.1;  // gap to the nearest other, over the eigenvalue's size
  const std::array asked{Requirement{Measure::decay}, Requirement{Measure::damping}};
  std::mt19937_64 random(23);
  std::uniform_real_distribution<double> power(-1.0, 1.0);
  std::array<int, 3> compared{};
  double moved = 0;  // change of attitude in the blending range, rad
  for (int trial = 0; trial < trials(1000); ++trial) {
    VectorXd at(gains);
    for (Index j = 0; j < gains; ++j)
      at[j] = std::sqrt(problem.gains[std::size_t(j)].lower * problem.gains[std::size_t(j)].upper) *
              std::pow(2.5, power(random));
    const std::vector<PlaceModes> here = candidates.at(at, true);
    for (Index j = 0; j < gains; ++j) {
      const auto around = beside(candidates, at, j);
      for (std::size_t p = 0; p < here.size(); ++p) {
        const auto trimmed = [&](const auto& places) { return places[p].valid(); };
        if (!here[p].valid() || !std::ranges::all_of(around, trimmed)) continue;
        if (p == 1) moved = std::max(moved, std::abs(around[3][p].at.x[2] - around[0][p].at.x[2]));
        for (const Requirement& r : asked) {
          const Deciding own = deciding(r, here[p]);
          if (own.gap < simple * std::abs(own.eigenvalue)) continue;
          std::array<double, 4> scores{};
          bool same = true;
          for (std::size_t k = 0; k < 4; ++k) {
            const Deciding other = deciding(r, around[k][p]);
            scores[k] = other.worst.score;
            same = same && std::abs(other.eigenvalue - own.eigenvalue) < 0.1 * own.gap;
          }
          if (!same) continue;
          // Of fourth order, where those of second agree well enough to tell.  [4, sec. 8.1]
          const double near = (scores[2] - scores[1]) / (2 * step_share * at[j]);
          const double wide = (scores[3] - scores[0]) / (4 * step_share * at[j]);
          const double difference = (4 * near - wide) / 3;
          const Scored s = score(r, here[p].eigenvalues[own.worst.eigenvalue]);
          const double slope =
              (std::conj(s.slope) * here[p].slopes(own.worst.eigenvalue, j)).real();
          const double size =
              std::max(std::abs(slope), 1e-2 * std::max(std::abs(own.worst.score), 0.1) / at[j]);
          if (std::abs(near - wide) > 1e-4 * size) continue;
          CHECK_NEAR(difference, slope, 1e-6 * size);
          ++compared.at(p);
        }
      }
    }
  }
  for (const int c : compared) CHECK(c > trials(5000));
  CHECK(moved > 1e-6);
}

// ---- two gains: exhaustive comparison ----

namespace {

SweepAxis logarithmic(const FreeGain& gain, std::size_t count) {
  SweepAxis axis;
  axis.name = gain.name.substr(gain.name.rfind('.') + 1);
  SweepAxis::Column column;
  column.name = column.signal = gain.name;
  for (std::size_t i = 0; i < count; ++i) {
    const double share = double(i) / double(count - 1);
    column.values.push_back(gain.lower * std::pow(gain.upper / gain.lower, share));
  }
  column.si = column.values;
  axis.columns = {column};
  return axis;
}

// The worst decay rate over the conditions at each point of the grid; -inf where damping or
// frequency is not within its limit.
std::vector<double> goals_on_grid(const SweepMap& map, double damping, double frequency) {
  const std::size_t each = map.points_per_condition(), n = map.modes();
  std::vector<double> goals(each, infinity);
  for (std::size_t point = 0; point < map.points(); ++point) {
    Stability s;
    for (std::size_t i = point * n; i < (point + 1) * n; ++i) {
      const Complex z(map.eigenvalue_re[i], map.eigenvalue_im[i]);
      s.decay = std::min(s.decay, -z.real());
      s.damping = std::min(s.damping, -z.real() / std::abs(z));
      s.frequency = std::max(s.frequency, std::abs(z));
    }
    double& goal = goals[point % each];
    const bool met = map.status[point] == 0 && s.damping >= damping && s.frequency <= frequency;
    goal = met ? std::min(goal, s.decay) : -infinity;
  }
  return goals;
}

TuneProblem two_gains(const Study& study) {
  TuneProblem p;
  p.points = sweep_requests(study, study.conditions, {});
  p.gains = {{"gains.K_Lp", 0.05, 5.0, true}, {"gains.k_de", 0.3, 30.0, true}};
  p.limits = {{Measure::damping, 0.4}, {Measure::frequency, 20.0}};
  return p;
}

}  // namespace

TEST_CASE("two gains: at least the best of 400 x 400 candidates, and beside it") {
  constexpr std::size_t count = sanitized ? 100 : 400;
  const Study study = study_of({transition, level});
  const TuneProblem problem = two_gains(study);
  const std::vector<SweepAxis> axes{logarithmic(problem.gains[0], count),
                                    logarithmic(problem.gains[1], count)};
  const SweepMap map = sweep(sweep_requests(study, study.conditions, axes), axes,
                             {.threads = 1, .crossings = false});
  const std::vector<double> goals = goals_on_grid(map, 0.4, 20.0);
  const auto best = std::size_t(std::ranges::max_element(goals) - goals.begin());
  const std::size_t i = best / count, k = best % count;
  REQUIRE((i > 0 && i + 1 < count && k > 0 && k + 1 < count));
  // How much the goal changes from the best point of the grid to the next in any direction.
  double next = 0;
  for (const std::size_t a : {i - 1, i, i + 1})
    for (const std::size_t b : {k - 1, k, k + 1})
      next = std::max(next, goals[best] - goals[a * count + b]);
  const double step = std::log(100.0) / double(count - 1);
  for (const GlobalSearch global : {GlobalSearch::multistart, GlobalSearch::crs2}) {
    CAPTURE(to_string(global));
    const TuneResult found = tune(problem, {.global = global, .evaluations = 400, .threads = 1});
    REQUIRE(found.status == TuneStatus::tuned);
    CHECK(found.goal >= goals[best]);
    CHECK(found.goal - goals[best] <= next);
    // A ridge along k_de: its top lies a little more than a step away, K_Lp's less than one.
    CHECK(std::abs(std::log(found.gains[0] / axes[0].columns[0].si[i])) <= step);
    CHECK(std::abs(std::log(found.gains[1] / axes[1].columns[0].si[k])) <= 2 * step);
  }
}

// Level flight only: three eigenvalues meet at the optimum (0.2034 1/s, found with 4,000
// candidates), where the goal varies as a cube root, and only two at a time are kept together: the
// result depends on the seed, and is this close to the optimum at best.
TEST_CASE("two gains, three eigenvalues that meet: near the optimum from any seed") {
  constexpr double optimum = 0.2034, near = 0.06;
  const TuneProblem problem = two_gains(study_of({level}));
  for (const std::uint64_t seed : {1, 2, 3, 4, 5, 6}) {
    const double goal = tune(problem, {.seed = seed, .evaluations = 1000, .threads = 1}).goal;
    CAPTURE(seed);
    CHECK(goal >= (1 - near) * optimum);
    CHECK(goal <= optimum + 5e-5);
    if (sanitized) break;
  }
}

// ---- each measure by an independent method ----

namespace {

// The closed loop with actuator j cut after the law: its input is v, its output the law's command
// y.
LinearModel cut_at(const Vehicle& vehicle, const OperatingPoint& trimmed, Index j) {
  const Model closed = closed_loop_with_inputs(vehicle, Axes::wind);
  Model open;
  open.name = "cut";
  open.states = closed.states;
  open.parameters = closed.parameters;
  open.inputs = {{"v", "", 0.1}};
  open.outputs = {{"y", "", 0.1}};
  const auto command = [closed, j](const VectorXd& x, const VectorXd& p) {
    return closed.h(x, VectorXd::Zero(3), p)[j];
  };
  open.f = [closed, command, j](const VectorXd& x, const VectorXd& v, const VectorXd& p) {
    return closed.f(x, (v[0] - command(x, p)) * VectorXd::Unit(3, j), p);
  };
  open.h = [command](const VectorXd& x, const VectorXd&, const VectorXd& p) -> VectorXd {
    return VectorXd::Constant(1, command(x, p));
  };
  const VectorXd v = VectorXd::Constant(1, command(trimmed.x, trimmed.p));
  LinearModel linear = linearize(open, {trimmed.x, v, trimmed.p}, {.method = Method::differences});
  REQUIRE(linear);
  return linear;
}

double abscissa(const Eigen::MatrixXcd& A) { return algebra::eigenvalues(A).real().maxCoeff(); }

// Where f, negative at zero, first is not: by steps up to `most`, then by halving.
double first_not_negative(const std::function<double(double)>& f, double step, double most) {
  double low = 0;
  for (double high = step; high <= most; low = high, high += step) {
    if (f(high) < 0) continue;
    while (high - low > 1e-11) {
      const double middle = 0.5 * (low + high);
      (f(middle) < 0 ? low : high) = middle;
    }
    return high;
  }
  return infinity;
}

struct Scanned {
  double gain_db, phase_deg, delay, disk;
};

// Margins without a formula for them: gain and lag by eigenvalues of the loop closed through
// κ = k and κ = exp(-iφ), delay and disk by a scan of the frequencies.
Scanned scanned(const LinearModel& cut) {
  const auto closed_through = [&](Complex kappa) {
    return abscissa(cut.A.cast<Complex>() + kappa * (cut.B * cut.C).cast<Complex>());
  };
  const auto at_gain = [&](double sign) {
    const auto f = [&](double log_k) { return closed_through(std::exp(sign * log_k)); };
    return first_not_negative(f, 2e-2, std::log(1e3));
  };
  const auto at_lag = [&](double phi) { return closed_through(std::polar(1.0, -phi)); };
  Scanned s{20 / std::numbers::ln10 * std::min(at_gain(1.0), at_gain(-1.0)),
            180 / pi * first_not_negative(at_lag, 1e-2, pi), infinity, 0.0};
  const auto L = [&](double omega) -> Complex {
    const Eigen::MatrixXcd shifted = Complex(0, omega) * Eigen::MatrixXcd::Identity(6, 6) - cut.A;
    return -(cut.C.cast<Complex>() *
             algebra::solve(shifted, Eigen::MatrixXcd(cut.B.cast<Complex>())))(0);
  };
  constexpr int steps = 4'000;
  const auto omega_at = [](double i) { return std::pow(10.0, -4.0 + 8.0 * i / steps); };
  const auto beyond_one = [&](double i) { return std::abs(L(omega_at(i))) - 1; };
  const auto sensitive = [](Complex l) { return std::abs((1.0 - l) / (1.0 + l)); };
  double before = beyond_one(0), peak = 0, at_peak = 0;
  for (int i = 1; i <= steps; ++i) {
    const Complex here = L(omega_at(i));
    if (sensitive(here) > peak) peak = sensitive(here), at_peak = i;
    const double now = std::abs(here) - 1;
    if (now * before < 0) {
      double low = i - 1, high = i;
      while (high - low > 1e-11) {
        const double middle = 0.5 * (low + high);
        (beyond_one(middle) * before > 0 ? low : high) = middle;
      }
      double lag = std::arg(L(omega_at(high))) + pi;
      if (lag <= 0) lag += 2 * pi;
      s.delay = std::min(s.delay, lag / omega_at(high));
    }
    before = now;
  }
  for (double i = at_peak - 1; i <= at_peak + 1; i += 0.01)  // again, a hundred times as dense
    peak = std::max(peak, sensitive(L(omega_at(i))));
  s.disk = 2 / peak;
  return s;
}

// The largest |y - middle|/half of each actuator for x' = A x from x0, y = y0 + C x, by
// Runge-Kutta.
std::array<double, 3> integrated_uses(const LinearModel& linear, const VectorXd& y0,
                                      const std::array<Range, 3>& limits, const VectorXd& x) {
  const MatrixXd& A = linear.A;
  const VectorXcd lambda = eigenvalues(A);
  const double dt = 0.05 / lambda.cwiseAbs().maxCoeff();
  const double end = 12 / -lambda.real().maxCoeff();
  Eigen::Vector3d middle, half, largest = Eigen::Vector3d::Zero();
  for (std::size_t j = 0; j < 3; ++j) {
    middle[Index(j)] = 0.5 * (limits.at(j).lower + limits.at(j).upper);
    half[Index(j)] = 0.5 * (limits.at(j).upper - limits.at(j).lower);
  }
  const Eigen::Matrix<double, 3, 6> C = linear.C.topRows(3);
  const Eigen::Vector3d from_middle = y0.head(3) - middle;
  // Of a linear system the four stages are one matrix.
  const MatrixXd Z = dt * A, I = MatrixXd::Identity(6, 6);
  const Eigen::Matrix<double, 6, 6> step = I + Z * (I + Z / 2 * (I + Z / 3 * (I + Z / 4)));
  Eigen::Matrix<double, 6, 1> now = x;
  for (double t = 0; t < end; t += dt, now = step * now)
    largest = largest.cwiseMax((from_middle + C * now).cwiseAbs());
  largest = largest.cwiseQuotient(half);
  return {largest[0], largest[1], largest[2]};
}

const std::array<const char*, 3> actuator_names{"theta0", "a1s", "delta_e"};

std::array<Range, 3> ranges(const Limits& l) { return {l.theta0, l.a1s, l.delta_e}; }

// The value of requirement i at the only place.
double value_at(const TuneResult& result, std::size_t i) {
  const auto asked = [&](const Achieved& a) { return a.asked == i; };
  return std::ranges::find_if(result.achieved, asked)->value;
}

// One evaluation: the middle of the box.
TuneResult evaluated(const Study& study, const std::vector<Requirement>& limits) {
  TuneProblem p = problem_of(study, 1.01);
  p.loops = {closed_loop_with_inputs(study.vehicle, Axes::wind)};
  p.uncertain = {{"aircraft.mass", 3.6, 4.4}, {"aircraft.CM_de", -0.8, -0.5}};
  p.corners = false;
  p.disturbance = {{"V_err", 0.5}, {"gamma_err", -0.05}, {"q", 0.1}};
  p.limits = limits;
  return tune(p, {.evaluations = 1, .threads = 1});
}

// Gains drawn about the reference ones that keep the condition stable.
std::optional<Study> drawn(const FlownAt& flight, std::mt19937_64& random) {
  std::uniform_real_distribution<double> power(-1.0, 1.0);
  Study study = study_of({flight});
  for (std::size_t k = 0; k < gain_signals().size(); ++k)
    gain_value(study.vehicle.gains, k) *= std::pow(1.6, power(random));
  const TrimResult trimmed = trim_closed_loop(study.vehicle, *study.conditions.front().command());
  if (!trimmed) return {};
  const LinearModel linear = linearize(closed_loop(study.vehicle, Axes::wind), trimmed.point);
  if (modes(linear).spectral_abscissa > -0.01) return {};
  return study;
}

void check_margins(const Study& study, const TrimResult& trimmed) {
  constexpr std::array margins_asked{Measure::gain_margin_db, Measure::phase_margin_deg,
                                     Measure::delay_margin, Measure::disk_margin};
  std::array<double, 4> least{infinity, infinity, infinity, infinity};
  for (Index j = 0; j < 3; ++j) {
    const std::string actuator = actuator_names.at(std::size_t(j));
    std::vector<Requirement> limits;
    for (const Measure m : margins_asked) limits.push_back({m, 0.0, actuator});
    const TuneResult result = evaluated(study, limits);
    const LinearModel cut = cut_at(study.vehicle, trimmed.point, j);
    CAPTURE(actuator);
    if ((cut.B * cut.C).norm() < 1e-12) {  // the law does not command it here
      for (std::size_t i = 1; i <= 4; ++i) CHECK(std::isnan(value_at(result, i)));
      continue;
    }
    const Scanned s = scanned(cut);
    const std::array<double, 4> expected{s.gain_db, s.phase_deg, s.delay, s.disk};
    for (std::size_t i = 0; i < 4; ++i) {
      CAPTURE(to_string(margins_asked.at(i)));
      const double found = value_at(result, i + 1);
      least.at(i) = std::min(least.at(i), found);
      if (std::isfinite(expected.at(i)))
        CHECK_NEAR(found, expected.at(i), 1e-5 * expected.at(i));
      else if (i == 0)
        CHECK(found > 60 - 1e-6);  // as far as was scanned
      else
        CHECK(found == infinity);
    }
  }
  std::vector<Requirement> of_all;
  for (const Measure m : margins_asked) of_all.push_back({m, 0.0});
  const TuneResult result = evaluated(study, of_all);
  for (std::size_t i = 0; i < 4; ++i)
    CHECK_NEAR(value_at(result, i + 1), least.at(i), 1e-9 * least.at(i));
}

void check_uses(const Study& study, const TrimResult& trimmed, const LinearModel& linear) {
  const auto limits = ranges(study.vehicle.limits);
  VectorXd x0 = VectorXd::Zero(6);
  x0[0] = 0.5, x0[1] = -0.05, x0[3] = 0.1;
  const std::array<double, 3> after_all = integrated_uses(linear, trimmed.outputs, limits, x0);
  double most = 0, most_after = 0;
  std::vector<Requirement> asked;
  std::vector<double> expected;
  for (Index j = 0; j < 3; ++j) {
    const Range& range = limits.at(std::size_t(j));
    const double middle = 0.5 * (range.lower + range.upper);
    const double use = std::abs(trimmed.outputs[j] - middle) / (0.5 * (range.upper - range.lower));
    const double after = after_all.at(std::size_t(j));
    asked.push_back({Measure::use, 1.0, actuator_names.at(std::size_t(j))});
    asked.push_back({Measure::response_use, 1.0, actuator_names.at(std::size_t(j))});
    expected.insert(expected.end(), {use, after});
    most = std::max(most, use);
    most_after = std::max(most_after, after);
  }
  asked.insert(asked.end(), {{Measure::use, 1.0}, {Measure::response_use, 1.0}});
  expected.insert(expected.end(), {most, most_after});
  const TuneResult result = evaluated(study, asked);
  // A response is sampled ten times to the radian of the fastest mode.
  constexpr double sampled = 2e-3;
  for (std::size_t i = 0; i < asked.size(); ++i) {
    CAPTURE(to_string(asked[i].measure));
    CAPTURE(asked[i].of);
    const double tolerance =
        asked[i].measure == Measure::use ? 1e-8 : sampled * std::max(expected[i], 1e-3);
    CHECK_NEAR(value_at(result, i + 1), expected[i], tolerance);
  }
}

void check_half_times(const Study& study, const LinearModel& linear) {
  std::map<std::string, double> slowest;
  for (const Mode& m : modes(linear).modes) {
    double& half_time = slowest.try_emplace(m.name, 0.0).first->second;
    half_time = std::max(half_time, m.time_to_half());
  }
  for (const auto& [name, expected] : slowest) {
    const TuneResult result = evaluated(study, {{Measure::half_time, 100.0, name}});
    CHECK_NEAR(value_at(result, 1), expected, 1e-6 * expected);
  }
}

// Eigenvalues trimmed again with one number a little less and a little more.
void check_sensitivity(const Study& study, const LinearModel& linear) {
  const VectorXcd here = eigenvalues(linear.A);
  const auto with = [&](double Aircraft::*number, double by) {
    Vehicle vehicle = study.vehicle;
    vehicle.aircraft.*number += by;
    return eigenvalues(linear_at(vehicle, *study.conditions.front().command()).A);
  };
  double expected = 0;
  for (const auto& [number, half] : {std::pair{&Aircraft::mass, 0.4}, {&Aircraft::CM_de, 0.15}}) {
    const double h = 1e-4 * half;
    const VectorXcd less = with(number, -h), more = with(number, h);
    for (const Complex& z : here) {
      const auto nearest = [&](const VectorXcd& all) {
        Index i = 0;
        (all.array() - z).abs().minCoeff(&i);
        return all[i];
      };
      expected = std::max(expected, half * std::abs(nearest(more) - nearest(less)) / (2 * h));
    }
  }
  const TuneResult result = evaluated(study, {{Measure::sensitivity, 100.0}});
  CHECK_NEAR(value_at(result, 1), expected, 1e-4 * expected);
}

}  // namespace

TEST_CASE("margins, uses, half-times, sensitivities: each as another road has it") {
  std::mt19937_64 random(31);
  for (const FlownAt& flight : {climb, transition, level}) {
    CAPTURE(flight.name);
    for (int done = 0; done < (sanitized ? 1 : 3);) {
      const std::optional<Study> study = drawn(flight, random);
      if (!study) continue;
      ++done;
      const Command& command = *study->conditions.front().command();
      const TrimResult trimmed = trim_closed_loop(study->vehicle, command);
      const LinearModel linear = linear_at(study->vehicle, command);
      check_margins(*study, trimmed);
      check_uses(*study, trimmed, linear);
      check_half_times(*study, linear);
      check_sensitivity(*study, linear);
    }
  }
}

namespace {

// x' = -x, an actuator at 0.9 + x in [0, 1].
TuneProblem relaxing(double from) {
  TuneProblem p = planted([](const VectorXd& x, double) -> VectorXd { return -x; });
  SweepRequest& r = p.points.front();
  r.model.outputs = {{"valve", "", 1.0}};
  r.model.h = [](const VectorXd& x, const VectorXd&, const VectorXd&) -> VectorXd {
    return VectorXd::Constant(1, 0.9 + x[0]);
  };
  r.spec.bounds["valve"] = {0.0, 1.0};
  r.inputs = {"valve"};
  p.disturbance = {{"a", from}};
  p.limits = {{Measure::response_use, 0.5}};
  return p;
}

}  // namespace

TEST_CASE("use after a disturbance that drives an actuator to its end") {
  const TuneResult found = tune(relaxing(0.05), {.evaluations = 1, .threads = 1});
  CHECK_NEAR(value_at(found, 1), 0.9, 1e-12);
}

// It rises monotonically to the trim's 0.8: only its start, 0, is tested.
TEST_CASE("use after a disturbance is no less than at rest") {
  const TuneResult found = tune(relaxing(-0.4), {.evaluations = 1, .threads = 1});
  CHECK_NEAR(value_at(found, 1), 0.8, 1e-3);
  CHECK(found.status == TuneStatus::limits_unmet);
}

// ---- schedules, corners, scatter, threads ----

TEST_CASE("a schedule's ends are two sets of constant gains") {
  const Study study = study_of({climb, level});
  TuneProblem p = problem_of(study, 3.0);
  p.schedule = {0.0, pi / 2};
  p.schedule_over = "eta";
  p.limits = {{Measure::damping, 0.3}, {Measure::frequency, 25.0}};
  const TuneResult found = tune(p, {.evaluations = 200, .threads = 1});
  REQUIRE(found.gains.size() == 18);
  const auto per_place = found.gains.reshaped(2, 9);
  CHECK((per_place.row(0) - per_place.row(1)).norm() > 0.1);
  for (std::size_t point = 0; point < 2; ++point) {
    const FlownAt& flight = point == 0 ? climb : level;  // tilts of pi/2 and 0
    const VectorXd own = per_place.row(point == 0 ? 1 : 0);
    const Stability s = stability_of(study_of({flight}), own);
    const std::array<double, 3> expected{s.decay, s.damping, s.frequency};
    for (std::size_t i = 0; i < 3; ++i) {
      const Achieved& a = found.achieved.at(3 * point + i);
      CHECK(a.place.point == point);
      CHECK_NEAR(a.value, expected.at(i), 1e-7 * std::max(1.0, std::abs(expected.at(i))));
    }
  }
}

TEST_CASE("between a schedule's places gains are linear, and slopes shared out") {
  const Study study = study_of({{"between", 6.0, 45.0, 30.0}});
  TuneProblem p = problem_of(study, 3.0);
  p.schedule = {0.0, pi / 2};
  p.schedule_over = "eta";
  Candidates candidates(p, TrimOptions{});
  VectorXd at(18);
  std::mt19937_64 random(7);
  std::uniform_real_distribution<double> power(-1.0, 1.0);
  for (Index j = 0; j < 18; ++j) {
    const FreeGain& g = p.gains[std::size_t(j / 2)];
    at[j] = std::sqrt(g.lower * g.upper) * std::pow(1.5, power(random));
  }
  const PlaceModes here = candidates.at(at, true).front();
  REQUIRE(here.valid());
  VectorXd mixed(9);
  for (Index k = 0; k < 9; ++k) mixed[k] = (2 * at[2 * k] + at[2 * k + 1]) / 3;
  const Stability expected = stability_of(study, mixed);
  Stability found;
  take(found, here.eigenvalues);
  CHECK_NEAR(found.decay, expected.decay, 1e-8);
  CHECK_NEAR(found.damping, expected.damping, 1e-8);
  int compared = 0;
  for (Index j = 0; j < 18; ++j) {
    const auto around = beside(candidates, at, j);
    for (Index i = 0; i < 6; ++i) {
      const Complex z = here.eigenvalues[i];
      std::array<Complex, 4> moved;
      for (std::size_t k = 0; k < 4; ++k) {
        Index nearest = 0;
        (around[k][0].eigenvalues.array() - z).abs().minCoeff(&nearest);
        moved[k] = around[k][0].eigenvalues[nearest];
      }
      const Complex difference =
          (8.0 * (moved[2] - moved[1]) - (moved[3] - moved[0])) / (12 * step_share * at[j]);
      const double size = std::max(std::abs(here.slopes(i, j)), 1e-2 * std::abs(z) / at[j]);
      CHECK_NEAR(std::abs(difference - here.slopes(i, j)), 0.0, 1e-5 * size);
      ++compared;
    }
  }
  CHECK(compared == 108);
}

TEST_CASE("a corner is a study with those numbers") {
  const Study study = study_of({transition, level});
  TuneProblem p = problem_of(study, 1.5);
  p.uncertain = {{"aircraft.mass", 3.6, 4.4}, {"aircraft.inertia_yy", 5.0, 7.0}};
  p.limits = {{Measure::damping, 0.1}, {Measure::frequency, 25.0}};
  const TuneResult found = tune(p, {.evaluations = 1, .threads = 1});
  REQUIRE(found.achieved.size() == 2 * 5 * 3);
  double worst = infinity;
  for (std::size_t place = 0; place < 10; ++place) {
    const Achieved::Place& where = found.achieved[3 * place].place;
    Study own = study_of({where.point == 0 ? transition : level});
    const std::size_t corner = place % 5;
    if (corner > 0) {
      own.vehicle.aircraft.mass = (corner - 1) % 2 ? 4.4 : 3.6;
      own.vehicle.aircraft.inertia_yy = (corner - 1) / 2 ? 7.0 : 5.0;
      CHECK(where.scatter == fmt::format("mass = {}, inertia_yy = {}", own.vehicle.aircraft.mass,
                                         own.vehicle.aircraft.inertia_yy));
    } else {
      CHECK(where.scatter.empty());
    }
    const Stability s = stability_of(own, found.gains);
    worst = std::min(worst, s.decay);
    CHECK_NEAR(found.achieved[3 * place].value, s.decay, 1e-8);
    CHECK_NEAR(found.achieved[3 * place + 1].value, s.damping, 1e-8);
    CHECK_NEAR(found.achieved[3 * place + 2].value, s.frequency, 1e-7);
  }
  CHECK_NEAR(found.goal, worst, 1e-8);
}

namespace {

// P(X >= from) or, from zero up, P(X <= to) of a binomial, term by term.
double binomial(long n, double share, long from, long to) {
  double sum = 0;
  for (long k = from; k <= to; ++k)
    sum += std::exp(std::lgamma(double(n) + 1) - std::lgamma(double(k) + 1) -
                    std::lgamma(double(n - k) + 1) + double(k) * std::log(share) +
                    double(n - k) * std::log1p(-share));
  return sum;
}

// Eigenvalues -(1 - m) and -1, m in [0, 1.25]; beyond m = 1.125 no equilibrium.
TuneProblem scattered(double least_decay) {
  TuneProblem p = planted([](const VectorXd& x, double) -> VectorXd { return x; });
  SweepRequest& r = p.points.front();
  r.model.parameters.push_back({"m", "", 1.0});
  r.model.f = [](const VectorXd& x, const VectorXd&, const VectorXd& q) -> VectorXd {
    if (q[1] > 1.125) return VectorXd::Constant(2, not_a_number);
    return Eigen::Vector2d{(q[1] - 1) * x[0], -x[1]};
  };
  r.guess.p = VectorXd::Constant(2, 0.5);
  p.uncertain = {{"m", 0.0, 1.25}};
  p.corners = false;
  p.limits = {{Measure::decay, least_decay}};
  return p;
}

}  // namespace

TEST_CASE("robustness: a share that is known, its interval by exact sums, any threads") {
  constexpr long n = 2000;
  const TuneProblem p = scattered(0.6);  // met for m <= 0.4: 32 % of the range
  const VectorXd gains = VectorXd::Ones(1);
  const Robustness one = robustness(p, gains, n, {.threads = 1});
  const Robustness two = robustness(p, gains, n, {.threads = 2});
  const auto near_share = [&](long count, double share) {
    CHECK_NEAR(double(count) / n, share, 4 * std::sqrt(share * (1 - share) / n));
  };
  CHECK(one.samples == n);
  near_share(one.met, 0.32);
  near_share(one.no_trim, 0.1);   // m > 1.125
  near_share(one.unstable, 0.1);  // 1 < m <= 1.125
  CHECK_NEAR(one.fraction, double(one.met) / n, 1e-15);
  CHECK_NEAR(binomial(n, one.lower, one.met, n), 0.025, 1e-8);
  CHECK_NEAR(binomial(n, one.upper, 0, one.met), 0.025, 1e-8);
  CHECK((one.worst_goal >= -0.125 && one.worst_goal < -0.12));
  CHECK(one.worst.find("planted, m = 1.12") == 0);
  CHECK(one.met == two.met);
  CHECK(one.no_trim == two.no_trim);
  CHECK(one.unstable == two.unstable);
  CHECK(one.lower == two.lower);
  CHECK(one.upper == two.upper);
  CHECK(one.worst_goal == two.worst_goal);
  CHECK(one.worst == two.worst);
}

TEST_CASE("robustness: a limit that applies nowhere is not met") {
  TuneProblem p = scattered(0.6);
  p.limits = {{Measure::half_time, 1.0, "dutch roll"}};
  CHECK(robustness(p, VectorXd::Ones(1), 100, {.threads = 1}).met == 0);
  // one that applies within the range, if not at its nominal value, is met there
  const Study study = parse_study(R"([model]
state = [{name = "z", rate = "v"}, {name = "v", rate = "-p*z - c*v"}]
parameter = [{name = "p", value = 0.1}, {name = "c", value = 2}]
[[condition]]
name = "rest"
[tune]
gain = [{key = "c", from = 1.5, to = 2.5}]
uncertain = [{key = "p", from = 3, to = 5}]
limit = [{measure = "half_time", of = "z + v", at_most = 3}]
)",
                                  "tune_cases_test.toml");
  const Robustness all =
      robustness(tune_problem(study), VectorXd::Constant(1, 1.5), 100, {.threads = 1});
  CHECK(all.met == 100);
  // a seed given in place of the study's draws those of the search, too
  CHECK(tune_study(study, {.seed = 7, .evaluations = 1}, {}).problem.sample_seed == 7);
}

TEST_CASE("pole regions with other bounds are other measures") {
  const Requirement region{.measure = Measure::pole_region, .damping = 0.5};
  Requirement other = region;
  other.limit = 2;
  CHECK(region.same_measure(other));
  for (double Requirement::*const bound :
       {&Requirement::decay, &Requirement::damping, &Requirement::frequency}) {
    other = region;
    other.*bound = 2;
    CHECK_FALSE(region.same_measure(other));
  }
}

TEST_CASE("robustness at the ends: none, all") {
  TuneProblem p = scattered(2.0);  // never: the other eigenvalue is -1
  const VectorXd gains = VectorXd::Ones(1);
  constexpr long n = 100;
  const Robustness none = robustness(p, gains, n, {.threads = 1});
  CHECK(none.met == 0);
  CHECK(none.lower == 0.0);
  CHECK_NEAR(none.upper, 1 - std::pow(0.025, 1.0 / n), 1e-10);
  p.uncertain = {{"m", 0.0, 0.3}};
  p.limits = {{Measure::decay, 0.6}};
  const Robustness all = robustness(p, gains, n, {.threads = 1});
  CHECK(all.met == n);
  CHECK(all.upper == 1.0);
  CHECK_NEAR(all.lower, std::pow(0.025, 1.0 / n), 1e-10);
}

TEST_CASE("one thread or two: the same bits") {
  TuneProblem p = problem_a();
  p.uncertain = {{"aircraft.mass", 3.8, 4.2}};
  p.samples = 2;
  const long evaluations = trials(200);
  const TuneOptions one{.evaluations = evaluations, .threads = 1},
      two{.evaluations = evaluations, .threads = 2};
  const TuneResult a = tune(p, one), b = tune(p, two);
  const auto same = [](double x, double y) { return x == y || (std::isnan(x) && std::isnan(y)); };
  CHECK(a.status == b.status);
  CHECK(a.message == b.message);
  CHECK(a.gains == b.gains);
  CHECK(a.goal == b.goal);
  REQUIRE(a.achieved.size() == b.achieved.size());
  for (std::size_t i = 0; i < a.achieved.size(); ++i) {
    CHECK(same(a.achieved[i].value, b.achieved[i].value));
    CHECK(a.achieved[i].place.scatter == b.achieved[i].place.scatter);
    CHECK(same(a.achieved[i].eigenvalue.imag(), b.achieved[i].eigenvalue.imag()));
  }
  REQUIRE(a.effects.size() == b.effects.size());
  for (std::size_t i = 0; i < a.effects.size(); ++i) {
    CHECK(a.effects[i].name == b.effects[i].name);
    CHECK(a.effects[i].slopes == b.effects[i].slopes);
    CHECK(same(a.effects[i].goal_less, b.effects[i].goal_less));
    CHECK(same(a.effects[i].goal_more, b.effects[i].goal_more));
  }
}

}  // namespace tune_cases_test
