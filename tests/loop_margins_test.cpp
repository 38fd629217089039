// Margins of a study's loops: against loops opened manually and against perturbed loops, and the
// command as a user runs it.
#include <Eigen/Core>
#include <algorithm>
#include <limits>
#include <nlohmann/json.hpp>
#include <numbers>
#include <string>

#include "report/loops.hpp"
#include "study/analyses.hpp"
#include "study/reference_vehicle.hpp"
#include "tests/algebra.hpp"
#include "tests/check.hpp"
#include "tests/program.hpp"
#include "vehicles/tiltrotor/along.hpp"
#include "vehicles/tiltrotor/corridor.hpp"

using namespace tiltrim;
using Eigen::Index;
using Eigen::MatrixXcd;
using Eigen::MatrixXd;
using Eigen::RowVectorXd;
using Eigen::VectorXd;
using Complex = std::complex<double>;
using nlohmann::json;

namespace loop_margins_test {

static constexpr double infinity = std::numeric_limits<double>::infinity();
static constexpr double pi = std::numbers::pi;
static constexpr double differenced = 1e-6;  // of a Jacobian by differences, gains of 100 included

static const std::string source = TILTRIM_SOURCE_DIR;
static const std::string paper = source + "/studies/paper.toml";

static Condition condition(const std::string& name, const Command& command) {
  Condition c;
  c.name = name;
  c.asked = command;
  return c;
}

// The paper's conditions, one in body axes, and two with blended cyclic and elevator (blended()).
static std::vector<Condition> conditions() {
  return {condition("climb", {2, pi / 2, pi / 2}), condition("transition", {6, pi / 4, pi / 4}),
          condition("level", {15, 0, 0}),          condition("slow", {0.4, pi / 2, pi / 2}),
          condition("shared", {15, 0, 0.4 * pi}),  condition("shared", {10, 0, pi / 3})};
}

static Vehicle blended() {
  Vehicle vehicle = reference_vehicle();
  vehicle.aircraft.cyclic_blend = 0.5;
  vehicle.limits.a1s = {-1.2, 1.2};  // one integral for both: they oppose each other
  vehicle.limits.delta_e = {-1.2, 1.2};
  return vehicle;
}

static Model with_inputs(const Vehicle& vehicle, const Condition& c) {
  return closed_loop_with_inputs(vehicle,
                                 c.command()->V < body_axes_below ? Axes::body : Axes::wind);
}

static Index position(const ActuatorLoop& loop) {
  const std::vector<std::string> all = actuators();
  return std::ranges::find(all, loop.actuator) - all.begin();
}

// Calls check(condition, answer, loop, model) on every loop in use.
template <class Check>
static void for_each_loop(const Check& check) {
  const Vehicle vehicle = blended();
  for (const Condition& c : conditions()) {
    CAPTURE(c.name);
    const LoopsAnswer answer = actuator_loops(vehicle, c);
    REQUIRE(answer.answered());
    REQUIRE(answer.loops.size() == 3);
    for (const ActuatorLoop& loop : answer.loops) {
      CAPTURE(loop.actuator);
      if (loop.in_use) check(answer, loop, with_inputs(vehicle, c));
    }
  }
}

// ---- independent method: the nonlinear model's loop opened manually, by differences ----

// The input of actuator j is v, whatever the law commands: x' = f(x, v - h_j(x)), y = h_j(x).
static LoopTransfer opened_by_hand(const Model& model, const OperatingPoint& trim, Index j) {
  const auto command = [=](const VectorXd& x, const VectorXd& p) {
    return model.h(x, VectorXd::Zero(3), p)[j];
  };
  Model open = model;
  open.derivatives = {};
  open.inputs = {model.inputs[std::size_t(j)]};
  open.outputs = {model.outputs[std::size_t(j)]};
  open.f = [=](const VectorXd& x, const VectorXd& v, const VectorXd& p) {
    return model.f(x, (v[0] - command(x, p)) * VectorXd::Unit(3, j), p);
  };
  open.h = [=](const VectorXd& x, const VectorXd&, const VectorXd& p) {
    return VectorXd::Constant(1, command(x, p));
  };
  const VectorXd v = VectorXd::Constant(1, command(trim.x, trim.p));
  const LinearModel linear = linearize(open, {trim.x, v, trim.p});
  REQUIRE(bool(linear));
  return {linear.A, linear.B, -linear.C, -linear.D(0, 0)};
}

static Complex return_difference(const LoopTransfer& g, double w) {
  const MatrixXcd M = Complex(0, w) * MatrixXd::Identity(6, 6) - g.A;
  return 1.0 + g.d + (g.c * algebra::solve(M, MatrixXcd(g.b.cast<Complex>()))).value();
}

template <class F>
static double bisected(const F& f, double low, double high) {
  const bool up = f(low) > 0;
  for (int k = 0; k < 60; ++k) {
    const double middle = std::sqrt(low * high);
    ((f(middle) > 0) == up ? low : high) = middle;
  }
  return low;
}

namespace {

/// Margins from 1 + L on a dense grid.
struct Scan {
  double gain_up = infinity, gain_down = 0, phase = infinity, delay = infinity, half = 0, peak = 0;
};

}  // namespace

static Scan scanned(const LoopTransfer& g) {
  const auto L = [&](double w) { return return_difference(g, w) - 1.0; };
  const auto real = [&](double w) { return L(w).imag(); };
  const auto size = [&](double w) { return std::abs(L(w)) - 1; };
  Scan s;
  constexpr int per_decade = sanitized ? 100 : 2000;
  for (int k = -4 * per_decade; k < 5 * per_decade; ++k) {
    const double low = std::pow(10, double(k) / per_decade);
    const double high = std::pow(10, double(k + 1) / per_decade);
    const Complex S = 1.0 / return_difference(g, low);
    s.peak = std::max(s.peak, std::abs(S));
    s.half = std::max(s.half, std::abs(S - 0.5));
    if ((real(low) > 0) != (real(high) > 0)) {
      const double factor = -1 / L(bisected(real, low, high)).real();
      if (factor > 1) s.gain_up = std::min(s.gain_up, factor);
      if (factor > 0 && factor < 1) s.gain_down = std::max(s.gain_down, factor);
    }
    if ((size(low) > 0) != (size(high) > 0)) {
      const double w = bisected(size, low, high), lag = std::arg(-L(w));
      s.phase = std::min(s.phase, std::abs(lag));
      s.delay = std::min(s.delay, (lag > 0 ? lag : lag + 2 * pi) / w);
    }
  }
  return s;
}

// Both infinite, or near.
static void check_same(double actual, double expected, double tolerance) {
  if (std::isinf(expected))
    CHECK(actual == expected);
  else
    CHECK_NEAR(actual, expected, tolerance * std::max(std::abs(expected), 1.0));
}

TEST_CASE("margins are those of a dense scan of the loop opened by hand" * thorough) {
  constexpr double gridded = sanitized ? 4e-3 : 1e-5;  // peaks between grid points, and differences
  for_each_loop([](const LoopsAnswer& a, const ActuatorLoop& l, const Model& model) {
    const Scan s = scanned(opened_by_hand(model, a.linear.point, position(l)));
    const Margins& m = l.margins;
    check_same(m.gain_up, s.gain_up, gridded);
    check_same(m.gain_down, s.gain_down, gridded);
    check_same(m.phase, s.phase, gridded);
    check_same(m.delay, s.delay, gridded);
    check_same(1 / m.disk, s.half, gridded);
    check_same(m.sensitivity_peak, s.peak, gridded);
    CHECK(m.complete);
  });
}

TEST_CASE("Bode data: the loop opened by hand, a decade beyond the eigenvalues on both sides") {
  for_each_loop([](const LoopsAnswer& a, const ActuatorLoop& l, const Model& model) {
    const LoopTransfer g = opened_by_hand(model, a.linear.point, position(l));
    const Bode& b = l.bode;
    REQUIRE(b.frequency.size() == 200);
    for (std::size_t k = 0; k < b.frequency.size(); ++k) {
      const Complex L = return_difference(g, b.frequency[k]) - 1.0;
      CHECK_NEAR(std::abs(std::polar(b.magnitude[k], b.phase[k]) - L), 0,
                 differenced * (1 + std::abs(L)));
    }
    const MatrixXd A = a.linear.A;
    const VectorXd frequency = algebra::eigenvalues(A).cwiseAbs();
    CHECK_NEAR(b.frequency.front(), frequency.minCoeff() / 10, differenced);
    CHECK_NEAR(b.frequency.back(), frequency.maxCoeff() * 10, differenced * frequency.maxCoeff());
  });
}

// ---- perturbed loops ----

// The closed loop with k times the command at actuator j, relative to the trim's.
static MatrixXd scaled(const Model& model, const OperatingPoint& trim, Index j, double k) {
  const double steady = model.h(trim.x, trim.u, trim.p)[j];
  Model changed = model;
  changed.derivatives = {};
  changed.f = [=](const VectorXd& x, const VectorXd& u, const VectorXd& p) {
    return model.f(x, (k - 1) * (model.h(x, u, p)[j] - steady) * VectorXd::Unit(3, j), p);
  };
  const LinearModel linear = linearize(changed, trim);
  REQUIRE(bool(linear));
  return linear.A;
}

static double abscissa(const MatrixXd& A) { return algebra::eigenvalues(A).real().maxCoeff(); }

TEST_CASE("the command times the gain margin: the nonlinear loop's eigenvalue is on the axis" *
          thorough) {
  int met = 0;
  for_each_loop([&](const LoopsAnswer& a, const ActuatorLoop& l, const Model& model) {
    const auto check = [&](double margin, double at) {
      if (margin == 0 || std::isinf(margin)) return;
      ++met;
      const auto rightmost = [&](double k) {
        return abscissa(scaled(model, a.linear.point, position(l), k));
      };
      const double k = bisected(rightmost, margin * 0.99, margin * 1.01);
      CHECK_NEAR(k, margin, differenced * margin);
      double nearest = infinity;
      for (const Complex s :
           algebra::eigenvalues(scaled(model, a.linear.point, position(l), margin)))
        nearest = std::min(nearest, std::abs(s - Complex(0, at)));
      CHECK_NEAR(nearest, 0, 1e-5 * (1 + at));
    };
    check(l.margins.gain_up, l.margins.gain_up_at);
    check(l.margins.gain_down, l.margins.gain_down_at);
  });
  CHECK(met >= 3);
}

TEST_CASE("the lag of the phase margin, and of the delay margin: an eigenvalue on the axis") {
  int met = 0;
  for_each_loop([&](const LoopsAnswer& a, const ActuatorLoop& l, const Model& model) {
    const LoopTransfer g = opened_by_hand(model, a.linear.point, position(l));
    const auto check = [&](double lag, double at) {
      if (std::isinf(lag)) return;
      ++met;
      double nearest = infinity;
      for (const double turn : {lag, -lag}) {  // lag or lead
        const MatrixXcd A = g.A - std::polar(1.0, -turn) * g.b * g.c;
        for (const Complex s : algebra::eigenvalues(A))
          nearest = std::min(nearest, std::abs(s - Complex(0, at)));
      }
      CHECK_NEAR(nearest, 0, 1e-5 * (1 + at));
    };
    check(l.margins.phase, l.margins.phase_at);
    check(l.margins.delay * l.margins.delay_at, l.margins.delay_at);
  });
  CHECK(met >= 8);
}

// ---- the law's algebraic loop ----

// Collective by (8), KEp He + KEi x1 with the acceleration measured, in place of (13): solved at
// the actuator, where u is added, δθ0 = (KEp (a - g c) δx + KEi δx1 + u)/(1 - KEp g), with
// He = a δx + g δu of the loop with (13), whose command is c δx.
static LoopTransfer measured_acceleration(const LinearModel& closed, const Gains& gains) {
  constexpr Index energy = 4;  // He is the rate of the energy integral
  const VectorXd b = closed.B.col(0);
  const RowVectorXd c = closed.C.row(0), a = closed.A.row(energy);
  const double g = b[energy], S = 1 / (1 - gains.K_Ep * g);
  const RowVectorXd law =
      S * (gains.K_Ep * (a - g * c) + gains.K_Ei * RowVectorXd::Unit(6, energy));
  return opened(closed.A + b * (law - c), S * b, law, S - 1);
}

TEST_CASE("(13) has no direct feedthrough; with the acceleration measured any delay destabilises") {
  Vehicle vehicle = reference_vehicle();
  vehicle.aircraft.wake_immersion = 0;  // else drag takes a share
  for (const Condition& c : conditions()) {
    if (c.name == "shared") continue;  // the handover, not blended
    CAPTURE(c.name);
    const LoopsAnswer answer = actuator_loops(vehicle, c, {.actuators = {"theta0"}});
    REQUIRE(answer.loops.size() == 1);
    const ActuatorLoop& printed = answer.loops.front();
    CHECK(printed.loop.d == 0);
    const LoopTransfer measured = measured_acceleration(answer.linear, vehicle.gains);
    const VectorXd y = answer.trimmed.trim.outputs;
    const double phi = y[5] + c.command()->eta - y[1];  // α + η - a1s
    const double gain = vehicle.aircraft.thrust_excess * vehicle.gains.K_Ep * std::cos(phi);
    CHECK_NEAR(measured.d, gain, 1e-9 * gain);
    const double S = 1 / std::abs(1.0 + response(measured, infinity));
    CHECK_NEAR(S, 1 / (1 + gain), 1e-9);
    const Margins m = margins(measured);
    if (m.stable()) CHECK(m.delay == 0);
    if (c.name == "level") CHECK(m.stable());
    CHECK(printed.margins.delay > 0);
  }
}

// ---- loops in use, and why margins may be missing ----

static std::vector<std::string> in_use(const LoopsAnswer& answer) {
  std::vector<std::string> found;
  for (const ActuatorLoop& l : answer.loops)
    if (l.in_use) found.push_back(l.actuator);
  return found;
}

TEST_CASE("loops in use: by tilt; none where the actuator changes nothing") {
  using Names = std::vector<std::string>;
  const std::vector<Condition> at = conditions();
  CHECK(in_use(actuator_loops(reference_vehicle(), at[0])) == Names{"theta0", "a1s"});
  CHECK(in_use(actuator_loops(reference_vehicle(), at[2])) == Names{"theta0", "delta_e"});
  CHECK(in_use(actuator_loops(blended(), at[5])) == actuators());
}

// A condition whose closed loop has these modes, and nothing else.
static LoopsAnswer answer_of(const Modes& modes) {
  LoopsAnswer a;
  a.trimmed.condition.name = "x";
  a.trimmed.trim.status = TrimStatus::converged;
  a.linear.status = LinearizeStatus::linear;
  a.modes = modes;
  return a;
}

static std::string text_of(const LoopsAnswer& answer) {
  const std::string text = margins_text({answer}, {.width = 1000});
  CHECK_FALSE(margins_json({answer}).empty());
  return text;
}

static bool says(const std::string& text, const std::string& words) {
  INFO(text);
  INFO(words);
  const bool found = text.find(words) != std::string::npos;
  CHECK(found);
  return found;
}

TEST_CASE("every reason is given in words") {
  const MatrixXd I = MatrixXd::Identity(2, 2);
  SUBCASE("unstable") {
    const LoopsAnswer a = answer_of(modes(I));
    says(text_of(a),
         "the closed loop is unstable, so no margins: right of the axis lies 1.0000 1/s");
    CHECK(a.answered());
  }
  SUBCASE("undecided") {
    const LoopsAnswer a = answer_of(modes(0 * I));
    says(text_of(a), "the stability of the closed loop is undecided, so no margins:");
    CHECK_FALSE(a.answered());
  }
  SUBCASE("no eigenvalues") {
    Modes none;
    none.converged = false;
    const LoopsAnswer a = answer_of(none);
    says(text_of(a), "the eigenvalue iteration did not converge");
    CHECK_FALSE(a.answered());
  }
  SUBCASE("no linear model") {
    LoopsAnswer a = answer_of({});
    a.linear.status = LinearizeStatus::not_finite;
    a.linear.message = "no derivative";
    says(text_of(a), "no linear model, so no margins: no derivative");
    CHECK(json::parse(margins_json({a}))["conditions"][0]["verdict"].is_null());
    CHECK_FALSE(a.answered());
  }
  SUBCASE("incomplete, not told apart, a remark") {
    LoopsAnswer a = actuator_loops(reference_vehicle(), conditions()[0]);
    REQUIRE(a.loops.size() == 3);
    a.loops[0].margins.complete = false;
    a.loops[1].margins = {};
    a.linear.remarks = {"a kink"};
    a.trimmed.trim.message = "some remark";
    const std::string text = text_of(a);
    says(text, "theta0: a margin may have been missed (left over: ");
    says(text, "incomplete");
    says(text,
         "a1s: within rounding its loop, opened and closed, cannot be distinguished from an "
         "unstable one");
    says(text, "a kink");
    says(text, "some remark");
    CHECK_FALSE(a.answered());
  }
}

TEST_CASE("an actuator that is commanded and changes nothing has no margins") {
  Vehicle vehicle = blended();
  vehicle.aircraft.CL_de = vehicle.aircraft.CM_de = 0;
  const LoopsAnswer answer = actuator_loops(vehicle, conditions()[5]);
  REQUIRE(answer.answered());
  CHECK(in_use(answer) == std::vector<std::string>{"theta0", "a1s"});
  says(text_of(answer), "has no effect");
}

// Between a stable and an unstable condition of the corridor, to the limit of rounding.
TEST_CASE("at the stability boundary: undecided, and no margins") {
  Command stable = corridor(55.0), unstable = corridor(52.5);
  LoopsAnswer answer;
  for (int k = 0; k < 60 && answer.modes.modes.empty(); ++k) {
    const Command middle{std::midpoint(stable.V, unstable.V),
                         std::midpoint(stable.gamma, unstable.gamma),
                         std::midpoint(stable.eta, unstable.eta)};
    answer = actuator_loops(reference_vehicle(), condition("boundary", middle));
    REQUIRE_FALSE(answer.modes.modes.empty());
    if (answer.modes.verdict == Verdict::undecided) break;
    (answer.modes.verdict == Verdict::stable ? stable : unstable) = middle;
    answer.modes = {};
  }
  REQUIRE_FALSE(answer.modes.modes.empty());
  CHECK_FALSE(answer.answered());
  for (const ActuatorLoop& l : answer.loops) CHECK_FALSE(l.margins.stable());
  says(text_of(answer), "undecided");
}

TEST_CASE("the caller's mistakes throw") {
  const Condition level = conditions()[2];
  const auto refused = [&](const Condition& c, const LoopsOptions& options) {
    CHECK_THROWS_AS((void)actuator_loops(reference_vehicle(), c, options), std::invalid_argument);
  };
  refused(level, {.actuators = {"delta"}});
  refused(level, {.points = 1});
  refused(level, {.from = 0.0});
  refused(level, {.from = 2.0, .to = 1.0});
  refused(level, {.to = infinity});
  refused(level, {.from = std::nan("")});
  Condition airframe = level;
  airframe.asked = AirframeCondition{};
  refused(airframe, {});
}

// ---- the command ----

static const std::string command = "margins " + paper;

TEST_CASE("tiltrim margins: text, JSON and CSV say the same" * thorough) {
  const program::Scratch scratch("margins");
  const program::Ran text = program::run(scratch, command);
  CHECK(text.exit_code == 0);
  CHECK(text.err.empty());
  says(text.out, "Not in use: the law does not command this actuator at this tilt.");
  const json all = json::parse(program::run(scratch, command + " -f json").out)["conditions"];
  const std::vector<program::Row> rows =
      program::csv_of(program::run(scratch, command + " -f csv").out);
  REQUIRE(rows.size() == 1 + 3 * 3);
  const auto column = [&](const char* key) {
    return std::size_t(std::ranges::find(rows[0], key) - rows[0].begin());
  };
  for (std::size_t i = 0; i < 9; ++i) {
    const json &c = all.at(i / 3), &l = c["loops"].at(i % 3), &m = l["margins"];
    const program::Row& row = rows[i + 1];
    CHECK(c["status"] == "converged");
    CHECK(c["verdict"] == "stable");
    CHECK(c["message"] == "");
    CHECK(row.at(0) == c["name"]);
    CHECK(row.at(1) == l["actuator"]);
    CHECK(row.back() == (l["in_use"] == true ? "stable" : "not in use"));
    CHECK(m.is_null() == !l["in_use"].get<bool>());
    CHECK(l["bode"].is_null() == m.is_null());
    CHECK(l["loop"].is_null() == m.is_null());
    if (m.is_null()) continue;
    CHECK_NEAR(std::stod(row.at(column("phase_deg"))), m["phase"].get<double>() * 180 / pi, 1e-9);
    CHECK_NEAR(std::stod(row.at(column("disk"))), m["disk"].get<double>(), 1e-12);
    if (m["gain_up"].is_null())
      CHECK(row.at(column("gain_up_dB")) == "inf");
    else
      CHECK_NEAR(std::stod(row.at(column("gain_up_dB"))),
                 20 * std::log10(m["gain_up"].get<double>()), 1e-9);
    CHECK(l["loop"]["A"].size() == 6);
    CHECK(l["loop"]["A"][5].size() == 6);
    CHECK(l["loop"]["b"].size() == 6);
    CHECK(l["loop"]["c"].size() == 6);
    CHECK(l["loop"]["d"] == 0.0);
    for (const char* key : {"frequency", "magnitude", "phase"}) CHECK(l["bode"][key].size() == 200);
  }
}

TEST_CASE("tiltrim margins: loops chosen, in the actuators' order, each once; Bode data as asked" *
          thorough) {
  const program::Scratch scratch("margins");
  const program::Ran ran = program::run(
      scratch, command +
                   " --only level --loop delta_e,theta0 --loop delta_e --from 0.1 --to 10 "
                   "--points 3 --bode bode.csv -f csv -o margins.csv");
  CHECK(ran.exit_code == 0);
  CHECK(ran.out.empty());
  const auto margins = program::csv_of(program::slurp(scratch.path / "margins.csv"));
  REQUIRE(margins.size() == 3);
  CHECK(margins[1].at(1) == "theta0");
  CHECK(margins[2].at(1) == "delta_e");
  const auto bode = program::csv_of(program::slurp(scratch.path / "bode.csv"));
  REQUIRE(bode.size() == 1 + 2 * 3);
  CHECK(bode[0] == program::Row{"name", "actuator", "frequency", "magnitude_dB", "phase_deg"});
  CHECK(bode[4][1] == "delta_e");
  CHECK(std::stod(bode[1][2]) == 0.1);
  CHECK_NEAR(std::stod(bode[2][2]), 1, 1e-12);
  CHECK(std::stod(bode[3][2]) == 10);
  CHECK(scratch.files() == std::set<std::string>{"bode.csv", "margins.csv"});
}

TEST_CASE("tiltrim margins: no trim is exit 1, unstable is an answer; the rest is written" *
          thorough) {
  const program::Scratch scratch("margins");
  scratch.write("study.toml",
                "[[condition]]\nname = \"level\"\nV = 15.0\ngamma_deg = 0.0\neta_deg = 0.0\n"
                "[[condition]]\nname = \"slow\"\nV = 3.0\ngamma_deg = 0.0\neta_deg = 0.0\n"
                "[[condition]]\nname = \"unstable\"\nV = 4.8\ngamma_deg = 56.0\n"
                "eta_deg = 56.0\n");
  const program::Ran all = program::run(scratch, "margins study.toml");
  CHECK(all.exit_code == 1);
  says(all.out, "slow: no trim, so no margins: ");
  says(all.out, "unstable: the closed loop is unstable, so no margins: right of the axis lies");
  says(all.out, "level");
  CHECK(program::run(scratch, "margins study.toml --only unstable --only level").exit_code == 0);
  const json j = json::parse(program::run(scratch, "margins study.toml -f json").out)["conditions"];
  CHECK(j[1]["loops"].empty());
  CHECK(j[1]["verdict"].is_null());
  CHECK(j[1]["message"] != "");
  CHECK(j[2]["verdict"] == "unstable");
  CHECK(j[2]["loops"][0]["margins"].is_null());
  CHECK(j[2]["loops"][0]["bode"]["frequency"].size() == 200);
}

TEST_CASE("tiltrim margins: mistakes are said in a line, and nothing is written" * thorough) {
  const program::Scratch scratch("margins");
  const auto refused = [&](const std::string& arguments, const std::string& words) {
    const program::Ran ran = program::run(scratch, arguments);
    CAPTURE(arguments);
    CHECK(ran.exit_code == 2);
    CHECK(ran.out.empty());
    CHECK(std::ranges::count(ran.err, '\n') == 1);
    says(ran.err, words);
  };
  refused(command + " --loop delta", "--loop: no loop 'delta'; there are: theta0, a1s, delta_e");
  refused(command + " --points 1", "--points");
  refused(command + " --from 2 --to 1", "--from 2 is not below --to 1");
  refused(command + " --from 1 --to 1", "--from 1 is not below --to 1");
  refused(command + " --from nan",
          "--from: nan is not a frequency; expected a number above 0 rad/s");
  refused(command + " --to -1", "--to: -1 is not a frequency");
  refused(command + " --to inf", "--to: inf is not a frequency");
  refused(command + " --from 1e9", "condition 'climb': no Bode data from 1e+09 to ");
  refused(command + " --bode a.csv -o ./a.csv", "--bode and -o name the same file;");
  refused("margins study.toml --bode ./study.toml", "--bode and the study name the same file;");
  refused(command + " --bode nowhere/a.csv", "nowhere: No such file");
  refused("margins " + source + "/studies/airframe.toml",
          "condition 'hover': margins need a closed loop; expected formulation closed_loop");
  refused("margin " + paper, "did you mean 'margins'?");
  CHECK(scratch.files().empty());
}

}  // namespace loop_margins_test
