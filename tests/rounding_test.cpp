// A host program's floating-point environment: results are those of round to nearest, and the
// host's settings are back afterwards.
#include "runtime/rounding.hpp"

#include <doctest/doctest.h>
#include <fmt/core.h>

#include <cfenv>
#include <functional>
#include <string>

#include "flight/fly.hpp"
#include "follow/follow.hpp"
#include "linearize/modes.hpp"
#include "runtime/threads.hpp"
#include "simulate/simulate.hpp"
#include "study/problems.hpp"
#include "study/study.hpp"
#include "sweep/sweep.hpp"
#include "tests/toy_models.hpp"
#include "trim/trim.hpp"
#include "tune/tune.hpp"
#if defined(__SSE2__)
#include <xmmintrin.h>
#endif

using namespace tiltrim;

namespace rounding_test {

namespace {

std::string bits(const auto& values) {
  std::string all;
  for (const double v : values) all += fmt::format(" {:a}", v);
  return all + "\n";
}

constexpr const char* study = R"(
[[condition]]
name = "level"
V = 15.0
gamma_deg = 0.1
eta_deg = 7.3
[[sweep.axis]]
key = "V"
from = 14.0
to = 15.1
count = 3
[simulate]
start = "level"
duration = 0.7
)";

// Every kind of verb once; results to the last bit.
std::string all_verbs() {
  const Study read = parse_study(study, "s.toml");
  const Condition& level = read.conditions.front();
  const Answer trimmed = answer(read.vehicle, level);
  std::string all = bits(trimmed.trim.point.x) + bits(trimmed.trim.rates);
  const LinearModel linear = linearize(trimmed.model, trimmed.trim.point);
  all += bits(linear.A.reshaped()) + bits(linear.A_error.reshaped());
  for (const Mode& m : modes(linear).modes) all += bits(m.right.real()) + bits(m.left.imag());
  OperatingPoint beside = trimmed.trim.point;
  beside.x[0] += 0.1;
  const Simulation motion = simulate(trimmed.model, beside, 0.5);
  all += bits(motion.x.reshaped()) + bits(motion.error);
  SweepOptions two;
  two.threads = 2;
  const SweepMap map =
      sweep(sweep_requests(read, read.conditions, read.sweep->axes), read.sweep->axes, two);
  all += bits(map.eigenvalue_re) + bits(map.state);
  const FlightPlan plan = flight_plan(read);
  for (const FlightState& x : fly(plan.flight, plan.start, plan.options).states)
    all += bits(std::initializer_list<double>{x.along, x.theta, x.q, x.distance});
  const Branch branch =
      follow(scalar([](double x, double p) { return p - x * x - x / 3; }),
             {.free = {"x"}, .steady = {"x"}}, {vec({0.7}), {}, vec({0.8})}, "p", 1.0);
  for (const BranchPoint& point : branch.points) all += bits(point.point.x);
  return all;
}

// Settings a host may have made: rounding, and on x86 FTZ and DAZ.
struct Setting {
  int rounding = std::fegetround();
#if defined(__SSE2__)
  unsigned flush = _mm_getcsr() & 0x8040U;
#else
  unsigned flush = 0;
#endif
  bool operator==(const Setting&) const = default;
};

void set_upward() { std::fesetround(FE_UPWARD); }
void set_flush() {
#if defined(__SSE2__)
  _mm_setcsr(_mm_getcsr() | 0x8040U);
#endif
}

template <class Result>
Result under(void (*set)(), const std::function<Result()>& work) {
  std::fenv_t before;
  std::fegetenv(&before);
  set();
  const Setting host;
  Result result = work();
  const Setting after;
  std::fesetenv(&before);
  CHECK(after == host);
  return result;
}

}  // namespace

TEST_CASE("verbs give the same bits whatever the host rounds to, and leave that as it is") {
  const std::string nearest = all_verbs();
  CHECK(nearest.find("nan") == std::string::npos);
  CHECK(under<std::string>(set_upward, all_verbs) == nearest);
  CHECK(under<std::string>(set_flush, all_verbs) == nearest);
}

TEST_CASE("subnormal numbers count where the host flushes them to zero") {
  // 0 = 10³¹⁰ (10⁻³¹⁰ x) - p, in two steps: x = p, unless the product is flushed.
  const Model m = scalar([](double x, double p) { return 1e155 * (1e155 * (1e-310 * x)) - p; });
  const std::function<TrimResult()> trimmed = [&] {
    return trim(m, {.free = {"x"}, .steady = {"x"}}, {vec({0.5}), {}, vec({2.0})});
  };
  const TrimResult found = under<TrimResult>(set_flush, trimmed);
  CHECK(found.status == TrimStatus::converged);
  CHECK(found.point.x[0] == trimmed().point.x[0]);
}

TEST_CASE("threads of a pool round to nearest, and their own settings are back afterwards") {
  const std::function<bool()> nearest_in_all = [] {
    std::vector<char> nearest(64);
    with_threads(3, [&] {
      spread(nearest.size(), [&](std::size_t i) {
        nearest[i] = Setting() == Setting{FE_TONEAREST, 0};
      });
    });
    return std::ranges::all_of(nearest, [](char yes) { return yes != 0; });
  };
  CHECK(under<bool>(set_upward, nearest_in_all));
  CHECK(under<bool>(set_flush, nearest_in_all));
}

}  // namespace rounding_test
