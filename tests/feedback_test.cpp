#include "model/feedback.hpp"

#include <cmath>
#include <numbers>
#include <numeric>
#include <random>

#include "linearize/modes.hpp"
#include "model/differentiate.hpp"
#include "tests/check.hpp"
#include "tests/toy_models.hpp"
#include "trim/trim.hpp"

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using namespace tiltrim;

namespace feedback_test {

using ::refusal;

namespace {

// x' = A x + B u,  y = C x + D u, with its derivatives.
struct StateSpace {
  MatrixXd A, B, C, D;
};

Model linear(const StateSpace& s, const Signals& x, const Signals& u, const Signals& y) {
  Model m;
  m.name = "linear";
  m.states = x;
  m.inputs = u;
  m.outputs = y;
  m.f = [s](const VectorXd& at, const VectorXd& v, const VectorXd&) -> VectorXd {
    return s.A * at + s.B * v;
  };
  m.h = [s](const VectorXd& at, const VectorXd& v, const VectorXd&) -> VectorXd {
    return s.C * at + s.D * v;
  };
  m.derivatives = [s](const OperatingPoint&, const std::vector<Index>& variables) {
    MatrixXd all(s.A.rows() + s.C.rows(), s.A.cols() + s.B.cols());
    all << s.A, s.B, s.C, s.D;
    return MatrixXd(all(Eigen::all, variables));
  };
  return m;
}

Signals named(const std::string& stem, int n) {
  Signals all;
  for (int i = 0; i < n; ++i) all.push_back({stem + std::to_string(i), "", 1.0});
  return all;
}

// A pendulum with drag in its pivot, moved by a torque.
Model pendulum() {
  Model m;
  m.name = "pendulum";
  m.states = {{"angle", "rad", 0.1}, {"rate", "rad/s", 0.1}};
  m.inputs = {{"torque", "1/s²", 1.0}, {"push", "1/s²", 1.0}};
  m.outputs = {{"height", "m", 0.1}};
  m.parameters = {{"length", "m", 0.1}};
  m.f = [](const VectorXd& x, const VectorXd& u, const VectorXd& p) -> VectorXd {
    return Eigen::Vector2d{x[1], u[0] + u[1] - 9.81 / p[0] * std::sin(x[0]) - x[1] * x[1] * x[1]};
  };
  m.h = [](const VectorXd& x, const VectorXd&, const VectorXd& p) -> VectorXd {
    return VectorXd::Constant(1, -p[0] * std::cos(x[0]));
  };
  m.derivatives = [](const OperatingPoint& at, const std::vector<Index>& variables) {
    const double l = at.p[0], s = std::sin(at.x[0]), c = std::cos(at.x[0]);
    MatrixXd all(3, 5);
    all.row(0) << 0, 1, 0, 0, 0;
    all.row(1) << -9.81 / l * c, -3 * at.x[1] * at.x[1], 1, 1, 9.81 / (l * l) * s;
    all.row(2) << l * s, 0, 0, 0, -c;
    return MatrixXd(all(Eigen::all, variables));
  };
  return m;
}

// torque = gain (aim - height)² - damping rate + integral, integral' = height - aim
Model height_hold() {
  Model m;
  m.name = "height hold";
  m.states = {{"integral", "1/s²", 1.0}};
  m.inputs = {{"rate", "rad/s", 0.1}, {"aim", "m", 0.1}, {"height", "m", 0.1}};
  m.outputs = {{"torque", "1/s²", 1.0}};
  m.parameters = {{"gain", "1/(m² s²)", 1.0}, {"damping", "1/s", 1.0}};
  m.f = [](const VectorXd&, const VectorXd& u, const VectorXd&) -> VectorXd {
    return VectorXd::Constant(1, u[2] - u[1]);
  };
  m.h = [](const VectorXd& x, const VectorXd& u, const VectorXd& p) -> VectorXd {
    const double miss = u[1] - u[2];
    return VectorXd::Constant(1, p[0] * miss * miss - p[1] * u[0] + x[0]);
  };
  m.derivatives = [](const OperatingPoint& at, const std::vector<Index>& variables) {
    const double miss = at.u[1] - at.u[2];
    MatrixXd all(2, 6);
    all.row(0) << 0, 0, -1, 1, 0, 0;
    all.row(1) << 1, -at.p[1], 2 * at.p[0] * miss, -2 * at.p[0] * miss, miss * miss, -at.u[0];
    return MatrixXd(all(Eigen::all, variables));
  };
  return m;
}

// The same loop written explicitly: states angle, rate, integral; inputs push, aim; outputs height,
// torque; parameters length, gain, damping.
VectorXd by_hand(const VectorXd& x, const VectorXd& u, const VectorXd& p) {
  const double height = -p[0] * std::cos(x[0]);
  const double torque = p[1] * (u[1] - height) * (u[1] - height) - p[2] * x[1] + x[2];
  VectorXd all(5);
  all << x[1], torque + u[0] - 9.81 / p[0] * std::sin(x[0]) - x[1] * x[1] * x[1], height - u[1],
      height, torque;
  return all;
}

MatrixXd slopes_by_hand(const OperatingPoint& at) {
  const double s = std::sin(at.x[0]), c = std::cos(at.x[0]), l = at.p[0];
  const double miss = at.u[1] + l * c, gain = at.p[1];
  MatrixXd J(5, 8);  // angle, rate, integral, push, aim, length, gain, damping
  J.row(3) << l * s, 0, 0, 0, 0, -c, 0, 0;
  J.row(4) << -2 * gain * miss * l * s, -at.p[2], 1, 0, 2 * gain * miss, 2 * gain * miss * c,
      miss * miss, -at.x[1];
  J.row(0) << 0, 1, 0, 0, 0, 0, 0, 0;
  J.row(1) = J.row(4);
  J(1, 0) -= 9.81 / l * c;
  J(1, 1) -= 3 * at.x[1] * at.x[1];
  J(1, 3) += 1;
  J(1, 5) += 9.81 / (l * l) * s;
  J.row(2) = J.row(3);
  J(2, 4) -= 1;
  return J;
}

double largest(const MatrixXd& M) { return M.cwiseAbs().maxCoeff(); }

std::string refusal(const Model& plant, const Model& controller) {
  try {
    (void)feedback(plant, controller);
  } catch (const std::invalid_argument& refused) {
    return refused.what();
  }
  return "";
}

// A gain: output `out` = k · input `in`.
Model gain(const std::string& in, const std::string& out, double k) {
  StateSpace s{MatrixXd(0, 0), MatrixXd(0, 1), MatrixXd(1, 0), MatrixXd::Constant(1, 1, k)};
  return linear(s, {}, {{in, "", 1.0}}, {{out, "", 1.0}});
}

// A first-order lag with feedthrough: out = x + D in.
Model lag(const std::string& in, const std::string& state, const std::string& out, double D) {
  StateSpace s{MatrixXd::Constant(1, 1, -1), MatrixXd::Ones(1, 1), MatrixXd::Ones(1, 1),
               MatrixXd::Constant(1, 1, D)};
  return linear(s, {{state, "", 1.0}}, {{in, "", 1.0}}, {{out, "", 1.0}});
}

}  // namespace

TEST_CASE("a closed loop is the loop written out by hand") {
  const Model loop = feedback(pendulum(), height_hold());
  CHECK(loop.name == "pendulum with height hold");
  CHECK(names(loop.states) == std::vector<std::string>{"angle", "rate", "integral"});
  CHECK(names(loop.inputs) == std::vector<std::string>{"push", "aim"});
  CHECK(names(loop.outputs) == std::vector<std::string>{"height", "torque"});
  CHECK(names(loop.parameters) == std::vector<std::string>{"length", "gain", "damping"});
  std::mt19937_64 random(1);
  std::uniform_real_distribution<double> draw(0.5, 1.5);
  for (int trial = 0; trial < trials(200); ++trial) {
    OperatingPoint at{VectorXd(3), VectorXd(2), VectorXd(3)};
    for (VectorXd* v : {&at.x, &at.u, &at.p})
      for (double& value : *v) value = draw(random);
    const Evaluation e = evaluate(loop, at);
    VectorXd all(5);
    all << e.rates, e.outputs;
    CHECK(largest(all - by_hand(at.x, at.u, at.p)) < 1e-13);
    const MatrixXd J = loop.derivatives(at, all_variables(loop));
    CHECK(largest(J - slopes_by_hand(at)) < 1e-12);
    // Any choice of variables, in any order.
    CHECK(loop.derivatives(at, {6, 0, 4}) == MatrixXd(J(Eigen::all, std::vector<Index>{6, 0, 4})));
  }
}

TEST_CASE("without derivatives of one side differences serve") {
  Model plant = pendulum();
  plant.derivatives = nullptr;
  const Model loop = feedback(plant, height_hold());
  CHECK_FALSE(loop.derivatives);
  const OperatingPoint at{Eigen::Vector3d{0.4, 0.3, 1}, Eigen::Vector2d{0.1, -0.5},
                          Eigen::Vector3d{1, 2, 3}};
  const Differences d = difference(loop, at, all_variables(loop));
  CHECK(((d.jacobian.value - slopes_by_hand(at)).cwiseAbs().array() <=
         d.jacobian.error.array() + 1e-12)
            .all());
}

TEST_CASE("linear loops close as state-space algebra says") {
  std::mt19937_64 random(2);
  std::uniform_real_distribution<double> draw(-1, 1);
  const auto matrix = [&](int rows, int columns) {
    return MatrixXd(MatrixXd::NullaryExpr(rows, columns, [&] { return draw(random); }));
  };
  for (int trial = 0; trial < trials(100); ++trial) {
    const int n = 1 + trial % 6, m = 1 + trial % 3, k = 1 + trial % 4, nc = trial % 3;
    // The plant's outputs do not depend on its inputs; the controller's do.
    const StateSpace p{matrix(n, n), matrix(n, m), matrix(k, n), MatrixXd::Zero(k, m)};
    const StateSpace c{matrix(nc, nc), matrix(nc, k), matrix(m, nc), matrix(m, k)};
    const Model loop = feedback(linear(p, named("x", n), named("u", m), named("y", k)),
                                linear(c, named("z", nc), named("y", k), named("u", m)));
    REQUIRE(loop.inputs.empty());
    MatrixXd A(n + nc, n + nc);
    A << p.A + p.B * c.D * p.C, p.B * c.C, c.B * p.C, c.A;
    const OperatingPoint origin{VectorXd::Zero(n + nc), VectorXd(0), VectorXd(0)};
    const LinearModel found = linearize(loop, origin);
    REQUIRE(found);
    CHECK(largest(found.A - A) < 1e-14 * (n + m + k + nc));
    const VectorXd x = matrix(n + nc, 1);
    CHECK(largest(loop.f(x, VectorXd(0), VectorXd(0)) - A * x) < 1e-13);
  }
}

TEST_CASE("an integral controller takes a disturbance to its aim") {
  // x' = -x + u + d, u = z, z' = -4 (x - 3): at rest x = 3, z = 3 - d; s² + s + 4 = 0.
  Model plant = lag("u", "x", "y", 0.0);
  plant.inputs.push_back({"disturbance", "", 1.0});
  plant.derivatives = nullptr;
  plant.f = [](const VectorXd& x, const VectorXd& u, const VectorXd&) -> VectorXd {
    return VectorXd::Constant(1, -x[0] + u[0] + u[1]);
  };
  plant.h = [](const VectorXd& x, const VectorXd&, const VectorXd&) -> VectorXd { return x; };
  Model integral;
  integral.states = {{"u", "", 1.0}};  // feeds the plant as a state
  integral.inputs = {{"y", "", 1.0}};
  integral.parameters = {{"aim", "", 1.0}};
  integral.f = [](const VectorXd&, const VectorXd& u, const VectorXd& p) -> VectorXd {
    return VectorXd::Constant(1, -4 * (u[0] - p[0]));
  };
  const Model loop = feedback(plant, integral);
  const OperatingPoint guess{VectorXd::Zero(2), VectorXd::Constant(1, 0.7),
                             VectorXd::Constant(1, 3.0)};
  const TrimResult rest = trim(loop, {.free = {"x", "u"}, .steady = {"x", "u"}}, guess);
  REQUIRE(rest);
  CHECK_NEAR(rest.point.x[0], 3.0, 1e-9);
  CHECK_NEAR(rest.point.x[1], 2.3, 1e-9);
  const Modes found = modes(linearize(loop, rest.point));
  CHECK(found.verdict == Verdict::stable);
  CHECK_NEAR(found.modes[0].eigenvalue.real(), -0.5, 1e-8);
  CHECK_NEAR(found.modes[0].frequency(), 2.0, 1e-8);
}

TEST_CASE("an output feeds before a state of the same name") {
  // The sensor reads twice the state.
  Model plant = lag("u", "x", "x", 0.0);
  plant.derivatives = nullptr;
  plant.h = [](const VectorXd& x, const VectorXd&, const VectorXd&) -> VectorXd { return 2 * x; };
  const Model loop = feedback(plant, gain("x", "u", -3));
  CHECK_NEAR(loop.f(VectorXd::Ones(1), VectorXd(0), VectorXd(0))[0], -1 - 3 * 2, 0);
}

TEST_CASE("feedthrough in a row is no algebraic loop, however long") {
  // a → b through the controller, b → c through the plant, c → d through the controller, d → x'.
  Model plant;
  plant.states = {{"x", "", 1.0}};
  plant.inputs = {{"d", "", 1.0}, {"b", "", 1.0}};
  plant.outputs = {{"c", "", 1.0}, {"a", "", 1.0}};
  plant.f = [](const VectorXd& x, const VectorXd& u, const VectorXd&) -> VectorXd {
    return VectorXd::Constant(1, u[0] - x[0]);
  };
  plant.h = [](const VectorXd& x, const VectorXd& u, const VectorXd&) -> VectorXd {
    return Eigen::Vector2d{u[1] + 1, x[0]};
  };
  plant.derivatives = [](const OperatingPoint&, const std::vector<Index>& variables) {
    MatrixXd all(3, 3);  // x, d, b
    all << -1, 1, 0, 0, 0, 1, 1, 0, 0;
    return MatrixXd(all(Eigen::all, variables));
  };
  const StateSpace s{MatrixXd(0, 0), MatrixXd(0, 2), MatrixXd(2, 0),
                     Eigen::Matrix2d{{0, 5}, {7, 0}}};
  const Model controller =
      linear(s, {}, {{"c", "", 1.0}, {"a", "", 1.0}}, {{"b", "", 1.0}, {"d", "", 1.0}});
  const Model loop = feedback(plant, controller);
  const VectorXd x = VectorXd::Constant(1, 2.0);
  CHECK(loop.f(x, VectorXd(0), VectorXd(0))[0] == 7 * (5 * 2.0 + 1) - 2);
  CHECK(loop.derivatives({x, VectorXd(0), VectorXd(0)}, {0})(0, 0) == 7 * 5 - 1);
}

TEST_CASE("switches are those of both sides, at the sides' own points") {
  Model plant = pendulum();
  plant.switches.push_back(
      {"the torque turns round", [](const OperatingPoint& at) { return at.u[0]; }});
  Model controller = height_hold();
  controller.switches.push_back(
      {"the aim is met", [](const OperatingPoint& at) { return at.u[1] - at.u[2]; }});
  const Model loop = feedback(plant, controller);
  REQUIRE(loop.switches.size() == 2);
  CHECK(loop.switches[0].name == "the torque turns round");
  const OperatingPoint at{Eigen::Vector3d{0.4, 0.3, 1}, Eigen::Vector2d{0.1, -0.5},
                          Eigen::Vector3d{1, 2, 3}};
  const VectorXd expected = by_hand(at.x, at.u, at.p);
  CHECK_NEAR(loop.switches[0].distance(at), expected[4], 1e-14);
  CHECK_NEAR(loop.switches[1].distance(at), -0.5 - expected[3], 1e-14);
}

TEST_CASE("what cannot be closed is refused with the names") {
  SUBCASE("nothing connects") {
    const std::string why = refusal(lag("u", "x", "y", 0), gain("z", "w", 1));
    CHECK(why.find("the loop is not closed: no input of the plant (u) is an output or state of the "
                   "controller (w), and no input of the controller (z) is one of the plant (y)") ==
          0);
  }
  SUBCASE("two states of one name") {
    CHECK(refusal(lag("u", "x", "y", 0), lag("y", "x", "u", 0)) ==
          "the name 'x' would stand for two signals: the plant's state and the controller's state");
  }
  SUBCASE("an open input of both") {
    Model plant = pendulum(), controller = height_hold();
    controller.inputs[1].name = "push";
    CHECK(refusal(plant, controller) ==
          "the name 'push' would stand for two signals: the plant's input and the controller's "
          "input");
  }
  SUBCASE("an output that is a variable of the other") {
    Model plant = pendulum(), controller = height_hold();
    controller.parameters[0].name = "height";
    controller.inputs[2].name = "angle";
    controller.inputs[2].unit = "rad";
    CHECK(refusal(plant, controller) ==
          "the name 'height' would stand for two signals: the plant's output and the controller's "
          "parameter");
  }
  SUBCASE("two parameters of one name") {
    Model plant = pendulum(), controller = height_hold();
    controller.parameters[1].name = "length";
    CHECK(refusal(plant, controller).find("'length'") != std::string::npos);
  }
  SUBCASE("units that differ") {
    Model plant = pendulum(), controller = height_hold();
    controller.inputs[2].unit = "ft";
    CHECK(refusal(plant, controller) ==
          "the controller's input 'height' [ft] is fed by the plant's output, which is [m]");
  }
  SUBCASE("a model that cannot be used") {
    Model plant = pendulum(), controller = height_hold();
    controller.f = nullptr;
    CHECK(refusal(plant, controller) == "the controller: the model has no function f");
  }
}

TEST_CASE("an algebraic loop is recognised") {
  SUBCASE("at construction, with the signals on it and no others") {
    Model plant = lag("u", "x", "y", 0.5);
    const StateSpace s{MatrixXd(0, 0), MatrixXd(0, 2), MatrixXd(1, 0), Eigen::RowVector2d{-0.5, 1}};
    const std::string why =
        refusal(plant, linear(s, {}, {{"y", "", 1.0}, {"x", "", 1.0}}, {{"u", "", 1.0}}));
    CHECK(why ==
          "algebraic loop: each of these depends on itself without a state in between: u, y");
  }
  SUBCASE("where it is met: feedthrough beyond a threshold alone") {
    Model plant = lag("u", "x", "y", 0.0);
    plant.h = [](const VectorXd& x, const VectorXd& u, const VectorXd&) -> VectorXd {
      return x + (x[0] > 10 ? 0.5 : 0.0) * u;
    };
    plant.derivatives = [](const OperatingPoint& at, const std::vector<Index>& variables) {
      const MatrixXd all = Eigen::Matrix2d{{-1, 1}, {1, at.x[0] > 10 ? 0.5 : 0.0}};
      return MatrixXd(all(Eigen::all, variables));
    };
    const Model loop = feedback(plant, gain("y", "u", -1));
    const VectorXd none(0);
    CHECK(loop.f(VectorXd::Ones(1), none, none)[0] == -2);
    CHECK_THROWS_WITH_AS((void)loop.f(VectorXd::Constant(1, 11.0), none, none),
                         doctest::Contains("algebraic loop"), std::invalid_argument);
    CHECK_THROWS_AS((void)loop.derivatives({VectorXd::Constant(1, 11.0), none, none}, {0}),
                    std::invalid_argument);
    // Trim reports it in its message: no exception leaves it.
    const TrimResult met = trim(loop, {.free = {"x"}, .steady = {"x"}, .bounds = {{"x", {11, 12}}}},
                                {VectorXd::Constant(1, 11.5), none, none});
    CHECK(met.status == TrimStatus::model_threw);
    CHECK(met.message.find("algebraic loop") != std::string::npos);
  }
  SUBCASE("at the origin too, where every start looks right") {
    Model plant = lag("u", "x", "y", 0.0);
    plant.derivatives = nullptr;
    plant.parameters = {{"feedthrough", "", 1.0}};
    plant.h = [](const VectorXd& x, const VectorXd& u, const VectorXd& p) -> VectorXd {
      return x + (p[0] > 2 ? 1.0 : 0.0) * u;
    };
    const Model loop = feedback(plant, gain("y", "u", -1));
    CHECK_THROWS_AS((void)loop.f(VectorXd::Zero(1), VectorXd(0), VectorXd::Constant(1, 3.0)),
                    std::invalid_argument);
  }
  SUBCASE("NaN is no algebraic loop") {
    Model plant = lag("u", "x", "y", 0.0);
    plant.h = [](const VectorXd& x, const VectorXd&, const VectorXd&) -> VectorXd {
      return VectorXd::Constant(1, std::sqrt(x[0]));
    };
    const Model loop = feedback(plant, gain("y", "u", -1));
    CHECK(std::isnan(loop.f(VectorXd::Constant(1, -1.0), VectorXd(0), VectorXd(0))[0]));
  }
}

}  // namespace feedback_test
