// Models written as formulas against hand calculations, published values and the same in C++.
#include <algorithm>
#include <boost/math/special_functions/ellint_1.hpp>
#include <cmath>
#include <complex>
#include <numbers>
#include <random>

#include "linearize/modes.hpp"
#include "model/lookup.hpp"
#include "study/analyses.hpp"
#include "study/problems.hpp"
#include "study/study.hpp"
#include "sweep/sweep.hpp"
#include "tests/check.hpp"
#include "tune/tune.hpp"

using namespace tiltrim;
using Complex = std::complex<double>;
using Eigen::Index;
using Eigen::VectorXd;

namespace user_cases_test {

namespace {

constexpr double g = 9.81, mass = 0.1, k = 9.81e-5, k_p = 200, k_d = 2;
const double pull = std::sqrt(mass * g / k);  // of the current over the gap, A/m: 100

const std::filesystem::path levitation_file = TILTRIM_SOURCE_DIR "/studies/levitation.toml";

Study levitation() { return load_study(levitation_file); }

Study parsed(const std::string& text) { return parse_study(text, "t.toml"); }

TrimResult trimmed(const Study& study, std::size_t condition = 0) {
  return answer(study.vehicle, study.conditions.at(condition)).trim;
}

// λ² + (2g/i) k_d λ + (2g/i) k_p - 2g/z = 0, with positive imaginary part.
Complex eigenvalue(double gap, double kp = k_p, double kd = k_d) {
  const double half = g / (pull * gap) * kd;
  const double c = 2 * g / (pull * gap) * kp - 2 * g / gap;
  return -half + std::sqrt(Complex(half * half - c));
}

const std::string lorenz = R"toml(
[model]
name = "Lorenz"
state = [
  {name = "x", rate = "sigma*(y - x)"},
  {name = "y", rate = "x*(r - z) - y"},
  {name = "z", rate = "x*y - b*z"}]
parameter = [
  {name = "sigma", value = 10},
  {name = "r", value = 10},
  {name = "b", value = 2.6666666666666667}]
[[condition]]
name = "convection"
guess = {x = 5, y = 5, z = 9}
[follow]
parameter = "r"
to = 30
[[sweep.axis]]
key = "r"
from = 10
to = 30
count = 21
)toml";

Branch branch_of(const Study& study) {
  return follow(study.vehicle, study.conditions.at(0), study.follow->parameter, study.follow->to)
      .branch;
}

const BranchEvent& only(const Branch& branch, EventKind kind) {
  REQUIRE(std::ranges::count(branch.events, kind, &BranchEvent::kind) == 1);
  return *std::ranges::find(branch.events, kind, &BranchEvent::kind);
}

SweepMap map_of(const Study& study, std::size_t condition = 0) {
  return sweep(sweep_requests(study, {study.conditions.at(condition)}, study.sweep->axes),
               study.sweep->axes);
}

// u + v - k x = y', x' = y; `lines` of the condition.
Study two_forces(const std::string& lines) {
  return parsed(
      "[model]\n"
      "state = [{name = 'x', rate = 'y'}, {name = 'y', rate = 'u + v - k*x'}]\n"
      "input = [{name = 'u'}, {name = 'v'}]\n"
      "output = [{name = 'apart', value = 'u - v'}]\n"
      "parameter = [{name = 'k', value = 2}]\n"
      "[[condition]]\nname = 'a'\n" +
      lines);
}

}  // namespace

// ---- levitation.toml by hand calculation ----

TEST_CASE("levitation: trims") {
  const Study study = levitation();
  CHECK_NEAR(pull, 100, 1e-12);
  const TrimResult held = trimmed(study, 0);
  REQUIRE(held);
  CHECK_NEAR(held.point.x[0], (k_p * 0.01 - 1) / (k_p - pull), 1e-12);
  CHECK_NEAR(held.point.x[1], 0, 1e-12);
  CHECK_NEAR(held.outputs[0], 1, 1e-10);
  CHECK_NEAR(held.outputs[1], mass * g, 1e-10);
  const TrimResult bias = trimmed(study, 1);
  REQUIRE(bias);
  CHECK(bias.point.x[0] == 0.008);
  CHECK_NEAR(bias.point.p[index_of(study.user_model->model.parameters, "bias", "parameter")],
             pull * 0.008 - k_p * (0.008 - 0.01), 1e-10);
}

TEST_CASE("levitation: A, B, C, D are exact to rounding") {
  const Study study = levitation();
  const TrimResult trim = trimmed(study, 0);
  const LinearModel linear = linearize(study.user_model->model, trim.point);
  REQUIRE(linear.status == LinearizeStatus::linear);
  CHECK(linear.method == Method::exact);
  CHECK(linear.remarks.empty());
  // pull = k (i/z)², i = bias + k_p (z - aim) + k_d ż + added
  const double k = 9.81e-5, k_d = 2, z = trim.point.x[0], i = 1 + k_p * (z - 0.01);
  const double by_i = 2 * k * i / (z * z), by_z = by_i * k_p - 2 * k * i * i / (z * z * z);
  const Eigen::Matrix2d A{{0, 1}, {-by_z / mass, -by_i * k_d / mass}};
  const Eigen::Matrix2d C{{k_p, k_d}, {by_z, by_i * k_d}};
  const Eigen::Vector2d B(0, -by_i / mass), D(0, by_i);
  const auto within = [](const Eigen::MatrixXd& value, const Eigen::MatrixXd& error,
                         const Eigen::MatrixXd& truth) {
    const double size = truth.cwiseAbs().maxCoeff();
    CHECK(((value - truth).cwiseAbs() - error).maxCoeff() <= 0);
    CHECK(error.maxCoeff() < 1e-12 * size);
  };
  within(linear.A, linear.A_error, A);
  within(linear.B, linear.B_error, B);
  within(linear.C, linear.C_error, C);
  within(linear.D, linear.D_error, D);
}

TEST_CASE("levitation: eigenvalues") {
  const Study study = levitation();
  for (const std::size_t i : {0, 1}) {
    const TrimResult trim = trimmed(study, i);
    const Modes found = modes(linearize(study.user_model->model, trim.point));
    REQUIRE(found.modes.size() == 2);
    const Complex expected = eigenvalue(i == 0 ? 0.01 : 0.008);
    CHECK(found.verdict == Verdict::stable);
    CHECK_NEAR(found.modes[1].eigenvalue.real(), expected.real(), 1e-5);
    CHECK_NEAR(found.modes[1].eigenvalue.imag(), expected.imag(), 1e-5);
    CHECK_NEAR(std::abs(found.modes[1].eigenvalue - expected), 0, found.modes[1].error);
  }
}

TEST_CASE("levitation: unstable below k_p = i/z, on the grid and by the branch") {
  const Study study = levitation();
  const SweepMap map = map_of(study, 1);
  REQUIRE(map.crossings.size() == 1);
  CHECK(map.crossings[0].kind == CrossingKind::zero);
  CHECK_NEAR(map.crossings[0].at[0], pull, 1e-6);
  CHECK(map.crossings[0].unstable_before == 1);
  CHECK(map.crossings[0].unstable_after == 0);
  // With a given bias every gap is a trim at k_p = i/z, and none is isolated.
  const SweepMap held = map_of(study, 0);
  for (const AxisCrossing& c : held.crossings) CHECK_NEAR(c.at[0], pull, 1e-3);
  const auto axis = study.sweep->axes[0].columns[0].values;
  for (std::size_t i = 0; i < axis.size(); ++i) {
    CAPTURE(axis[i]);
    const bool there = std::abs(axis[i] - pull) < 1e-6;
    CHECK(Verdict(held.verdict[i]) == (there            ? Verdict::undecided
                                       : axis[i] < pull ? Verdict::unstable
                                                        : Verdict::stable));
  }
}

TEST_CASE("levitation: at k_p = i/z the branch is crossed by one of all gaps, and goes on") {
  const Study study = levitation();
  const Branch branch = branch_of(study);
  CHECK(branch.end == BranchEnd::reached);
  REQUIRE(branch.events.size() == 2);
  const BranchEvent& crossed = only(branch, EventKind::branch_point);
  CHECK_NEAR(crossed.at.parameter, pull, 1e-3);
  for (const BranchPoint& p : branch.points) {
    CHECK_NEAR(p.point.x[0], 0.01, 1e-9);
    CHECK(p.unstable == (p.parameter > pull ? 0 : 1));
  }
}

TEST_CASE("levitation: sensitivities, the trim's own shift included") {
  const Study study = levitation();
  const SensitivityAnswer a = sensitivities(study.vehicle, study.conditions[0]);
  REQUIRE(a.sensitivities);
  REQUIRE(a.sensitivities.parameters.size() == 7);
  const auto of = [&](const char* name) -> const ParameterSensitivity& {
    return *std::ranges::find_if(a.sensitivities.parameters, [&](const ParameterSensitivity& s) {
      return s.parameter.name == name;
    });
  };
  // gap = (k_p aim - bias)/(k_p - √(m g/k))
  const double apart = k_p - pull;
  CHECK_NEAR(of("bias").x[0], -1 / apart, 1e-9);
  CHECK_NEAR(of("aim").x[0], k_p / apart, 1e-7);
  CHECK_NEAR(of("k_p").x[0], 0, 1e-12);
  CHECK_NEAR(of("k_d").x[0], 0, 1e-12);
  CHECK_NEAR(of("mass").x[0], 1 / (apart * apart) * pull / (2 * mass), 1e-8);
  const double gap = 0.01, a0 = 2 * g / (pull * gap);
  const Complex at = eigenvalue(gap), slope = 2.0 * at + a0 * k_d;
  const auto moved = [&](const char* name, Complex by) {
    CAPTURE(name);
    const ParameterSensitivity::ModeSensitivity& mode =
        of(name).modes.at(1);  // of the pair the upper
    CHECK_NEAR(mode.eigenvalue.real(), by.real(), 1e-4 * std::abs(by));
    CHECK_NEAR(mode.eigenvalue.imag(), by.imag(), 1e-4 * std::abs(by));
  };
  moved("k_d", -a0 * at / slope);
  moved("k_p", -a0 / slope);
  const double shift = -1 / apart, a_shift = -a0 * shift / gap;
  moved("bias", -(a_shift * k_d * at + a_shift * k_p + 2 * g * shift / (gap * gap)) / slope);
}

TEST_CASE("levitation: margins of L = (2g/i)(k_d s + k_p)/(s² - 2g/z)") {
  const Study study = levitation();
  const LoopsAnswer a = actuator_loops(study.vehicle, study.conditions[0]);
  CHECK(a.answered());
  REQUIRE(a.loops.size() == 1);
  CHECK(a.loops[0].actuator == "coil");
  const Margins& m = a.loops[0].margins;
  CHECK(m.stable());
  const double a0 = 2 * g, pole = 2 * g / 0.01;
  for (const double w : {1.0, 30.0, 200.0}) {
    const Complex s(0, w), expected = a0 * (k_d * s + k_p) / (s * s - pole);
    CHECK_NEAR(std::abs(response(a.loops[0].loop, w) - expected), 0, 1e-6);
  }
  CHECK_NEAR(m.gain_down, pole / (a0 * k_p), 1e-7);
  CHECK_NEAR(m.gain_down_at, 0, 1e-6);
  CHECK(m.gain_up == Margins::none);
  // |L| = 1: ω⁴ + (2 pole - a² k_d²) ω² + pole² - a² k_p² = 0
  const double half = pole - a0 * a0 * k_d * k_d / 2;
  const double w = std::sqrt(-half + std::sqrt(half * half - pole * pole + a0 * a0 * k_p * k_p));
  const double phase = std::atan(k_d * w / k_p);
  CHECK_NEAR(m.phase, phase, 1e-6);
  CHECK_NEAR(m.phase_at, w, 1e-4);
  CHECK_NEAR(m.delay, phase / w, 1e-8);
  CHECK_THROWS_WITH_AS((void)actuator_loops({}, study.conditions[0], {.actuators = {"theta0"}}),
                       "no actuator 'theta0'; there are: coil", std::invalid_argument);
}

TEST_CASE("levitation: the envelope's ends are the lines of both limits of the gap") {
  const Study study = levitation();
  const EnvelopeTable& table = *study.envelope;
  const EnvelopeAnswer a = envelope({}, study.conditions[0], table, {.rows = {40, 80, 150, 240}});
  CHECK(a.answered());
  REQUIRE(a.parts.size() == 1);
  REQUIRE(a.parts[0].rows.size() == 4);
  for (const EnvelopeRow& row : a.parts[0].rows) {
    CAPTURE(row.y);
    // The magnet pulls whichever way its current flows: bias + k_p (gap - aim) = ±pull gap. Which
    // aims have a gap within 5 and 20 mm, for either sign?
    std::vector<Range> stretches;
    for (const double signed_pull : {pull, -pull}) {
      const auto aim = [&](double gap) { return gap + (1 - signed_pull * gap) / row.y; };
      const Range all{std::max(std::min(aim(0.005), aim(0.02)), 0.004),
                      std::min(std::max(aim(0.005), aim(0.02)), 0.03)};
      if (!(all.lower < all.upper)) continue;
      if (!stretches.empty() && all.lower < stretches.back().upper)
        stretches.back().upper = std::max(stretches.back().upper, all.upper);
      else
        stretches.push_back(all);
    }
    REQUIRE(row.intervals.size() == stretches.size());
    for (std::size_t i = 0; i < stretches.size(); ++i) {
      CHECK_NEAR(row.intervals[i].from.x, stretches[i].lower, 1e-8);
      CHECK_NEAR(row.intervals[i].to.x, stretches[i].upper, 1e-8);
    }
  }
  CHECK(a.parts[0].rows[0].intervals[0].from.name == "edge");
  CHECK(a.parts[0].rows[0].intervals[0].to.name == "gap lower");
  CHECK(a.parts[0].rows[1].intervals[0].from.name == "gap upper");
  CHECK(a.parts[0].rows[3].intervals[0].from.name == "gap lower");
}

TEST_CASE("levitation: the fastest decay is where both eigenvalues meet") {
  const Study study = levitation();
  TuneOptions options = tune_options(study);
  options.evaluations = 1000;
  const TuneResult best = tune(tune_problem(study), options);
  CHECK(best.status == TuneStatus::tuned);
  const double frequency = std::sqrt(2 * g * k_p - 2 * g / 0.01);
  CHECK_NEAR(best.gains[0], 2 * frequency / (2 * g), 1e-3);
  CHECK_NEAR(best.goal, frequency, 0.02);
  const auto phase = std::ranges::find_if(best.achieved, [](const Achieved& a) {
    return a.requirement.measure == Measure::phase_margin_deg;
  });
  REQUIRE(phase != best.achieved.end());
  const double a0 = 2 * g, pole = 2 * g / 0.01, kd = best.gains[0];
  const double half = pole - a0 * a0 * kd * kd / 2;
  const double w = std::sqrt(-half + std::sqrt(half * half - pole * pole + a0 * a0 * k_p * k_p));
  CHECK_NEAR(phase->value, std::atan(kd * w / k_p) * 180 / std::numbers::pi, 1e-4);
}

TEST_CASE("levitation: the motion by Runge and Kutta's steps, written out") {
  const MotionAnswer m = user_motion(levitation());
  REQUIRE(m.answered());
  const double h = 1e-5;
  double z = 0.01 + 0.0005, v = 0;
  const auto acceleration = [](double at_z, double at_v, double added) {
    const double i = 1 + k_p * (at_z - 0.01) + k_d * at_v + added;
    return g - k * i * i / (at_z * at_z) / mass;
  };
  const std::vector<double>&t = m.table["time"], &gap = m.table["gap"], &added = m.table["added"];
  std::size_t row = 0;
  for (int step = 0; step <= 50'000; ++step) {
    if (step % 500 == 0) {
      REQUIRE(row < t.size());
      CHECK_NEAR(t[row], step * h, 1e-12);
      CHECK_NEAR(gap[row], z, 1e-10);
      if (step != 30'000)  // 0.2 + 0.1 is not 0.3
        CHECK(added[row] == (step >= 20'000 && step < 30'000 ? 0.05 : 0.0));
      ++row;
    }
    const double u = step >= 20'000 && step < 30'000 ? 0.05 : 0.0;
    const double v1 = v, a1 = acceleration(z, v, u);
    const double v2 = v + h / 2 * a1, a2 = acceleration(z + h / 2 * v1, v2, u);
    const double v3 = v + h / 2 * a2, a3 = acceleration(z + h / 2 * v2, v3, u);
    const double v4 = v + h * a3, a4 = acceleration(z + h * v3, v4, u);
    z += h / 6 * (v1 + 2 * v2 + 2 * v3 + v4);
    v += h / 6 * (a1 + 2 * a2 + 2 * a3 + a4);
  }
  CHECK(row == t.size());
  CHECK(m.table.columns.size() == 6);  // time, states, input, outputs; no parameter changes
}

TEST_CASE("levitation: linear and nonlinear motion part in proportion to the offset") {
  const Condition held = levitation().conditions[0];
  const auto apart = [&](double by) {
    const Response r = user_response(held, {{"gap", by}}, {.duration = 0.3, .sample = 0.01});
    CHECK(r.status == ResponseStatus::responded);
    // x(t) = Re(C exp(λt)), x(0) = by, x'(0) = 0
    const Complex pole = eigenvalue(0.01);
    const Complex c(by, pole.real() / pole.imag() * by);
    for (std::size_t i = 0; i < r.t.size(); ++i)
      CHECK_NEAR(r.linear(0, Index(i)), (c * std::exp(pole * r.t[i])).real(), 1e-6 * by);
    return r.apart;
  };
  const double small = apart(1e-6), large = apart(2e-6);
  CHECK(small < 1e-3);
  CHECK_NEAR(large / small, 2, 0.01);
  CHECK_THROWS_AS((void)user_response(held, {{"bias", 0.1}}), std::invalid_argument);
  CHECK_THROWS_AS((void)user_response(held, {}), std::invalid_argument);
}

// ---- keys of a condition ----

TEST_CASE("an objective decides between inputs, in its scales and about its references") {
  const auto forces = [](const std::string& lines) -> Eigen::Vector2d {
    const TrimResult r = trimmed(two_forces("x = 1\nu = 'free'\nv = 'free'\n" + lines));
    REQUIRE(r);
    return r.point.u;
  };
  const auto are = [](const Eigen::Vector2d& u, double first, double second) {
    CHECK_NEAR(u[0], first, 1e-8);
    CHECK_NEAR(u[1], second, 1e-8);
  };
  are(forces(""), 1, 1);
  are(forces("objective = [{signal = 'u'}, {signal = 'v', scale = 2}]\n"), 0.4, 1.6);
  are(forces("objective = [{signal = 'u', reference = 1}, {signal = 'v'}]\n"), 1.5, 0.5);
  are(forces("objective = [{signal = 'apart', reference = -2}]\n"), 0, 2);
}

TEST_CASE("outputs are bounded and held, parameters freed") {
  const TrimResult bounded =
      trimmed(two_forces("x = 1\nu = 'free'\nv = 'free'\napart = [0.5, 1.0]\n"));
  REQUIRE(bounded);
  CHECK_NEAR(bounded.point.u[0], 1.25, 1e-8);
  REQUIRE(bounded.limits_active.size() == 1);
  CHECK(bounded.limits_active[0].signal == "apart");
  CHECK_FALSE(bounded.limits_active[0].upper);
  const TrimResult held = trimmed(two_forces("x = 1\nu = 'free'\nv = 'free'\napart = 0.2\n"));
  REQUIRE(held);
  CHECK_NEAR(held.point.u[0], 1.1, 1e-8);
  const TrimResult stiffness = trimmed(two_forces("x = 2\nu = 1\nv = 4\nk = [0, 10]\n"));
  REQUIRE(stiffness);
  CHECK_NEAR(stiffness.point.p[0], 2.5, 1e-10);
}

TEST_CASE("rates held at a number, let go, implied") {
  const TrimResult moving = trimmed(two_forces("x = 1\nu = 0\nv = 'free'\nrates = {x = 0.5}\n"));
  REQUIRE(moving);
  CHECK_NEAR(moving.point.x[1], 0.5, 1e-10);
  CHECK_NEAR(moving.point.u[1], 2, 1e-10);
  const TrimResult falling = trimmed(two_forces("x = 1\nu = 0\nv = 0\nrates = {y = 'free'}\n"));
  REQUIRE(falling);
  CHECK_NEAR(falling.point.x[1], 0, 1e-10);
  CHECK_NEAR(falling.rates[1], -2, 1e-10);
  const TrimResult implied = trimmed(two_forces("x = 1\nu = 0\nv = 0\nrates = {y = 'implied'}\n"));
  CHECK(implied.status == TrimStatus::not_implied);
}

TEST_CASE("the guess chooses among equilibria") {
  for (const double start : {-3.0, 3.0}) {
    const Study study = parsed(
        fmt::format("model.state = [{{name = 'x', rate = '1 - x^2'}}]\n[[condition]]\nname = 'a'\n"
                    "x = [-5, 5]\nguess = {{x = {}}}\n",
                    start));
    const TrimResult r = trimmed(study);
    REQUIRE(r);
    CHECK_NEAR(r.point.x[0], start / 3, 1e-10);
  }
}

// ---- known cases ----

TEST_CASE("Lorenz: Hopf point at r = σ(σ + b + 3)/(σ - b - 1), followed and on a grid") {
  constexpr double sigma = 10, b = 8.0 / 3, r = sigma * (sigma + b + 3) / (sigma - b - 1);
  CHECK_NEAR(r, 24.7368, printed_to("24.7368"));
  const double frequency = std::sqrt(2 * sigma * (sigma + 1) * b / (sigma - b - 1));
  const Study study = parsed(lorenz);
  const Branch branch = branch_of(study);
  CHECK(branch.end == BranchEnd::reached);
  const BranchEvent& hopf = only(branch, EventKind::hopf);
  CHECK_NEAR(hopf.at.parameter, r, 1e-6);
  REQUIRE(hopf.eigenvalue);
  CHECK_NEAR(std::abs(hopf.eigenvalue->imag()), frequency, 1e-5);
  for (const BranchPoint& p : branch.points) {
    CHECK_NEAR(p.point.x[0], std::sqrt(b * (p.parameter - 1)), 1e-8);
    CHECK_NEAR(p.point.x[2], p.parameter - 1, 1e-8);
  }
  const SweepMap map = map_of(study);
  REQUIRE(map.crossings.size() == 1);
  CHECK(map.crossings[0].kind == CrossingKind::hopf);
  CHECK_NEAR(map.crossings[0].at[0], r, 1e-6);
  CHECK_NEAR(map.crossings[0].frequency, frequency, 1e-5);
}

TEST_CASE("the fold's normal form turns back at zero") {
  const Branch branch =
      branch_of(parsed("[model]\nstate = [{name = 'x', rate = 'mu + x^2'}]\n"
                       "parameter = [{name = 'mu', value = -1, nominal = 1}]\n"
                       "[[condition]]\nname = 'lower'\nguess = {x = -1}\nx = [-2, 2]\n"
                       "[follow]\nparameter = 'mu'\nto = 1\n"));
  const BranchEvent& fold = only(branch, EventKind::fold);
  CHECK_NEAR(fold.at.parameter, 0, 1e-9);
  CHECK_NEAR(fold.at.point.x[0], 0, 1e-5);
}

TEST_CASE("Hopf's normal form loses its stability at zero, at one rad/s") {
  const Branch branch =
      branch_of(parsed("[model]\nstate = [{name = 'x', rate = '(mu - r2)*x - y'}, "
                       "{name = 'y', rate = 'x + (mu - r2)*y'}]\n"
                       "let = [{name = 'r2', value = 'x^2 + y^2'}]\n"
                       "parameter = [{name = 'mu', value = -1, nominal = 1}]\n"
                       "[[condition]]\nname = 'rest'\n[follow]\nparameter = 'mu'\nto = 1\n"));
  CHECK(branch.end == BranchEnd::reached);
  const BranchEvent& hopf = only(branch, EventKind::hopf);
  CHECK_NEAR(hopf.at.parameter, 0, 1e-8);
  CHECK_NEAR(std::abs(hopf.eigenvalue->imag()), 1, 1e-8);
}

TEST_CASE("a planar VTOL as formulas is the same in C++") {
  const Study study = parsed(R"toml(
[model]
state = [{name = "x", rate = "vx"}, {name = "vx", rate = "-thrust/mass*sin(theta)"},
         {name = "z", rate = "vz"}, {name = "vz", rate = "thrust/mass*cos(theta) - g"},
         {name = "theta", unit = "rad", rate = "q"}, {name = "q", unit = "rad/s", rate = "moment/inertia"}]
let = [{name = "aim", value = "(k_x*x + k_v*vx)/g"}, {name = "thrust", value = "mass*(g - 2*z - 3*vz)"},
       {name = "moment", value = "-inertia*(k_q*q + k_theta*(theta - aim))"}]
parameter = [{name = "mass", value = 4}, {name = "inertia", value = 0.5}, {name = "g", value = 9.81},
             {name = "k_theta", value = 6}, {name = "k_q", value = 4}, {name = "k_x", value = 0.75},
             {name = "k_v", value = 1}]
[[condition]]
name = "hover"
[[sweep.axis]]
key = "k_theta"
values = [1.5, 2.5, 3.5, 4.5, 5.5, 6.5]
)toml");
  const auto same = [](const VectorXd& x, const VectorXd& p) -> VectorXd {
    const double m = p[0], inertia = p[1], aim = (p[5] * x[0] + p[6] * x[1]) / p[2];
    const double thrust = m * (p[2] - 2 * x[2] - 3 * x[3]);
    return Eigen::Vector<double, 6>{x[1], -thrust / m * std::sin(x[4]),
                                    x[3], thrust / m * std::cos(x[4]) - p[2],
                                    x[5], -(p[4] * x[5] + p[3] * (x[4] - aim)) * inertia / inertia};
  };
  std::mt19937 random(1);
  std::uniform_real_distribution<double> any(-2, 2);
  for (int i = 0; i < 100; ++i) {
    const VectorXd x = VectorXd::NullaryExpr(6, [&] { return any(random); });
    const VectorXd rates = study.user_model->model.f(x, VectorXd(0), study.user_model->parameters);
    CHECK((rates - same(x, study.user_model->parameters)).cwiseAbs().maxCoeff() < 1e-12);
  }
  const SweepMap map = map_of(study);  // Routh: k_q² k_x/(k_v (k_q - k_v)) = 4
  REQUIRE(map.crossings.size() == 1);
  CHECK(map.crossings[0].kind == CrossingKind::hopf);
  CHECK_NEAR(map.crossings[0].at[0], 4, 1e-6);
}

TEST_CASE("a pendulum's period by the elliptic integral, from its study") {
  constexpr double amplitude = 2.0;
  const double period = 4 * std::sqrt(0.7 / g) * boost::math::ellint_1(std::sin(amplitude / 2));
  const Study study = parsed(
      fmt::format("[model]\nstate = [{{name = 'angle', unit = 'rad', rate = 'speed'}}, "
                  "{{name = 'speed', rate = '-g/length*sin(angle)'}}]\n"
                  "parameter = [{{name = 'g', value = 9.81}}, {{name = 'length', value = 0.7}}]\n"
                  "switch = [{{name = 'lowest', at = 'angle'}}]\n"
                  "[[condition]]\nname = 'down'\nangle = [-1, 1]\n"
                  "[simulate]\nduration = {0:.17g}\nsample = {1:.17g}\ntolerance = 1e-12\n"
                  "offset = {{angle_deg = {2:.17g}}}\n",
                  period, period / 4, amplitude * 180 / std::numbers::pi));
  const MotionAnswer m = user_motion(study);
  REQUIRE(m.answered());
  const std::vector<double>& angle = m.table["angle_deg"];
  CHECK_NEAR(angle.back(), amplitude * 180 / std::numbers::pi, 1e-7);
  REQUIRE(m.motion->events.size() == 2);
  CHECK_NEAR(m.motion->events[0].t, period / 4, 1e-9);
  CHECK_NEAR(m.motion->events[1].t, 3 * period / 4, 1e-9);
}

TEST_CASE("a doublet is a step and its opposite; a parameter that changes has a column") {
  const Study study = parsed(
      "[model]\nstate = [{name = 'x', rate = 'p - x'}]\n"
      "parameter = [{name = 'p', unit = 'rad', value = 0.1}]\n"
      "[[condition]]\nname = 'a'\n[simulate]\nduration = 4\nsample = 0.5\ntolerance = 1e-11\n"
      "[[simulate.disturbance]]\nkind = 'doublet'\non = 'p_deg'\nat = 1\nsize = 10\nduration = "
      "1\n");
  const MotionAnswer m = user_motion(study);
  REQUIRE(m.answered());
  const std::vector<double>&p = m.table["p_deg"], &x = m.table["x"];
  const double own = 0.1 * 180 / std::numbers::pi;
  const std::vector<double> expected{0, 0, 10, 10, -10, -10, 0, 0, 0};
  REQUIRE(p.size() == expected.size());
  for (std::size_t i = 0; i < p.size(); ++i) CHECK_NEAR(p[i] - own, expected[i], 1e-12);
  const double size = 10 * std::numbers::pi / 180, e = std::exp(-1.0);
  CHECK_NEAR(x[4], 0.1 + size * (1 - e), 1e-9);
  CHECK_NEAR(x[6], 0.1 + size * (1 - e) * e - size * (1 - e), 1e-9);
  CHECK_NEAR(x.back(), 0.1 + size * ((1 - e) * e - (1 - e)) * e, 1e-9);
}

TEST_CASE("no motion of the tiltrotor, none without a trim") {
  CHECK_THROWS_AS((void)user_motion(load_study(TILTRIM_SOURCE_DIR "/studies/paper.toml")),
                  std::invalid_argument);
  const MotionAnswer m = user_motion(
      parsed("model.state = [{name = 'x', rate = 'x^2 + 1'}]\n[[condition]]\nname = 'a'\n"));
  CHECK_FALSE(m.motion);
  CHECK_FALSE(m.answered());
  CHECK(m.start.trim.status == TrimStatus::not_found);
}

}  // namespace user_cases_test
