// The XV-15 against published numbers and against textbook forms of its rotor.
#include "vehicles/xv15/xv15.hpp"

#include <complex>
#include <numbers>

#include "follow/envelope.hpp"
#include "study/loads_study.hpp"
#include "study/reference_vehicle.hpp"
#include "study/study.hpp"
#include "tests/check.hpp"
#include "trim/trim.hpp"
#include "vehicles/xv15/airframe.hpp"
#include "vehicles/xv15/loads.hpp"
#include "vehicles/xv15/rotor.hpp"

using namespace tiltrim;
using namespace tiltrim::xv15;

namespace xv15_test {

namespace {

constexpr double foot = 0.3048, pound = 4.4482216152605;

std::shared_ptr<const Data> data_of(Variant variant) {
  static const std::array both{load(data_directory() / "xv15", Variant::report_1988),
                               load(data_directory() / "xv15", Variant::printed_1983)};
  return both[std::size_t(variant)];
}

// Lift proportional to the incidence, constant drag: what the closed form assumes.
Pair linear_sections(double lift_slope, double drag) {
  Pair pair{{"mach", {0, 1, 2}}, {"alpha", {-180, -90, 0, 90, 180}}, {}};
  for (std::size_t mach = 0; mach < 3; ++mach)
    for (const double alpha : pair.y.at) pair.values.push_back({lift_slope * alpha * degree, drag});
  pair.prepare();
  return pair;
}

// Untapered linear twist in steps of a midpoint rule.
std::vector<Element> linear_blade(double radius, double chord, double twist) {
  std::vector<Element> elements;
  constexpr int count = 2000;
  for (int k = 0; k < count; ++k) {
    const double x = (k + 0.5) / count;
    elements.push_back({x * radius, radius / count, chord, twist * (x - 0.75), 0});
  }
  return elements;
}

struct TextbookRotor {
  double radius = 4, chord = 0.3, omega = 50, density = 1.2, inertia = 100;
  double lift_slope = 5.7, drag = 0.01, twist = -0.2;
  std::vector<Element> elements = linear_blade(radius, chord, twist);

  Blade blade(double tan_delta3, const Pair& section) const {
    return {&elements, {section.view()}, 3, inertia, tan_delta3, radius};
  }
  SimpleBlade simple(double theta_75) const {
    return {lift_slope,
            drag,
            theta_75 - 0.75 * twist,
            twist,
            3 * chord / (std::numbers::pi * radius),
            density * lift_slope * chord * std::pow(radius, 4) / inertia};
  }
  double scale() const {
    return density * std::numbers::pi * radius * radius * std::pow(omega * radius, 2);
  }
};

}  // namespace

TEST_CASE("the kernel's thrust and torque are sums of scalar blade elements") {
  const auto data = data_of(Variant::report_1988);
  const Blade blade = blade_of(*data);
  const RotorMotion<double> y{4, 0.03, -0.02};
  // Helicopter, reverse flow inboard, airplane, descent: every quadrant and side of pi.
  for (const auto& wind : {std::array{20.0, -3.0}, {120.0, 5.0}, {3.0, 90.0}, {40.0, -60.0}})
    for (const double theta : {0.1, 3.0, -3.0}) {
      const double V_e = wind[0], V_n = wind[1];
      CAPTURE(V_e);
      CAPTURE(theta);
      const RotorInput<double> in{V_e, V_n, 0.02, theta, 0.03, 62, 1.2, 340, 0};
      double thrust = 0, torque = 0, size = 0;
      for (int k = 0; k < 8; ++k)
        for (const Element& e : data->elements) {
          const double psi = std::numbers::pi * k / 4, s = std::sin(psi), c = std::cos(psi);
          const double flap = -y.a1 * c - y.b1 * s, swing = 62 * (y.a1 * s - y.b1 * c) - in.q * c;
          const double T = 62 * e.r + V_e * s, P = V_n + y.v + e.r * swing + V_e * flap * c;
          const double U = std::hypot(T, P), pitch = theta - in.B1 * s - blade.tan_delta3 * flap;
          const double alpha =
              std::remainder(pitch + e.twist - std::atan2(P, T), 2 * std::numbers::pi);
          const Eigen::Array2d at = data->airfoils[e.section].at(U / 340, alpha / degree);
          const double dr = 0.6 * U * e.chord * e.dr * 3 / 8;
          thrust += dr * (at[0] * T - at[1] * P);
          torque += dr * e.r * (at[0] * P + at[1] * T);
          size += dr * U;
        }
      const RotorForces<double> ours = blade_forces(in, y, blade);
      CHECK(std::abs(ours.thrust - thrust) < 1e-13 * size);
      CHECK(std::abs(ours.torque - torque) < 1e-13 * size * data->radius);
    }
}

TEST_CASE("blade elements are the closed form to first order in mu and lambda") {
  const TextbookRotor rotor;
  const Pair sections = linear_sections(rotor.lift_slope, 0);
  // Second-order terms: halving mu, lambda, pitch and cyclic quarters the difference.
  const auto difference = [&](double size) {
    const double mu = 0.1 * size, lambda = 0.05 * size, theta = 0.1 * size, B1 = 0.02 * size;
    const double tip = rotor.omega * rotor.radius, k = -0.268;
    TextbookRotor small;
    small.twist = -0.2 * size;
    small.elements = linear_blade(small.radius, small.chord, small.twist);
    const ClosedForm form = closed_form(small.simple(theta), mu, lambda, 0.0, B1, k);
    const RotorInput<double> in{mu * tip,    lambda * tip,  0,   theta, B1,
                                rotor.omega, rotor.density, 340, 0};
    const auto at =
        blade_forces(in, RotorMotion<double>{0, form.a1, form.b1}, small.blade(k, sections));
    const double moment = rotor.inertia * rotor.omega * rotor.omega;
    return std::array{at.thrust / rotor.scale() - form.CT, at.flap_sin / moment,
                      at.flap_cos / moment};
  };
  const auto whole = difference(0.1), half = difference(0.05);
  for (std::size_t k = 0; k < whole.size(); ++k) {
    CAPTURE(k);
    CHECK(std::abs(half[k]) < 0.3 * std::abs(whole[k]) + 1e-9);
    CHECK(std::abs(whole[k]) < 2e-4);
  }
}

TEST_CASE("in hover a pitch rate tilts the disc by -16 q/(gamma Omega)") {
  const TextbookRotor rotor;
  const double q = 0.01, gamma = rotor.simple(0.1).gamma;
  const RotorInput<double> in{0, 4, q, 0.1, 0, rotor.omega, rotor.density, 340, 0};
  const RotorMotion<double> flapping{0, -16 * q / (gamma * rotor.omega), -q / rotor.omega};
  const Pair sections = linear_sections(rotor.lift_slope, 0);
  const auto at = blade_forces(in, flapping, rotor.blade(0, sections));
  const double gyroscopic = 2 * rotor.inertia * rotor.omega * q;
  // Left over are squares of the inflow angle.
  CHECK(std::abs(at.flap_sin) < 0.02 * gyroscopic);
  CHECK(std::abs(at.flap_cos) < 0.02 * gyroscopic);
}

TEST_CASE("figure of merit of the measured hover run") {
  // data/xv15/tables/rotor_hover_test.csv (CR-2017-219486, Table A-2): CT, CP at 768 ft/s
  constexpr std::array<std::array<double, 2>, 9> measured{{{0.004063, 0.5814},
                                                           {0.005581, 0.6921},
                                                           {0.007391, 0.7641},
                                                           {0.009208, 0.7849},
                                                           {0.010104, 0.7866},
                                                           {0.011063, 0.7881},
                                                           {0.012035, 0.7858},
                                                           {0.013089, 0.7797},
                                                           {0.013929, 0.7632}}};
  const auto data = data_of(Variant::report_1988);
  for (const auto& point : measured) {
    const double CT = point[0], figure = point[1];
    CAPTURE(CT);
    double low = 0, high = 20 * degree;
    for (int step = 0; step < 40; ++step) {
      const double middle = (low + high) / 2;
      (hover(*data, middle, 768 * foot).CT < CT ? low : high) = middle;
    }
    CHECK(std::abs(hover(*data, low, 768 * foot).figure_of_merit - figure) < 0.03);
  }
}

TEST_CASE("flow from behind: the fuselage continues its tables, while it is slow") {
  const auto data = data_of(Variant::report_1988);
  const auto fuselage_at = [&](double degrees, double knots) -> Eigen::Vector3d {
    State<double> s{};
    s.u = knots * kt * std::cos(degrees * degree);
    s.w = knots * kt * std::sin(degrees * degree);
    s.density = 1.225;
    s.sound = 340;
    const Stream<double> f = stream(s);
    const LoadOf<double> l = fuselage(*data, f, geometry(*data, 0.0));
    return Eigen::Vector3d(l.X, l.Z, l.M) / f.pressure;  // m², m³
  };
  constexpr double slow = 19, step = 1e-7;
  for (const double across : {-90.0, 90.0})
    CHECK((fuselage_at(across - step, slow) - fuselage_at(across + step, slow)).norm() < 1e-5);
  CHECK((fuselage_at(180 - step, slow) - fuselage_at(-180 + step, slow)).norm() < 1e-5);
  // backwards it drags as forwards, and the sides' forces are each other's images
  CHECK_NEAR(fuselage_at(180, slow)[0], -fuselage_at(0, slow)[0], 1e-9);
  CHECK_NEAR(fuselage_at(120, slow)[0], -fuselage_at(60, slow)[0], 1e-9);
  CHECK_NEAR(fuselage_at(120, slow)[1], fuselage_at(60, slow)[1], 1e-9);
  CHECK_THROWS_AS((void)fuselage_at(120, 21), std::domain_error);
  CHECK_NOTHROW((void)fuselage_at(60, 21));
}

TEST_CASE("component loads of the printed runs") {
  // data/xv15/trims_gtrs_loads.csv (CR-166537, A-11 and A-17), lbf and lbf ft
  struct Printed {
    double u, w, stick, induced;  // ft/s, in, ft/s
    Load spinners, fuselage, tail, wing;
  };
  const std::array runs{Printed{67.45,
                                -2.967,
                                5.0691,
                                35.4892,
                                {-57.326, 32.686, 351.934},
                                {-15.85, -26.143, -598.516},
                                {-3.86, -75.388, -1618.995},
                                {-350.068, -719.309, 451.962}},
                        Printed{133.2,
                                -21.93,
                                5.7948,
                                18.6232,
                                {-256.482, 78.063, 1581.401},
                                {-104.003, 44.085, -5308.99},
                                {-10.673, 31.094, 689.586},
                                {-1154.732, -676.317, -322.313}}};
  const auto data = data_of(Variant::printed_1983);
  for (const Printed& run : runs) {
    CAPTURE(run.u);
    OperatingPoint at{Eigen::Vector4d(run.u * foot, run.w * foot, 0, 0),
                      Eigen::Vector4d(0, run.stick, 40 * degree, 0), parameters(*data)};
    const Loads ours = loads(*data, at, {{}, run.induced * foot});
    const auto part = [&](const char* name) {
      for (const auto& [own, l] : ours.components)
        if (own == name) return Load{l.X / pound, l.Z / pound, l.M / pound / foot};
      return Load{};
    };
    CHECK(std::abs(part("spinners").X - run.spinners.X) < 0.5);
    CHECK(std::abs(part("spinners").Z - run.spinners.Z) < 0.5);
    CHECK(std::abs(part("fuselage").X - run.fuselage.X) < 1);
    CHECK(std::abs(part("fuselage").Z - run.fuselage.Z) < 1);
    CHECK(std::abs(part("fuselage").M - run.fuselage.M) < 2);
    CHECK(std::abs(part("horizontal_tail").Z / run.tail.Z - 1) < 0.03);
    CHECK(std::abs(part("horizontal_tail").M / run.tail.M - 1) < 0.03);
    // CD of the wing: its force along the free stream turned by the rotors
    const double q_S = 0.5 * 0.002377 * (run.u * run.u + run.w * run.w) * 181;
    const double c = std::cos(ours.wing_alpha), s = std::sin(ours.wing_alpha);
    const auto drag = [&](const Load& l) { return -(l.X * c + l.Z * s) / q_S; };
    CHECK(std::abs(drag(part("wing")) - drag(run.wing)) < 0.001);
  }
}

TEST_CASE("derivatives equal the complex step") {
  const auto data = data_of(Variant::report_1988);
  const Model m = model(data);
  // Between entries and within rounded corners: 40 kt, conversion, airplane.
  for (const double mast : {0.02, 0.5, 1.5}) {
    CAPTURE(mast);
    OperatingPoint at{Eigen::Vector4d(20 + 50 * mast, -1, 0.05, 0.02),
                      Eigen::Vector4d(0.15 + 0.25 * mast, 5.2, 0.1, mast), parameters(*data)};
    if (mast > 1) at.u[2] = 0;
    std::vector<Eigen::Index> variables(8);
    for (std::size_t k = 0; k < 8; ++k) variables[k] = Eigen::Index(k);
    const Eigen::MatrixXd exact = m.derivatives(at, variables);
    using Complex = std::complex<double>;
    for (std::size_t k = 0; k < 8; ++k) {
      CAPTURE(k);
      constexpr double h = 1e-30;
      std::array<Complex, 4> x, u, rates;
      std::array<Complex, 8> p;
      std::ranges::copy(at.x, x.begin());
      std::ranges::copy(at.u, u.begin());
      std::ranges::copy(at.p, p.begin());
      (k < 4 ? x[k] : u[k - 4]) += Complex(0, h);
      rates_on<Complex>(*data, x, u, p, rates);
      for (std::size_t i = 0; i < 4; ++i) {
        CAPTURE(i);
        const double step = rates[i].imag() / h;
        CHECK(std::abs(exact(Eigen::Index(i), Eigen::Index(k)) - step) <
              1e-12 * (1 + std::abs(step)));
      }
    }
  }
}

TEST_CASE("a trim starts near and needs few steps") {
  const auto data = data_of(Variant::report_1988);
  const Model m = model(data);
  for (const auto& flown :
       {std::array{0.0, 0.0, 40.0}, std::array{0.0, 80.0, 40.0}, std::array{30.0, 100.0, 20.0},
        std::array{60.0, 120.0, 20.0}, std::array{90.0, 160.0, 0.0}}) {
    const double mast = flown[0], knots = flown[1], flap = flown[2];
    CAPTURE(mast);
    CAPTURE(knots);
    OperatingPoint at{Eigen::Vector4d::Zero(), Eigen::Vector4d(0, 0, flap * degree, mast * degree),
                      parameters(*data)};
    at.p[airspeed_kt] = knots;
    const Start start = start_of(*data, at, knots * kt, 0);
    at.u[0] = start.collective;
    at.u[1] = start.stick;
    at.x << knots * kt * std::cos(start.theta), knots * kt * std::sin(start.theta), start.theta, 0;
    TrimSpec spec{.free = {"u", "w", "theta", "q", "collective", "stick"}};
    spec.bounds = {{"forward_error", {0, 0}}, {"climb_error", {0, 0}}};
    int steps = 0;
    TrimOptions options{.method = TrimMethod::newton, .starts = 0};
    options.observe = [&](const OperatingPoint&) { ++steps; };
    const TrimResult found = trim(m, spec, at, options);
    CHECK(found.status == TrimStatus::converged);
    CHECK(steps <= 6);
    CHECK(std::abs(found.point.x[2] - start.theta) < 3 * degree);
    CHECK(std::abs(found.point.u[0] - start.collective) < 4 * degree);
    // The commanded speed and level flight.
    CHECK(std::abs(found.outputs[3] - knots) < 1e-9);
    CHECK(std::abs(found.outputs[2]) < 1e-9);
  }
}

namespace {

struct Flown {
  double knots, climb, flap, mast;  // kt, degrees
};

OperatingPoint begun(const Data& data, const Flown& flown, double theta, const Start& start) {
  OperatingPoint at{
      Eigen::Vector4d::Zero(),
      Eigen::Vector4d(start.collective, start.stick, flown.flap * degree, flown.mast * degree),
      parameters(data)};
  const double V = flown.knots * kt, alpha = theta - flown.climb * degree;
  at.p[airspeed_kt] = flown.knots;
  at.p[climb_angle] = flown.climb * degree;
  at.x << V * std::cos(alpha), V * std::sin(alpha), theta, 0;
  return at;
}

TrimSpec flown_as_commanded() {
  TrimSpec spec{.free = {"u", "w", "theta", "q", "collective", "stick"}};
  spec.bounds = {{"forward_error", {0, 0}},
                 {"climb_error", {0, 0}},
                 {"stick", {0, 9.6}},
                 {"collective", {-10 * degree, 70 * degree}}};
  return spec;
}

TrimResult newton_trim(const Data& data, const Model& m, const Flown& flown) {
  const OperatingPoint still = begun(data, flown, 0, {});
  const Start start = start_of(data, still, flown.knots * kt, flown.climb * degree);
  return trim(m, flown_as_commanded(), begun(data, flown, start.theta, start),
              {.method = TrimMethod::newton, .starts = 0});
}

}  // namespace

TEST_CASE("straight up and down: Newton's method from the start, with a level fuselage") {
  const auto data = data_of(Variant::report_1988);
  const Model m = model(data);
  for (const double flap : {0.0, 40.0}) {
    double before = 0;
    for (const double climbed : {-30.0, -20.0, -15.0, -10.0, -5.0, 5.0, 10.0, 15.0, 20.0, 30.0}) {
      CAPTURE(flap);
      CAPTURE(climbed);
      const TrimResult found =
          newton_trim(*data, m, {std::abs(climbed), std::copysign(90, climbed), flap, 0});
      REQUIRE(found.status == TrimStatus::converged);
      CHECK(std::abs(found.point.x[2]) < 4 * degree);
      // A faster climb takes more collective; stalled blades would leave the order.
      CHECK(found.point.u[0] > before);
      CHECK(found.point.u[0] < 15 * degree);
      before = found.point.u[0];
    }
  }
  const auto collective = [&](const Flown& flown) {
    return newton_trim(*data, m, flown).point.u[0] / degree;
  };
  // From guesses next to these equilibria, by hand.
  const double up = collective({15, 90, 0, 0}), down = collective({15, -90, 0, 0});
  CHECK_NEAR(up, 12.343, 5e-4);
  CHECK_NEAR(down, 9.690, 5e-4);
  const double vertical = collective({10, 90, 40, 0}), steep = collective({10, 89, 40, 0});
  CHECK_NEAR(vertical, steep, 0.01);
}

TEST_CASE("loads without a collective find the one of a trim") {
  const auto data = data_of(Variant::report_1988);
  const Model m = model(data);
  for (const Flown& flown :
       {Flown{0, 0, 0, 0}, Flown{0, 0, 40, 0}, Flown{10, 90, 40, 0}, Flown{10, -90, 0, 0},
        Flown{80, 0, 40, 0}, Flown{100, 5, 20, 30}, Flown{120, -3, 20, 60}, Flown{160, 0, 0, 90}}) {
    CAPTURE(flown.knots);
    CAPTURE(flown.climb);
    CAPTURE(flown.mast);
    const TrimResult found = newton_trim(*data, m, flown);
    REQUIRE(found.status == TrimStatus::converged);
    const Loads at = loads(*data, found.point, {});
    CHECK_NEAR(at.collective, found.point.u[0], 1e-8);
    CHECK_NEAR(at.induced_velocity, found.outputs[6], 1e-6);
    CHECK_NEAR(at.total.M, 0, 0.1);  // N m
  }
}

TEST_CASE("loads at rest, along the masts and backwards are next to those of a slow flight") {
  const auto collective = [](double u, double w) {
    const Study study =
        parse_study(fmt::format("vehicle = 'xv15'\n[[condition]]\nname = 'slow'\nu = {}\nw = {}\n"
                                "stick = 4.8\nflap_deg = 0\nmast_angle_deg = 0\n",
                                u, w),
                    "slow.toml");
    const LoadsAnswer answer = component_loads(study.conditions.front());
    CAPTURE(answer.message);
    REQUIRE(answer.loads.components.size() == 7);
    // The thrust balances the weight, with the fuselage at the pitch assumed.
    const double weight = answer.at.p[mass] * answer.at.p[gravity];
    CHECK_NEAR(answer.loads.total.Z, -weight * std::cos(answer.at.x[2]), 1e-3);
    return answer.loads.collective / degree;
  };
  const double hover = collective(0, 0);
  CHECK_NEAR(hover, 11.149, 5e-4);
  CHECK_NEAR(collective(0.01, 0), hover, 1e-3);
  CHECK_NEAR(collective(-0.01, 0), hover, 1e-3);
  // Climbing takes more, descending less; so does flight in either direction.
  CHECK(collective(0, -5) > hover);
  CHECK(collective(0, 5) < hover);
  CHECK_NEAR(collective(-5, 0), collective(5, 0), 0.5);
  CHECK(collective(-5, 0) < hover);
}

TEST_CASE("what a trim finds by way of the closest point is among all equilibria") {
  const auto data = data_of(Variant::report_1988);
  const Model m = model(data);
  // Far from level: this trim ends with stalled blades.
  const OperatingPoint steep = begun(*data, {10, 90, 40, 0}, 2.5215958083778469,
                                     {0, -0.082902769929379061, 3.7087002234970186});
  const TrimSpec spec = flown_as_commanded();
  const TrimResult plain = trim(m, spec, steep);
  REQUIRE(plain.status == TrimStatus::converged);
  const AllEquilibria all = all_equilibria(m, spec, steep, {}, 1.0, {.starts = 200});
  CHECK(std::ranges::any_of(all.equilibria, [&](const Equilibrium& e) {
    return (e.trim.point.u - plain.point.u).norm() < 1e-6;
  }));
}

TEST_CASE("tables meet their entries with continuous second derivatives") {
  const Axis axis{"test", {0.0, 1.0, 3.0, 4.0}, false};
  const Table table{axis, {1.0, 3.0, 2.0, 2.0}, {}};
  for (std::size_t k = 0; k < axis.at.size(); ++k)
    CHECK(table.at(axis.at[k]) == doctest::Approx(table.values[k]).epsilon(1e-15));
  CHECK(table.at(2.0) == doctest::Approx(2.5));  // linear in between
  const auto curvature = [&](double x) {
    constexpr double h = 1e-4;
    return (table.at(x - h) - 2 * table.at(x) + table.at(x + h)) / (h * h);
  };
  for (double x = 0.01; x < 3.98; x += 0.001)  // no jump: the fourth derivative is bounded
    CHECK(std::abs(curvature(x + 0.001) - curvature(x)) < 1.2);
  CHECK_THROWS_WITH_AS(table.at(4.5), "the table test is silent at 4.5; it covers 0 to 4",
                       std::domain_error);
}

}  // namespace xv15_test
