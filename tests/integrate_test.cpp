// Integration: order, events, every way of ending.
#include "simulate/integrate.hpp"

#include <doctest/doctest.h>

#include <cmath>

#include "check.hpp"

using namespace tiltrim;

TEST_CASE("a harmonic oscillator comes back after a hundred periods") {
  Motion motion;
  motion.states = {{"x", "m", 1.0}, {"v", "m/s", 1.0}};
  motion.f = [](double, const double* x, int, double* rates) {
    rates[0] = x[1];
    rates[1] = -x[0];
  };
  const double periods = 100 * 2 * 3.14159265358979323846;
  const Trajectory flown = integrate(motion, {1.0, 0.0}, 0, 0.0, periods, {.tolerance = 1e-13});
  REQUIRE(flown);
  CHECK_NEAR(flown.state(flown.samples() - 1)[0], 1.0, 1e-9);
  CHECK_NEAR(flown.state(flown.samples() - 1)[1], 0.0, 1e-9);
}
