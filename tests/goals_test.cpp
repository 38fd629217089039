// Goals over responses, several goals, and problems with printed results: every number by hand, by
// differences, or as printed.
#include <fmt/ranges.h>

#include <Eigen/LU>
#include <cmath>
#include <fstream>
#include <nlohmann/json.hpp>
#include <numbers>
#include <random>

#include "design/design.hpp"
#include "model/differentiate.hpp"
#include "model/lookup.hpp"
#include "study/problems.hpp"
#include "study/reference_vehicle.hpp"
#include "study/study.hpp"
#include "tests/check.hpp"
#include "tune/requirement.hpp"
#include "tune/step_response.hpp"
#include "tune/tune.hpp"
#include "vehicles/tiltrotor/formulations.hpp"

using namespace tiltrim;
using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using nlohmann::json;

namespace goals_test {

namespace {

TuneResult tuned(const std::string& text) {
  const Study study = parse_study(text, "goals_test.toml");
  return tune(tune_problem(study), tune_options(study));
}

std::string terms(const json& row, const std::string& name) {
  std::string sum;
  for (std::size_t k = 0; k < row.size(); ++k)
    if (row[k] != 0) sum += fmt::format(" + {}*{}{}", row[k].get<double>(), name, k + 1);
  return sum;
}

std::string numbered(const std::string& name, std::size_t count) {
  std::vector<std::string> all;
  for (std::size_t k = 0; k < count; ++k) all.push_back(fmt::format("\"{}{}\"", name, k + 1));
  return fmt::format("[{}]", fmt::join(all, ", "));
}

// A plant of data/references/fixed_order.json, K's entries free.
std::string published(const json& p) {
  const std::size_t n = p["A"].size(), nw = p["B1"][0].size(), nz = p["C1"].size(),
                    ny = p["C"].size(), nu = p["B"][0].size();
  std::string text = "[model]\n", tail;
  for (std::size_t i = 0; i < n; ++i)
    text += fmt::format("[[model.state]]\nname = \"x{}\"\nrate = \"0{}{}{}\"\n", i + 1,
                        terms(p["A"][i], "x"), terms(p["B1"][i], "w"), terms(p["B"][i], "u"));
  for (std::size_t i = 0; i < ny; ++i)
    text += fmt::format("[[model.let]]\nname = \"y{}\"\nvalue = \"0{}{}\"\n", i + 1,
                        terms(p["C"][i], "x"), terms(p["D21"][i], "w"));
  for (std::size_t i = 0; i < nu; ++i) {
    std::string law = "0";
    for (std::size_t j = 0; j < ny; ++j) {
      law += fmt::format(" + k{}{}*y{}", i + 1, j + 1, j + 1);
      text += fmt::format("[[model.parameter]]\nname = \"k{}{}\"\nvalue = 0\n", i + 1, j + 1);
      tail += fmt::format("[[tune.gain]]\nkey = \"k{}{}\"\nfrom = -{}\nto = {}\n", i + 1, j + 1,
                          p["bound"].get<double>(), p["bound"].get<double>()) +
              "spacing = \"linear\"\n";
    }
    text += fmt::format("[[model.let]]\nname = \"u{}\"\nvalue = \"{}\"\n", i + 1, law);
  }
  for (std::size_t i = 0; i < nz; ++i)
    text += fmt::format("[[model.output]]\nname = \"z{}\"\nvalue = \"0{}{}{}\"\n", i + 1,
                        terms(p["C1"][i], "x"), terms(p["D11"][i], "w"), terms(p["D12"][i], "u"));
  std::string condition = "[[condition]]\nname = \"origin\"\n";
  for (std::size_t k = 0; k < nw; ++k) {
    text += fmt::format("[[model.input]]\nname = \"w{}\"\n", k + 1);
    condition += fmt::format("w{} = 0\n", k + 1);
  }
  return text + condition +
         fmt::format(
             "[tune]\nevaluations = 4500\ngoal = {{measure = \"peak_gain\", input = {}, "
             "output = {}}}\n",
             numbered("w", nw), numbered("z", nz)) +
         tail;
}

}  // namespace

TEST_CASE("plants of COMPleib: the printed norms of static controllers, or better" * thorough) {
  std::ifstream file(TILTRIM_SOURCE_DIR "/data/references/fixed_order.json");
  const json read = json::parse(file);
  for (const json& p : read["problems"]) {
    const std::string printed = p["printed"];
    if (sanitized && p["name"] != "HE1") continue;  // the smallest runs the same code
    CAPTURE(p["name"].get<std::string>());
    const TuneResult found = tuned(published(p));
    CHECK(found.status == TuneStatus::tuned);
    CHECK(found.goal <= std::stod(printed) + printed_to(printed));
    CHECK(found.goal > 0.9 * std::stod(printed));  // the same problem
  }
}

// n(s)/d(s) against 1/(s² (s² + 2)): the coefficients of s³ and s⁵ of the closed loop are 2 to 1,
// which (s + a)⁶ has for a² = 3/5.                                                          [93]
TEST_CASE("two masses and a spring: the decay rate √15/5 of a sextuple root") {
  const TuneResult found = tuned(R"([model]
let = [{name = "force", value = "-n2*p2 - (n1 - n2*d1)*c2 - (n0 - n2*d0)*c1"}]
state = [{name = "p1", rate = "v1"}, {name = "v1", rate = "p2 - p1 + force"},
         {name = "p2", rate = "v2"}, {name = "v2", rate = "p1 - p2"},
         {name = "c1", rate = "c2"}, {name = "c2", rate = "-d0*c1 - d1*c2 + p2"}]
parameter = [{name = "d0", value = 1}, {name = "d1", value = 1}, {name = "n0", value = 1},
             {name = "n1", value = 1}, {name = "n2", value = 1}]
[[condition]]
name = "origin"
[tune]
gain = [{key = "d0", from = 0, to = 10, spacing = "linear"},
        {key = "d1", from = 0, to = 10, spacing = "linear"},
        {key = "n0", from = -10, to = 10, spacing = "linear"},
        {key = "n1", from = -10, to = 10, spacing = "linear"},
        {key = "n2", from = -10, to = 10, spacing = "linear"}]
)");
  const double best = std::sqrt(15.0) / 5;
  CHECK(found.status == TuneStatus::tuned);
  CHECK(found.goal > (1 - 2e-3) * best);
  CHECK(found.goal <= best + 1e-9);
}

// ---- measures, by hand ----

namespace {

// z'' = -kp (z - r) - kd z' + wind + push; `push` is added to the command.
const std::string mass = R"([model]
state = [{name = "z", rate = "v"}, {name = "v", rate = "-kp*(z - r) - kd*v + wind + push"}]
output = [{name = "command", value = "-kp*(z - r) - kd*v"}, {name = "none", value = "0*z"}]
input = [{name = "wind"}, {name = "r"}, {name = "push"}, {name = "idle"}]
parameter = [{name = "kp", value = 4}, {name = "kd", value = 1}]
loop = [{name = "a", input = "push", output = "command"},
        {name = "b", input = "idle", output = "none"}]
[[condition]]
name = "rest"
wind = 0
r = 0
[tune]
gain = [{key = "kp", from = 0.01, to = 100}, {key = "kd", from = 0.01, to = 100}]
disturbance = {z = 1, v = 0.5}
)";

TuneProblem problem_of(const std::string& text) {
  return tune_problem(parse_study(text, "goals_test.toml"));
}

// The scores of the requirements with these gains.
PlaceModes described(const TuneProblem& problem, const VectorXd& gains, bool slopes = false) {
  Candidates candidates(problem, {});
  return candidates.at(gains, slopes).front();
}

double value(const std::string& goal, double kp, double kd) {
  const TuneProblem problem = problem_of(mass + "goal = {" + goal + "}\n");
  const PlaceModes place = described(problem, Eigen::Vector2d(kp, kd));
  return value_of(problem.goal.measure, worst(0, problem.goal, place).score);
}

}  // namespace

TEST_CASE("peaks, norms and costs of a mass on a spring") {
  const double kp = 4, kd = 1, omega = 2, zeta = 0.25;
  // 1/(s² + kd s + kp): 1/(2 ζ √(1 - ζ²) ω²)
  const double peak = 1 / (2 * zeta * std::sqrt(1 - zeta * zeta) * omega * omega);
  CHECK_NEAR(value("measure = 'peak_gain', input = 'wind', output = 'z'", kp, kd), peak, 1e-7);
  // of both outputs at once: √(1 + ω²) times that, over ω
  double largest = 0;
  for (double w = 1.5; w < 2.5; w += 1e-5)
    largest = std::max(largest, std::sqrt((1 + w * w) / (std::pow(kp - w * w, 2) + w * w)));
  CHECK_NEAR(value("measure = 'peak_gain', input = 'wind', output = ['z', 'v']", kp, kd), largest,
             1e-8);
  // s/(s + 3) as weight of r to z
  largest = 0;
  for (double w = 1.5; w < 2.5; w += 1e-5)
    largest = std::max(largest, w / std::hypot(w, 3) * kp / std::hypot(kp - w * w, w));
  const double weighted = value(
      "measure = 'peak_gain', input = 'r', output = 'z', weight = {numerator = [1, 0],"
      " denominator = [1, 3]}",
      kp, kd);
  CHECK_NEAR(weighted, largest, 1e-8);
  // |S| = |s²/(s² + kd s + kp)| has the peak of kp/(s² + kd s + kp), at the inverse frequency
  CHECK_NEAR(value("measure = 'peak_sensitivity', of = 'a'", kp, kd), kp * peak, 1e-6);
  // nothing of a loop that acts on nothing, with a weight as without
  const std::string lag =
      "measure = 'peak_sensitivity', weight = {numerator = [0.3], denominator = [1, 1]}";
  CHECK(value("measure = 'peak_sensitivity'", kp, kd) ==
        value("measure = 'peak_sensitivity', of = 'a'", kp, kd));
  CHECK(value(lag, kp, kd) == value(lag + ", of = 'a'", kp, kd));
  CHECK(std::isnan(value(lag + ", of = 'b'", kp, kd)));
  // ∫ h² dt = 1/(2 kd kp)
  CHECK_NEAR(value("measure = 'h2_norm', input = 'wind', output = 'z'", kp, kd),
             std::sqrt(1 / (2 * kd * kp)), 1e-12);
  CHECK(std::isinf(value("measure = 'h2_norm', input = 'r', output = 'command'", kp, kd)));
  // ∫ (3 z² + v²/2) dt from z = 1, v = 1/2, by P: kd kp ∫z² = ..., ∫v² = (kp z₀² + v₀²)/(2 kd)
  const double v2 = (kp + 0.25) / (2 * kd);
  const double z2 = (0.5 * kd + 0.5 + v2) / kp;  // from d(z v + kd z²/2)/dt = v² - kp z²
  const double cost = value("measure = 'quadratic_cost', weights = {z = 3, v = 0.5}", kp, kd);
  CHECK_NEAR(cost, 3 * z2 + 0.5 * v2, 1e-11);
  // an unstable loop has none of them; poles of the region
  CHECK_NEAR(value("measure = 'pole_region', decay = 0.25, damping = 0.5, frequency = 3", kp, kd),
             0.5, 1e-12);
  CHECK_NEAR(value("measure = 'pole_region', decay = 0.25, frequency = 1", kp, kd), 0.5, 1e-12);
  CHECK_NEAR(value("measure = 'pole_region', decay = 2", kp, kd), 0.25, 1e-12);
}

// ---- commands of the tiltrotor ----

namespace {

TuneProblem of_level_flight(const std::string& goal) {
  return problem_of(
      "[[condition]]\nname = 'level'\nV = 15.0\ngamma_deg = 0.0\neta_deg = 0.0\n"
      "[tune]\ngain = [{key = 'gains.k_V', from = 0.1, to = 1}]\n"
      "disturbance = {V = 1}\ngoal = {" +
      goal + "}\n");
}

double score_at(const TuneProblem& problem, double k_V) {
  return described(problem, VectorXd::Constant(1, k_V)).scores[0];
}

// In body axes the command is a parameter, and its step changes nothing else.
TuneProblem in_body_axes(TuneProblem problem) {
  const Vehicle vehicle = reference_vehicle();
  TrimProblem body = closed_loop_problem(vehicle, {15.0, 0.0, 0.0}, Axes::body);
  SweepRequest& point = problem.points.front();
  point.model = body.model;
  point.spec = body.spec;
  point.guess = body.guess;
  point.cold = {};
  problem.loops = {closed_loop_with_inputs(vehicle, Axes::body)};
  problem.responses.clear();
  problem.disturbance.clear();
  for (std::string& from : problem.goal.from) from = from.substr(0, from.find("_added"));
  return problem;
}

}  // namespace

TEST_CASE("a command's transfers and steps are the same in wind and body axes") {
  const double k_V = 0.35;
  for (const char* goal :
       {"measure = 'peak_gain', input = 'V_added', output = 'airspeed'",
        "measure = 'peak_gain', input = ['V_added', 'gamma_added'], output = ['theta', 'delta_e']",
        "measure = 'h2_norm', input = 'gamma_added', output = 'energy_integral'",
        "measure = 'overshoot', input = 'V_added', output = 'airspeed'",
        "measure = 'settling_time', input = 'gamma_added', output = 'flight_path'"}) {
    CAPTURE(goal);
    const TuneProblem wind = of_level_flight(goal);
    const double own = score_at(wind, k_V), other = score_at(in_body_axes(wind), k_V);
    CHECK(std::isfinite(own));
    CHECK_NEAR(own / other, 1.0, 1e-7);
    // its slope, against fourth-order differences
    const PlaceModes place = described(wind, VectorXd::Constant(1, k_V), true);
    const double h = 2e-3;
    const auto at = [&](double k) { return score_at(wind, k); };
    const double slope =
        (8 * (at(k_V + h) - at(k_V - h)) - (at(k_V + 2 * h) - at(k_V - 2 * h))) / (12 * h);
    CHECK_NEAR(place.score_slopes(0, 0), slope, 1e-4 * std::max(1.0, std::abs(slope)));
  }
}

TEST_CASE("a small step of the commanded speed, flown: its overshoot") {
  const double k_V = 0.35, step = 1e-4, dt = 0.01;
  Vehicle vehicle = reference_vehicle();
  vehicle.gains.k_V = k_V;
  const TrimProblem level = closed_loop_problem(vehicle, {15.0, 0.0, 0.0}, Axes::body);
  const OperatingPoint start = trim(level.model, level.spec, level.guess).point;
  const Model& loop = level.model;
  VectorXd x = start.x, p = start.p;
  p[index_of(loop.parameters, "V", "parameter")] += step;
  const auto f = [&](const VectorXd& z) { return loop.f(z, start.u, p); };
  double fastest = 0;
  for (double t = 0; t < 100; t += dt) {
    const VectorXd k1 = f(x), k2 = f(x + 0.5 * dt * k1), k3 = f(x + 0.5 * dt * k2),
                   k4 = f(x + dt * k3);
    x += dt / 6 * (k1 + 2 * k2 + 2 * k3 + k4);
    fastest = std::max(fastest, loop.h(x, start.u, p)[3]);
  }
  CHECK_NEAR(loop.h(x, start.u, p)[3], 15 + step, 1e-3 * step);
  const double overshoot = -score_at(
      of_level_flight("measure = 'overshoot', input = 'V_added', output = 'airspeed'"), k_V);
  CHECK(overshoot > 0.01);
  CHECK_NEAR((fastest - 15) / step - 1, overshoot, 1e-3);
}

TEST_CASE("a disturbance at the elevator, over all frequencies; the cost of a deviation in speed" *
          thorough) {
  const double k_V = 0.35;
  const auto value_at = [&](const std::string& goal) {
    return -score_at(of_level_flight(goal), k_V);
  };
  Vehicle vehicle = reference_vehicle();
  vehicle.gains.k_V = k_V;
  const TrimProblem level = closed_loop_problem(vehicle, {15.0, 0.0, 0.0});
  OperatingPoint at = trim(level.model, level.spec, level.guess).point;
  at.u = VectorXd::Zero(3);
  const MatrixXd J = jacobian(closed_loop_with_inputs(vehicle), at, {0, 1, 2, 3, 4, 5, 8});
  const MatrixXd A = J.topLeftCorner(6, 6);
  double largest = 0;
  for (double w = 1e-3; w < 1e3; w *= 1.001) {
    const Eigen::MatrixXcd M = std::complex(0.0, w) * MatrixXd::Identity(6, 6) - A;
    const VectorXd b = J.col(6).head(6);
    const Eigen::VectorXcd x = M.partialPivLu().solve(b.cast<std::complex<double>>());
    largest = std::max(largest, std::abs((J.row(8).head(6) * x)(0) + J(8, 6)));
  }
  CHECK_NEAR(
      value_at("measure = 'peak_gain', input = 'delta_e_added', output = 'delta_e'") / largest, 1.0,
      1e-5);
  // ∫ V_err² dt from an airspeed 1 m/s too high, by steps of exp(A dt)
  const double dt = 1e-3;
  const MatrixXd Adt = A * dt;
  const MatrixXd step = MatrixXd::Identity(6, 6) + Adt + Adt * Adt / 2 + Adt * Adt * Adt / 6;
  VectorXd x = -VectorXd::Unit(6, 0);
  double cost = 0;
  for (double t = 0; t < 200; t += dt) {
    const VectorXd next = step * x;
    cost += dt * (x[0] * x[0] + x[0] * next[0] + next[0] * next[0]) / 3;
    x = next;
  }
  const double tuned_cost = value_at("measure = 'quadratic_cost', weights = {airspeed = 2}");
  CHECK_NEAR(tuned_cost / (2 * cost), 1.0, 1e-5);
}

TEST_CASE("a loop may have the name of a state") {
  std::string text = mass;
  text.replace(text.find("name = \"a\""), 10, "name = \"z\"");
  const TuneProblem problem =
      problem_of(text + "goal = {measure = 'peak_sensitivity', of = 'z'}\n");
  const double own = described(problem, Eigen::Vector2d(4, 1)).scores[0];
  CHECK_NEAR(-own, value("measure = 'peak_sensitivity', of = 'a'", 4, 1), 1e-12);
}

TEST_CASE("overshoot and settling time are those of closed forms") {
  const std::string overshoot = "measure = 'overshoot', input = 'r', output = 'z'";
  const std::string settling = "measure = 'settling_time', input = 'r', output = 'z', band = 0.05";
  for (const double zeta : {0.05, 0.3, 0.7, 0.95}) {
    CAPTURE(zeta);
    const double omega = 3, damped = omega * std::sqrt(1 - zeta * zeta);
    const double kp = omega * omega, kd = 2 * zeta * omega;
    CHECK_NEAR(value(overshoot, kp, kd),
               std::exp(-std::numbers::pi * zeta / std::sqrt(1 - zeta * zeta)), 1e-6);
    // the last of 10⁶ samples that is outside, and one step further
    double last = 0;
    const double step = 1e-4;
    for (int i = 0; i < 1000000; ++i) {
      const double t = i * step;
      const double y = std::exp(-zeta * omega * t) *
                       (std::cos(damped * t) + zeta * omega / damped * std::sin(damped * t));
      if (std::abs(y) > 0.05) last = t;
    }
    CHECK_NEAR(value(settling, kp, kd), last + step / 2, step / 2 + 1e-6);
  }
  // two real poles: no overshoot
  CHECK(value(overshoot, 2, 3) == 0);
  // nearly a double pole; one of them fast
  CHECK(value(overshoot, 1, 2 + 1e-9) < 1e-8);
  const double slow = 0.1, fast = 50;  // (s + slow)(s + fast): ln(20 fast/(fast - slow))/slow
  CHECK_NEAR(value(settling, slow * fast, slow + fast), std::log(20 * fast / (fast - slow)) / slow,
             1e-4);
  // a step that ends at zero has neither
  CHECK(std::isnan(value("measure = 'overshoot', input = 'wind', output = 'v'", 4, 1)));
  const TuneProblem cancelling = problem_of(R"([model]
state = [{name = "x", rate = "w - k*x"}, {name = "y", rate = "0.1*w - 0.3*k*y"}]
output = [{name = "apart", value = "x - 3*y"}]
input = [{name = "w"}]
parameter = [{name = "k", value = 1}]
[[condition]]
name = "rest"
w = 0
[tune]
gain = [{key = "k", from = 0.1, to = 10}]
goal = {measure = "overshoot", input = "w", output = "apart"}
)");
  for (const double k : {0.7, 1.3, 3.1}) {
    const PlaceModes place = described(cancelling, VectorXd::Constant(1, k));
    CHECK(std::isnan(worst(0, cancelling.goal, place).score));
  }
}

TEST_CASE("costs and norms do not depend on the units of the states") {
  // x'' + k x' + x = w in micro- and megaunits: the cost of x = 1 is (1 + k²)/(2 k), the H2 norm
  // 1/√(2 k).
  const TuneResult found = tuned(R"([model]
state = [{name = "x", nominal = 1000, rate = "1e6*v"},
         {name = "v", nominal = 0.001, rate = "1e-3*w - x/1e6 - k*v"}]
input = [{name = "w"}]
output = [{name = "y", value = "x/1000"}]
parameter = [{name = "k", value = 1}]
[[condition]]
name = "c"
w = 0
[tune]
goal = {measure = "h2_norm", input = "w", output = "y"}
gain = [{key = "k", from = 0.1, to = 10}]
disturbance = {x = 1000}
limit = [{measure = "quadratic_cost", weights = {y = 1}, at_most = 1.25}]
)");
  REQUIRE(found);  // (1 + k²)/(2 k) = 1.25 at k = 2
  CHECK_NEAR(found.gains[0], 2, 1e-6);
  CHECK_NEAR(found.goal, 0.5, 1e-6);
  CHECK_NEAR(found.achieved[1].value, 1.25, 1e-6);
}

TEST_CASE("a response that does not decay is not determined") {
  const MatrixXd A{{1e-3, 1.0}, {-1.0, 0.0}};
  CHECK(!decaying(A, Eigen::RowVector2d(1, 0), Eigen::Vector2d(1, 0), 1, 0.02, 1).determined);
}

TEST_CASE("a peak whose bounds do not meet counts with the upper one") {
  const MatrixXd A{{-2.1e-6, 1.19e-3, 0, 0},
                   {-1.19e-3, -2.1e-6, 0, 0},
                   {1.6e-3, 45.4, -3.075e-3, 0},
                   {-1.49, 22755, -6.13, -21908}};
  const VectorXd B{{-0.153, -0.487, -0.2566, -0.0527}};
  const Eigen::RowVectorXd C{{3.84e-4, 3.67e5, -4.02e-3, 21510}};
  const Peak peak = hinf_norm(A, B, C, MatrixXd::Constant(1, 1, 0.231));
  REQUIRE(peak.status == PeakStatus::iteration_limit);
  REQUIRE(peak.upper > 1.001 * peak.gain);
  const auto sum = [](double of_w, const Eigen::RowVectorXd& of_x) {
    std::string terms = fmt::format("{}*w", of_w);
    for (Index j = 0; j < of_x.size(); ++j) terms += fmt::format(" + {}*x{}", of_x[j], j + 1);
    return terms;
  };
  std::string text = "[model]\n";
  for (Index i = 0; i < 4; ++i)
    text +=
        fmt::format("[[model.state]]\nname = \"x{}\"\nrate = \"{}\"\n", i + 1, sum(B[i], A.row(i)));
  text += fmt::format("[[model.output]]\nname = \"z\"\nvalue = \"k*({})\"\n", sum(0.231, C));
  const TuneProblem problem = problem_of(text + R"([[model.input]]
name = "w"
[[model.parameter]]
name = "k"
value = 1
[[condition]]
name = "origin"
w = 0
[tune]
gain = [{key = "k", from = 0.1, to = 10}]
goal = {measure = "peak_gain", input = "w", output = "z"}
)");
  const PlaceModes place = described(problem, VectorXd::Ones(1));
  CHECK_NEAR(worst(0, problem.goal, place).score / -peak.upper, 1, 1e-9);
}

// ---- slopes ----

TEST_CASE("slopes of peaks, norms, costs and regions: those of differences of higher order") {
  const TuneProblem problem = problem_of(mass + R"(
[[tune.goal]]
measure = "peak_gain"
input = ["wind", "r"]
output = ["z", "command"]
weight = {numerator = [1, 2], denominator = [1, 3, 5]}
at_most = 1
[[tune.goal]]
measure = "peak_sensitivity"
weight = {numerator = [2, 1], denominator = [1, 2]}
at_most = 1
[[tune.goal]]
measure = "h2_norm"
input = "wind"
output = ["z", "command"]
at_most = 1
[[tune.goal]]
measure = "quadratic_cost"
weights = {z = 2, command = 0.3}
at_most = 1
[[tune.goal]]
measure = "pole_region"
decay = 0.2
damping = 0.6
frequency = 9
at_least = 1
)");
  std::mt19937 draw(5);
  std::uniform_real_distribution<double> factor(0.5, 4.0);
  for (int sample = 0; sample < trials(20); ++sample) {
    const Eigen::Vector2d gains(factor(draw), factor(draw));
    const PlaceModes here = described(problem, gains, true);
    for (std::size_t i = 0; i < problem.goals.size(); ++i) {
      const Requirement& r = problem.goals[i];
      const auto score_at = [&](const VectorXd& g) {
        return worst(i, r, described(problem, g)).score;
      };
      for (const Index j : {0, 1}) {
        const auto difference = [&](double h) {
          const Eigen::Vector2d step = h * Eigen::Vector2d::Unit(j);
          return (score_at(gains + step) - score_at(gains - step)) / (2 * h);
        };
        const double h = 1e-3;
        const double fine = (4 * difference(h) - difference(2 * h)) / 3;
        CAPTURE(name_of(r));
        CHECK_NEAR(score_slope(i, r, here)[j], fine, 2e-6 * std::max(1.0, std::abs(fine)));
      }
    }
  }
}

TEST_CASE("an unstable loop is worse than any stable one, with a slope to the axis") {
  TuneProblem problem =
      problem_of(mass + "goal = {measure = 'peak_gain', input = 'wind', output = 'z'}\n");
  problem.gains[1].lower = -1;
  problem.gains[1].logarithmic = false;
  const auto at = [&](double kd) { return described(problem, Eigen::Vector2d(4, kd), true); };
  CHECK(at(-0.5).scores[0] < at(-0.1).scores[0]);
  CHECK(at(-0.1).scores[0] < at(1e-3).scores[0]);
  CHECK(at(-0.1).score_slopes(0, 1) > 0);
  CHECK(std::isinf(value_of(Measure::peak_gain, at(-0.1).scores[0])));
}

// ---- answers ----

// The cost of x' = (x₂, -x₁ - f x₂) from unit noise is 2/f·(1/2 + ...): 1/f + 3 f/2, least at
// f² = 2/3, for outputs x₁ and f x₂.
TEST_CASE("constant output feedback of Levine and Athans: the least H2 norm" * thorough) {
  const TuneResult found = tuned(R"([model]
state = [{name = "x1", rate = "x2 + w1"}, {name = "x2", rate = "-x1 - f*x2 + w2"}]
output = [{name = "u", value = "-f*x2"}]
input = [{name = "w1"}, {name = "w2"}]
parameter = [{name = "f", value = 1}]
[[condition]]
name = "rest"
w1 = 0
w2 = 0
[tune]
gain = [{key = "f", from = 0.01, to = 100}]
goal = {measure = "h2_norm", input = ["w1", "w2"], output = ["x1", "u"]}
)");
  CHECK(found.status == TuneStatus::tuned);
  CHECK(found.end == TuneEnd::locally_optimal);
  CHECK_NEAR(found.gains[0], std::sqrt(2.0 / 3), 1e-5);
  CHECK_NEAR(found.goal, std::sqrt(std::sqrt(6.0)), 1e-10);
}

TEST_CASE("several goals: the smallest reserve is the largest possible") {
  // x' = -k x + w: 1/k against 0.1, k against 5; 1 - 10/k = 1 - k/5 at k² = 50
  const std::string text = R"([model]
state = [{name = "x", rate = "-k*x + w"}]
input = [{name = "w"}]
parameter = [{name = "k", value = 1}]
[[condition]]
name = "rest"
w = 0
[tune]
gain = [{key = "k", from = 0.01, to = 1000}]
[[tune.goal]]
measure = "peak_gain"
input = "w"
output = "x"
at_most = 0.1
[[tune.goal]]
measure = "frequency"
at_most = 5
)";
  const TuneResult found = tuned(text);
  CHECK(found.status == TuneStatus::tuned);
  CHECK(found.end == TuneEnd::locally_optimal);
  CHECK_NEAR(found.gains[0], std::sqrt(50.0), 1e-5);
  CHECK_NEAR(found.goal, 1 - std::sqrt(50.0) / 5, 1e-6);
  REQUIRE(found.achieved.size() == 3);  // and stability
  for (const std::size_t i : {0, 1}) {
    CHECK(found.achieved[i].active);
    CHECK_NEAR(found.achieved[i].reserve(), found.goal, 1e-6);
  }
  // of a half time, that of the rate: k 2/ln 2 - 1 = 1 - k/3
  const std::string two = text.substr(0, text.find("[[tune.goal]]"));
  const TuneResult half = tuned(two +
                                "goal = [{measure = \"half_time\", of = \"x\", at_most = 2},\n"
                                "        {measure = \"frequency\", at_most = 3}]\n");
  CHECK_NEAR(half.gains[0], 2 / (2 / std::numbers::ln2 + 1.0 / 3), 1e-5);
  for (const std::size_t i : {0, 1}) CHECK_NEAR(half.achieved[i].reserve(), half.goal, 1e-6);
  // a hard limit goes before both
  const TuneResult hard = tuned(text + "[[tune.limit]]\nmeasure = \"frequency\"\nat_most = 4\n");
  CHECK(hard.status == TuneStatus::tuned);
  CHECK_NEAR(hard.gains[0], 4, 1e-5);
  CHECK_NEAR(hard.goal, -1.5, 1e-5);
  // and one that none meets is named
  const TuneResult never =
      tuned(text + "[[tune.limit]]\nmeasure = \"frequency\"\nat_most = 0.005\n");
  CHECK(never.status == TuneStatus::limits_unmet);
  CHECK(never.message.find("frequency") != std::string::npos);
}

TEST_CASE("goals without influence, without a value, and of forty gains have their own statuses") {
  const TuneResult flat =
      tuned(mass + "goal = {measure = 'peak_gain', input = 'r', output = 'none'}\n");
  CHECK(flat.end == TuneEnd::no_influence);
  const TuneResult undefined =
      tuned(mass + "goal = {measure = 'overshoot', input = 'wind', output = 'v'}\n");
  CHECK(undefined.status == TuneStatus::limits_unmet);
  CHECK(undefined.message.find("final value is zero") != std::string::npos);
  const TuneResult infinite = tuned(
      mass + "evaluations = 500\ngoal = {measure = 'h2_norm', input = 'r', output = 'command'}\n");
  CHECK(infinite.end == TuneEnd::no_influence);
  CHECK(infinite.status == TuneStatus::limits_unmet);
  CHECK(infinite.message.find("h2_norm at 'rest' is infinite") != std::string::npos);
  CHECK(std::isinf(infinite.goal));
  std::string forty = "[model]\n",
              gains =
                  "[tune]\nevaluations = 400\n"
                  "goal = {measure = \"h2_norm\", input = \"w\", output = \"x\"}\n",
              sum = "0";
  for (int i = 0; i < 40; ++i) {
    forty += fmt::format("[[model.parameter]]\nname = \"k{}\"\nvalue = 1\n", i);
    gains += fmt::format("[[tune.gain]]\nkey = \"k{}\"\nfrom = 0.1\nto = 2\n", i);
    sum += fmt::format(" + k{}/40", i);
  }
  forty += "[[model.state]]\nname = \"x\"\nrate = \"-(" + sum +
           ")*x + w\"\n"
           "[[model.input]]\nname = \"w\"\n[[condition]]\nname = \"rest\"\nw = 0\n";
  const TuneResult found = tuned(forty + gains);
  CHECK(found.status == TuneStatus::tuned);
  CHECK_NEAR(found.goal, 0.5, 1e-3);  // 1/√(2 k) at k = 2
}

// ---- starts ----

TEST_CASE("a regulator's gains are a start where the law is state feedback") {
  const Study study = parse_study(mass + "regulator_starts = [0.01, 1, 100]\n", "goals_test.toml");
  const TuneProblem problem = tune_problem(study);
  const std::vector<double> efforts = study.tune->regulator_starts;
  const std::vector<VectorXd> starts =
      regulator_starts(problem, tune_options(study).start, efforts);
  REQUIRE(starts.size() == 3);
  for (std::size_t k = 0; k < 3; ++k) {
    const Regulator regulator =
        lqr(MatrixXd{{0, 1}, {0, 0}}, Eigen::Vector2d(0, 1), MatrixXd::Identity(2, 2),
            efforts[k] * MatrixXd::Identity(1, 1));
    REQUIRE(regulator);
    CHECK_NEAR(starts[k][0], regulator.K(0, 0), 1e-7);
    CHECK_NEAR(starts[k][1], regulator.K(0, 1), 1e-7);
  }
  CHECK_THROWS_AS((void)regulator_starts(problem, starts[0], {-1.0}), std::invalid_argument);
  TuneProblem closed = problem;
  closed.loops.clear();
  CHECK_THROWS_AS((void)regulator_starts(closed, starts[0], {1.0}), std::invalid_argument);
  CHECK_THROWS_AS((void)regulator_starts(problem, VectorXd::Ones(3), {1.0}), std::invalid_argument);
  // s² + kd s + kp with the poles -a and -2 a
  const std::vector<VectorXd> placed = placed_starts(problem, starts[0], {0.5, 3});
  REQUIRE(placed.size() == 2);
  CHECK_NEAR(placed[0][0], 0.5, 1e-9);
  CHECK_NEAR(placed[0][1], 1.5, 1e-9);
  CHECK_NEAR(placed[1][0], 18, 1e-7);
  CHECK_NEAR(placed[1][1], 9, 1e-7);
  CHECK_THROWS_AS((void)placed_starts(problem, starts[0], {0.0}), std::invalid_argument);
  CHECK_THROWS_AS((void)placed_starts(closed, starts[0], {1.0}), std::invalid_argument);
  // The quadratic cost of the regulator's own weights is least at its gains.
  TuneProblem quadratic = problem;
  quadratic.goal = {.measure = Measure::quadratic_cost};
  quadratic.goal.weights = {{"z", 1.0}, {"v", 1.0}, {"command", 1.0}};
  const TuneResult found = tune(quadratic, {.starts = starts});
  CHECK(found.status == TuneStatus::tuned);
  const PlaceModes regulated = described(quadratic, starts[1]);
  CHECK(found.goal <= -regulated.scores[0] * (1 + 1e-9));
  CHECK_NEAR(found.goal, -regulated.scores[0], 1e-6);
  CHECK_THROWS_AS((void)tune(quadratic, {.starts = {VectorXd::Ones(3)}}), std::invalid_argument);
}

// ---- mistakes ----

TEST_CASE("requirements that cannot be evaluated are refused, with the key and the names") {
  const auto says = [](const std::string& goal, const std::string& words) {
    CAPTURE(goal);
    std::string message;
    try {
      (void)tuned(mass + "goal = {" + goal + "}\n");
    } catch (const std::exception& e) {
      message = e.what();
    }
    CAPTURE(message);
    CHECK(message.find(words) != std::string::npos);
  };
  says("measure = 'peak_gain'", "tune.goal.input");
  says("measure = 'peak_gain', input = 'winds', output = 'z'", "wind, r, push, idle, kp, kd");
  says("measure = 'peak_gain', input = 'wind', output = []", "tune.goal.output: is empty");
  says("measure = 'peak_gain', input = 'wind', output = 3", "3 is not a name");
  says("measure = 'decay', input = 'wind'", "input does not apply to decay");
  says(
      "measure = 'peak_gain', input = 'wind', output = 'z', weight = {numerator = [1, 0, 0], "
      "denominator = [1, 1]}",
      "no higher degree");
  says("measure = 'peak_gain', input = 'wind', output = 'z', weight = {denominator = [1, -1]}",
       "stable weight");
  says("measure = 'peak_gain', input = 'wind', output = 'z', weight = {denominator = [0, 1]}",
       "the first not zero");
  says("measure = 'overshoot', input = ['r', 'wind'], output = 'z'", "expected one of each");
  says("measure = 'quadratic_cost'", "tune.goal.weights");
  says("measure = 'quadratic_cost', weights = 3", "is not a table");
  says("measure = 'quadratic_cost', weights = {y = 1}", "'y'");
  says("measure = 'pole_region'", "positive decay, damping or frequency");
  says("measure = 'peak_gain', input = 'wind', output = 'z', at_most = 1", "no limit");
  CHECK_THROWS_WITH_AS(
      (void)tuned(R"([model]
state = [{name = "theta", unit = "rad", rate = "-k*theta"}]
parameter = [{name = "k", value = 1}]
[[condition]]
name = "rest"
[tune]
gain = [{key = "k", from = 1, to = 2}]
disturbance = {theta_deg = 10, theta = 0.5}
)"),
      "goals_test.toml:8:28: tune.disturbance.theta_deg: theta_deg is given twice; expected each "
      "number once",
      StudyError);
}

}  // namespace goals_test
