#include "model/exact.hpp"

#include <Eigen/Geometry>
#include <array>
#include <cmath>
#include <functional>
#include <limits>
#include <numbers>
#include <numeric>

#include "follow/follow.hpp"
#include "linearize/modes.hpp"
#include "model/differentiate.hpp"
#include "model/feedback.hpp"
#include "model/scalar.hpp"
#include "sweep/sweep.hpp"
#include "tests/check.hpp"
#include "tests/toy_models.hpp"
#include "trim/trim.hpp"

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using namespace tiltrim;

namespace exact_test {

namespace {

constexpr double ulp = std::numeric_limits<double>::epsilon();
constexpr double infinity = std::numeric_limits<double>::infinity();

// A number with slope along the first direction only.
Dual moving(double value) {
  Dual x = value;
  x.slopes[0] = 1;
  return x;
}

// dg/dx by eighth-order central differences in extended precision: truncation and rounding are
// about 1e-16 of the terms.
double slope(const std::function<long double(long double)>& g, double x) {
  const long double h = std::ldexp(std::max(std::abs(x), 0.5), -9), at = x;
  const auto odd = [&](int k) { return g(at + k * h) - g(at - k * h); };
  return static_cast<double>((672 * odd(1) - 168 * odd(2) + 32 * odd(3) - 3 * odd(4)) / (840 * h));
}

struct Case {
  std::string name;
  std::function<Dual(Dual)> dual;
  std::function<double(double)> value;
  std::function<long double(long double)> longer;
  std::vector<double> at;
};

template <class G>
Case case_of(std::string name, const G& g, std::vector<double> at) {
  return {std::move(name), g, g, g, std::move(at)};
}

// An expression in x: std functions on numbers, Dual's own on Duals.
#define IN_X(text, ...)          \
  case_of(#text,                 \
          [](auto x) {           \
            using namespace std; \
            return text;         \
          },                     \
          {__VA_ARGS__})

}  // namespace

TEST_CASE("functions: values as std's, slopes as differences in extended precision") {
  const std::vector<Case> cases = {
      IN_X(abs(x), -2.5, 0.7),
      IN_X(fabs(x), -2.5, 0.7),
      IN_X(sqrt(x), 0.3, 7.0),
      IN_X(cbrt(x), -0.3, 7.0),
      IN_X(exp(x), -3.0, 0.2, 4.0),
      IN_X(expm1(x), -1.0, 1e-3, 2.0),
      IN_X(log(x), 0.2, 9.0),
      IN_X(log1p(x), -0.4, 1e-3, 5.0),
      IN_X(log10(x), 0.2, 9.0),
      IN_X(sin(x), -0.8, 0.3, 3.0),
      IN_X(cos(x), -0.8, 0.3, 3.0),
      IN_X(tan(x), -1.2, 0.3),
      IN_X(asin(x), -0.7, 0.2),
      IN_X(acos(x), -0.7, 0.2),
      IN_X(atan(x), -3.0, 0.4),
      IN_X(sinh(x), -1.5, 0.4),
      IN_X(cosh(x), -1.5, 0.4),
      IN_X(tanh(x), -1.5, 0.4, 4.0),
      IN_X(asinh(x), -2.0, 0.3),
      IN_X(acosh(x), 1.4, 3.0),
      IN_X(atanh(x), -0.6, 0.2),
      IN_X(pow(x, 2.5), 0.4, 3.0),
      IN_X(pow(x, 3.0), -1.3, 0.5),
      IN_X(pow(x, -2.0), -1.3, 0.5),
      IN_X(pow(2.5, x), -1.3, 0.5),
      IN_X(pow(x, x), 0.4, 1.8),
      IN_X(atan2(x, 1 + x * x), -0.7, 1.4),
      IN_X(atan2(1.0 - x, x), -0.7, 1.4),
      IN_X(hypot(x, 1 + x), -0.2, 3.0),
      IN_X((1 + x) * (2 - x) / (3 + x * x) - 4 / x, -0.7, 1.4),
      IN_X(-x / 3.0 + (+x) * 2.0 - (x - 1.0) + (2.0 - x) * (3.0 * x), -0.7, 1.4)};
  for (const Case& c : cases)
    for (const double x : c.at) {
      CAPTURE(c.name);
      CAPTURE(x);
      const Dual y = c.dual(moving(x));
      CHECK(y.value == c.value(x));
      const double expected = slope(c.longer, x);
      CHECK_NEAR(y.slopes[0], expected, 8 * ulp * std::max(1.0, std::abs(expected)));
      CHECK(y.slopes.tail(dual_width - 1).isZero(0.0));
    }
}

TEST_CASE("compound assignments are the operations written out") {
  const Dual x = moving(0.7), y = sin(x);
  const auto same = [](const Dual& a, const Dual& b) {
    return a.value == b.value && (a.slopes == b.slopes).all();
  };
  Dual z = x;
  CHECK(same(z += y, x + y));
  CHECK(same(z -= 2 * y, x + y - 2 * y));
  CHECK(same(z = x, x));
  CHECK(same(z *= y, x * y));
  CHECK(same(z /= 2 + x, x * y / (2 + x)));
}

TEST_CASE("comparisons are of values, with numbers on either side") {
  const Dual x = moving(0.5), y = 0.5;
  CHECK(x == y);
  CHECK(x == 0.5);
  CHECK(x != 1.0);
  CHECK(x < 1.0);
  CHECK(0.25 < x);
  CHECK(x >= y);
  CHECK_FALSE(x > y);
  CHECK_FALSE(Dual(std::nan("")) <= x);
}

TEST_CASE("at a kink the derivative is of the side whose value is taken") {
  const Dual x = moving(0.0), none = 0.0;
  CHECK(abs(x).slopes[0] == 1.0);
  CHECK(max(x, 0.0).slopes[0] == 1.0);
  CHECK(max(0.0, x).slopes[0] == 0.0);
  CHECK(min(x, none).slopes[0] == 1.0);
  CHECK(min(none, x).slopes[0] == 0.0);
  CHECK(max(moving(-1.0), 0.0).value == 0.0);
  CHECK(max(moving(-1.0), 0.0).slopes[0] == 0.0);
  CHECK(max(moving(2.0), 0.0).slopes[0] == 1.0);
  CHECK(min(moving(-1.0), 0.0).slopes[0] == 1.0);
  CHECK(clamp(moving(0.4), 0.0, 1.0).slopes[0] == 1.0);
  CHECK(clamp(moving(1.4), 0.0, 1.0).slopes[0] == 0.0);
  CHECK(clamp(moving(1.4), 0.0, 1.0).value == 1.0);
  CHECK(clamp(moving(-3.0), 0.0, 1.0).value == 0.0);
  CHECK(fmax(Dual(std::nan("")), x).value == 0.0);
  CHECK(fmin(x, Dual(std::nan(""))).value == 0.0);
}

TEST_CASE("an infinite slope is one where the argument moves, and none where it does not") {
  const Dual x = moving(0.0);
  for (const Dual& root : {sqrt(x), cbrt(x), pow(x, 0.5), asin(x + 1.0), log(x)}) {
    CHECK(std::isinf(root.slopes[0]));
    CHECK(root.slopes[1] == 0.0);
  }
  CHECK(std::isnan(hypot(x, Dual(0.0)).slopes[0]));  // |x| has none at 0
  CHECK(hypot(x, Dual(0.0)).slopes[1] == 0.0);
  CHECK(std::isnan(atan2(x, Dual(0.0)).slopes[0]));
  CHECK(atan2(x, Dual(0.0)).slopes[1] == 0.0);
  CHECK(std::isnan(sqrt(moving(-1.0)).slopes[0]));
  CHECK(sqrt(moving(-1.0)).slopes[1] == 0.0);
}

TEST_CASE("powers at their edges") {
  struct {
    double base, exponent, value, slope;
  } of_base[] = {{0, 0, 1, 0},  {0, 1, 0, 1},          {0, 2, 0, 0},     {0, 3.5, 0, 0},
                 {-2, 0, 1, 0}, {-2, 1, -2, 1},        {-2, 3, -8, 12},  {-2, -1, -0.5, -0.25},
                 {5, 0, 1, 0},  {0, 0.5, 0, infinity}, {4, 0.5, 2, 0.25}};
  for (const auto& c : of_base) {
    CAPTURE(c.base);
    CAPTURE(c.exponent);
    CHECK(pow(moving(c.base), c.exponent).value == c.value);
    CHECK(pow(moving(c.base), c.exponent).slopes[0] == c.slope);
    const Dual still = c.exponent;  // without slope
    CHECK(pow(moving(c.base), still).value == c.value);
    CHECK(pow(moving(c.base), still).slopes[0] == c.slope);
  }
  CHECK(pow(moving(-2.0), 2).slopes[0] == -4.0);  // an integer exponent is not a special case
  CHECK(pow(0.0, moving(2.0)).value == 0.0);
  CHECK(pow(0.0, moving(2.0)).slopes[0] == 0.0);
  CHECK(pow(1.0, moving(2.0)).slopes[0] == 0.0);
  CHECK(std::isnan(pow(-2.0, moving(3.0)).slopes[0]));  // -2 to a power near 3 is not real
}

TEST_CASE("chain: a function known by its value and slope") {
  const Dual x = sin(moving(0.4));
  const Dual y =
      chain(x, std::erf(x.value), 2 / std::sqrt(std::numbers::pi) * std::exp(-x.value * x.value));
  CHECK(y.value == std::erf(std::sin(0.4)));
  CHECK_NEAR(y.slopes[0], slope([](long double t) { return std::erf(std::sin(t)); }, 0.4), 8 * ulp);
}

TEST_CASE("Eigen's vectors and matrices of them") {
  // |R(a) v| does not depend on a; its first component is cos a at v = (1, 0).
  const Dual a = moving(0.3);
  Eigen::Matrix<Dual, 2, 2> R;
  R << cos(a), -sin(a), sin(a), cos(a);
  const Eigen::Matrix<Dual, 2, 1> turned = R * Eigen::Vector2d(1, 0);
  CHECK_NEAR(turned[0].slopes[0], -std::sin(0.3), ulp);
  CHECK_NEAR((2.0 * turned).norm().value, 2.0, 2 * ulp);
  CHECK_NEAR((2.0 * turned).norm().slopes[0], 0.0, 2 * ulp);
  Eigen::Matrix<Dual, 3, 1> x(1.0, a, 0.0), z(0.0, 0.0, a);
  CHECK_NEAR(x.cross(z)[0].slopes[0], 2 * 0.3, ulp);
  CHECK_NEAR(x.dot(z + x).slopes[0], 2 * 0.3, ulp);
}

namespace {

// A pendulum with torque; the output is the height of its bob; length and damping are parameters.
const auto pendulum_rates = [](auto x, auto u, auto p, auto rates) {
  rates[0] = x[1];
  rates[1] = u[0] - p[1] * x[1] - 9.81 / p[0] * sin(x[0]);
};
const auto pendulum_outputs = [](auto x, auto, auto p, auto outputs) {
  outputs[0] = -p[0] * cos(x[0]);
};

Model pendulum() {
  Model m;
  m.name = "pendulum";
  m.states = {{"angle", "rad", 0.1}, {"rate", "rad/s", 0.1}};
  m.inputs = {{"torque", "1/s²", 1.0}};
  m.outputs = {{"height", "m", 0.1}};
  m.parameters = {{"length", "m", 0.1}, {"damping", "1/s", 0.1}};
  return exact_model(m, pendulum_rates, pendulum_outputs);
}

MatrixXd pendulum_slopes(const OperatingPoint& at) {
  const double s = std::sin(at.x[0]), c = std::cos(at.x[0]), l = at.p[0];
  MatrixXd all(3, 5);
  all.row(0) << 0, 1, 0, 0, 0;
  all.row(1) << -9.81 / l * c, -at.p[1], 1, 9.81 / (l * l) * s, -at.x[1];
  all.row(2) << l * s, 0, 0, -c, 0;
  return all;
}

const OperatingPoint swing{Eigen::Vector2d{0.4, -0.7}, VectorXd::Constant(1, 0.3),
                           Eigen::Vector2d{1.3, 0.2}};

}  // namespace

TEST_CASE("a model of functions on any scalar: values as on double, derivatives as by hand") {
  const Model m = pendulum();
  const VectorXd& x = swing.x;
  CHECK(m.f(x, swing.u, swing.p)[1] == 0.3 - 0.2 * x[1] - 9.81 / 1.3 * std::sin(x[0]));
  CHECK(m.h(x, swing.u, swing.p)[0] == -1.3 * std::cos(x[0]));
  const MatrixXd J = pendulum_slopes(swing);
  const MatrixXd found = m.derivatives(swing, all_variables(m));
  REQUIRE(found.rows() == 3);
  CHECK((found - J).cwiseAbs().maxCoeff() <= 4 * ulp * J.cwiseAbs().maxCoeff());
  const std::vector<Index> some = {4, 0, 4};  // any order, any number of times
  CHECK(m.derivatives(swing, some) == found(Eigen::all, some));
  CHECK(m.derivatives(swing, {}).cols() == 0);
}

TEST_CASE("more variables than directions: several passes") {
  constexpr Index n = 15;  // of states
  Model chain_of_springs;
  for (Index i = 0; i < n; ++i)
    chain_of_springs.states.push_back({"x" + std::to_string(i), "", 1.0});
  chain_of_springs.parameters = {{"k", "", 1.0}};
  const Model m = exact_model(chain_of_springs, [](auto x, auto, auto p, auto rates) {
    for (std::size_t i = 0; i < x.size(); ++i) rates[i] = -p[0] * x[i] * x[(i + 1) % x.size()];
  });
  const OperatingPoint at{VectorXd::LinSpaced(n, 0.1, 2.0), VectorXd(0), VectorXd::Constant(1, 3)};
  MatrixXd J = MatrixXd::Zero(n, n + 1);
  for (Index i = 0; i < n; ++i) {
    const Index next = (i + 1) % n;
    J(i, i) = -3 * at.x[next];
    J(i, next) = -3 * at.x[i];
    J(i, n) = -at.x[i] * at.x[next];
  }
  CHECK((m.derivatives(at, all_variables(m)) - J).cwiseAbs().maxCoeff() <= 8 * ulp);
}

TEST_CASE("linearize: exact, and the differences agree within their estimates") {
  const Model m = pendulum();
  const OperatingPoint rest{Eigen::Vector2d{0.4, 0.0},
                            VectorXd::Constant(1, 9.81 / 1.3 * std::sin(0.4)), swing.p};
  const LinearModel lin = linearize(m, rest);
  REQUIRE(lin);
  CHECK(lin.method == Method::exact);
  CHECK(lin.remarks.empty());
  CHECK_NEAR(lin.A(1, 0), -9.81 / 1.3 * std::cos(0.4), 16 * ulp);
  REQUIRE(lin.A_differences);
  const MatrixXd apart = (lin.A - lin.A_differences->value).cwiseAbs();
  CHECK((apart.array() <= (lin.A_error + lin.A_differences->error).array()).all());
  CHECK(apart.maxCoeff() > 0);  // two different methods
}

TEST_CASE("linearize: at a kink the exact derivative is of one side, and that is said") {
  Model m;
  m.states = {{"x", "", 1.0}};
  m = exact_model(m, [](auto x, auto, auto, auto rates) { rates[0] = -x[0] + abs(x[0]) / 2; });
  const LinearModel lin = linearize(m, {VectorXd::Zero(1), VectorXd(0), VectorXd(0)});
  REQUIRE(lin);
  CHECK(lin.A(0, 0) == -0.5);
  REQUIRE(lin.remarks.size() >= 1);
  CHECK(lin.remarks[0].find("kink") != std::string::npos);
}

TEST_CASE("trim, follow, sweep take it; the answers are those without derivatives") {
  const Model m = pendulum();
  Model plain = m;
  plain.derivatives = nullptr;
  TrimSpec hold{.free = {"angle"}, .steady = {"rate"}, .implied = {"angle"}};
  hold.bounds = {{"angle", {-1.5, 1.5}}};
  OperatingPoint guess = swing;
  guess.x << 0.1, 0.0;
  guess.u[0] = 2.0;
  const TrimResult trimmed = trim(m, hold, guess);
  REQUIRE(trimmed);
  CHECK_NEAR(trimmed.point.x[0], std::asin(2.0 * 1.3 / 9.81), 4 * ulp);
  CHECK_NEAR(trim(plain, hold, guess).point.x[0], trimmed.point.x[0], 1e-12);

  // The torque can be 9.81/length at most: there the branch turns back, at π/2.
  TrimSpec free = hold;
  free.bounds = {{"angle", {-1.5, 3.0}}};
  const Branch branch = follow(m, free, trimmed.point, "torque", 10.0);
  REQUIRE(branch.events.size() >= 1);
  CHECK(branch.events[0].kind == EventKind::fold);
  CHECK_NEAR(branch.events[0].at.point.x[0], std::numbers::pi / 2, 1e-7);
  CHECK_NEAR(branch.events[0].at.parameter, 9.81 / 1.3, 1e-12);

  const std::vector<double> values = {-0.2, -0.1, 0.1, 0.2};
  const SweepMap map = sweep({{"swing", m, hold, guess, {}}},
                             {{"damping", {{"damping", "1/s", "damping", values, values}}}});
  REQUIRE(map.crossings.size() == 1);
  CHECK_NEAR(map.crossings[0].at[0], 0.0, 1e-9);
}

TEST_CASE("a crossing at which the trim's own equations are singular is one crossing") {
  // A damped spring of stiffness k - 1: rest is an equilibrium for every k; at k = 1 it is not
  // isolated, and no trim converges there.
  Model m;
  m.states = {{"x", "m", 0.1}, {"v", "m/s", 1.0}};
  m.parameters = {{"k", "1/s²", 0.1}};
  m = exact_model(m, [](auto x, auto, auto p, auto rates) {
    rates[0] = x[1];
    rates[1] = (1 - p[0]) * x[0] - 0.3 * x[1];
  });
  const auto states = names(m.states);
  TrimSpec still{.free = states, .steady = states};
  still.bounds = {{"x", {-1.0, 1.0}}};
  const OperatingPoint rest{VectorXd::Zero(2), VectorXd(0), VectorXd::Zero(1)};
  const std::vector<double> values = {0.4, 0.7, 1.1, 1.6};
  const SweepMap map =
      sweep({{"rest", m, still, rest, {}}}, {{"k", {{"k", "1/s²", "k", values, values}}}});
  REQUIRE(map.crossings.size() == 1);
  CHECK(map.crossings[0].kind == CrossingKind::zero);
  CHECK(map.crossings[0].error <= 1e-10);  // of steps of some 0.4
  CHECK_NEAR(map.crossings[0].at[0], 1.0, map.crossings[0].error);
  CHECK(map.crossings[0].unstable_before == 1);
  CHECK(map.crossings[0].unstable_after == 0);
  for (const AxisInterval& i : map.intervals) CHECK(i.verdict != IntervalVerdict::no_trim);
}

TEST_CASE("a loop of two exact models is exact") {
  Model law;
  law.name = "law";
  law.states = {{"integral", "", 1.0}};
  law.inputs = {{"angle", "rad", 0.1}, {"rate", "rad/s", 0.1}};
  law.outputs = {{"torque", "1/s²", 1.0}};
  law.parameters = {{"gain", "", 1.0}};
  law = exact_model(
      law, [](auto, auto u, auto, auto rates) { rates[0] = u[0]; },
      [](auto x, auto u, auto p, auto torque) { torque[0] = -p[0] * (sin(u[0]) + u[1]) - x[0]; });
  const Model loop = feedback(pendulum(), law);
  REQUIRE(loop.derivatives);
  VectorXd p(3);
  p << 1.3, 0.2, 5.0;
  const OperatingPoint at{Eigen::Vector3d{0.4, -0.7, 0.6}, VectorXd(0), p};
  // angle, rate, integral; length, damping, gain
  const double s = std::sin(0.4), c = std::cos(0.4), l = 1.3;
  MatrixXd J(5, 6);
  J.row(0) << 0, 1, 0, 0, 0, 0;
  J.row(1) << -5 * c - 9.81 / l * c, -5 - 0.2, -1, 9.81 / (l * l) * s, 0.7, 0.7 - s;
  J.row(2) << 1, 0, 0, 0, 0, 0;
  J.row(3) << l * s, 0, 0, -c, 0, 0;
  J.row(4) << -5 * c, -5, -1, 0, 0, 0.7 - s;
  const MatrixXd found = loop.derivatives(at, all_variables(loop));
  CHECK((found - J).cwiseAbs().maxCoeff() <= 4 * ulp * J.cwiseAbs().maxCoeff());
  const LinearModel lin = linearize(loop, {VectorXd::Zero(3), VectorXd(0), p});
  REQUIRE(lin);
  CHECK(lin.method == Method::exact);
}

TEST_CASE("a law without states needs no f") {
  Model law;
  law.name = "law";
  law.inputs = {{"rate", "rad/s", 0.1}};
  law.outputs = {{"torque", "1/s²", 1.0}};
  law = exact_model(law, {}, [](auto, auto u, auto, auto torque) { torque[0] = -2 * u[0]; });
  const Model loop = feedback(pendulum(), law);
  REQUIRE(loop.derivatives);
  CHECK(loop.derivatives({Eigen::Vector2d{0, 0}, VectorXd(0), swing.p}, {1})(1, 0) == -2.2);
}

TEST_CASE("what f does not write is not a number, in values and derivatives") {
  Model m;
  m.states = {{"x", "", 1.0}, {"y", "", 1.0}};
  m = exact_model(m, [](auto x, auto, auto, auto rates) { rates[0] = -x[0]; });
  const OperatingPoint at{VectorXd::Zero(2), VectorXd(0), VectorXd(0)};
  CHECK(m.f(at.x, at.u, at.p)[0] == 0.0);
  CHECK(std::isnan(m.f(at.x, at.u, at.p)[1]));
  const TrimSpec still{.free = {"x", "y"}, .steady = {"x", "y"}};
  CHECK(trim(m, still, at).status == TrimStatus::not_finite);
}

TEST_CASE("what f throws is the model's own word") {
  Model m;
  m.states = {{"x", "", 1.0}};
  m = exact_model(m, [](auto x, auto, auto, auto rates) {
    if (x[0] < 1.0) throw std::domain_error("no table below 1");
    rates[0] = -x[0];
  });
  const OperatingPoint at{VectorXd::Zero(1), VectorXd(0), VectorXd(0)};
  const TrimSpec still{.free = {"x"}, .steady = {"x"}, .bounds = {{"x", {-0.5, 0.5}}}};
  const TrimResult result = trim(m, still, at);
  CHECK(result.status == TrimStatus::model_threw);
  CHECK(result.message.find("no table below 1") != std::string::npos);
}

TEST_CASE("mistakes are refused in words") {
  Model m = pendulum();
  CHECK(refusal([&] { (void)exact_model(m, {}, pendulum_outputs); }) ==
        "the model has no function f");
  CHECK(refusal([&] { (void)exact_model(m, pendulum_rates); }) ==
        "the model names outputs but has no function h");
  CHECK(refusal([&] { m.f(VectorXd::Zero(3), swing.u, swing.p); }) ==
        "state x: expected 2 values, got 3");
  OperatingPoint short_of = swing;
  short_of.p = VectorXd::Zero(1);
  CHECK(refusal([&] { m.derivatives(short_of, {0}); }) == "parameters p: expected 2 values, got 1");
  m.parameters[0].name = "angle";
  CHECK(refusal([&] { (void)exact_model(m, pendulum_rates, pendulum_outputs); }) ==
        "the signal name 'angle' is used twice");
}

}  // namespace exact_test
