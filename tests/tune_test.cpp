#include "tune/tune.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <limits>
#include <numbers>
#include <random>

#include "linearize/linearize.hpp"
#include "linearize/modes.hpp"
#include "study/problems.hpp"
#include "study/study.hpp"
#include "tests/check.hpp"
#include "tune/candidate.hpp"
#include "tune/measures.hpp"
#include "tune/requirement.hpp"
#include "tune/step_response.hpp"
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

// ---- measures of responses: infinite, huge, or slow to settle ----

namespace {

TuneProblem asked_of_text(const std::string& model, const std::string& requirement) {
  return tune_problem(parse_study(model + "[tune]\nsecond = \"none\"\nevaluations = 300\n" +
                                      "gain = [{key = \"g\", from = 0.5, to = 2}]\n" + requirement,
                                  "tune_test.toml"));
}

// x' = -g x + u with this output.
std::string lag(const std::string& output) {
  return "[model]\nstate = [{name = \"x\", rate = \"-g*x + u\"}]\ninput = [{name = \"u\"}]\n"
         "parameter = [{name = \"g\", value = 1}]\noutput = [{name = \"o\", value = \"" +
         output + "\"}]\n[[condition]]\nname = \"c\"\nu = 0\n";
}

// The value of a goal from u to o at g.
double value_at(const std::string& model, const std::string& measure, double g) {
  const TuneProblem problem = asked_of_text(
      model, "goal = {measure = \"" + measure + "\", input = \"u\", output = \"o\"}\n");
  Candidates candidates(problem, {});
  const PlaceModes place = candidates.at(VectorXd::Constant(1, g), false).front();
  return value_of(problem.goal.measure, worst(0, problem.goal, place).score);
}

// y(t) = Re Σ r exp(λ t).
struct Sum {
  std::vector<Complex> r, lambda;

  double operator()(double t) const {
    Complex y = 0;
    for (std::size_t i = 0; i < r.size(); ++i) y += r[i] * std::exp(lambda[i] * t);
    return y.real();
  }
  // The last t with |y| > band, by samples back from where the sum of amplitudes is below it.
  double last_beyond(double band, double step) const {
    const auto amplitudes = [&](double t) {
      double sum = 0;
      for (std::size_t i = 0; i < r.size(); ++i) sum += std::abs(r[i] * std::exp(lambda[i] * t));
      return sum;
    };
    double within = 1, beyond = 0;
    while (amplitudes(within) > band) within *= 2;
    for (int i = 0; i < 50; ++i)
      (amplitudes((within + beyond) / 2) > band ? beyond : within) = (within + beyond) / 2;
    double in = within;
    while (std::abs((*this)(in)) <= band) in -= step;
    double out = in;
    in += step;
    for (int i = 0; i < 60; ++i)
      (std::abs((*this)((in + out) / 2)) > band ? out : in) = (in + out) / 2;
    return out;
  }
};

// What is left of a unit step through Π -λ/(s - λ).
Sum left_of_step(const std::vector<Complex>& lambda) {
  Sum sum{{}, lambda};
  for (std::size_t i = 0; i < lambda.size(); ++i) {
    Complex r = -1.0;
    for (std::size_t k = 0; k < lambda.size(); ++k)
      if (k != i) r *= lambda[k] / (lambda[k] - lambda[i]);
    sum.r.push_back(r);
  }
  return sum;
}

std::vector<Complex> pair_of(double omega, double zeta) {
  const Complex upper = omega * Complex(-zeta, std::sqrt(1 - zeta * zeta));
  return {upper, std::conj(upper)};
}

// A real matrix with these eigenvalues, in blocks, and what a unit step leaves at its sum.
struct Blocks {
  Eigen::MatrixXd A;
  Eigen::RowVectorXd c;
  VectorXd x;
};
Blocks blocks(const Sum& sum) {
  const auto n = Index(sum.r.size());
  Blocks b{Eigen::MatrixXd::Zero(n, n), Eigen::RowVectorXd::Ones(n), VectorXd::Zero(n)};
  for (Index i = 0; i < n; ++i) {
    const Complex lambda = sum.lambda[std::size_t(i)], r = sum.r[std::size_t(i)];
    b.A(i, i) = lambda.real();
    b.x[i] = r.real();
    if (lambda.imag() == 0) continue;
    // z' = λ z: its real part counts twice, its imaginary part not
    b.A(i, i + 1) = -lambda.imag();
    b.A(i + 1, i) = lambda.imag();
    b.A(i + 1, i + 1) = lambda.real();
    b.c[i] = 2;
    b.c[i + 1] = 0;
    b.x[i + 1] = r.imag();
    ++i;
  }
  return b;
}

}  // namespace

TEST_CASE("a measure without a finite value meets no limit") {
  const std::string direct = lag("x + 0.5*u");
  const TuneProblem problem = asked_of_text(
      direct, "limit = [{measure = \"h2_norm\", input = \"u\", output = \"o\", at_most = 1e6}]\n");
  const TuneResult found = tune(problem, {.evaluations = 300});
  CHECK(found.status == TuneStatus::limits_unmet);
  CHECK(contains(found.message, "h2_norm at 'c'"));
  CHECK(contains(found.message, "infinite"));
  CHECK(std::isinf(value_at(direct, "h2_norm", 1)));
  // x' = x, which no gain changes
  std::string unstable = lag("x");
  unstable.replace(unstable.find("-g*x"), 4, "x");
  for (const char* measure : {"peak_gain", "h2_norm", "overshoot", "settling_time"}) {
    CAPTURE(measure);
    CHECK(std::isinf(value_at(unstable, measure, 1)));
    const TuneProblem p =
        asked_of_text(unstable, std::string("limit = [{measure = \"") + measure +
                                    "\", input = \"u\", output = \"o\", at_most = 1e6}]\n");
    Candidates candidates(p, {});
    const PlaceModes place = candidates.at(VectorXd::Ones(1), false).front();
    CHECK(missed_by(p.limits[0], worst(1, p.limits[0], place).score) > 1);
  }
  // an eigenvalue twice with one eigenvector moves infinitely fast: a' = b, b' = e a at e = 0
  TuneProblem twice = asked_of_text(
      "[model]\nstate = [{name = \"a\", rate = \"b - a\"}, {name = \"b\", rate = \"e*a - g*b\"}]\n"
      "parameter = [{name = \"g\", value = 1}, {name = \"e\", value = 0}]\n"
      "[[condition]]\nname = \"c\"\n",
      "uncertain = [{key = \"e\", from = -1, to = 1}]\ncorners = \"none\"\n"
      "limit = [{measure = \"sensitivity\", at_most = 1e6}]\n");
  Candidates candidates(twice, {});
  const PlaceModes place = candidates.at(VectorXd::Ones(1), false).front();
  CHECK(missed_by(twice.limits[0], worst(1, twice.limits[0], place).score) > 0);
}

TEST_CASE("finite values beyond 1e6 are what they are") {
  const auto near = [](double actual, double expected, double relative) {
    CHECK_NEAR(actual / expected, 1.0, relative);
  };
  for (const double g : {0.5, 1.0, 2.0}) {
    near(value_at(lag("1e9*x"), "peak_gain", g), 1e9 / g, 1e-7);
    near(value_at(lag("1e9*x"), "h2_norm", g), 1e9 / std::sqrt(2 * g), 1e-12);
  }
  // its square is beyond 1e6, itself not
  near(value_at(lag("2000*sqrt(2)*x"), "h2_norm", 1), 2000, 1e-12);
  // slow: ln 50 over a decay of 1e-7
  near(value_at(lag("x + 0*u"), "settling_time", 1), std::log(50.0), 1e-7);
  std::string slow = lag("x");
  slow.replace(slow.find("-g*x"), 4, "-1e-7*g*x");
  near(value_at(slow, "settling_time", 1), std::log(50.0) / 1e-7, 1e-7);
  // unstable remains worse than any of them
  CHECK(score_of(Measure::peak_gain, 1e12) > score_of(Measure::peak_gain, 1e15));
}

TEST_CASE("a goal beyond 1e6 is optimized, a limit is missed by the value that is printed") {
  const std::string of_u = "{measure = \"peak_gain\", input = \"u\", output = \"o\"";
  for (const LocalSearch local : {LocalSearch::bfgs, LocalSearch::slsqp, LocalSearch::bobyqa}) {
    const TuneResult least = tune(asked_of_text(lag("1e9*x"), "goal = " + of_u + "}\n"),
                                  {.local = local, .evaluations = 300});
    CHECK(least.status == TuneStatus::tuned);
    CHECK_NEAR(least.goal, 5e8, 1e2);  // at g = 2
    CHECK_NEAR(least.gains[0], 2, 1e-6);
  }
  const TuneResult missed =
      tune(asked_of_text(lag("1e9*x"), "limit = [" + of_u + ", at_most = 9.9e5}]\n"),
           {.evaluations = 300});
  CHECK(missed.status == TuneStatus::limits_unmet);
  CHECK(contains(missed.message, "the best found is 5e+08, required is at most 990000"));
}

TEST_CASE("a feasible candidate is better than one that is not, however large its goal") {
  const Merit feasible{0, true, -1e25, 0.0}, larger{0, true, -1e24, 0.0};
  const Merit missed{0, false, 1.0, 1e-3}, more{0, false, 1.0, 1e30}, lost{1, false, 0.0, 0.0};
  CHECK(feasible < larger);
  CHECK(missed < feasible);
  CHECK(more < missed);
  CHECK(lost < more);
}

TEST_CASE("the settling time of a loop with little damping is that of the closed form") {
  for (const double zeta : {5e-3, 2e-3, 1e-3, 1e-4, 1e-5}) {
    CAPTURE(zeta);
    for (const bool fast : {false, true}) {
      std::vector<Complex> lambda = pair_of(1, zeta);
      if (fast)
        for (const Complex& l : pair_of(300, 0.6)) lambda.push_back(l);
      if (fast) lambda.emplace_back(-1000.0);
      const Sum sum = left_of_step(lambda);
      const auto [A, c, x] = blocks(sum);
      const Decaying settling = decaying(A, c, x, 1, 0.02, 1);
      REQUIRE(settling.determined);
      const double expected = sum.last_beyond(0.02, 1e-3);
      CHECK_NEAR(settling.last_beyond, expected, 1e-9 * expected + 1e-6);
      const Decaying over = decaying(A, c, x, 1, 0, 1);
      REQUIRE(over.determined);
      if (!fast)
        CHECK_NEAR(over.largest, std::exp(-std::numbers::pi * zeta / std::sqrt(1 - zeta * zeta)),
                   1e-7);
    }
  }
  const std::string spring =
      "[model]\nstate = [{name = \"x\", rate = \"v\"}, {name = \"v\", rate = \"u - x - 0.01*v\"}]\n"
      "input = [{name = \"u\"}]\nparameter = [{name = \"g\", value = 1}]\n"
      "output = [{name = \"o\", value = \"x\"}]\n[[condition]]\nname = \"c\"\nu = 0\n";
  CHECK_NEAR(value_at(spring, "settling_time", 1),
             left_of_step(pair_of(1, 0.005)).last_beyond(0.02, 1e-3), 1e-5);
  const TuneResult met =
      tune(asked_of_text(spring,
                         "limit = [{measure = \"settling_time\", input = \"u\", output = \"o\", "
                         "at_most = 1000}]\n"),
           {.evaluations = 50});
  CHECK(met.status == TuneStatus::tuned);
}

TEST_CASE("two modes with little damping that beat, and one behind a slow one") {
  // 0.7 cos t and 0.5 cos 1.01 t, one of which outlives the other
  const Sum beat{{-0.35, -0.35, -0.25, -0.25},
                 {{-1e-3, 1}, {-1e-3, -1}, {-8e-4, 1.01}, {-8e-4, -1.01}}};
  const auto [A, c, x] = blocks(beat);
  CHECK_NEAR(decaying(A, c, x, 1, 0.02, 1).last_beyond, beat.last_beyond(0.02, 1e-3), 1e-5);
  double largest = 0;
  for (double t = 0; t < 2000; t += 1e-3) largest = std::max(largest, beat(t));
  CHECK_NEAR(decaying(A, c, x, 1, 0, 1).largest, largest, 1e-6);
  // -exp(-t/100) + (1 - cos 5 t)/1000 or so: above only once the slow one is gone
  const Sum behind{{-1.0, -5e-4, -5e-4}, {{-0.01, 0}, {-1e-4, 5}, {-1e-4, -5}}};
  const auto [B, d, z] = blocks(behind);
  largest = 0;
  for (double t = 0; t < 3000; t += 1e-3) largest = std::max(largest, behind(t));
  REQUIRE(largest > 5e-4);
  CHECK_NEAR(decaying(B, d, z, 1, 0, 1).largest, largest, 1e-8);
  CHECK_NEAR(decaying(B, d, z, 1, 0.02, 1).last_beyond, behind.last_beyond(0.02, 1e-3), 1e-5);
}

TEST_CASE("two equal modes in series have no basis of eigenvectors: t exp(-s t) cos t") {
  for (const double s : {0.3, 1e-2, 1e-3}) {
    CAPTURE(s);
    const Eigen::MatrixXd A{{-s, 1, 1, 0}, {-1, -s, 0, 1}, {0, 0, -s, 1}, {0, 0, -1, -s}};
    const double size = 1 / s, band = 0.02 * size;
    double last = 0, largest = 0;
    for (double t = 0; t < 20 / s; t += 1e-3) {
      const double y = t * std::exp(-s * t) * std::cos(t);
      if (std::abs(y) > band) last = t;
      largest = std::max(largest, y);
    }
    const Eigen::RowVector4d c(1, 0, 0, 0);
    const Eigen::Vector4d x(0, 0, 1, 0);
    const Decaying settling = decaying(A, c, x, 1, band, size);
    REQUIRE(settling.determined);
    CHECK_NEAR(settling.last_beyond, last + 5e-4, 5e-4 + 1e-5);
    const Decaying over = decaying(A, c, x, 1, 0, size);
    REQUIRE(over.determined);
    CHECK_NEAR(over.largest, largest, 1e-6 * size);
  }
}

TEST_CASE("use after a disturbance of two equal modes in series, and of one with little damping") {
  TuneProblem problem = asked_of_text(
      "[model]\nstate = [{name = \"a\", rate = \"b - a\"}, {name = \"b\", rate = \"-b\"},\n"
      "  {name = \"x\", rate = \"v\"}, {name = \"v\", rate = \"-x - 2e-4*v\"},\n"
      "  {name = \"z\", rate = \"-g*z\"}]\n"
      "parameter = [{name = \"g\", value = 1}]\n"
      "output = [{name = \"d\", value = \"a\"}, {name = \"e\", value = \"0.1 - x\"}]\n"
      "[[condition]]\nname = \"c\"\n",
      "disturbance = {b = 1, x = 1}\n");
  problem.points[0].inputs = {"d", "e"};
  problem.points[0].spec.bounds["d"] = {-1, 1};
  problem.points[0].spec.bounds["e"] = {-2, 2};
  problem.limits = {{Measure::response_use, 1.0, "d"}, {Measure::response_use, 1.0, "e"}};
  Candidates candidates(problem, {});
  const PlaceModes place = candidates.at(VectorXd::Ones(1), false).front();
  const auto use = [&](std::size_t i) { return -worst(i, problem.limits[i - 1], place).score; };
  CHECK_NEAR(use(1), std::exp(-1.0), 1e-8);  // t exp(-t) at t = 1
  // 0.1 - x, where x is first lowest after half a period
  const double zeta = 1e-4, over = std::exp(-std::numbers::pi * zeta / std::sqrt(1 - zeta * zeta));
  CHECK_NEAR(use(2), (0.1 + over) / 2, 1e-8);
}

TEST_CASE("a settling time that is not determined is said to be so") {
  // the same with a decay of 1e-9, beyond what can be followed
  const std::string text =
      "[model]\nstate = [{name = \"a\", rate = \"-1e-9*a + b + c\"},\n"
      "  {name = \"b\", rate = \"-a - 1e-9*b + d\"}, {name = \"c\", rate = \"-1e-9*c + d + u\"},\n"
      "  {name = \"d\", rate = \"-c - 1e-9*d\"}, {name = \"x\", rate = \"-g*x\"}]\n"
      "input = [{name = \"u\"}]\nparameter = [{name = \"g\", value = 1}]\n"
      "output = [{name = \"o\", value = \"a\"}]\n[[condition]]\nname = \"c\"\nu = 0\n";
  const TuneResult found =
      tune(asked_of_text(text,
                         "limit = [{measure = \"settling_time\", input = \"u\", output = \"o\", "
                         "at_most = 1e6}]\n"),
           {.evaluations = 1});
  CHECK(found.status == TuneStatus::limits_unmet);
  CHECK(contains(found.message, "not determined"));
}

}  // namespace tune_test
