#include "model/model.hpp"

#include <unistd.h>

#include <algorithm>
#include <complex>
#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>
#include <numbers>
#include <numeric>
#include <random>

#include "model/in_place.hpp"
#include "model/name_table.hpp"
#include "model/scalar.hpp"
#include "tests/check.hpp"
#include "vehicles/tiltrotor/coefficients.hpp"

// Complex steps: a step of 1e-30 along the imaginary axis gives the derivative without subtractive
// cancellation. The physics finds these by overload, so they come before it.
namespace tiltrim::physics {

using Complex = std::complex<double>;

static Complex abs(const Complex& x) { return x.real() < 0 ? -x : x; }
static SinCos<Complex> sin_cos(const Complex& angle) {
  return {angle, std::sin(angle), std::cos(angle)};
}
static CoefficientsOf<Complex> coefficients(const Polar& polar, const Complex& alpha) {
  const auto [value, slope] = polar.slope_at(alpha.real());
  const double step = alpha.imag();
  return {{value.CL, slope.CL * step}, {value.CD, slope.CD * step}, {value.CM, slope.CM * step}};
}

}  // namespace tiltrim::physics

#include "model/lookup.hpp"
#include "tests/toy_models.hpp"
#include "vehicles/tiltrotor/closed_loop.hpp"
#include "vehicles/tiltrotor/corridor.hpp"
#include "vehicles/tiltrotor/numbers.hpp"

using namespace tiltrim;
using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
namespace fs = std::filesystem;

namespace model_test {

static const fs::path source = TILTRIM_SOURCE_DIR;
static constexpr double pi = std::numbers::pi;
static constexpr double degree = pi / 180;
static constexpr double epsilon = std::numeric_limits<double>::epsilon();

static Vehicle reference() {
  Vehicle vehicle;
  vehicle.polar = std::make_shared<const Polar>(load_polar(source / "data/naca8h12_re150k.csv"));
  return vehicle;
}

// Random numbers, the same in every run.
struct Dice {
  std::mt19937 engine{20131120};
  double between(double lower, double upper) {
    return std::uniform_real_distribution<double>(lower, upper)(engine);
  }
};

#define CHECK_CONTAINS(text, part) \
  CHECK_MESSAGE(contains(text, part), fmt::format("'{}' does not say '{}'", text, part))

// The middle of the flight envelope; inputs independent of the control law, of either sign.
static OperatingPoint airframe_point(Dice& dice, const Vehicle& vehicle) {
  return {
      vec({dice.between(3, 20), dice.between(-1, 1.5), dice.between(-1, 1), dice.between(-1, 1)}),
      vec({dice.between(-0.5, 1), dice.between(-0.3, 0.3), dice.between(-0.5, 0.5),
           dice.between(0, pi / 2)}),
      airframe_parameters(vehicle)};
}

static OperatingPoint loop_point(Dice& dice, const Vehicle& vehicle) {
  const Command command{dice.between(5, 20), dice.between(-0.5, 1.5), dice.between(0, pi / 2)};
  return {vec({dice.between(-2, 2), dice.between(-0.3, 0.3), dice.between(-1, 1),
               dice.between(-1, 1), dice.between(-1, 3), dice.between(-40, 2)}),
          VectorXd(0), closed_loop_parameters(vehicle, command)};
}

// The same motion in body axes: V, alpha become u, w.
static OperatingPoint in_body_axes(OperatingPoint at, double V, double alpha) {
  at.x[0] = V * std::cos(alpha);
  at.x[1] = V * std::sin(alpha);
  return at;
}

static std::vector<Index> first(Index n) {
  std::vector<Index> all(static_cast<std::size_t>(n));
  std::iota(all.begin(), all.end(), Index{0});
  return all;
}

static Index count(const Model& m) {
  return std::ssize(m.states) + std::ssize(m.inputs) + std::ssize(m.parameters);
}

// --- the independent reference ---------------------------------------------------------------

TEST_CASE("the reference file: equilibria, Jacobians and inputs of an independent program") {
  const auto file = nlohmann::json::parse(std::ifstream(source / "data/reference_cases.json"));
  const Vehicle vehicle = reference();
  const Model loop = closed_loop(vehicle);
  REQUIRE(file["cases"].size() == 7);
  for (const auto& known : file["cases"]) {
    const auto& asked = known["condition"];
    CAPTURE(asked["name"].get<std::string>());
    const Command command{asked["V"], asked["gamma_deg"].get<double>() * degree,
                          asked["eta_deg"].get<double>() * degree};
    OperatingPoint at{VectorXd(6), VectorXd(0), closed_loop_parameters(vehicle, command)};
    for (Index i = 0; i < 6; ++i) at.x[i] = known["state"][loop.states[std::size_t(i)].name];

    const auto [rates, outputs] = evaluate(loop, at);
    // Solved there to 1e-13; the largest entry of A, below 1e3, carries the states' last digits.
    for (Index i = 0; i < 6; ++i) CHECK_NEAR(rates[i], 0.0, 1e-12);
    for (const char* name : {"theta0", "a1s", "delta_e"})
      CHECK_NEAR(outputs[find(loop.outputs, name)], known["input"][name].get<double>(), 1e-13);

    const MatrixXd J = loop.derivatives(at, first(6));
    double largest = 0;
    for (const auto& row : known["A"])
      for (double a : row) largest = std::max(largest, std::abs(a));
    // Two spline solvers differ in curvature by round-off over the squared spacing, 1e-12.
    for (std::size_t i = 0; i < 6; ++i)
      for (std::size_t j = 0; j < 6; ++j)
        CHECK_NEAR(J(Index(i), Index(j)), known["A"][i][j].get<double>(), 1e-11 * largest);
  }
}

TEST_CASE("the reference aircraft and gains are the defaults") {
  const auto file = nlohmann::json::parse(std::ifstream(source / "data/reference_cases.json"));
  const Vehicle vehicle = reference();
  const Model loop = closed_loop(vehicle);
  const OperatingPoint at{VectorXd(6), VectorXd(0), closed_loop_parameters(vehicle, {})};
  const auto compare = [&](const char* group, const std::string& prefix) {
    for (const auto& [key, value] : file[group].items()) {
      const bool degrees = key.ends_with("_deg");
      const std::string name = prefix + (degrees ? key.substr(0, key.size() - 4) : key);
      const double expected = value.get<double>() * (degrees ? degree : 1.0);
      CHECK_NEAR(value_of(at, variable(loop, name)), expected, epsilon * std::abs(expected));
    }
  };
  compare("aircraft", "aircraft.");
  compare("gains", "gains.");
}

TEST_CASE("numbers by position are the numbers by name") {
  Vehicle vehicle = reference();
  for (std::size_t i = 0; i < aircraft_signals().size(); ++i)
    aircraft_value(vehicle.aircraft, i) = 1.0 + double(i);
  for (std::size_t i = 0; i < gain_signals().size(); ++i)
    gain_value(vehicle.gains, i) = 100.0 + double(i);
  const OperatingPoint at{VectorXd(6), VectorXd(0), closed_loop_parameters(vehicle, {7, 8, 9})};
  const Model loop = closed_loop(vehicle);
  CHECK(value_of(at, variable(loop, "V")) == 7);
  CHECK(value_of(at, variable(loop, "eta")) == 9);
  CHECK(value_of(at, variable(loop, "aircraft.chord")) == vehicle.aircraft.chord);
  CHECK(value_of(at, variable(loop, "aircraft.cyclic_blend")) == vehicle.aircraft.cyclic_blend);
  CHECK(value_of(at, variable(loop, "gains.k_V")) == vehicle.gains.k_V);
  CHECK(value_of(at, variable(loop, "gains.k_de")) == vehicle.gains.k_de);
  CHECK_THROWS_AS(aircraft_value(vehicle.aircraft, 22), std::out_of_range);
  CHECK_THROWS_AS(gain_value(vehicle.gains, 9), std::out_of_range);
}

// --- derivatives ------------------------------------------------------------------------------

static VectorXd values(const Model& m, const OperatingPoint& at) {
  const auto [rates, outputs] = evaluate(m, at);
  VectorXd all(rates.size() + outputs.size());
  all << rates, outputs;
  return all;
}

static VectorXd difference(const Model& m, OperatingPoint at, Index j, double h) {
  const double here = value_of(at, j);
  set_value(at, j, here + h);
  const VectorXd ahead = values(m, at);
  const double top = value_of(at, j);
  set_value(at, j, here - h);
  return (ahead - values(m, at)) / (top - value_of(at, j));
}

static void check_derivatives(const Model& m, const OperatingPoint& at) {
  const MatrixXd J = m.derivatives(at, first(count(m)));
  REQUIRE(J.cols() == count(m));
  const double size = values(m, at).cwiseAbs().maxCoeff();
  for (Index j = 0; j < count(m); ++j) {
    const Signal& signal = signal_of(m, j);
    const double h = 1e-5 * std::min(signal.nominal, std::abs(value_of(at, j)) + 1e-2);
    const VectorXd wide = difference(m, at, j, 2 * h);
    const VectorXd near = difference(m, at, j, h);
    for (Index i = 0; i < J.rows(); ++i) {
      CAPTURE(signal.name);
      CAPTURE(i);
      // Truncation of the near one is a third of what the wide one adds (all of it where the step
      // crosses a knot of the polar); round-off is a few hundred ulps of the terms summed, over h.
      CHECK_NEAR(near[i], J(i, j),
                 std::abs(wide[i] - near[i]) + 1000 * epsilon * (size + std::abs(J(i, j))) / h);
    }
  }
}

TEST_CASE("exact derivatives along every variable are those of differences") {
  Vehicle vehicle = reference();
  Dice dice;
  for (double blend : {0.0, 40 * degree}) {
    vehicle.aircraft.cyclic_blend = blend;
    for (int i = 0; i < 20; ++i) {
      const OperatingPoint wind = airframe_point(dice, vehicle);
      check_derivatives(airframe(vehicle), wind);
      check_derivatives(airframe(vehicle, Axes::body),
                        in_body_axes(wind, wind.x[0], wind.x[2] - wind.x[1]));
      const OperatingPoint loop = loop_point(dice, vehicle);
      const double alpha = loop.x[2] - (loop.p[1] - loop.x[1]);
      check_derivatives(closed_loop(vehicle), loop);
      check_derivatives(closed_loop(vehicle, Axes::body),
                        in_body_axes(loop, loop.p[0] - loop.x[0], alpha));
    }
  }
}

TEST_CASE("exact derivatives of the closed loop are those of complex steps") {
  using physics::Complex;
  const Vehicle vehicle = reference();
  const Model loop = closed_loop(vehicle);
  const physics::WindLoop<> physics{vehicle.polar, vehicle.equations};
  constexpr double step = 1e-30;
  Dice dice;
  for (int trial = 0; trial < 100; ++trial) {
    const OperatingPoint at = loop_point(dice, vehicle);
    const MatrixXd J = loop.derivatives(at, first(6));
    for (Index j = 0; j < 6; ++j) {
      std::array<Complex, 6> x, rates, outputs;
      std::copy(at.x.begin(), at.x.end(), x.begin());
      x[std::size_t(j)] += Complex(0, step);
      physics(x.data(), static_cast<const Complex*>(nullptr), at.p.data(), rates.data(),
              outputs.data());
      for (std::size_t i = 0; i < 6; ++i) {
        // Round-off alone: some hundred operations on entries up to the largest of the column.
        const double tolerance = 200 * epsilon * (1 + J.col(j).cwiseAbs().maxCoeff());
        CHECK_NEAR(J(Index(i), j), rates[i].imag() / step, tolerance);
        CHECK_NEAR(J(Index(i) + 6, j), outputs[i].imag() / step, tolerance);
      }
    }
  }
}

TEST_CASE("rates and outputs that share one function take one call, and are those of f and h") {
  int calls = 0;
  const auto both = std::make_shared<const InPlace>(
      InPlace{1, 1, [&](const double* x, const double*, const double*, double* rates, double* y) {
                ++calls;
                if (rates) *rates = 1 / *x;
                if (y) *y = *x / 3;
              }});
  Model m;
  m.states = {{"x", "", 1.0}};
  m.outputs = {{"y", "", 1.0}};
  m.f = InPlaceFunction<false>{both};
  m.h = InPlaceFunction<true>{both};
  const OperatingPoint at{Eigen::VectorXd::Constant(1, 7.0), {}, {}};
  const Evaluation e = evaluate(m, at);
  CHECK(calls == 1);
  CHECK(e.rates == m.f(at.x, at.u, at.p));
  CHECK(e.outputs == m.h(at.x, at.u, at.p));
  m.h = [](const auto& x, const auto&, const auto&) -> Eigen::VectorXd { return 2 * x; };
  CHECK(evaluate(m, at).outputs[0] == 14);
}

TEST_CASE("derivatives are asked for by number, in any order and number") {
  const Vehicle vehicle = reference();
  const Model loop = closed_loop(vehicle);
  Dice dice;
  const OperatingPoint at = loop_point(dice, vehicle);
  const MatrixXd all = loop.derivatives(at, first(count(loop)));
  const std::vector<Index> wanted{39, 2, 6, 0, 17, 3, 4, 8, 2};  // two passes, one column twice
  const MatrixXd some = loop.derivatives(at, wanted);
  REQUIRE(some.cols() == std::ssize(wanted));
  for (std::size_t k = 0; k < wanted.size(); ++k)
    for (Index i = 0; i < 12; ++i) {
      CAPTURE(k);
      CHECK(some(i, Index(k)) == all(i, wanted[k]));
    }
  CHECK(loop.derivatives(at, {}).cols() == 0);
  CHECK_THROWS_AS((void)loop.derivatives(at, {count(loop)}), std::out_of_range);
}

// --- two forms of one motion ------------------------------------------------------------------

// u' and w' of a motion given by V', alpha'.
static std::array<double, 2> body_rates(double V, double alpha, double V_rate, double alpha_rate) {
  return {V_rate * std::cos(alpha) - V * alpha_rate * std::sin(alpha),
          V_rate * std::sin(alpha) + V * alpha_rate * std::cos(alpha)};
}

TEST_CASE("wind and body axes tell of one airframe") {
  const Vehicle vehicle = reference();
  const Model wind = airframe(vehicle);
  const Model body = airframe(vehicle, Axes::body);
  Dice dice;
  for (int i = 0; i < 200; ++i) {
    const OperatingPoint at = airframe_point(dice, vehicle);
    const double V = at.x[0];
    const double alpha = at.x[2] - at.x[1];
    const auto [rates, outputs] = evaluate(wind, at);
    const auto [moved, seen] = evaluate(body, in_body_axes(at, V, alpha));
    const auto [u, w] = body_rates(V, alpha, rates[0], rates[2] - rates[1]);
    const double size = 1 + V * std::abs(rates[1]) + std::abs(rates[0]) + std::abs(V * at.x[3]);
    CHECK_NEAR(moved[0], u, 1e-12 * size);
    CHECK_NEAR(moved[1], w, 1e-12 * size);
    CHECK(moved[2] == rates[2]);
    CHECK_NEAR(moved[3], rates[3], 1e-12 * (1 + std::abs(rates[3])));
    for (Index k = 0; k < 4; ++k)
      CHECK_NEAR(seen[k], outputs[k], 1e-12 * (1 + std::abs(outputs[k])));
  }
}

TEST_CASE("wind and body axes tell of one closed loop") {
  Vehicle vehicle = reference();
  Dice dice;
  for (int i = 0; i < 200; ++i) {
    vehicle.aircraft.cyclic_blend = i % 2 ? 0.0 : 30 * degree;
    const OperatingPoint at = loop_point(dice, vehicle);
    const double V = at.p[0] - at.x[0];
    const double alpha = at.x[2] - (at.p[1] - at.x[1]);
    const auto [rates, outputs] = evaluate(closed_loop(vehicle), at);
    const auto [moved, seen] =
        evaluate(closed_loop(vehicle, Axes::body), in_body_axes(at, V, alpha));
    // The law's gains, up to k_V = 10 per second, amplify round-off in its inputs.
    const double size = 10 * (1 + V * rates.head(2).cwiseAbs().sum() + std::abs(at.x[5]));
    const auto [u, w] = body_rates(V, alpha, -rates[0], rates[2] + rates[1]);
    CHECK_NEAR(moved[0], u, 1e-12 * size);
    CHECK_NEAR(moved[1], w, 1e-12 * size);
    for (Index k = 2; k < 6; ++k) CHECK_NEAR(moved[k], rates[k], 1e-12 * size);
    for (Index k = 0; k < 6; ++k) CHECK_NEAR(seen[k], outputs[k], 1e-12 * size);
  }
}

TEST_CASE("without wing and thrust the airframe falls freely") {
  Vehicle vehicle = reference();
  vehicle.aircraft.wing_area = 1e-300;
  const Model body = airframe(vehicle, Axes::body);
  const double u = 12, w = 3, theta = 0.4, q = 0.7, g = vehicle.aircraft.gravity;
  const auto rates =
      body.f(vec({u, w, theta, q}), vec({0, 0.1, 0.1, 1}), airframe_parameters(vehicle));
  CHECK_NEAR(rates[0], -g * std::sin(theta) - q * w, 4 * epsilon * 12);
  CHECK_NEAR(rates[1], g * std::cos(theta) + q * u, 4 * epsilon * 18);
  CHECK_NEAR(rates[3], 0.0, 1e-290);
}

TEST_CASE("body axes hold at rest") {
  const Vehicle vehicle = reference();
  const double g = vehicle.aircraft.gravity;
  const double hover = 1 / vehicle.aircraft.thrust_excess;  // thrust equals weight
  Vehicle dry = vehicle;
  dry.aircraft.wake_immersion = 0;
  const auto rates =
      airframe(dry, Axes::body)
          .f(vec({0, 0, 0, 0}), vec({hover, 0, 0, pi / 2}), airframe_parameters(dry));
  CHECK_NEAR(rates[0], 0.0, 4 * epsilon * g);
  CHECK_NEAR(rates[1], 0.0, 4 * epsilon * g);
}

// --- laws -------------------------------------------------------------------------------------

TEST_CASE("thrust (4) is theta0 times its full value") {
  const Vehicle vehicle = reference();
  const Aircraft& a = vehicle.aircraft;
  const Model wind = airframe(vehicle);
  for (double theta0 : {-0.5, 0.0, 0.25, 1.0}) {
    const VectorXd y =
        wind.h(vec({15, 0, 0.1, 0}), vec({theta0, 0, 0, 0}), airframe_parameters(vehicle));
    const double T = a.thrust_excess * a.mass * a.gravity * theta0;
    CHECK_NEAR(y[find(wind.outputs, "thrust")], T, 4 * epsilon * std::abs(T));
  }
}

TEST_CASE("induced velocity (3) is the printed formula where that holds, and odd") {
  const Aircraft a;
  const double tip_speed = a.rotor_speed_rpm * 2 * pi / 60 * a.rotor_radius;
  const double sigma = a.blade_count * a.blade_chord / (pi * a.rotor_radius);
  const double c1 = a.blade_lift_slope * sigma;
  for (double theta0 : {1e-6, 1e-3, 0.1, 0.5, 1.0}) {
    const double root = std::sqrt(1 + 32 * a.pitch_scale * theta0 / c1);
    const double printed = tip_speed * c1 / 16 * (root - 1);
    const double vi = physics::induced_velocity(theta0, a);
    // The printed difference loses the digits that root and 1 have in common.
    CHECK_NEAR(vi, printed, 8 * epsilon * (vi + tip_speed * c1 / 16 * root));
    CHECK(physics::induced_velocity(-theta0, a) == -vi);
  }
  CHECK(physics::induced_velocity(0.0, a) == 0.0);
}

TEST_CASE("authority hands over from cyclic to elevator") {
  Aircraft a;
  CHECK(authority(a, a.cyclic_off) == 1.0);
  CHECK(authority(a, std::nextafter(a.cyclic_off, 0.0)) == 0.0);
  CHECK(authority(a, pi / 2) == 1.0);
  CHECK(authority(a, 0.0) == 0.0);
  a.cyclic_blend = 20 * degree;
  const double low = a.cyclic_off - a.cyclic_blend / 2;
  const double high = a.cyclic_off + a.cyclic_blend / 2;
  CHECK(authority(a, low - 1e-9) == 0.0);
  CHECK(authority(a, high + 1e-9) == 1.0);
  for (double t : {0.1, 0.25, 0.5, 0.8}) {
    const double s = 3 * t * t - 2 * t * t * t;
    // t is formed by a difference of angles near 1: 4 ulps of it over the width of the blend
    CHECK_NEAR(authority(a, low + t * a.cyclic_blend), s, 1.5 * 4 * epsilon / a.cyclic_blend);
    CHECK_NEAR(authority(a, low + t * a.cyclic_blend) + authority(a, high - t * a.cyclic_blend),
               1.0, 3 * 4 * epsilon / a.cyclic_blend);
  }
  for (double end : {low, high})  // slope zero: h² is all that is left
    CHECK_NEAR(authority(a, end + 1e-6), authority(a, end - 1e-6),
               4 * std::pow(1e-6 / a.cyclic_blend, 2));
}

TEST_CASE("energy and distribution errors (7): sum and difference") {
  const Vehicle vehicle = reference();
  const Model loop = closed_loop(vehicle);
  Dice dice;
  for (int i = 0; i < 100; ++i) {
    const OperatingPoint at = loop_point(dice, vehicle);
    const VectorXd rates = loop.f(at.x, at.u, at.p);
    const double He = rates[4], Le = rates[5], V_rate = -rates[0];
    const double speeding = (vehicle.gains.k_V * at.x[0] - V_rate) / vehicle.aircraft.gravity;
    CHECK_NEAR(He + Le, 2 * speeding, 16 * epsilon * (1 + std::abs(speeding)));
    CHECK_NEAR(He - Le, 2 * std::sin(at.x[1]), 16 * epsilon * (1 + std::abs(speeding)));
  }
}

TEST_CASE("schedule (16): ends, middle, zero slopes, held outside") {
  const auto same = [](const Command& c, double V, double angle) {
    CHECK_NEAR(c.V, V, 8 * epsilon * V);
    CHECK_NEAR(c.eta, angle, 8 * epsilon);
    CHECK_NEAR(c.gamma, angle, 8 * epsilon);
  };
  same(corridor(0), 2, pi / 2);
  same(corridor(-5), 2, pi / 2);
  same(corridor(120), 15, 0);
  same(corridor(500), 15, 0);
  same(corridor(60), 2 + 13 * (3 * 0.16 - 2 * 0.064), pi / 4);
  same(corridor(20), 2, pi * (8000 / 1728000.0 - 400 / 9600.0 + 0.5));
  const double h = 1e-3;  // m; a cubic with zero slope at its end moves by second order only
  CHECK_NEAR(corridor(h).eta, pi / 2, pi * h * h / 9600 * 1.001);
  CHECK_NEAR(corridor(120 - h).eta, 0.0, pi * h * h / 9600 * 1.001);
  CHECK_NEAR(corridor(20 + h).V, 2.0, 13 * 3e-4 * h * h * 1.001);
  CHECK_NEAR(corridor(120 - h).V, 15.0, 13 * 3e-4 * h * h * 1.001);
}

TEST_CASE("the printed equations differ in the two rows that are wrong, and in nothing else") {
  Vehicle vehicle = reference();
  const Model consistent = closed_loop(vehicle);
  vehicle.equations = Equations::printed;
  const Model printed = closed_loop(vehicle);
  Dice dice;
  for (int i = 0; i < 50; ++i) {
    const OperatingPoint at = loop_point(dice, vehicle);
    const VectorXd right = consistent.f(at.x, at.u, at.p);
    const VectorXd wrong = printed.f(at.x, at.u, at.p);
    const double V = at.p[0] - at.x[0];
    const double gamma = at.p[1] - at.x[1];
    const double commanded = vehicle.gains.k_V * at.x[0];
    CHECK_NEAR(wrong[0] - right[0], commanded,
               4 * epsilon * (std::abs(commanded) + std::abs(right[0])));
    // With lift and thrust reversed only the weight remains in the sum: 2 g cos γ / V.
    CHECK_NEAR(wrong[1] + right[1], 2 * vehicle.aircraft.gravity * std::cos(gamma) / V,
               8 * epsilon * (std::abs(wrong[1]) + std::abs(right[1])));
    for (Index k = 2; k < 6; ++k) CHECK(wrong[k] == right[k]);
  }
}

TEST_CASE("the thrust's moment is hub position times force") {
  Vehicle vehicle = reference();
  vehicle.aircraft.wake_immersion = 0;  // the aerodynamic moment is then independent of theta0
  const Aircraft& a = vehicle.aircraft;
  const Model wind = airframe(vehicle);
  Dice dice;
  for (int i = 0; i < 50; ++i) {
    OperatingPoint at = airframe_point(dice, vehicle);
    const double a1s = at.u[1], eta = at.u[3];
    const VectorXd with = wind.f(at.x, at.u, at.p);
    const double T = a.thrust_excess * a.mass * a.gravity * at.u[0];
    at.u[0] = 0;
    const VectorXd without = wind.f(at.x, at.u, at.p);
    // body axes, x ahead, z down
    const double x = a.rotor_x + a.rotor_z * std::cos(eta), z = -a.rotor_z * std::sin(eta);
    const double X = T * std::cos(eta - a1s), Z = -T * std::sin(eta - a1s);
    CHECK_NEAR(with[3] - without[3], (z * X - x * Z) / a.inertia_yy,
               16 * epsilon * (1 + std::abs(with[3]) + std::abs(without[3])));
  }
}

TEST_CASE("vehicles that cannot be modelled are refused") {
  Vehicle vehicle = reference();
  vehicle.equations = Equations::printed;
  CHECK_THROWS_AS((void)airframe(vehicle, Axes::body), std::invalid_argument);
  CHECK_THROWS_AS((void)closed_loop(vehicle, Axes::body), std::invalid_argument);
  vehicle.polar = nullptr;
  CHECK_THROWS_AS((void)airframe(vehicle), std::invalid_argument);
  CHECK_THROWS_AS((void)closed_loop(vehicle), std::invalid_argument);
}

TEST_CASE("the hand-over without blend is told as a switch, with one as none") {
  Vehicle vehicle = reference();
  const Model hard = closed_loop(vehicle);
  REQUIRE(hard.switches.size() == 1);
  const double off = vehicle.aircraft.cyclic_off;
  for (double eta : {0.5, off, 1.5}) {
    const OperatingPoint at{VectorXd(6), VectorXd(0),
                            closed_loop_parameters(vehicle, {15, 0, eta})};
    CHECK(hard.switches[0].distance(at) == eta - off);
  }
  vehicle.aircraft.cyclic_blend = 0.1;
  CHECK(closed_loop(vehicle).switches.empty());
}

// --- polar ------------------------------------------------------------------------------------

static std::array<double, 3> triple(const Coefficients& c) { return {c.CL, c.CD, c.CM}; }

// Known functions of period 2π.
static Coefficients waves(double alpha) {
  return {std::sin(alpha), std::cos(alpha), 0.3 + 0.1 * std::cos(2 * alpha)};
}

// Knots all around, evenly spaced but for `wobble`, a share of the spacing.
static std::vector<double> knots(int n, double wobble = 0.0) {
  Dice dice;
  std::vector<double> alpha{-pi};
  for (int i = 1; i < n; ++i)
    alpha.push_back(-pi + 2 * pi * (i + dice.between(-wobble, wobble)) / n);
  alpha.push_back(pi);
  return alpha;
}

static std::vector<double> halved(const std::vector<double>& alpha) {
  std::vector<double> finer{alpha.front()};
  for (std::size_t i = 1; i < alpha.size(); ++i) {
    finer.push_back((alpha[i - 1] + alpha[i]) / 2);
    finer.push_back(alpha[i]);
  }
  return finer;
}

static Polar wave_polar(const std::vector<double>& alpha) {
  std::vector<Coefficients> rows;
  for (double a : alpha) rows.push_back(waves(a));
  rows.back() = rows.front();
  return {alpha, rows};
}

static double largest_miss(const Polar& polar) {
  double miss = 0;
  for (int i = 0; i < 20011; ++i) {  // a prime: falls everywhere between the knots
    const double alpha = -pi + 2 * pi * i / 20011;
    const auto got = triple(polar.at(alpha));
    const auto wanted = triple(waves(alpha));
    for (std::size_t k = 0; k < 3; ++k) miss = std::max(miss, std::abs(got[k] - wanted[k]));
  }
  return miss;
}

// The shipped polar's table, read independently.
static std::vector<std::array<double, 4>> table() {
  std::ifstream in(source / "data/naca8h12_re150k.csv");
  std::vector<std::array<double, 4>> rows;
  for (std::string line; std::getline(in, line);) {
    std::array<double, 4> v{};
    if (std::sscanf(line.c_str(), "%lf,%lf,%lf,%lf", &v[0], &v[1], &v[2], &v[3]) == 4)
      rows.push_back(v);
  }
  return rows;
}

TEST_CASE("the polar goes through its table and is periodic") {
  const Polar polar = *reference().polar;
  REQUIRE(table().size() == 361);
  for (const auto& [alpha_deg, CL, CD, CM] : table()) {
    const std::array<double, 3> wanted{CL, CD, CM};
    for (int turns : {0, 1, -2}) {
      const auto got = triple(polar.at(alpha_deg * degree + 2 * pi * turns));
      // the angle's own round-off, 4 ulps of 5π, times slopes up to 10 per radian
      for (std::size_t k = 0; k < 3; ++k) CHECK_NEAR(got[k], wanted[k], 10 * 4 * epsilon * 5 * pi);
    }
  }
}

TEST_CASE("the polar is twice continuously differentiable, across its ends too") {
  const auto check = [](const Polar& polar, const std::vector<double>& alpha) {
    const auto curvature = [&](double at, double h) {  // exact where the slope is a parabola
      const auto s0 = triple(polar.slope_at(at).slope);
      const auto s1 = triple(polar.slope_at(at + h).slope);
      const auto s2 = triple(polar.slope_at(at + 2 * h).slope);
      std::array<double, 3> c;
      for (std::size_t k = 0; k < 3; ++k) c[k] = (-3 * s0[k] + 4 * s1[k] - s2[k]) / (2 * h);
      return c;
    };
    constexpr double h = 2e-3;  // below half the least spacing
    for (double at : alpha) {
      const auto before = curvature(at, -h);
      const auto after = curvature(at, h);
      // slopes up to 10 per radian, 8 ulps of them over h; and knots are met to 4 ulps of π only,
      // where third derivatives reach 1e4
      for (std::size_t k = 0; k < 3; ++k)
        CHECK_NEAR(before[k], after[k], 80 * epsilon / h + 4 * epsilon * pi * 1e4);
    }
  };
  check(*reference().polar, knots(360));
  check(wave_polar(knots(37, 0.4)), knots(37, 0.4));
}

TEST_CASE("slopes of the polar are those of its values") {
  const Polar polar = *reference().polar;
  Dice dice;
  for (int i = 0; i < 300; ++i) {
    const double alpha = dice.between(-7, 7);
    const double h = 1e-5;
    const auto [value, slope] = polar.slope_at(alpha);
    const auto ahead = triple(polar.at(alpha + h)), behind = triple(polar.at(alpha - h));
    for (std::size_t k = 0; k < 3; ++k) {
      CHECK(triple(value)[k] == triple(polar.at(alpha))[k]);
      // third derivatives up to 1e4, twice that where the step holds a knot; 4 ulps of 7 in alpha
      CHECK_NEAR((ahead[k] - behind[k]) / (2 * h), triple(slope)[k],
                 1e4 * h * h + 10 * 4 * epsilon * 7 / h);
    }
  }
}

TEST_CASE("the spline's error falls with the fourth power of the spacing") {
  for (double wobble : {0.0, 0.3}) {
    std::vector<double> alpha = halved(knots(48, wobble));
    double before = largest_miss(wave_polar(alpha));
    for (int halvings = 0; halvings < 3; ++halvings) {
      alpha = halved(alpha);
      const double miss = largest_miss(wave_polar(alpha));
      // the next term of the error is of fifth order and smaller by the spacing, 0.13 and less
      CHECK_NEAR(std::log2(before / miss), 4.0, 0.15);
      before = miss;
    }
  }
}

TEST_CASE("a polar through unevenly spaced knots goes through them") {
  const std::vector<double> alpha = knots(37, 0.4);
  const Polar polar = wave_polar(alpha);
  for (double a : alpha)
    for (std::size_t k = 0; k < 3; ++k)  // 4 ulps of π, slopes of 1
      CHECK_NEAR(triple(polar.at(a))[k], triple(waves(a))[k], 4 * epsilon * pi);
}

TEST_CASE("ranges of the polar hold all values between, and no more") {
  const Polar polar = *reference().polar;
  Dice dice;
  for (int i = 0; i < 200; ++i) {
    const double lower = dice.between(-8, 8);
    const double width = std::pow(10, dice.between(-4, 0.9));
    const auto ranges = polar.range(lower, lower + width);
    std::array<Range, 3> seen;
    seen.fill({1e9, -1e9});
    for (int j = 0; j <= 3000; ++j) {
      const auto c = triple(polar.at(lower + width * j / 3000));
      for (std::size_t k = 0; k < 3; ++k)
        seen[k] = {std::min(seen[k].lower, c[k]), std::max(seen[k].upper, c[k])};
    }
    // round-off of the angle (8 ulps of 16) times slopes up to 10; curvature (below 200) over half
    // a step of the sampling is all that may be missing on the other side
    const double hair = 10 * 8 * epsilon * 16;
    const double missed = hair + 200 * std::pow(width / 6000, 2) / 2;
    for (std::size_t k = 0; k < 3; ++k) {
      CHECK(ranges[k].lower <= seen[k].lower + hair);
      CHECK(ranges[k].upper >= seen[k].upper - hair);
      CHECK_NEAR(ranges[k].lower, seen[k].lower, missed);
      CHECK_NEAR(ranges[k].upper, seen[k].upper, missed);
    }
  }
}

TEST_CASE("ranges of the polar over one piece are exact, and a point's range is its value") {
  const Polar polar = *reference().polar;
  for (double start : {-179.0, -12.0, -2.0, 9.0, 12.0, 90.0}) {
    const double lower = start * degree, upper = (start + 1) * degree;
    const auto ranges = polar.range(lower, upper);
    constexpr int samples = 200'000;  // half a step: 4e-8 rad, with curvatures below 200 2e-13
    std::array<Range, 3> seen;
    seen.fill({1e9, -1e9});
    for (int j = 0; j <= samples; ++j) {
      const auto c = triple(polar.at(lower + (upper - lower) * j / samples));
      for (std::size_t k = 0; k < 3; ++k)
        seen[k] = {std::min(seen[k].lower, c[k]), std::max(seen[k].upper, c[k])};
    }
    for (std::size_t k = 0; k < 3; ++k) {
      CHECK_NEAR(ranges[k].lower, seen[k].lower, 2e-13);
      CHECK_NEAR(ranges[k].upper, seen[k].upper, 2e-13);
    }
    const auto point = polar.range(lower + 0.001, lower + 0.001);
    const auto value = triple(polar.at(lower + 0.001));
    for (std::size_t k = 0; k < 3; ++k) {
      CHECK(point[k].lower == value[k]);
      CHECK(point[k].upper == value[k]);
    }
  }
}

TEST_CASE("angles that are no angles give coefficients that are no numbers") {
  for (const Polar& polar : {*reference().polar, wave_polar(knots(37, 0.4))})
    for (double alpha : {std::nan(""), std::numeric_limits<double>::infinity()})
      CHECK(std::isnan(polar.at(alpha).CL));
  CHECK(std::isfinite(reference().polar->at(1e300).CL));
}

TEST_CASE("tables that make no polar are refused, the row named") {
  std::vector<double> alpha{-pi, -1, 0, 1, pi};
  std::vector<Coefficients> rows(5, Coefficients{0.1, 0.2, 0.3});
  const auto message = [&] {
    return refusal<std::invalid_argument>([&] { (void)Polar(alpha, rows); });
  };
  CHECK(message().empty());
  SUBCASE("two rows") {
    alpha = {-pi, pi};
    rows.resize(2);
    CHECK_CONTAINS(message(), "at least 4 rows, got 2");
  }
  SUBCASE("more angles than rows") {
    rows.pop_back();
    CHECK_CONTAINS(message(), "got 4");
  }
  SUBCASE("not rising") {
    alpha[3] = 0;
    CHECK_CONTAINS(message(), "row 4: alpha does not increase");
  }
  SUBCASE("not periodic") {
    rows.back().CM = 0.30001;
    CHECK_CONTAINS(message(), "row 5");
    CHECK_CONTAINS(message(), "not periodic");
  }
  SUBCASE("not a number") {
    rows[1].CD = std::nan("");
    CHECK_CONTAINS(message(), "row 2: a value is not finite");
  }
  SUBCASE("not the whole circle") {
    alpha.front() = -3;
    CHECK_CONTAINS(message(), "from -180 to 180");
  }
}

// A file removed at the end of the test.
struct Scratch {
  fs::path path = fs::temp_directory_path() / fmt::format("tiltrim_polar_{}.csv", getpid());
  explicit Scratch(std::string_view text) { std::ofstream(path) << text; }
  Scratch(const Scratch&) = delete;
  Scratch& operator=(const Scratch&) = delete;
  ~Scratch() { fs::remove(path); }
};

TEST_CASE("polar files are read, and refused with file and line") {
  const std::string good = "# made by hand\nalpha_deg,CL,CD,CM\r\n-180,0,1,0\n-90,1,2,0.5\n";
  const std::string end = "0,0,1,0\n90,-1,2,0.5\n180,0,1,0\n";
  {
    const Scratch file(good + "\n# a remark\n" + end);
    CHECK_NEAR(load_polar(file.path).at(pi / 2).CL, -1.0, 8 * epsilon);
  }
  const auto refused = [](const std::string& text, std::string_view place, std::string_view why) {
    const Scratch file(text);
    const auto message = refusal<std::runtime_error>([&] { (void)load_polar(file.path); });
    CHECK_CONTAINS(message, file.path.string() + std::string(place));
    CHECK_CONTAINS(message, why);
  };
  refused("alpha,CL,CD,CM\n", ":1: ", "expected the header 'alpha_deg,CL,CD,CM'");
  refused(good + "0,0,1\n" + end, ":5: ", "column 3");
  refused(good + "0,0,1,0,7\n" + end, ":5: ", "column 4");
  refused(good + "0,zero,1,0\n" + end, ":5: ", "column 2");
  refused(good + "0,0,inf,0\n" + end, ":5: ", "column 3");
  refused(good + "-90,0,1,0\n" + end, ":5: ", "alpha does not increase");
  refused(good + "180,0,1,0.1\n", ": ", "at least 4 rows");
  refused(good + "0,0,1,0\n180,0,1,0.1\n", ": ", "polar row 4: the polar is not periodic");
  refused("", ": ", "at least 4 rows, got 0");
  CHECK_CONTAINS(refusal<std::runtime_error>([] { (void)load_polar("no/such/polar.csv"); }),
                 "no/such/polar.csv: ");
  const Scratch huge("");
  fs::resize_file(huge.path, 5 << 20);
  CHECK_CONTAINS(refusal<std::runtime_error>([&] { (void)load_polar(huge.path); }),
                 "bytes is too large for a polar");
}

// --- enclosures -------------------------------------------------------------------------------

// A box about a random point, `share` of the way to the envelope's size; parameters fixed.
static std::vector<Range> box_about(const OperatingPoint& at, double share) {
  const std::array<double, 8> reach{2, 0.5, 0.5, 0.5, 0.3, 0.2, 0.3, 0.4};
  std::vector<Range> box;
  for (Index j = 0; j < at.x.size() + at.u.size() + at.p.size(); ++j) {
    const double r = j < 8 ? share * reach[std::size_t(j)] : 0.0;
    box.push_back({value_of(at, j) - r, value_of(at, j) + r});
  }
  return box;
}

TEST_CASE("an enclosure holds the values at every point of its box") {
  const Vehicle vehicle = reference();
  const Model wind = airframe(vehicle);
  REQUIRE(wind.enclosure);
  Dice dice;
  for (double share : {1.0, 0.1, 1e-3, 0.0})
    for (int i = 0; i < 40; ++i) {
      const OperatingPoint middle = airframe_point(dice, vehicle);
      const auto box = box_about(middle, share);
      const auto ranges = wind.enclosure(box);
      REQUIRE(ranges.size() == 8);
      for (int k = 0; k < 50; ++k) {
        OperatingPoint at = middle;
        for (Index j = 0; j < 8; ++j) {
          const Range& side = box[std::size_t(j)];
          set_value(at, j,
                    k % 5 == 0 ? (k % 2 ? side.lower : side.upper)
                               : dice.between(side.lower, side.upper));
        }
        const VectorXd inside = values(wind, at);
        for (Index r = 0; r < 8; ++r) {
          const auto [lower, upper] = ranges[std::size_t(r)];
          // ranges are not rounded outward: some hundred ulps of the terms, accelerations to 1e3
          const double hair = 100 * epsilon * (1e3 + std::abs(inside[r]));
          CAPTURE(r);
          CHECK(inside[r] >= lower - hair);
          CHECK(inside[r] <= upper + hair);
        }
      }
    }
}

TEST_CASE("an enclosure shrinks with its box") {
  const Vehicle vehicle = reference();
  const Model wind = airframe(vehicle);
  Dice dice;
  for (int i = 0; i < 40; ++i) {
    const OperatingPoint at = airframe_point(dice, vehicle);
    const auto width = [&](double share, std::size_t row) {
      const Range r = wind.enclosure(box_about(at, share))[row];
      return r.upper - r.lower;
    };
    for (std::size_t row = 0; row < 8; ++row) {
      CAPTURE(row);
      const double small = width(1e-4, row);
      CHECK(small < 1.0);
      // first order; curvatures of the polar up to 200 leave a hundredth at this size
      CHECK_NEAR(width(0.5e-4, row) / small, 0.5, 0.05);
    }
  }
}

// --- interface --------------------------------------------------------------------------------

static Model pendulum() {
  Model m;
  m.name = "pendulum";
  m.states = {{"angle", "rad", 0.1}, {"speed", "rad/s", 0.1}};
  m.inputs = {{"torque", "N m", 1.0}};
  m.parameters = {{"length", "m", 1.0}};
  m.outputs = {{"height", "m", 1.0}};
  m.f = [](const VectorXd& x, const VectorXd& u, const VectorXd& p) {
    return vec({x[1], u[0] - std::sin(x[0]) / p[0]});
  };
  m.h = [](const VectorXd& x, const VectorXd&, const VectorXd& p) {
    return vec({p[0] * std::cos(x[0])});
  };
  return m;
}

TEST_CASE("evaluate: rates, outputs, and sizes that do not fit") {
  Model m = pendulum();
  const OperatingPoint at{vec({0, 2}), vec({3}), vec({4})};
  CHECK(evaluate(m, at).rates == vec({2, 3}));
  CHECK(evaluate(m, at).outputs == vec({4}));
  const auto message = [&](const OperatingPoint& point) {
    return refusal<std::invalid_argument>([&] { (void)evaluate(m, point); });
  };
  CHECK_CONTAINS(message({vec({1, 2, 3}), at.u, at.p}), "state x: expected 2 values, got 3");
  CHECK_CONTAINS(message({at.x, vec({}), at.p}), "input u: expected 1 values, got 0");
  CHECK_CONTAINS(message({at.x, at.u, vec({1, 2})}), "parameters p: expected 1 values, got 2");
  m.f = [](const auto&, const auto&, const auto&) { return vec({1, 2, 3}); };
  CHECK_CONTAINS(message(at), "rates f: expected 2 values, got 3");
  m = pendulum();
  m.h = [](const auto&, const auto&, const auto&) { return VectorXd(0); };
  CHECK_CONTAINS(message(at), "outputs h: expected 1 values, got 0");
  m.h = nullptr;
  CHECK_CONTAINS(message(at), "outputs h: expected 1 values, got 0");
}

TEST_CASE("variables are counted through states, inputs, parameters") {
  const Model m = pendulum();
  OperatingPoint at{vec({1, 2}), vec({3}), vec({4})};
  const std::array<const char*, 4> order{"angle", "speed", "torque", "length"};
  for (Index j = 0; j < 4; ++j) {
    CHECK(variable(m, order[std::size_t(j)]) == j);
    CHECK(signal_of(m, j).name == order[std::size_t(j)]);
    CHECK(value_of(at, j) == 1.0 + double(j));
    set_value(at, j, -double(j));
    CHECK(value_of(at, j) == -double(j));
  }
  const auto message = refusal<std::invalid_argument>([&] { (void)variable(m, "torqe"); });
  CHECK_CONTAINS(message, "no signal 'torqe' (nearest: 'torque')");
  CHECK_CONTAINS(message, "angle, speed, torque, length");
  CHECK(!contains(refusal<std::invalid_argument>([&] { (void)variable(m, "zzzzzzzzzz"); }),
                  "nearest"));
  CHECK_THROWS_AS((void)signal_of(m, 4), std::out_of_range);
}

TEST_CASE("points by signal names") {
  const Model m = pendulum();
  const OperatingPoint at = point_of(m, {{"length", 4}, {"speed", 2}, {"torque", 3}});
  CHECK(at.x == vec({0, 2}));
  CHECK(at.u == vec({3}));
  CHECK(at.p == vec({4}));
  const OperatingPoint longer = changed(m, at, {{"length", 5}});
  CHECK(longer.x == at.x);
  CHECK(longer.u == at.u);
  CHECK(longer.p == vec({5}));
  for (const auto& [name, value] :
       std::map<std::string, double>{{"angle", 0}, {"speed", 2}, {"torque", 3}})
    CHECK(value_of(m, at, name) == value);
  CHECK_CONTAINS(refusal<std::invalid_argument>([&] {
                   (void)point_of(m, {{"torqe", 1}});
                 }),
                 "no signal 'torqe' (nearest: 'torque')");
  CHECK_CONTAINS(refusal<std::invalid_argument>([&] { (void)value_of(m, at, "lenght"); }),
                 "(nearest: 'length')");
  const OperatingPoint small{vec({0}), vec({3}), vec({4})};
  CHECK_CONTAINS(refusal<CallerMistake>([&] {
                   (void)changed(m, small, {{"length", 5}});
                 }),
                 "state x: expected 2 values, got 1");
  CHECK_CONTAINS(refusal<CallerMistake>([&] { (void)value_of(m, small, "length"); }),
                 "state x: expected 2 values, got 1");
}

TEST_CASE("check: models and points that cannot be used") {
  const auto message = [](const Model& m) {
    return refusal<std::invalid_argument>([&] { check(m); });
  };
  CHECK(message(pendulum()).empty());
  CHECK(message(closed_loop(reference())).empty());
  CHECK(message(airframe(reference(), Axes::body)).empty());
  Model m = pendulum();
  SUBCASE("no f") {
    m.f = nullptr;
    CHECK_CONTAINS(message(m), "no function f");
  }
  SUBCASE("outputs without h") {
    m.h = nullptr;
    CHECK_CONTAINS(message(m), "no function h");
  }
  SUBCASE("a name twice") {
    m.parameters.push_back({"angle", "rad", 1.0});
    CHECK_CONTAINS(message(m), "'angle' is used twice");
  }
  SUBCASE("names that differ in the middle alone are two names; the last of many twice") {
    constexpr int many = 300;
    for (int k = 0; k < many; ++k)
      m.parameters.push_back({"beginning" + std::to_string(1000 + k) + "the end", "", 1.0});
    CHECK(message(m).empty());
    const ModelNames found = checked_names(m);
    for (const Signal& s : m.parameters) CHECK(found.variables.find(s.name) == variable(m, s.name));
    CHECK(found.variables.find("beginning999the end") == -1);
    CHECK(found.variables.find("") == -1);
    m.parameters.push_back(m.parameters.back());
    CHECK_CONTAINS(message(m), "'beginning1299the end' is used twice");
  }
  SUBCASE("an output may be a state") {
    m.outputs[0].name = "angle";
    CHECK(message(m).empty());
  }
  SUBCASE("nominal sizes") {
    for (double bad : {0.0, -1.0, std::nan(""), std::numeric_limits<double>::infinity()}) {
      m.inputs[0].nominal = bad;
      CHECK_CONTAINS(message(m), "'torque': nominal size");
    }
  }
  SUBCASE("a point that is not finite, or of another size") {
    const OperatingPoint bad{vec({0, std::nan("")}), vec({3}), vec({4})};
    CHECK_CONTAINS(refusal<std::invalid_argument>([&] { check(m, bad); }), "'speed' is nan");
    const OperatingPoint small{vec({0}), vec({3}), vec({4})};
    CHECK_THROWS_AS(check(m, small), std::invalid_argument);
  }
}

TEST_CASE("signals: positions, names, sizes, and the nearest name") {
  const Signals signals{{"elevator", "rad", 0.1}, {"throttle", "", 0.2}};
  CHECK(find(signals, "throttle") == 1);
  CHECK(find(signals, "flaps") == -1);
  CHECK(index_of(signals, "elevator", "input") == 0);
  CHECK_CONTAINS(
      refusal<std::invalid_argument>([&] { (void)index_of(signals, "elevtor", "input"); }),
      "no input 'elevtor'; the model has: elevator, throttle");
  CHECK(names(signals) == std::vector<std::string>{"elevator", "throttle"});
  CHECK(nominals(signals) == vec({0.1, 0.2}));
  CHECK(nearest_name("elevtor", names(signals)) == "elevator");
  CHECK(nearest_name("throtle", names(signals)) == "throttle");
  CHECK(nearest_name("throttle", names(signals)) == "throttle");
  CHECK(nearest_name("zzz", names(signals)).empty());
  CHECK(nearest_name("klp", {"K_Ep", "K_Lp"}) == "K_Lp");
  CHECK(nearest_name("K_lp", {"K_Lr", "gains.K_Lp"}) == "gains.K_Lp");
  CHECK(nearest_name("x", {}).empty());
  CHECK(nearest_name(std::string(100'000, 'e'), names(signals)).empty());
}

}  // namespace model_test
