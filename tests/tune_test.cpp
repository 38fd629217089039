#include "tune/tune.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <limits>
#include <random>

#include "linearize/linearize.hpp"
#include "linearize/modes.hpp"
#include "study/problems.hpp"
#include "study/study.hpp"
#include "tests/check.hpp"
#include "tune/candidate.hpp"
#include "tune/measures.hpp"
#include "vehicles/tiltrotor/corridor.hpp"
#include "vehicles/tiltrotor/formulations.hpp"
#include "vehicles/tiltrotor/numbers.hpp"

using namespace tiltrim;
using Complex = std::complex<double>;
using Eigen::Index;
using Eigen::VectorXd;

namespace tune_test {

namespace {

Study three_conditions() {
  return parse_study(R"(
[[condition]]
name = "climb"
V = 2.0
gamma_deg = 90.0
eta_deg = 90.0
[[condition]]
name = "transition"
V = 6.0
gamma_deg = 45.0
eta_deg = 45.0
[[condition]]
name = "level"
V = 15.0
gamma_deg = 0.0
eta_deg = 0.0
)",
                     "tune_test.toml");
}

// The reference aircraft, three conditions, nine gains in [0.02, 10], every eigenvalue damped by
// 0.4 at least and no faster than 20 rad/s; the least decay rate is to be as large as it can be.
TuneProblem problem_a() {
  const Study study = three_conditions();
  TuneProblem p;
  p.points = sweep_requests(study, study.conditions, {});
  for (const Signal& s : gain_signals()) p.gains.push_back({s.name, 0.02, 10.0, true});
  p.limits = {{Measure::damping, 0.4}, {Measure::frequency, 20.0}};
  return p;
}

// Two differential evolutions of 40,000 evaluations each ended there.
constexpr double evolved = 0.3346;

Modes modes_with(const Study& study, const VectorXd& gains, const Condition& condition) {
  Vehicle vehicle = study.vehicle;
  for (std::size_t k = 0; k < gain_signals().size(); ++k)
    gain_value(vehicle.gains, k) = gains[Index(k)];
  const TrimResult trimmed = trim_closed_loop(vehicle, *condition.command());
  REQUIRE(trimmed.status == TrimStatus::converged);
  const LinearModel linear = linearize(closed_loop(vehicle, Axes::wind), trimmed.point);
  return modes(linear.A);
}

}  // namespace

TEST_CASE("three conditions, nine gains: past what evolution found, by two searches, any seed" *
          thorough) {
  const TuneProblem problem = problem_a();
  const Study study = three_conditions();
  for (const GlobalSearch global : {GlobalSearch::multistart, GlobalSearch::mlsl})
    for (const std::uint64_t seed : {1, 2, 3}) {
      // The fewer candidates would all go to the global search.
      if (sanitized && global != GlobalSearch::multistart) continue;
      const TuneResult found =
          tune(problem, {.global = global, .seed = seed, .evaluations = trials(4000)});
      CAPTURE(to_string(global));
      CAPTURE(seed);
      REQUIRE(found.status == TuneStatus::tuned);
      CHECK(found.evaluations <= 4000);
      if (!sanitized) CHECK(found.goal >= evolved - printed_to("0.3346"));
      if (!sanitized) CHECK(found.coalescing);
      // Verified independently.
      double decay = std::numeric_limits<double>::infinity();
      for (const Condition& condition : study.conditions)
        for (const Mode& m : modes_with(study, found.gains, condition).modes) {
          decay = std::min(decay, -m.eigenvalue.real());
          CHECK(m.damping() >= 0.4 - 1e-9);
          CHECK(std::abs(m.eigenvalue) <= 20 + 1e-9);
        }
      CHECK_NEAR(decay, found.goal, 1e-6);
      for (Index j = 0; j < found.gains.size(); ++j)
        CHECK((found.gains[j] >= 0.02 && found.gains[j] <= 10.0));
    }
}

TEST_CASE("slopes of eigenvalues agree with trimming again, the trim's shift included") {
  const TuneProblem problem = problem_a();
  Candidates candidates(problem, TrimOptions{});
  std::mt19937_64 random(11);
  std::uniform_real_distribution<double> share(0.05, 0.95);
  int compared = 0;
  for (int trial = 0; trial < trials(1000); ++trial) {
    VectorXd gains(9);
    for (double& g : gains) g = 0.02 * std::pow(500.0, share(random));
    const std::vector<PlaceModes> points = candidates.at(gains, true);
    const Index j = Index(random() % 9);
    const double h = 1e-3 * gains[j];
    const auto at = [&](double steps) {
      VectorXd moved = gains;
      moved[j] += steps * h;
      return candidates.at(moved, false);
    };
    const auto p1 = at(1), m1 = at(-1), p2 = at(2), m2 = at(-2);
    for (std::size_t p = 0; p < points.size(); ++p) {
      if (!points[p].valid()) continue;
      const Eigen::VectorXcd& lambda = points[p].eigenvalues;
      for (Index i = 0; i < lambda.size(); ++i) {
        double gap = std::numeric_limits<double>::infinity();
        for (Index k = 0; k < lambda.size(); ++k)
          if (k != i) gap = std::min(gap, std::abs(lambda[k] - lambda[i]));
        if (gap < 0.3 * std::abs(lambda[i])) continue;  // simple, and well so
        const auto same = [&](const std::vector<PlaceModes>& at_step) {
          const Eigen::VectorXcd& all = at_step[p].eigenvalues;
          return *std::min_element(all.begin(), all.end(), [&](Complex a, Complex b) {
            return std::abs(a - lambda[i]) < std::abs(b - lambda[i]);
          });
        };
        // Of fourth order, where those of second agree well enough to tell.      [4, sec. 8.1]
        const Complex near = (same(p1) - same(m1)) / (2.0 * h);
        const Complex wide = (same(p2) - same(m2)) / (4.0 * h);
        const Complex difference = (4.0 * near - wide) / 3.0;
        const Complex slope = points[p].slopes(i, j);
        const double scale = std::max(std::abs(slope), 1e-2 * std::abs(lambda[i]) / gains[j]);
        if (std::abs(near - wide) > 1e-4 * scale) continue;
        CHECK(std::abs(difference - slope) <= 1e-6 * scale);
        ++compared;
      }
    }
  }
  CHECK(compared > trials(5000));
}

TEST_CASE("what cannot be is said, with the requirement's name") {
  TuneProblem p = problem_a();
  p.limits = {{Measure::decay, 5.0}};
  p.goal = {Measure::damping};
  const TuneResult unmet = tune(p, {.evaluations = 300});
  CHECK(unmet.status == TuneStatus::limits_unmet);
  CHECK(unmet.message.find("required is at least 5 1/s") != std::string::npos);
  CHECK(!unmet);

  const TuneResult nothing = tune(problem_a(), {.evaluations = 0});
  CHECK(nothing.status == TuneStatus::no_trim);
  CHECK(nothing.out_of_evaluations);
  CHECK(nothing.message == "the search ended before a candidate was evaluated: decay is unknown");
}

TEST_CASE("no equilibrium at any candidate is no success") {
  TuneProblem p = problem_a();
  p.points.resize(1);
  p.points[0].spec.bounds["theta0"] = {0.0, 0.01};
  p.points[0].cold = {};
  p.gains.resize(1);
  const TuneResult result = tune(p, {.evaluations = 2});
  CHECK(result.status == TuneStatus::no_trim);
  CHECK(result.message.find("no equilibrium at 'climb'") != std::string::npos);
}

TEST_CASE("the caller's mistakes") {
  const auto broken = [](auto change) {
    TuneProblem p = problem_a();
    change(p);
    return tune(p, {.evaluations = 10});
  };
  const double nan = std::numeric_limits<double>::quiet_NaN();
  CHECK_THROWS_WITH_AS(broken([](TuneProblem& p) { p.gains[0].upper = 0.01; }),
                       doctest::Contains("gains.k_V is free in [0.02, 0.01]"),
                       std::invalid_argument);
  CHECK_THROWS_AS(broken([&](TuneProblem& p) { p.gains[0].lower = nan; }), std::invalid_argument);
  CHECK_THROWS_WITH_AS(broken([](TuneProblem& p) { p.gains[0].lower = -1; }),
                       doctest::Contains("logarithmic"), std::invalid_argument);
  CHECK_THROWS_WITH_AS(broken([](TuneProblem& p) { p.gains[0].name = "gains.k_VV"; }),
                       doctest::Contains("gains.k_V"), std::invalid_argument);
  CHECK_THROWS_WITH_AS(broken([](TuneProblem& p) { p.gains[0].name = "theta"; }),
                       doctest::Contains("an unknown of the trim"), std::invalid_argument);
  CHECK_THROWS_AS(broken([](TuneProblem& p) { p.gains.clear(); }), std::invalid_argument);
  CHECK_THROWS_AS(broken([](TuneProblem& p) { p.points.clear(); }), std::invalid_argument);
}

TEST_CASE("the same seed, the same answer; a stop keeps the best") {
  const TuneProblem p = problem_a();
  const TuneResult a = tune(p, {.seed = 5, .evaluations = 300});
  const TuneResult b = tune(p, {.seed = 5, .evaluations = 300});
  CHECK(a.gains == b.gains);
  CHECK(a.goal == b.goal);
  std::stop_source stop;
  TuneOptions options{.evaluations = 300, .stop = stop.get_token()};
  options.observe = [&](const TuneProgress& at) {
    if (at.evaluations == 100) stop.request_stop();
  };
  const TuneResult stopped = tune(p, options);
  CHECK(stopped.interrupted);
  CHECK(stopped.evaluations == 100);
  CHECK(stopped.gains.size() == 9);
}

namespace {

const std::filesystem::path studies = std::filesystem::path(TILTRIM_SOURCE_DIR) / "studies";

SweepAxis listed(const std::string& key, const std::vector<double>& values) {
  std::string text = "[[sweep.axis]]\nkey = \"" + key + "\"\nvalues = [";
  for (const double v : values) text += fmt::format("{}, ", v);
  text += "]\n[[condition]]\nname = \"c\"\nV = 15.0\ngamma_deg = 0.0\neta_deg = 0.0\n";
  return parse_study(text, "axis.toml").sweep->axes.front();
}

}  // namespace

TEST_CASE("the answer is no worse than a front's points that meet the study's own limits") {
  Study study = load_study(studies / "tune_paper.toml");  // damping: 0.4, and from 0.4 to 0.8
  study.tune->second = "none";
  TuneOptions options = tune_options(study);
  options.evaluations = 300;
  const TuningReport report = tune_study(study, options);
  REQUIRE(report.front.size() == 5);
  // A search of 300 candidates alone ends below the front's.
  const double alone = tune(report.problem, options).goal;
  double best = alone;
  for (const TuningReport::FrontPoint& p : report.front)
    if (p.result) best = std::max(best, p.result.goal);
  if (!sanitized) CHECK(best > alone + 1e-4);
  CHECK(report.result.goal >= best * (1 - 1e-6));  // of a search
}

TEST_CASE("thirteen points, all corners of 15 % in mass, inertia and CM_de: constant gains do") {
  const Study study = load_study(studies / "tune_corridor.toml");
  const TuneProblem problem = tune_problem(study);
  REQUIRE(problem.points.size() == 13);
  TuneOptions options = tune_options(study);
  if (!sanitized) options.global = global_search(study.tune->second);
  options.evaluations = trials(int(options.evaluations));
  const TuneResult found = tune(problem, options);
  REQUIRE(found.status == TuneStatus::tuned);
  if (!sanitized) CHECK(found.goal >= 0.1677);

  // The same places by a sweep.
  Study own = study;
  for (std::size_t k = 0; k < 9; ++k) gain_value(own.vehicle.gains, k) = found.gains[Index(k)];
  std::vector<double> heights;
  for (int i = 0; i < 13; ++i) heights.push_back(10.0 * i);
  const std::vector<SweepAxis> axes{listed("aircraft.mass", {4 * 0.85, 4 * 1.15}),
                                    listed("aircraft.inertia_yy", {6.076 * 0.85, 6.076 * 1.15}),
                                    listed("aircraft.CM_de", {-0.64 * 1.15, -0.64 * 0.85}),
                                    listed("h", heights)};
  const SweepMap map = sweep(sweep_requests(own, own.conditions, axes), axes, {.crossings = false});
  for (std::size_t i = 0; i < map.points(); ++i) {
    CHECK(map.verdict[i] == std::int8_t(Verdict::stable));
    CHECK(map.spectral_abscissa[i] <= -found.goal + 1e-6);
    CHECK(map.damping[i] >= 0.4 - 1e-6);
  }
  const Robustness random = robustness(problem, found.gains, trials(1000), options);
  CHECK(random.no_trim + random.unstable == 0);
}

TEST_CASE("gains scheduled over the tilt: stable between the points wherever there is a trim") {
  if (sanitized) return;  // 26,000 points, whose code the sweep's tests run
  const Study study = load_study(studies / "scheduled.toml");
  std::vector<SweepAxis> axes = study.sweep->axes;
  const SweepMap map = sweep(sweep_requests(study, study.conditions, axes), axes, {});
  const int h = int(axes.size()) - 1;
  int throughout = 0;
  for (const AxisInterval& i : map.intervals) {
    if (i.axis != h) continue;
    if (i.verdict == IntervalVerdict::stable && i.from == 0 && i.to == 120) ++throughout;
    CHECK((i.verdict == IntervalVerdict::stable || i.verdict == IntervalVerdict::no_trim));
    if (i.verdict != IntervalVerdict::no_trim) continue;
    CHECK(i.at[0] ==
          4.6);  // where the elevator alone cannot hold the heaviest with the least of it
    CHECK(i.at[2] == -0.544);
    CHECK((i.from > 46.4 && i.to < 47.0));
  }
  CHECK(throughout == 24);
  // and no gains would
  Vehicle vehicle = study.vehicle;
  vehicle.aircraft.mass = 4.6;
  vehicle.aircraft.CM_de = -0.544;
  CHECK(trim_closed_loop(vehicle, corridor(46.6)).status == TrimStatus::infeasible);
}

}  // namespace tune_test
