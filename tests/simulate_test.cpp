// simulate(): the motion of any model, against closed forms; every way of ending.
#include "simulate/simulate.hpp"

#include <algorithm>
#include <boost/math/special_functions/ellint_1.hpp>
#include <cmath>
#include <functional>
#include <numbers>
#include <stdexcept>

#include "model/formulas.hpp"
#include "tests/algebra.hpp"
#include "tests/check.hpp"

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using namespace tiltrim;

namespace simulate_test {

namespace {

constexpr double not_a_number = std::numeric_limits<double>::quiet_NaN();
const VectorXd none(0);

VectorXd one(double value) { return VectorXd::Constant(1, value); }

// x' = rate(x, u, p).
Model scalar(const std::function<double(double x, double u, double p)>& rate) {
  Model m;
  m.name = "scalar";
  m.states = {{"x", "", 1.0}};
  m.inputs = {{"u", "", 1.0}};
  m.parameters = {{"p", "", 1.0}};
  m.f = [rate](const VectorXd& x, const VectorXd& u, const VectorXd& p) {
    return one(rate(x[0], u[0], p[0]));
  };
  return m;
}

OperatingPoint from(double x, double u = 0, double p = 0) { return {one(x), one(u), one(p)}; }

double last(const Simulation& s) { return s.x(0, s.x.cols() - 1); }

bool says(const std::string& message, std::string_view words) {
  return message.find(words) != std::string::npos;
}

// θ" = -(g/l) sin θ, with the lowest position as a switch.
Model pendulum() {
  return model_of({.name = "pendulum",
                   .states = {{"angle", "rad", 0.1}, {"rate", "rad/s", 0.1}},
                   .inputs = {},
                   .outputs = {{"energy", "m²/s²", 1.0}},
                   .parameters = {{"g", "m/s²", 1.0}, {"length", "m", 0.1}},
                   .let = {},
                   .rates = {"rate", "-g/length*sin(angle)"},
                   .values = {"(length*rate)^2/2 - g*length*cos(angle)"},
                   .switches = {{"straight", "angle"}}});
}

}  // namespace

TEST_CASE("a linear model moves by the matrix exponential, a step on its input and all") {
  MatrixXd A(3, 3);
  A << -0.2, 2.0, 0.1, -2.0, -0.3, 0.0, 0.5, 0.4, -1.5;
  const Eigen::Vector3d b{0.3, -1.0, 0.7}, x0{1.0, -0.5, 0.25};
  Model m;
  m.states = {{"x", ""}, {"y", ""}, {"z", ""}};
  m.inputs = {{"u", ""}};
  m.f = [A, b](const VectorXd& x, const VectorXd& u, const VectorXd&) -> VectorXd {
    return A * x + b * u[0];
  };
  constexpr double begin = 0.73, end = 1.91, size = 0.8;
  const Simulation s = simulate(m, {x0, one(0.25), none}, 4.0, {{"u", size, begin, end}},
                                {.tolerance = 1e-12, .sample = 0.25});
  REQUIRE(s);
  REQUIRE(s.t.size() == 17);
  // The input held: d/dt [x; u] = [A b; 0 0] [x; u].
  MatrixXd held = MatrixXd::Zero(4, 4);
  held.topLeftCorner(3, 3) = A;
  held.topRightCorner(3, 1) = b;
  const auto moved = [&](const VectorXd& x, double u, double dt) -> VectorXd {
    const MatrixXd over = algebra::exponential(held * dt);
    return over.topLeftCorner(3, 3) * x + over.topRightCorner(3, 1) * u;
  };
  for (std::size_t k = 0; k < s.t.size(); ++k) {
    const double t = s.t[k];
    VectorXd x = moved(x0, 0.25, std::min(t, begin));
    if (t > begin) x = moved(x, 0.25 + size, std::min(t, end) - begin);
    if (t > end) x = moved(x, 0.25, t - end);
    for (Index i = 0; i < 3; ++i) CHECK_NEAR(s.x(i, Index(k)), x[i], 1e-10);
    CHECK(s.u(0, Index(k)) == (t >= begin && t < end ? 0.25 + size : 0.25));
  }
}

TEST_CASE("inputs and parameters change exactly at their times") {
  const Model m = scalar([](double, double u, double p) { return u + p; });
  // To rounding, whatever the tolerance: no step crosses a change.
  const Simulation s =
      simulate(m, from(0, 2, 0), 1.0,
               {{"u", 1.0, 0.3, 0.7}, {"u", 0.5, 0.123456789}, {"p", -4.0, 0.0, 0.41}},
               {.tolerance = 1e-2, .sample = 0.1});
  REQUIRE(s);
  REQUIRE(s.t.size() == 11);
  for (std::size_t k = 0; k < s.t.size(); ++k) {
    const double t = s.t[k];
    const double area = 2 * t + std::clamp(t - 0.3, 0.0, 0.4) +
                        0.5 * std::max(t - 0.123456789, 0.0) - 4 * std::min(t, 0.41);
    CAPTURE(t);
    CHECK_NEAR(s.x(0, Index(k)), area, 1e-14);
    CHECK(s.u(0, Index(k)) == 2 + (t >= 0.3 && t < 0.7) + (t >= 0.123456789 ? 0.5 : 0));
    CHECK(s.p(0, Index(k)) == (t < 0.41 ? -4 : 0));
  }
}

TEST_CASE("a pendulum's period by the elliptic integral, its lowest point located") {
  constexpr double amplitude = 2.5, g = 9.81, length = 0.7;
  const double period = 4 * std::sqrt(length / g) * boost::math::ellint_1(std::sin(amplitude / 2));
  const Simulation s =
      simulate(pendulum(), {Eigen::Vector2d{amplitude, 0}, none, Eigen::Vector2d{g, length}},
               period, {}, {.tolerance = 1e-12, .sample = period / 8});
  REQUIRE(s);
  CHECK_NEAR(last(s), amplitude, 1e-10);
  CHECK_NEAR(s.x(1, s.x.cols() - 1), 0, 1e-9);
  REQUIRE(s.events.size() == 2);
  CHECK(s.events[0].name == "straight");
  CHECK_NEAR(s.events[0].t, period / 4, 1e-10);
  CHECK_FALSE(s.events[0].rising);
  CHECK_NEAR(s.events[1].t, 3 * period / 4, 1e-10);
  CHECK(s.events[1].rising);
  REQUIRE(s.y.rows() == 1);
  for (Index k = 0; k < s.y.cols(); ++k)
    CHECK_NEAR(s.y(0, k), -g * length * std::cos(amplitude), 1e-9);
}

TEST_CASE("what is not smooth is met where the model says so") {
  // x' = 1 below x = 0.37, then 2. The rates are also evaluated beyond the switch, so the error is
  // of the order of the tolerance.
  Model m = scalar([](double x, double, double) { return x < 0.37 ? 1.0 : 2.0; });
  m.switches.push_back({"faster", [](const OperatingPoint& at) { return at.x[0] - 0.37; }});
  const Simulation s = simulate(m, from(0), 1.0, {}, {.tolerance = 1e-10});
  REQUIRE(s.events.size() == 1);
  CHECK_NEAR(s.events[0].t, 0.37, 1e-8);
  CHECK(s.events[0].rising);
  CHECK_NEAR(last(s), 0.37 + 2 * 0.63, 1e-8);
}

// ---- every way of ending ----

TEST_CASE("completed") {
  const Simulation s = simulate(scalar([](double x, double, double) { return -x; }), from(1), 2.0);
  CHECK(s.status == MotionStatus::completed);
  CHECK(s.message.empty());
  CHECK_NEAR(last(s), std::exp(-2.0), 1e-8);
  CHECK(s.steps > 0);
  CHECK(s.evaluations > s.steps);
}

TEST_CASE("diverged") {
  const Simulation s = simulate(scalar([](double x, double, double) { return x; }), from(1), 100.0);
  CHECK(s.status == MotionStatus::diverged);
  CHECK_NEAR(s.t.back(), std::log(1e9), 0.5);
  CHECK(says(s.message, "x is "));
}

TEST_CASE("not finite, with the model's words where it throws") {
  SUBCASE("no number") {
    const Simulation s =
        simulate(scalar([](double x, double, double) { return x > 0.5 ? not_a_number : 1.0; }),
                 from(0), 2.0);
    CHECK(s.status == MotionStatus::not_finite);
    CHECK_NEAR(s.t.back(), 0.5, 1e-9);
    CHECK(s.message == "the rate of x is nan");
  }
  SUBCASE("at the start") {
    const Simulation s =
        simulate(scalar([](double, double, double) { return not_a_number; }), from(0), 2.0);
    CHECK(s.status == MotionStatus::not_finite);
    REQUIRE(s.t.size() == 1);
    CHECK(s.x(0, 0) == 0);
  }
  SUBCASE("an exception, also one that the caller's mistakes would have") {
    const Simulation s = simulate(scalar([](double x, double, double) {
                                    if (x > 0.5) throw std::invalid_argument("no row 7");
                                    return 1.0;
                                  }),
                                  from(0), 2.0);
    CHECK(s.status == MotionStatus::not_finite);
    CHECK_NEAR(s.t.back(), 0.5, 1e-9);
    CHECK(s.message == "the rate of x is nan: the model threw: no row 7");
  }
  SUBCASE("what is no exception of the standard library") {
    const Simulation s =
        simulate(scalar([](double, double, double) -> double { throw 3; }), from(0), 2.0);
    CHECK(s.status == MotionStatus::not_finite);
    CHECK(says(s.message, "the model threw: an exception that is not a std::exception"));
  }
  SUBCASE("a switch throws") {
    Model m = scalar([](double, double, double) { return 1.0; });
    m.switches.push_back(
        {"edge", [](const OperatingPoint&) -> double { throw std::runtime_error("no edge"); }});
    const Simulation s = simulate(m, from(0), 2.0);
    CHECK(s.status == MotionStatus::not_finite);
    CHECK(s.message == "the event function 'edge' is nan: the model threw: no edge");
  }
}

TEST_CASE("what is thrown beside the way is no remark of a motion that is completed") {
  int thrown = 0;
  const Model m = scalar([&thrown](double x, double, double) {
    if (x >= 0) return -50 * x;
    ++thrown;
    throw std::runtime_error("below zero");
  });
  const Simulation s = simulate(m, from(1), 1.0, {}, {.tolerance = 1e-2, .sample = 0.5});
  CHECK(thrown > 0);
  CHECK(s.status == MotionStatus::completed);
  CHECK(s.message.empty());
}

TEST_CASE("outputs that throw are NaN, and said; the motion goes on") {
  Model m = scalar([](double, double, double) { return 1.0; });
  m.outputs = {{"y", ""}};
  m.h = [](const VectorXd& x, const VectorXd&, const VectorXd&) {
    if (x[0] > 0.75) throw std::runtime_error("off the chart");
    return one(2 * x[0]);
  };
  const Simulation s = simulate(m, from(0), 1.0, {}, {.sample = 0.5});
  CHECK(s.status == MotionStatus::completed);
  CHECK(s.message == "the model threw: off the chart");
  REQUIRE(s.y.cols() == 3);
  CHECK_NEAR(s.y(0, 1), 1.0, 1e-12);
  CHECK(std::isnan(s.y(0, 2)));
}

TEST_CASE("step too small: an infinite slope") {
  const Simulation s =
      simulate(scalar([](double x, double, double) { return -1 / x; }), from(1), 1.0);
  CHECK(s.status == MotionStatus::step_too_small);
  CHECK_NEAR(s.t.back(), 0.5, 1e-6);  // x² = 1 - 2t
  CHECK(says(s.message, "even the shortest step exceeds"));
}

TEST_CASE("step limit: held short by the caller, not by stability") {
  const Simulation s = simulate(scalar([](double, double, double) { return 1.0; }), from(0), 1.0,
                                {}, {.longest_step = 1e-4, .max_steps = 1000});
  CHECK(s.status == MotionStatus::step_limit);
  CHECK(says(s.message, "1000 steps"));
  CHECK_FALSE(s.stiff);
  CHECK_NEAR(s.t.back(), 0.1, 1e-3);
  CHECK_NEAR(last(s), s.t.back(), 1e-12);
}

TEST_CASE("stiff: Robertson's reactions, to the digits of the ODE test set") {
  // J. R. Mazzia, C. Magherini: Test set for initial value problem solvers, release 2.4, 2008:
  // ROBER.
  const Model m = model_of({.name = "Robertson",
                            .states = {{"a", ""}, {"b", "", 1e-4}, {"c", ""}},
                            .inputs = {},
                            .outputs = {},
                            .parameters = {},
                            .let = {},
                            .rates = {"-0.04*a + 1e4*b*c", "0.04*a - 1e4*b*c - 3e7*b^2", "3e7*b^2"},
                            .values = {},
                            .switches = {}});
  const Simulation s =
      simulate(m, {Eigen::Vector3d{1, 0, 0}, none, none}, 40.0, {}, {.sample = 10});
  CHECK(s.status == MotionStatus::completed);
  CHECK(s.stiff);
  CHECK(s.steps < 5000);
  const Eigen::Vector3d end = s.x.col(s.x.cols() - 1);
  const Eigen::Vector3d truth{0.7158270687194135, 9.185534764557636e-6, 0.2841637457458209};
  for (Eigen::Index i = 0; i < 3; ++i) {
    CHECK_NEAR(end[i], truth[i], 2 * s.error[i] + 1e-12);
    CHECK(s.error[i] < 1e-7);
  }
  CHECK_NEAR(s.x.col(2).sum(), 1.0, 1e-9);
}

TEST_CASE("stiff, with a step in the input and a switch on the way") {
  // x' = -1e6 (x - u): x follows u within a microsecond, and passes 1/2 in ln 2 of one.
  Model m = scalar([](double x, double u, double) { return -1e6 * (x - u); });
  m.switches = {{"half", [](const OperatingPoint& at) { return at.x[0] - 0.5; }}};
  const Simulation s = simulate(m, from(0), 2.0, {{"u", 1.0, 0.5, 1.5}});
  CHECK(s.status == MotionStatus::completed);
  CHECK(s.stiff);
  REQUIRE(s.events.size() == 2);
  CHECK_NEAR(s.events[0].t, 0.5 + 1e-6 * std::numbers::ln2, 1e-11);
  CHECK(s.events[0].rising);
  CHECK_NEAR(s.events[1].t, 1.5 + 1e-6 * std::numbers::ln2, 1e-11);
  CHECK_NEAR(s.x(0, 10), 1.0, 1e-8);
  CHECK_NEAR(last(s), 0.0, 1e-8);
}

TEST_CASE(
    "stiff: a sample at every step; a switch that is NaN and the limit of events end the motion") {
  Model m = scalar([](double x, double u, double) { return -1e6 * (x - u); });
  const std::vector<SignalChange> pulse{{"u", 1.0, 0.5, 1.5}};
  const Simulation every = simulate(m, from(0.4), 2.0, pulse, {.sample = 0});
  CHECK(every.status == MotionStatus::completed);
  CHECK(every.stiff);
  CHECK(every.steps < 2000);
  CHECK(std::ssize(every.t) == every.steps + 1);
  CHECK(std::ranges::is_sorted(every.t, std::less_equal{}));
  CHECK_NEAR(last(every), 0.0, 1e-8);

  m.switches = {{"half", [](const OperatingPoint& at) { return at.x[0] - 0.5; }}};
  const Simulation limited = simulate(m, from(0.4), 2.0, pulse, {.max_events = 1});
  CHECK(limited.status == MotionStatus::event_limit);
  CHECK(limited.stiff);
  CHECK(says(limited.message, "1 events"));
  REQUIRE(limited.events.size() == 1);
  CHECK_NEAR(limited.t.back(), 0.5, 1e-3);

  m.switches = {{"root", [](const OperatingPoint& at) { return std::sqrt(0.5 - at.x[0]); }}};
  const Simulation nan = simulate(m, from(0.4), 2.0, pulse);
  CHECK(nan.status == MotionStatus::not_finite);
  CHECK(nan.stiff);
  CHECK(says(nan.message, "'root' is nan"));
  CHECK_NEAR(nan.t.back(), 0.5, 1e-3);
}

TEST_CASE("a fixed step is taken as often as it is asked for") {
  const Simulation s = simulate(scalar([](double x, double, double) { return -x; }), from(1), 2.0,
                                {}, {.sample = 1.0, .fixed_step = 1e-4});
  CHECK(s.status == MotionStatus::completed);
  CHECK(s.steps >= 20'000);
  CHECK_NEAR(last(s), std::exp(-2.0), 1e-12);
  CHECK(s.error.array().isNaN().all());
}

TEST_CASE("stiff, and its own derivatives throw: the motion ends, nothing escapes") {
  Model m = scalar([](double x, double, double) { return -1e6 * (x - 1); });
  m.derivatives = [](const OperatingPoint&, const std::vector<Eigen::Index>&) -> Eigen::MatrixXd {
    throw std::runtime_error("no derivatives");
  };
  const Simulation s = simulate(m, from(0), 1.0, {}, {.max_steps = 20'000});
  CHECK(s.status == MotionStatus::step_limit);
  CHECK_FALSE(s.stiff);
}

TEST_CASE("the error is that of the motion, not of a step") {
  // A mode of frequency one over a hundred periods, and one that grows.
  const Model turning = model_of({.name = "turning",
                                  .states = {{"x", ""}, {"y", ""}},
                                  .inputs = {},
                                  .outputs = {},
                                  .parameters = {},
                                  .let = {},
                                  .rates = {"y", "-x"},
                                  .values = {},
                                  .switches = {}});
  const double end = 200 * std::numbers::pi;
  const OperatingPoint turned{Eigen::Vector2d{1, 0}, none, none};
  // The second run, of smaller steps, does not come to the end: no estimate, and no doubt either.
  const Simulation whole = simulate(turning, turned, end);
  CHECK(whole.error.allFinite());
  const Simulation limited =
      simulate(turning, turned, end, {}, {.max_steps = whole.steps + whole.steps / 10});
  CHECK(limited.status == MotionStatus::completed);
  CHECK(limited.error.array().isNaN().all());
  for (const double tolerance : {1e-5, 1e-7, 1e-9}) {
    const Simulation s = simulate(turning, {Eigen::Vector2d{1, 0}, none, none}, end, {},
                                  {.tolerance = tolerance, .sample = 1.0});
    REQUIRE(s);
    double worst = 0;
    for (std::size_t k = 0; k < s.t.size(); ++k)
      worst = std::max(worst, std::abs(s.x(0, Eigen::Index(k)) - std::cos(s.t[k])));
    CHECK(worst <= 1.05 * s.error[0]);
    CHECK(s.error[0] <= 1.2 * worst);
  }
  const Simulation growing =
      simulate(scalar([](double x, double, double) { return x; }), from(1e-3), 10.0);
  CHECK_NEAR(last(growing), 1e-3 * std::exp(10.0), 1.05 * growing.error[0]);
  CHECK(growing.error[0] < 1e-5);
  // With samples at the steps two runs have only the ends in common.
  const Simulation steps = simulate(turning, {Eigen::Vector2d{1, 0}, none, none}, end, {},
                                    {.tolerance = 1e-7, .sample = 0.0});
  CHECK(steps);
  CHECK(std::abs(steps.x(0, steps.x.cols() - 1) - 1) <= 1.05 * steps.error[0]);
  CHECK(steps.error[0] < 1e-3);
  const Simulation alone =
      simulate(turning, {Eigen::Vector2d{1, 0}, none, none}, 1.0, {}, {.global_error = false});
  CHECK(alone);
  CHECK(alone.error.array().isNaN().all());
}

TEST_CASE("samples at the steps: the error is that of the worst of them, not of the last") {
  for (const double tolerance : {1e-5, 1e-9}) {
    const Simulation s = simulate(scalar([](double x, double, double) { return -x; }), from(1),
                                  20.0, {}, {.tolerance = tolerance, .sample = 0});
    double worst = 0;
    for (Eigen::Index k = 0; k < s.x.cols(); ++k)
      worst = std::max(worst, std::abs(s.x(0, k) - std::exp(-s.t[std::size_t(k)])));
    CHECK(worst <= 2 * s.error[0]);
    CHECK(s.error[0] <= 20 * worst);
  }
}

TEST_CASE("the error of a motion that ends early is that of its last sample, or is not known") {
  // x' = x beyond 1e9, its one sample before the end the start.
  const Model growing = scalar([](double x, double, double) { return x; });
  const Simulation diverged = simulate(growing, from(1), 800.0, {}, {.sample = 50});
  REQUIRE(diverged.status == MotionStatus::diverged);
  REQUIRE(diverged.t.size() == 2);
  const double off = std::abs(last(diverged) - std::exp(diverged.t.back()));
  CHECK(off > 1);
  CHECK_NEAR(diverged.error[0], off, 0.1 * off);
  // An edge: x' = cos t by a second state, until 0.9.
  const Model edge = model_of({.name = "edge",
                               .states = {{"x", ""}, {"v", ""}},
                               .inputs = {},
                               .outputs = {},
                               .parameters = {},
                               .let = {},
                               .rates = {"v + 0*sqrt(0.9 - x)", "-x"},
                               .values = {},
                               .switches = {}});
  const Simulation stopped = simulate(edge, {Eigen::Vector2d{0, 1}, none, none}, 10.0, {},
                                      {.tolerance = 1e-6, .sample = 50});
  REQUIRE(stopped.status == MotionStatus::not_finite);
  REQUIRE(stopped.t.size() == 2);
  const double edge_off = std::abs(stopped.x(0, 1) - std::sin(stopped.t[1]));
  CHECK(edge_off > 1e-9);
  CHECK(stopped.error[0] >= 0.5 * edge_off);
  CHECK(stopped.error[0] < 1e-5);
  // A limit of steps leaves no second run.
  const Simulation limited = simulate(growing, from(1), 10.0, {}, {.max_steps = 30});
  CHECK(limited.status == MotionStatus::step_limit);
  CHECK(limited.error.array().isNaN().all());
  // Nor does a tolerance that cannot be smaller.
  CHECK(simulate(growing, from(1), 1.0, {}, {.tolerance = 1e-14}).error.array().isNaN().all());
}

TEST_CASE("the error is estimated where the longest step alone limits the steps, and not too low") {
  const Model decay = scalar([](double x, double, double) { return -x; });
  for (const double longest : {0.1, 0.5}) {
    const Simulation s = simulate(decay, from(1), 2.0, {},
                                  {.tolerance = 1e-3, .sample = 2.0, .longest_step = longest});
    const double off = std::abs(last(s) - std::exp(-2.0));
    CHECK(off > 1e-10);
    CHECK_NEAR(s.error[0], off, 0.05 * off);
  }
}

TEST_CASE("samples lie on the grid, and the end is no second sample of it") {
  const Model decay = scalar([](double x, double, double) { return -x; });
  const Model stiff = scalar([](double x, double, double) { return -1e6 * (x - 1); });
  const struct {
    double duration, sample;
    std::size_t samples;
  } all[] = {{1, 1.0 / 49, 50}, {1e-5, 1e-6, 11}, {1, 0.1, 11}, {1, 0.3, 5}, {0.7, 0.1, 8}};
  for (const auto& [duration, sample, samples] : all) {
    const Simulation s = simulate(decay, from(1), duration, {}, {.sample = sample});
    REQUIRE(s.t.size() == samples);
    for (std::size_t k = 0; k + 1 < samples; ++k) CHECK(s.t[k] == double(k) * sample);
    CHECK(s.t.back() == duration);
  }
  const Simulation implicit = simulate(stiff, from(0), 1.0, {}, {.sample = 1.0 / 49});
  CHECK(implicit.stiff);
  CHECK(implicit.t.size() == 50);
}

TEST_CASE("a motion that slides along a switch ends, and the message names the switch") {
  // x' = v, v' = -2 sign(v + x): on v + x = 0 with |v| < 2 both sides lead back, and x decays.
  const auto sliding = [](const std::vector<Formula>& switches) {
    return model_of({.name = "relay",
                     .states = {{"x", ""}, {"v", ""}},
                     .inputs = {{"u", ""}},
                     .outputs = {},
                     .parameters = {},
                     .let = {},
                     .rates = {"v", "-2*sign(v + x) + u"},
                     .values = {},
                     .switches = switches});
  };
  const OperatingPoint start{Eigen::Vector2d{1, 0}, one(0), none};
  const Simulation named =
      simulate(sliding({{"relay", "v + x"}}), start, 5.0, {}, {.max_steps = 20'000});
  CHECK_FALSE(named);
  CHECK_NEAR(named.t.back(), std::numbers::sqrt2 - 1, 1e-3);  // 1 - t² = 2t
  CHECK(says(named.message, "the motion slides along 'relay', to which the rates lead back"));
  CHECK(named.error.array().isNaN().all());
  const Simulation undeclared = simulate(sliding({}), start, 5.0, {}, {.max_steps = 20'000});
  CHECK(undeclared.status == MotionStatus::step_limit);
  CHECK(says(undeclared.message, "or the motion slides along a jump of the rates"));
  // Steep is not a jump.
  Model steep = scalar([](double x, double, double) { return -1e3 * x; });
  steep.switches = {{"zero", [](const OperatingPoint& at) { return at.x[0]; }}};
  const Simulation short_steps =
      simulate(steep, from(0), 1.0, {}, {.longest_step = 1e-4, .max_steps = 1000});
  CHECK(short_steps.status == MotionStatus::step_limit);
  CHECK_FALSE(says(short_steps.message, "'zero'"));
}

TEST_CASE("inaccurate: where the error has eaten a chaotic motion, it ends") {
  const Model lorenz = model_of({.name = "Lorenz",
                                 .states = {{"x", ""}, {"y", ""}, {"z", ""}},
                                 .inputs = {},
                                 .outputs = {},
                                 .parameters = {},
                                 .let = {},
                                 .rates = {"10*(y - x)", "x*(28 - z) - y", "x*y - 8/3*z"},
                                 .values = {},
                                 .switches = {}});
  const OperatingPoint start{Eigen::Vector3d{1, 1, 1}, none, none};
  const Simulation s = simulate(lorenz, start, 100.0);
  CHECK(s.status == MotionStatus::inaccurate);
  CHECK(to_string(s.status) == "inaccurate");
  CHECK(s.t.back() > 15);
  CHECK(s.t.back() < 45);
  CHECK(says(s.message, "a smaller tolerance extends the valid range"));
  // Up to its end it is the motion, as computed with a much smaller tolerance.
  const Simulation truth = simulate(lorenz, start, s.t.back(), {}, {.tolerance = 1e-13});
  for (Eigen::Index k = 0; k < s.x.cols(); ++k)
    CHECK((s.x.col(k) - truth.x.col(k)).cwiseAbs().maxCoeff() < 6);
}

TEST_CASE("event limit") {
  Model m = model_of({.name = "clock",
                      .states = {{"x", ""}, {"y", ""}},
                      .inputs = {},
                      .outputs = {},
                      .parameters = {},
                      .let = {},
                      .rates = {"y", "-x"},
                      .values = {},
                      .switches = {{"zero", "x"}}});
  const Simulation s =
      simulate(m, {Eigen::Vector2d{1, 0}, none, none}, 100.0, {}, {.max_events = 5});
  CHECK(s.status == MotionStatus::event_limit);
  CHECK(s.events.size() == 5);
  CHECK_NEAR(s.t.back(), 4.5 * std::numbers::pi, 1e-8);
}

TEST_CASE("interrupted") {
  std::stop_source source;
  const Model m = scalar([&](double x, double, double) {
    if (x > 0.5) source.request_stop();
    return 1.0;
  });
  const Simulation s =
      simulate(m, from(0), 10.0, {}, {.longest_step = 0.1, .stop = source.get_token()});
  CHECK(s.status == MotionStatus::interrupted);
  CHECK(s.t.back() < 1.0);
}

// ---- the caller's mistakes ----

TEST_CASE("the caller's mistakes throw, in words") {
  const Model m = scalar([](double, double, double) { return 1.0; });
  const auto message = [&](const Model& model, const OperatingPoint& start, double duration,
                           const std::vector<SignalChange>& changes = {}) -> std::string {
    try {
      (void)simulate(model, start, duration, changes);
    } catch (const std::invalid_argument& e) {
      return e.what();
    }
    return {};
  };
  CHECK(says(message(m, from(0), 1, {{"v", 1}}), "'v'"));
  CHECK(
      says(message(m, from(0), 1, {{"x", 1}}), "'x' is a state; expected an input or a parameter"));
  CHECK(says(message(m, from(0), 1, {{"u", not_a_number}}), "a change of 'u' by nan"));
  CHECK(
      says(message(m, from(0), 1, {{"u", 1, 0.5, 0.5}}), "numbers and an end after the beginning"));
  CHECK(says(message(m, from(0), 1, {{"u", 1, not_a_number}}), "expected finite numbers"));
  CHECK(says(message(m, from(0), 0), "the end must come after the start"));
  CHECK(says(message(m, from(not_a_number), 1), "'x' is nan"));
  CHECK(says(message(m, {one(0), none, one(0)}, 1), "expected 1 values, got 0"));
  CHECK(says(message(Model{}, {}, 1), "the model has no function f"));
  Model wrong = m;
  wrong.f = [](const VectorXd&, const VectorXd&, const VectorXd&) -> VectorXd {
    return VectorXd::Zero(2);
  };
  CHECK(message(wrong, from(0), 1) == "model 'scalar': its rates f: expected 1 values, got 2");
  wrong = m;
  wrong.outputs = {{"y", ""}};
  wrong.h = [](const VectorXd&, const VectorXd&, const VectorXd&) -> VectorXd {
    return VectorXd::Zero(2);
  };
  CHECK(message(wrong, from(0), 1) == "model 'scalar': its outputs h: expected 1 values, got 2");
}

}  // namespace simulate_test
