// Local minima of functions with kinks, and how nearly a point is one.
#include "optimize/nonsmooth.hpp"

#include <cmath>
#include <limits>

#include "tests/check.hpp"
#include "tests/random_draws.hpp"
#include "tests/toy_models.hpp"

using namespace tiltrim;
using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace nonsmooth_test {

namespace {

double sign(double x) { return x < 0 ? -1.0 : 1.0; }

// 8 |x² - y| + (1 - x)²: Lewis and Overton (2013), section 5; its minimum is 0 at (1, 1).
double rosenbrock(const VectorXd& x, VectorXd* gradient) {
  const double kink = x[0] * x[0] - x[1], rest = 1 - x[0];
  if (gradient) *gradient = vec({16 * x[0] * sign(kink) - 2 * rest, -8 * sign(kink)});
  return 8 * std::abs(kink) + rest * rest;
}

// max xᵢ²: MAXQ of the collections of nonsmooth problems; its minimum is 0.
double maxq(const VectorXd& x, VectorXd* gradient) {
  Index i = 0;
  const double largest = x.cwiseAbs().maxCoeff(&i);
  if (gradient) *gradient = 2 * x[i] * VectorXd::Unit(x.size(), i);
  return largest * largest;
}

// The largest real part of the zeros of z² + a z + b, least (-1) where a = 2, b = 1: a double zero,
// at which it has no Lipschitz constant. a is limited to 2 by a kink.
double abscissa(const VectorXd& x, VectorXd* gradient) {
  const double a = x[0], b = x[1], D = a * a / 4 - b;
  const double root = D > 0 ? std::sqrt(D) : 0.0;
  const double over = std::max(a - 2, 0.0);
  if (gradient)
    *gradient = vec({-0.5 + (root > 0 ? a / (4 * root) : 0) + (over > 0 ? 5 : 0),
                     root > 0 ? -1 / (2 * root) : 0});
  return -a / 2 + root + 5 * over;
}

}  // namespace

TEST_CASE("functions with kinks are minimized") {
  const NonsmoothOptions options{.tolerance = 1e-12, .steps = 2000};
  const NonsmoothMinimum at = minimize_nonsmooth(rosenbrock, vec({-1.2, 1.3}), options);
  CHECK(at.converged);
  CHECK(at.value < 1e-6);
  CHECK((at.x - vec({1, 1})).norm() < 1e-3);
  const VectorXd start = VectorXd::LinSpaced(20, -10, 9.5);
  CHECK(minimize_nonsmooth(maxq, start, options).value < 1e-6);
  CHECK(minimize_nonsmooth(abscissa, vec({0.5, 3}), options).value < -1 + 1e-3);
}

TEST_CASE("it ends where there is nothing to follow") {
  const Nonsmooth flat = [](const VectorXd& x, VectorXd* gradient) {
    if (gradient) gradient->setZero(x.size());
    return 3.0;
  };
  const NonsmoothMinimum on_flat = minimize_nonsmooth(flat, vec({1, 2}));
  CHECK(on_flat.converged);
  CHECK(on_flat.x == vec({1, 2}));
  const Nonsmooth nowhere = [](const VectorXd&, VectorXd*) {
    return std::numeric_limits<double>::quiet_NaN();
  };
  CHECK(minimize_nonsmooth(nowhere, vec({1, 2})).value == std::numeric_limits<double>::infinity());
  // Unbounded below: the cap ends it.
  const Nonsmooth falling = [](const VectorXd& x, VectorXd* gradient) {
    if (gradient) *gradient = vec({-1});
    return -x[0];
  };
  CHECK_FALSE(minimize_nonsmooth(falling, vec({0}), {.steps = 5}).converged);
}

TEST_CASE("the least element of a hull: no other is shorter, and it is one") {
  MatrixXd triangle(2, 3);
  triangle << 1, 3, 1, -1, 0, 2;
  CHECK((least_in_hull(triangle) - vec({1, 0})).norm() < 1e-9);
  CHECK(least_in_hull((MatrixXd(2, 3) << 1, -1, 0, 1, 1, -2).finished()).norm() < 1e-9);
  CHECK(least_in_hull(MatrixXd(2, 0)).norm() == 0);
  Random random(3);
  for (int trial = 0; trial < trials(300); ++trial) {
    const Index n = 1 + trial % 9, m = 1 + trial % 17;
    const MatrixXd G = normal(random, n, m) + MatrixXd::Constant(n, m, uniform(random, 0, 2));
    const VectorXd x = least_in_hull(G);
    // The condition for the least element: g·x >= x·x for every g of the hull.
    CHECK((G.transpose() * x).minCoeff() >= x.squaredNorm() - 1e-8 * G.squaredNorm());
  }
}

TEST_CASE("stationarity: zero at a kink's minimum and where gradients vanish, one on a slope") {
  const auto relative = [](const Nonsmooth& f, const VectorXd& x) {
    return stationarity(f, x, 1e-3, 1);
  };
  CHECK(relative(rosenbrock, vec({1, 1})) < 0.02);
  CHECK(relative(rosenbrock, vec({-1.2, 1.3})) > 0.9);
  CHECK(relative(maxq, vec({0, 0, 0})) < 0.05);
  CHECK(relative(abscissa, vec({2, 1})) < 0.05);
  CHECK(relative(abscissa, vec({1, 3})) > 0.9);
  const Nonsmooth nowhere = [](const VectorXd&, VectorXd*) {
    return std::numeric_limits<double>::infinity();
  };
  CHECK(relative(nowhere, vec({1})) == 1);
}

}  // namespace nonsmooth_test
