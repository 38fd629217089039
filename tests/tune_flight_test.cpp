// Tuning for whole flights.
#include <doctest/doctest.h>

#include <cmath>
#include <numbers>
#include <vector>

#include "flight/fly.hpp"
#include "study/problems.hpp"
#include "study/study.hpp"
#include "tests/check.hpp"
#include "tune/tune.hpp"
#include "vehicles/tiltrotor/numbers.hpp"

using namespace tiltrim;

namespace tune_flight_test {

namespace {

constexpr const char* level = R"(
[[condition]]
name = "level"
V = 15.0
gamma_deg = 0.0
eta_deg = 0.0
)";

constexpr const char* settles = R"(
[simulate]
schedule = "hold"
start = "level"
height = 500.0
duration = 20.0
[simulate.states]
theta_deg = 6.0
)";

constexpr const char* tuned = R"(
[tune]
goal = "tracking"
global = "crs2"
local = "sbplx"
second = "none"
evaluations = 60
[[tune.limit]]
measure = "flight"
at_most = 1.0
[[tune.gain]]
key = "gains.K_Lp"
from = 0.1
to = 5.0
[[tune.gain]]
key = "gains.k_de"
from = 0.5
to = 10.0
)";

Study study(const std::string& text) { return parse_study(text, "study.toml"); }

Eigen::VectorXd parameters(const Study& s) {
  return closed_loop_parameters(s.vehicle, {15.0, 0.0, 0.0});
}

}  // namespace

TEST_CASE("the figures of a flight are those of the flight itself") {
  const Study s = study(std::string(level) + settles + tuned);
  const TuneProblem problem = tune_problem(s);
  FlightPlan plan = flight_plan(s);
  plan.options.integrate.sample = 0.25;
  const FlightResult flown = fly(plan.flight, plan.start, plan.options);
  REQUIRE(flown);
  double sum = 0.0, theta = 0.0;
  for (std::size_t k = 0; k < flown.t.size(); ++k) {
    const FlightState& x = flown.states[k];
    const double V = std::hypot(x.along, x.across) - 15.0;
    const double gamma = x.theta - std::atan2(x.across, x.along);
    sum += V * V + 100 * gamma * gamma;
    theta = std::max(theta, std::abs(x.theta));
  }
  const FlightState& x = flown.states.back();
  const double V = std::abs(std::hypot(x.along, x.across) - 15.0) / 0.2;
  const double gamma = std::abs(x.theta - std::atan2(x.across, x.along)) / 0.01;
  constexpr double coarser = 1e-5;  // candidates are simulated with a tolerance of 1e-7
  CHECK_NEAR(problem.figures.at("tracking")(parameters(s)), std::sqrt(sum / double(flown.t.size())),
             coarser);
  CHECK_NEAR(problem.figures.at("flight")(parameters(s)), std::max({theta / 1.3, V, gamma}),
             coarser);
}

TEST_CASE("a flight that ends early counts for more the earlier it ends") {
  const std::string lost = R"(
[simulate]                # reference gains, integrals not made ready: back on the ground in seconds
schedule = "corridor"
)";
  const Study s = study(std::string(level) + lost + tuned);
  const FlightPlan plan = flight_plan(s);
  const FlightResult flown = fly(plan.flight, plan.start, plan.options);
  REQUIRE(flown.status == FlightStatus::ground_contact);
  const double expected = 10 + 90 * (1 - flown.t.back() / 90);
  const TuneProblem problem = tune_problem(s);
  CHECK_NEAR(problem.figures.at("flight")(parameters(s)), expected, 1e-4);
  CHECK_NEAR(problem.figures.at("tracking")(parameters(s)), expected, 1e-4);
}

TEST_CASE("gains are tuned for a flight") {
  const Study s = study(std::string(level) + settles + tuned);
  const TuneProblem problem = tune_problem(s);
  const TuneOptions options = tune_options(s);
  const double before = problem.figures.at("tracking")(parameters(s));
  const TuneResult result = tune(problem, options);
  REQUIRE(result);
  CHECK(result.goal < before);
  CHECK(result.evaluations <= 60);
  Study better = s;
  better.vehicle.gains.K_Lp = result.gains[0];
  better.vehicle.gains.k_de = result.gains[1];
  CHECK_NEAR(problem.figures.at("tracking")(parameters(better)), result.goal, 1e-12);
  CHECK(problem.figures.at("flight")(parameters(better)) <= 1);
}

TEST_CASE("figures computed together: once per parameter set, and apart from those of others") {
  long calls = 0;
  const auto sums = figures_together({"sum", "product"}, [&](const Eigen::VectorXd& p) {
    ++calls;
    return std::vector{p.sum(), p.prod()};
  });
  const auto others =
      figures_together({"sum"}, [](const Eigen::VectorXd& p) { return std::vector{-p.sum()}; });
  const Eigen::VectorXd first = Eigen::Vector2d(2, 5), second = Eigen::Vector2d(3, 4);
  for (const Eigen::VectorXd& p : {first, second}) {
    CHECK(sums.at("sum")(p) == p.sum());
    CHECK(sums.at("product")(p) == p.prod());
    CHECK(others.at("sum")(p) == -p.sum());
  }
  CHECK(calls == 2);
  CHECK(sums.at("sum")(second) == 7);
  CHECK(calls == 3);  // another function was asked in between
}

TEST_CASE("flights that cannot be asked for are refused") {
  std::string scheduled = std::string(level) + settles + tuned;
  scheduled.replace(scheduled.find("[tune]\n"), 7, "[tune]\nschedule_eta_deg = [0, 90]\n");
  const Study s = study(scheduled);
  CHECK_THROWS_WITH_AS((void)tune(tune_problem(s), tune_options(s)),
                       doctest::Contains("constant gains"), std::invalid_argument);
  TuneProblem none = tune_problem(study(std::string(level) + settles + tuned));
  none.figures.clear();
  CHECK_THROWS_WITH_AS((void)tune(none), doctest::Contains("not among the problem's figures;"),
                       std::invalid_argument);
}

}  // namespace tune_flight_test
