// Integration: order, tolerance, events, every way of ending.
#include "simulate/integrate.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <stdexcept>

#include "tests/check.hpp"

using namespace tiltrim;
using enum EventFunction::Direction;

namespace integrate_test {

using ::refusal;

static constexpr double pi = std::numbers::pi;
static constexpr double inf = std::numeric_limits<double>::infinity();
static constexpr double nan_value = std::numeric_limits<double>::quiet_NaN();

// One state x with a given rate.
static Motion of_one(std::function<double(double t, double x)> rate) {
  Motion motion;
  motion.states = {{"x", "m", 1.0}};
  motion.f = [rate = std::move(rate)](double t, const double* x, int, double* rates) {
    rates[0] = rate(t, x[0]);
  };
  return motion;
}

// x'' = -x: from (1, 0) it is (cos t, -sin t).
static Motion oscillator() {
  Motion motion;
  motion.states = {{"x", "m", 1.0}, {"v", "m/s", 1.0}};
  motion.f = [](double, const double* x, int, double* rates) {
    rates[0] = x[1];
    rates[1] = -x[0];
  };
  return motion;
}

static void watch(Motion& motion, const EventFunction& function,
                  std::function<double(double t, const double* x)> g) {
  motion.event_functions.push_back(function);
  motion.g = [before = motion.g, g = std::move(g), k = motion.event_functions.size() - 1](
                 double t, const double* x, int mode, double* values) {
    if (before) before(t, x, mode, values);
    values[k] = g(t, x);
  };
}

// Thrown up at v = 1 from the ground, unit gravity; each bounce keeps a fraction of the speed.
static Motion ball(double keeps) {
  Motion motion;
  motion.states = {{"height", "m", 1.0}, {"speed", "m/s", 1.0}};
  motion.f = [](double, const double* x, int, double* rates) {
    rates[0] = x[1];
    rates[1] = -1;
  };
  watch(motion, {"ground", falling}, [](double, const double* x) { return x[0]; });
  motion.at = [keeps](const MotionEvent&, double* x, int mode) {
    x[1] *= -keeps;
    return mode;
  };
  return motion;
}

static const double* last(const Trajectory& flown) { return flown.state(flown.samples() - 1); }

static std::vector<double> times(const Trajectory& flown) {
  std::vector<double> all;
  for (const MotionEvent& event : flown.events) all.push_back(event.t);
  return all;
}

static double largest_step(const Trajectory& flown) {
  double largest = 0;
  for (std::size_t k = 1; k < flown.samples(); ++k)
    largest = std::max(largest, flown.t[k] - flown.t[k - 1]);
  return largest;
}

// ---- order and tolerance ----

// x' = x cos t: x = exp(sin t).
static Motion growth() {
  return of_one([](double t, double x) { return x * std::cos(t); });
}

TEST_CASE("the solution converges with order 5") {
  const auto error = [](double step) {
    const Trajectory flown =
        integrate(growth(), {1.0}, 0, 0.0, 4.0, {.sample = 0, .fixed_step = step});
    REQUIRE(flown);
    CHECK(flown.rejected == 0);
    CHECK(flown.evaluations == 6 * flown.steps + 1);  // the last rate of a step is the next's first
    return std::abs(last(flown)[0] - std::exp(std::sin(4.0)));
  };
  const double order = std::log2(error(4.0 / 128) / error(4.0 / 256));
  CHECK_NEAR(order, 5.0, 0.1);
}

TEST_CASE("samples between the steps converge with order 4 at least") {
  const auto error = [](double step) {
    const Trajectory flown =
        integrate(growth(), {1.0}, 0, 0.0, 4.0, {.sample = step / 7, .fixed_step = step});
    double worst = 0;
    for (std::size_t k = 0; k < flown.samples(); ++k)
      worst = std::max(worst, std::abs(flown.state(k)[0] - std::exp(std::sin(flown.t[k]))));
    return worst;
  };
  CHECK(std::log2(error(4.0 / 64) / error(4.0 / 128)) > 4.0);
}

TEST_CASE("a harmonic oscillator comes back after a hundred periods") {
  const Trajectory flown =
      integrate(oscillator(), {1.0, 0.0}, 0, 0.0, 200 * pi, {.tolerance = 1e-13});
  REQUIRE(flown);
  CHECK_NEAR(last(flown)[0], 1.0, 1e-9);
  CHECK_NEAR(last(flown)[1], 0.0, 1e-9);
}

TEST_CASE("the error at the end follows the tolerance") {
  const auto error = [](double tolerance) {
    const Trajectory flown =
        integrate(oscillator(), {1.0, 0.0}, 0, 0.0, 20 * pi, {.tolerance = tolerance});
    return std::hypot(last(flown)[0] - 1, last(flown)[1]);
  };
  double before = error(1e-5);
  for (const double tolerance : {1e-6, 1e-7, 1e-8, 1e-9, 1e-10, 1e-11}) {
    const double now = error(tolerance);
    CAPTURE(tolerance);
    CHECK(now < 1000 * tolerance);  // some hundred steps, each within it
    CHECK(now < before / 4);        // error per step: tolerance^(4/5) at least, 6.3
    before = now;
  }
}

TEST_CASE("the Arenstorf orbit closes after its period") {
  // Restricted three bodies, with the numbers of [52, chapter II, eq. (0.1), (0.2)].
  constexpr double moon = 0.012277471, earth = 1 - moon;
  Motion motion;
  motion.states = {{"x", "", 1.0}, {"y", "", 1.0}, {"vx", "", 1.0}, {"vy", "", 1.0}};
  motion.f = [=](double, const double* x, int, double* rates) {
    const double to_earth = std::pow(std::hypot(x[0] + moon, x[1]), 3);
    const double to_moon = std::pow(std::hypot(x[0] - earth, x[1]), 3);
    rates[0] = x[2];
    rates[1] = x[3];
    rates[2] = x[0] + 2 * x[3] - earth * (x[0] + moon) / to_earth - moon * (x[0] - earth) / to_moon;
    rates[3] = x[1] - 2 * x[2] - earth * x[1] / to_earth - moon * x[1] / to_moon;
  };
  const std::vector<double> start{0.994, 0.0, 0.0, -2.00158510637908252240537862224};
  constexpr double period = 17.0652165601579625588917206249;
  const auto gap = [&](double tolerance) {
    const Trajectory flown = integrate(motion, start, 0, 0.0, period, {.tolerance = tolerance});
    REQUIRE(flown);
    return std::hypot(last(flown)[0] - start[0], last(flown)[1] - start[1]);
  };
  CHECK(gap(1e-13) < 1e-5);
  CHECK(gap(1e-13) < gap(1e-10) / 50);
}

TEST_CASE("Lorenz: a run at a coarser tolerance follows a finer one") {
  Motion motion;
  motion.states = {{"x", "", 1.0}, {"y", "", 1.0}, {"z", "", 1.0}};
  motion.f = [](double, const double* x, int, double* rates) {
    rates[0] = 10 * (x[1] - x[0]);
    rates[1] = x[0] * (28 - x[2]) - x[1];
    rates[2] = x[0] * x[1] - 8.0 / 3 * x[2];
  };
  const auto end = [&](double tolerance) {
    const Trajectory flown = integrate(motion, {1, 1, 1}, 0, 0.0, 10.0, {.tolerance = tolerance});
    return std::vector<double>(last(flown), last(flown) + 3);
  };
  const auto fine = end(1e-13), coarse = end(1e-9), coarser = end(1e-7);
  for (int i = 0; i < 3; ++i) {
    CHECK_NEAR(coarse[i], fine[i], 1e-4);  // errors grow by exp(0.9 t) = 8000
    CHECK(std::abs(coarse[i] - fine[i]) < std::abs(coarser[i] - fine[i]));
  }
}

// ---- steps and samples ----

TEST_CASE("the longest step is kept, by samples at the steps themselves") {
  const Motion still = of_one([](double, double) { return 1.0; });
  for (const double longest : {0.5, 0.03, 1e-3}) {
    const Trajectory flown =
        integrate(still, {0.0}, 0, 0.0, 1.7, {.sample = 0, .longest_step = longest});
    REQUIRE(flown);
    CHECK(largest_step(flown) <= longest * (1 + 2e-9));  // the last step absorbs a tiny remainder
    CHECK(flown.samples() == std::size_t(flown.steps) + 1);
    CHECK(std::ranges::adjacent_find(flown.t, std::greater_equal{}) == flown.t.end());
  }
}

TEST_CASE("samples are on the grid, first and last on the ends to the bit") {
  const Motion motion = growth();
  for (const double to : {1.0, 0.3, 0.7, 1.0 / 3, 0.1 + 0.2, std::nextafter(0.7, 1.0), 1e-7}) {
    const Trajectory flown = integrate(motion, {1.0}, 0, 0.0, to, {.sample = 0.1});
    REQUIRE(flown);
    CAPTURE(to);
    CHECK(flown.t.front() == 0.0);
    CHECK(flown.t.back() == to);
    CHECK(flown.end() == to);
    CHECK(flown.x.size() == flown.t.size());
    CHECK(flown.modes.size() == flown.t.size());
    for (std::size_t k = 0; k + 1 < flown.samples(); ++k) CHECK(flown.t[k] == double(k) * 0.1);
    CHECK(std::ranges::adjacent_find(flown.t, std::greater_equal{}) == flown.t.end());
  }
  CHECK(integrate(motion, {1.0}, 0, 0.0, 1.0, {.sample = inf}).samples() == 2);
}

TEST_CASE("an event on the grid has one sample before it and one behind") {
  Motion motion = of_one([](double, double) { return 1.0; });
  watch(motion, {"half", rising}, [](double, const double* x) { return x[0] - 0.5; });
  motion.at = [](const MotionEvent&, double* x, int mode) {
    x[0] = 10;
    return mode + 1;
  };
  for (const double grid : {0.25, 0.3, 0.0}) {
    CAPTURE(grid);
    const Trajectory flown = integrate(motion, {0.0}, 7, 0.0, 1.0, {.sample = grid});
    REQUIRE(flown);
    REQUIRE(flown.events.size() == 1);
    const auto before = std::ranges::find(flown.t, flown.events[0].t);
    CHECK(std::ranges::count(flown.t, flown.events[0].t) == 2);
    const std::size_t k = std::size_t(before - flown.t.begin());
    CHECK_NEAR(flown.state(k)[0], 0.5, 1e-15);
    CHECK(flown.modes[k] == 7);
    CHECK(flown.state(k + 1)[0] == 10);
    CHECK(flown.modes[k + 1] == 8);
    CHECK_NEAR(last(flown)[0], 10.5, 1e-14);
  }
}

TEST_CASE("twice the same gives the same bits") {
  const auto once = [] { return integrate(ball(0.8), {0.0, 1.0}, 0, 0.0, 9.0); };
  const Trajectory a = once(), b = once();
  CHECK(a.t == b.t);
  CHECK(a.x == b.x);
  CHECK(times(a) == times(b));
  CHECK(a.evaluations == b.evaluations);
}

TEST_CASE("times far away, long and short") {
  const auto off = [](double from, double span, double rate, const IntegrateOptions& options = {}) {
    const Motion motion =
        of_one([=](double t, double) { return rate * std::cos(rate * (t - from)); });
    const Trajectory flown = integrate(motion, {0.0}, 0, from, from + span, options);
    REQUIRE(flown);
    CHECK(flown.t.back() == from + span);
    CHECK(flown.steps < 2000);
    return std::abs(last(flown)[0] - std::sin(rate * (flown.t.back() - from)));
  };
  CHECK(off(0, 1e-9, 1e9) < 1e-8);
  CHECK(off(0, 1e-9, 3e10) < 1e-7);
  CHECK(off(1e9, 10, 1) < 1e-6);  // times there are 1e-7 apart
  CHECK(off(-1e9, 10, 1) < 1e-6);
  CHECK(off(0, 1e9, 1e-8, {.sample = 1e8, .longest_step = 1e8}) < 1e-7);
  CHECK(off(-5, 10, 1) < 1e-8);
}

TEST_CASE("a hundred states, each with a decay of its own") {
  Motion motion;
  std::vector<double> x0;
  for (int i = 0; i < 100; ++i) {
    motion.states.push_back({fmt::format("x{}", i), "", 1.0});
    x0.push_back(1.0);
  }
  motion.f = [](double, const double* x, int, double* rates) {
    for (int i = 0; i < 100; ++i) rates[i] = -0.01 * (i + 1) * x[i];
  };
  const Trajectory flown = integrate(motion, x0, 0, 0.0, 5.0);
  REQUIRE(flown);
  for (int i = 0; i < 100; ++i) CHECK_NEAR(last(flown)[i], std::exp(-0.05 * (i + 1)), 1e-8);
}

TEST_CASE(
    "a jump without an event function costs steps, and accuracy within a hundred tolerances") {
  const Motion motion =
      of_one([](double t, double x) { return (t < 1 / std::sqrt(2.0) ? 1.0 : -1.0) - x; });
  const Trajectory flown = integrate(motion, {0.0}, 0, 0.0, 2.0);
  REQUIRE(flown);
  const double jump = 1 / std::sqrt(2.0), there = 1 - std::exp(-jump);
  CHECK(flown.rejected > 5);
  // Between the last stages the estimate sees a jump ten times too small, or worse.
  CHECK_NEAR(last(flown)[0], (there + 1) * std::exp(jump - 2) - 1, 100e-9);
}

TEST_CASE("breaks: a piecewise constant force keeps order 5, and few steps are refused") {
  // x' = u - x, u constant between breaks: x - u decays there.
  const std::vector<double> breaks{0.3, 1.0, 1.0 + 1e-3}, u{0.5, -1.0, 2.0, 0.0};
  Motion motion = of_one([&](double t, double x) {
    return u[std::size_t(std::ranges::upper_bound(breaks, t) - breaks.begin())] - x;
  });
  motion.breaks = {-1.0, 0.0, 0.3, 1.0, 1.0 + 1e-3, 2.0, 5.0};
  double x = 0.0, t = 0.0;
  for (std::size_t k = 0; k < u.size(); ++k) {
    const double next = k < breaks.size() ? breaks[k] : 2.0;
    x = u[k] + (x - u[k]) * std::exp(t - next);
    t = next;
  }
  const auto flown = [&](const IntegrateOptions& options) {
    return integrate(motion, {0.0}, 0, 0.0, 2.0, options);
  };
  const Trajectory controlled = flown({.tolerance = 1e-10});
  CHECK_NEAR(last(controlled)[0], x, 1e-9);
  CHECK(controlled.rejected <= 6);
  const auto error = [&](double step) {
    return std::abs(last(flown({.fixed_step = step}))[0] - x);
  };
  CHECK_NEAR(std::log2(error(0.1) / error(0.05)), 5.0, 0.3);  // steps at the breaks are not halved
}

// ---- events ----

TEST_CASE("a ball bounces in a geometric sequence until it may no longer be followed") {
  for (const double keeps : {0.5, 0.8, 0.95}) {
    CAPTURE(keeps);
    const Trajectory flown = integrate(ball(keeps), {0.0, 1.0}, 0, 0.0, 100.0);
    CHECK(flown.status == MotionStatus::event_limit);
    CHECK(flown.message.starts_with("'ground' chatters,"));
    double t = 0, flight = 2;
    std::size_t bounces = 0;
    for (; flight > 1e-10; ++bounces, flight *= keeps) {
      t += flight;
      REQUIRE(bounces < flown.events.size());
      CHECK_NEAR(flown.events[bounces].t, t, 1e-12);
      CHECK_FALSE(flown.events[bounces].rising);
    }
    CHECK(flown.events.size() > bounces);
    const double end = 2 / (1 - keeps);
    CHECK_NEAR(flown.end(), end, 2e-13 * end / (1 - keeps));  // flights of an instant are left out
    for (std::size_t k = 0; k < flown.samples(); ++k) CHECK(flown.state(k)[0] > -1e-12);
  }
}

TEST_CASE("crossings of an oscillator, in each direction") {
  // In addition to the event's error the solution's: tolerance times a hundred steps.
  const auto crossings = [](EventFunction::Direction direction) {
    Motion motion = oscillator();
    watch(motion, {"x", direction}, [](double, const double* x) { return x[0]; });
    return integrate(motion, {1.0, 0.0}, 0, 0.0, 6 * pi, {.tolerance = 1e-14});
  };
  const Trajectory all = crossings(both), up = crossings(rising), down = crossings(falling);
  REQUIRE(all.events.size() == 6);
  for (std::size_t k = 0; k < 6; ++k) {
    CHECK_NEAR(all.events[k].t, (double(k) + 0.5) * pi, 1e-12);
    CHECK(all.events[k].rising == (k % 2 == 1));
  }
  REQUIRE(up.events.size() == 3);
  REQUIRE(down.events.size() == 3);
  for (std::size_t k = 0; k < 3; ++k) {
    CHECK_NEAR(down.events[k].t, (2 * double(k) + 0.5) * pi, 1e-12);
    CHECK_NEAR(up.events[k].t, (2 * double(k) + 1.5) * pi, 1e-12);
  }
}

// A clock with an event function.
static Motion clock_with(const EventFunction& function, std::function<double(double t)> g) {
  Motion motion = of_one([](double, double) { return 1.0; });
  watch(motion, function, [g = std::move(g)](double, const double* x) { return g(x[0]); });
  return motion;
}

TEST_CASE("events at the start, in the first step and at the end") {
  const auto at = [](double t, EventFunction::Direction direction, double sign) {
    return times(
        integrate(clock_with({"there", direction}, [=](double x) { return sign * (x - t); }), {0.0},
                  0, 0.0, 1.0));
  };
  using Times = std::vector<double>;
  SUBCASE("zero is below: at the start, what rises from it has an event, what falls has none") {
    CHECK(at(0.0, both, 1) == Times{0.0});
    CHECK(at(0.0, rising, 1) == Times{0.0});
    CHECK(at(0.0, falling, 1) == Times{});
    CHECK(at(0.0, both, -1) == Times{});
  }
  SUBCASE("in the first step") {
    for (const double t : {1e-15, 1e-9, 1e-3, 0.0099})
      for (const double sign : {1.0, -1.0}) {
        REQUIRE(at(t, both, sign).size() == 1);
        CHECK_NEAR(at(t, both, sign)[0], t, 1e-14);
      }
  }
  SUBCASE("at the end: what falls to zero is there, what rises to it is not yet") {
    const auto by_time = [](double t, double sign) {
      Motion motion = of_one([](double, double) { return 1.0; });
      watch(motion, {"there"}, [=](double now, const double*) { return sign * (now - t); });
      return times(integrate(motion, {0.0}, 0, 0.0, 1.0));
    };
    CHECK(by_time(1.0, -1) == Times{1.0});
    CHECK(by_time(1.0, 1) == Times{});
    CHECK(by_time(std::nextafter(1.0, 0.0), 1) == Times{1.0});
    CHECK(by_time(std::nextafter(1.0, 2.0), -1) == Times{});
    REQUIRE(at(1 - 1e-13, both, -1).size() == 1);
    CHECK_NEAR(at(1 - 1e-13, both, -1)[0], 1.0, 1e-12);
    CHECK(at(1 + 1e-9, both, 1) == Times{});
  }
}

TEST_CASE("an event function that only touches zero from below has no event") {
  CHECK(integrate(clock_with({"touch"}, [](double x) { return -(x - 0.5) * (x - 0.5); }), {0.0}, 0,
                  0.0, 1.0)
            .events.empty());
  CHECK(integrate(clock_with({"zero"}, [](double) { return 0.0; }), {0.0}, 0, 0.0, 1.0)
            .events.empty());
  CHECK(integrate(clock_with({"far"}, [](double) { return -inf; }), {0.0}, 0, 0.0, 1.0)
            .events.empty());
}

TEST_CASE("an event function infinite on one side is located too") {
  const Trajectory flown = integrate(
      clock_with({"edge"}, [](double x) { return x > 0.3 ? inf : -inf; }), {0.0}, 0, 0.0, 1.0);
  REQUIRE(flown.events.size() == 1);
  CHECK_NEAR(flown.events[0].t, 0.3, 1e-12);
}

TEST_CASE("what changes its sign twice within a step is missed, shorter steps see it") {
  const auto seen = [](double longest) {
    return integrate(clock_with({"blip"}, [](double x) { return 0.01 - std::abs(x - 0.6); }), {0.0},
                     0, 0.0, 1.0, {.longest_step = longest})
        .events.size();
  };
  CHECK(seen(0.5) == 0);
  CHECK(seen(0.019) == 2);
}

TEST_CASE("two events at the same instant both happen") {
  Motion motion = clock_with({"a"}, [](double x) { return x - 0.4; });
  watch(motion, {"b"}, [](double t, const double*) { return 0.4 - t; });
  watch(motion, {"c"}, [](double, const double* x) { return x[0] - 0.5; });
  const Trajectory flown = integrate(motion, {0.0}, 0, 0.0, 1.0);
  REQUIRE(flown.events.size() == 3);
  CHECK(flown.events[0].which + flown.events[1].which == 1);
  CHECK(flown.events[2].which == 2);
  for (const int k : {0, 1}) CHECK_NEAR(flown.events[std::size_t(k)].t, 0.4, 1e-13);
  CHECK_NEAR(flown.events[2].t, 0.5, 1e-13);
}

TEST_CASE("of several events in one step each is at its own time, in order") {
  Motion motion = of_one([](double, double) { return 1.0; });
  const std::vector<double> at{0.73, 0.71, 0.74, 0.72};
  for (const double t : at)
    watch(motion, {fmt::format("{}", t)}, [t](double, const double* x) { return x[0] - t; });
  const Trajectory flown = integrate(motion, {0.0}, 0, 0.0, 1.0);
  REQUIRE(flown.events.size() == 4);
  CHECK(std::ranges::is_sorted(times(flown)));
  for (const MotionEvent& event : flown.events) CHECK_NEAR(event.t, at[event.which], 1e-13);
}

TEST_CASE("modes: a thermostat between two temperatures has a closed form") {
  // x' = m - x, m = 1 until x = 0.75, then 0 until 0.25: ln 3 each way after the first, ln 4.
  Motion motion = of_one([](double, double) { return 0.0; });
  motion.f = [](double, const double* x, int mode, double* rates) { rates[0] = mode - x[0]; };
  watch(motion, {"hot", rising}, [](double, const double* x) { return x[0] - 0.75; });
  watch(motion, {"cold", falling}, [](double, const double* x) { return x[0] - 0.25; });
  motion.at = [](const MotionEvent& event, double*, int) { return event.which == 0 ? 0 : 1; };
  const Trajectory flown = integrate(motion, {0.0}, 1, 0.0, 10.0, {.tolerance = 1e-14});
  REQUIRE(flown);
  REQUIRE(flown.events.size() == 8);
  for (std::size_t k = 0; k < 8; ++k) {
    CHECK_NEAR(flown.events[k].t, std::log(4.0) + double(k) * std::log(3.0), 1e-12);
    CHECK(flown.events[k].which == k % 2);
  }
  CHECK_NEAR(last(flown)[0], 1 - 0.75 * std::exp(flown.events[7].t - 10), 1e-12);
}

TEST_CASE("what one event moves makes another happen at the same instant") {
  Motion motion = clock_with({"first", rising}, [](double x) { return x - 0.3; });
  watch(motion, {"second", rising}, [](double, const double* x) { return x[0] - 5; });
  motion.at = [](const MotionEvent& event, double* x, int mode) {
    if (event.which == 0) x[0] = 6;
    return mode + 1;
  };
  const Trajectory flown = integrate(motion, {0.0}, 0, 0.0, 1.0);
  REQUIRE(flown.events.size() == 2);
  CHECK(flown.events[0].t == flown.events[1].t);
  CHECK(flown.modes.back() == 2);
  CHECK_NEAR(last(flown)[0], 6.7, 1e-13);
}

TEST_CASE("a jump of an event function at a break is an event at the break") {
  Motion motion = clock_with({"switch"}, [](double) { return 0.0; });
  motion.g = [](double t, const double*, int, double* g) { g[0] = t < 0.6 ? -1 : 1; };
  motion.breaks = {0.6};
  const Trajectory flown = integrate(motion, {0.0}, 0, 0.0, 1.0);
  CHECK(times(flown) == std::vector<double>{0.6});
}

// ---- every way of ending ----

TEST_CASE("completed: to the end, without a message") {
  const Trajectory flown = integrate(oscillator(), {1.0, 0.0}, 0, 0.0, 1.0);
  CHECK(flown);
  CHECK(flown.status == MotionStatus::completed);
  CHECK(flown.message.empty());
}

TEST_CASE("ended by an event, named") {
  Motion motion = clock_with({"wall", rising, true}, [](double x) { return x - 0.7; });
  const Trajectory flown = integrate(motion, {0.0}, 0, 0.0, 1.0);
  CHECK_FALSE(flown);
  CHECK(flown.status == MotionStatus::ended_by_event);
  CHECK(flown.message == "wall");
  CHECK_NEAR(flown.end(), 0.7, 1e-13);
  CHECK(flown.end() == flown.events.back().t);
}

TEST_CASE("diverged: x' = x² from 1 is without bound at t = 1") {
  const Trajectory flown =
      integrate(of_one([](double, double x) { return x * x; }), {1.0}, 0, 0.0, 2.0);
  CHECK(flown.status == MotionStatus::diverged);
  CHECK(flown.message.starts_with("x is "));
  CHECK_NEAR(flown.end(), 1.0, 1e-7);
  CHECK(last(flown)[0] > 1e9);
}

TEST_CASE("not finite: at the start, after some time, behind a break, in fixed steps") {
  const auto flown = [](auto rate, const IntegrateOptions& options = {}) {
    return integrate(of_one(rate), {0.0}, 0, 0.0, 2.0, options);
  };
  const auto nan_from_1 = [](double t, double) { return t < 1 ? 1.0 : nan_value; };
  const Trajectory start = flown([](double, double) { return nan_value; });
  CHECK(start.status == MotionStatus::not_finite);
  CHECK(start.message == "the rate of x is nan");
  CHECK(start.end() == 0.0);
  CHECK(start.samples() == 1);
  const Trajectory later = flown(nan_from_1);
  CHECK(later.status == MotionStatus::not_finite);
  CHECK(later.message == "the rate of x is nan");
  CHECK_NEAR(later.end(), 1.0, 1e-12);
  const Trajectory fixed = flown(nan_from_1, {.fixed_step = 0.03});
  CHECK(fixed.status == MotionStatus::not_finite);
  CHECK_NEAR(fixed.end(), 0.99, 1e-12);
  Motion motion = of_one(nan_from_1);
  motion.breaks = {1.0};
  const Trajectory behind = integrate(motion, {0.0}, 0, 0.0, 2.0);
  CHECK(behind.status == MotionStatus::not_finite);
  CHECK(behind.end() == 1.0);
  CHECK(behind.rejected == 0);
}

TEST_CASE("not finite: an event function, at the start and later") {
  for (const double from : {0.0, 0.6}) {
    const Trajectory flown =
        integrate(clock_with({"g"}, [=](double x) { return x < from ? -1.0 : nan_value; }), {0.0},
                  0, 0.0, 1.0);
    CHECK(flown.status == MotionStatus::not_finite);
    CHECK(flown.message == "the event function 'g' is nan");
    CHECK(flown.events.empty());
  }
}

TEST_CASE("step too small: before a pole, or times are too far apart") {
  const Trajectory pole = integrate(of_one([](double, double x) { return x * x; }), {1.0}, 0, 0.0,
                                    2.0, {.diverged_beyond = inf});
  CHECK(pole.status == MotionStatus::step_too_small);
  CHECK_NEAR(pole.end(), 1.0, 1e-7);
  // Times at 1e9 s are 1e-7 s apart.
  const Trajectory far = integrate(of_one([](double t, double) { return 1e9 * std::cos(1e9 * t); }),
                                   {0.0}, 0, 1e9, 1e9 + 1);
  CHECK(far.status == MotionStatus::step_too_small);
  CHECK(far.end() == 1e9);
  CHECK(far.message == "even the shortest step exceeds the tolerance");
}

TEST_CASE("step limit: stiff") {
  const Trajectory flown =
      integrate(of_one([](double t, double x) { return -1e6 * (x - std::cos(t)); }), {1.0}, 0, 0.0,
                10.0, {.max_steps = 1000});
  CHECK(flown.status == MotionStatus::step_limit);
  CHECK(flown.message.find("1000 steps") != std::string::npos);
  CHECK(flown.steps + flown.rejected == 1000);
  CHECK(flown.end() < 10.0);
  CHECK(flown.t.back() > 0.0);
}

TEST_CASE("event limit: a relay that switches to and fro at once, and too many events") {
  Motion relay = of_one([](double, double) { return 0.0; });
  relay.f = [](double, const double*, int mode, double* rates) { rates[0] = mode; };
  watch(relay, {"relay"}, [](double, const double* x) { return x[0]; });
  relay.at = [](const MotionEvent& event, double*, int) { return event.rising ? -1 : 1; };
  const Trajectory chatter = integrate(relay, {0.5}, -1, 0.0, 1.0);
  CHECK(chatter.status == MotionStatus::event_limit);
  CHECK(chatter.message.starts_with("'relay' chatters,"));
  CHECK_NEAR(chatter.end(), 0.5, 1e-12);
  Motion many = oscillator();
  watch(many, {"x"}, [](double, const double* x) { return x[0]; });
  const Trajectory flown = integrate(many, {1.0, 0.0}, 0, 0.0, 100.0, {.max_events = 5});
  CHECK(flown.status == MotionStatus::event_limit);
  CHECK(flown.events.size() == 5);
}

TEST_CASE("interrupted, from rates or from an event function") {
  for (const bool from_rates : {true, false}) {
    std::stop_source source;
    const auto stop_behind = [&source](double t) {
      if (t > 0.5) source.request_stop();
    };
    Motion motion = of_one([&](double t, double) {
      if (from_rates) stop_behind(t);
      return 1.0;
    });
    watch(motion, {"g"}, [&](double t, const double*) {
      if (!from_rates) stop_behind(t);
      return -1.0;
    });
    const Trajectory flown =
        integrate(motion, {0.0}, 0, 0.0, 10.0, {.longest_step = 0.1, .stop = source.get_token()});
    CHECK(flown.status == MotionStatus::interrupted);
    CHECK(flown.message == "stopped");
    CHECK_NEAR(flown.end(), 0.5, 0.21);
    CHECK_NEAR(last(flown)[0], flown.end(), 1e-12);
  }
}

TEST_CASE("an event cut short does not shorten the steps behind it") {
  Motion motion = of_one([](double, double) { return 1.0; });
  for (int k = 1; k <= 50; ++k)
    watch(motion, {"tick"}, [k](double, const double* x) { return x[0] - 20 * k - 1e-6; });
  const Trajectory flown = integrate(motion, {0.0}, 0, 0.0, 1010.0);
  CHECK(flown.events.size() == 50);
  CHECK(flown.rejected == 0);
  CHECK(flown.steps <= 2020 + 50 + 5);  // of 0.5, one more at each event, five to grow
}

TEST_CASE("every status has a name of its own") {
  std::vector<std::string> names;
  for (int k = 0; k <= int(MotionStatus::interrupted); ++k)
    names.push_back(to_string(MotionStatus(k)));
  CHECK(names.front() == "completed");
  CHECK(names.back() == "interrupted");
  std::ranges::sort(names);
  CHECK(std::ranges::adjacent_find(names) == names.end());
}

// ---- the caller's mistakes ----

TEST_CASE("an exception of the caller's functions passes through") {
  struct Fault {};
  CHECK_THROWS_AS((void)integrate(of_one([](double t, double) -> double {
                                    if (t > 0.5) throw Fault{};
                                    return 1.0;
                                  }),
                                  {0.0}, 0, 0.0, 1.0),
                  Fault);
  CHECK_THROWS_AS((void)integrate(clock_with({"g"},
                                             [](double x) -> double {
                                               if (x > 0.5) throw Fault{};
                                               return x - 0.4;
                                             }),
                                  {0.0}, 0, 0.0, 1.0),
                  Fault);
  Motion motion = clock_with({"g"}, [](double x) { return x - 0.4; });
  motion.at = [](const MotionEvent&, double*, int) -> int { throw Fault{}; };
  CHECK_THROWS_AS((void)integrate(motion, {0.0}, 0, 0.0, 1.0), Fault);
}

static std::string refusal(const Motion& motion, const std::vector<double>& x0, double from,
                           double to, const IntegrateOptions& options = {}) {
  try {
    (void)integrate(motion, x0, 0, from, to, options);
  } catch (const std::invalid_argument& e) {
    return e.what();
  }
  return {};
}

TEST_CASE("what does not fit is refused in words") {
  const Motion good = growth();
  CHECK(refusal(good, {1.0}, 0, 1).empty());
  const auto check_refused = [](const std::string& message, const std::string& word) {
    CAPTURE(message);
    CHECK(message.starts_with("integrate: "));
    CHECK(message.find(word) != std::string::npos);
  };
  Motion motion = good;
  motion.f = {};
  check_refused(refusal(motion, {1.0}, 0, 1), "no rates f");
  motion = good;
  motion.states.clear();
  check_refused(refusal(motion, {}, 0, 1), "no states");
  check_refused(refusal(good, {1.0, 2.0}, 0, 1), "2 values for 1 states");
  motion = good;
  motion.event_functions = {{"a"}};
  check_refused(refusal(motion, {1.0}, 0, 1), "no event function g");
  motion = good;
  for (const double second : {1.0, nan_value}) {
    motion.breaks = {2.0, second};
    check_refused(refusal(motion, {1.0}, 0, 1), "breaks");
  }
  motion = good;
  motion.states[0].nominal = 0;
  check_refused(refusal(motion, {1.0}, 0, 1), "nominal 0");
  for (const double to : {0.0, -1.0, inf, nan_value})
    check_refused(refusal(good, {1.0}, 0, to), "the end must come after the start");
  for (const double from : {1.0, -inf, nan_value})
    check_refused(refusal(good, {1.0}, from, 1), "the end must come after the start");
  for (const double x : {inf, nan_value}) check_refused(refusal(good, {x}, 0, 1), "x starts at");
  for (const double tolerance : {0.0, 1.0, -1e-9, nan_value})
    check_refused(refusal(good, {1.0}, 0, 1, {.tolerance = tolerance}), "tolerance");
  for (const double wrong : {-1.0, nan_value}) {
    check_refused(refusal(good, {1.0}, 0, 1, {.sample = wrong}), "sample");
    check_refused(refusal(good, {1.0}, 0, 1, {.fixed_step = wrong}), "steps");
    check_refused(refusal(good, {1.0}, 0, 1, {.longest_step = wrong}), "steps");
    check_refused(refusal(good, {1.0}, 0, 1, {.diverged_beyond = wrong}), "diverged_beyond");
  }
  check_refused(refusal(good, {1.0}, 0, 1, {.longest_step = 0}), "steps");
  check_refused(refusal(good, {1.0}, 0, 1, {.fixed_step = inf}), "steps");
}

}  // namespace integrate_test
