#include "qualities/qualities.hpp"

#include <fstream>
#include <nlohmann/json.hpp>
#include <numbers>
#include <utility>

#include "examples/f16.hpp"
#include "qualities/levels.hpp"
#include "tests/check.hpp"
#include "trim/trim.hpp"

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using namespace tiltrim;
using Root = std::complex<double>;

namespace qualities_test {

namespace {

nlohmann::json reference(const char* file) {
  std::ifstream in(std::string(TILTRIM_SOURCE_DIR "/data/references/") + file);
  return nlohmann::json::parse(in);
}

double number(const nlohmann::json& printed) { return std::stod(printed.get<std::string>()); }

LinearModel linear_of(const Signals& states, const MatrixXd& A, const Signals& inputs = {},
                      const MatrixXd& B = {}) {
  LinearModel l;
  l.status = LinearizeStatus::linear;
  l.states = states;
  l.inputs = inputs;
  l.A = A;
  l.B = B.size() > 0 ? B : MatrixXd(MatrixXd::Zero(A.rows(), std::ssize(inputs)));
  l.C = l.C_error = MatrixXd::Zero(0, A.rows());
  l.D = l.D_error = MatrixXd::Zero(0, std::ssize(inputs));
  l.A_error = MatrixXd::Zero(A.rows(), A.cols());
  l.B_error = MatrixXd::Zero(l.B.rows(), l.B.cols());
  l.point.x = VectorXd::Zero(A.rows());
  return l;
}

// The models of data/references/linear_models.json.
LinearModel published(std::size_t k, const Signals& inputs = {}, const MatrixXd& B = {}) {
  const auto entry = reference("linear_models.json").at("models")[k];
  Signals states;
  for (const auto& name : entry.at("states")) states.push_back({name, "", 0.1});
  const Index n = std::ssize(states);
  MatrixXd A(n, n);
  for (Index i = 0; i < n; ++i)
    for (Index j = 0; j < n; ++j) A(i, j) = number(entry.at("A")[std::size_t(i)][std::size_t(j)]);
  return linear_of(states, A, inputs, B);
}

// [2], sections 6.2 and 7.6.
LinearModel jet() {
  return published(0, {{"elevator", "rad", 0.01}}, Eigen::Vector4d(-0.000187, -17.85, -1.158, 0));
}

QualitiesOptions of_jet(FlightCategory category) {
  QualitiesOptions o;
  o.roles.pitch = "theta";
  o.roles.pitch_rate = "q";
  o.roles.downward_speed = "w";
  o.roles.speed = "u";
  o.roles.stick = "elevator";
  o.aircraft = AircraftClass::III;
  o.category = category;
  o.airspeed = 774;
  o.gravity = 32.2;
  return o;
}

const Criterion& named(const Qualities& q, const std::string& name) {
  const auto at = std::ranges::find(q.criteria, name, &Criterion::name);
  REQUIRE(at != q.criteria.end());
  return *at;
}

// States alpha, q, u, theta with these two eigenvalues of the first two; u and theta are slow.
LinearModel with_roots(double product, double sum, double n_per_alpha) {
  // (s + Z)(s + D) + M = s² + (Z + D) s + Z D + M; n/α = (U/g) Z with U/g = 1
  const double Z = n_per_alpha, D = -sum - Z, M = product - Z * D;
  MatrixXd A = MatrixXd::Zero(4, 4);
  A.topLeftCorner(2, 2) << -Z, 1, -M, -D;
  A.bottomRightCorner(2, 2) << -0.02, -0.01, 0.01, 0;
  A(3, 1) = 1;
  const Signals states{{"alpha", "", 0.1}, {"q", "", 0.1}, {"u", "", 0.1}, {"theta", "", 0.1}};
  return linear_of(states, A, {{"stick", "", 1}}, Eigen::Vector4d(0, 1, 0, 0));
}

QualitiesOptions of_roots() {
  QualitiesOptions o;
  o.roles = {"theta", "q", "alpha", "", "u", "", "", "stick"};
  o.airspeed = o.gravity = 1;
  return o;
}

}  // namespace

TEST_CASE("Boeing 747 in cruise: level 1 of category B, level 2 of category C") {
  const Qualities b = qualities(jet(), of_jet(FlightCategory::B));
  // [2], section 6.2: -0.3719 ± 0.8875i and -0.003289 ± 0.06723i
  const Root fast(-0.3719, 0.8875), slow(-0.003289, 0.06723);
  CHECK(b.short_period.kind == OscillationKind::pair);
  CHECK(b.phugoid.kind == OscillationKind::pair);
  CHECK_NEAR(b.short_period.frequency.value, std::abs(fast), 2 * printed_to("0.8875"));
  CHECK_NEAR(b.short_period.damping.value, -fast.real() / std::abs(fast), 1e-4);
  CHECK_NEAR(b.phugoid.damping.value, -slow.real() / std::abs(slow), 1e-5);
  // q/w after a step of the elevator, by Cramer's rule, and n/α = U² q/(g w)
  const double Zw = -0.3151, U = 773.98, Mw = -0.001026, Mq = -0.4285, Z = -17.85, M = -1.158;
  const double ratio = (Mw * Z - Zw * M) / (Mq * Z - U * M);
  CHECK_NEAR(b.n_per_alpha.value, std::abs(ratio) * 774 * 774 / 32.2, 1e-10);
  CHECK(b.n_per_alpha.error < 1e-10);
  const double anticipation = std::norm(fast) / b.n_per_alpha.value;
  CHECK_NEAR(named(b, "control anticipation").value, anticipation, 2e-5);
  CHECK(named(b, "control anticipation").level == Level::one);  // 0.085 to 3.6
  CHECK(named(b, "short-period damping").level == Level::one);  // 0.30 to 2.00
  CHECK(named(b, "phugoid damping").level == Level::one);       // 0.04
  CHECK(named(b, "aperiodic stability").level == Level::not_judged);
  CHECK_NEAR(named(b, "phugoid damping").distance(), b.phugoid.damping.value - 0.04, 1e-15);
  CHECK(b.level == Level::one);
  const Qualities c = qualities(jet(), of_jet(FlightCategory::C));
  CHECK(named(c, "control anticipation").level == Level::two);    // 0.16 > 0.13 > 0.096
  CHECK(named(c, "short-period frequency").level == Level::one);  // class III: 0.7 rad/s
  CHECK(named(c, "acceleration sensitivity").level == Level::one);
  CHECK(c.level == Level::two);
  const Qualities a = qualities(jet(), of_jet(FlightCategory::A));
  CHECK(named(a, "control anticipation").level == Level::none);   // 0.16
  CHECK(named(a, "short-period frequency").level == Level::two);  // 1.0 and 0.6 rad/s
  CHECK(a.level == Level::none);
}

TEST_CASE("gravity is by the unit of speed, if it is not given") {
  LinearModel l = jet();
  QualitiesOptions given = of_jet(FlightCategory::B);
  QualitiesOptions left_out = given;
  left_out.gravity = std::numeric_limits<double>::quiet_NaN();
  for (const auto& [unit, gravity] :
       std::vector<std::pair<std::string, double>>{{"ft/s", 9.80665 / 0.3048},
                                                   {"ft s-1", 9.80665 / 0.3048},
                                                   {"m/s", 9.80665},
                                                   {"", 9.80665}}) {
    l.states[1].unit = unit;
    given.gravity = gravity;
    CHECK(qualities(l, left_out).n_per_alpha.value == qualities(l, given).n_per_alpha.value);
  }
  l.states[1].unit = "kt";
  CHECK_THROWS_WITH_AS((void)qualities(l, left_out),
                       "qualities: w is in kt; expected gravity, in the units of airspeed and s",
                       std::invalid_argument);
  CHECK(qualities(l, given).level == qualities(jet(), given).level);
  // a speed that is an output has a unit, too
  l = jet();
  l.outputs = {{"true airspeed", "kt"}};
  l.C = l.C_error = Eigen::MatrixXd::Zero(1, l.A.rows());
  l.C(0, 0) = 1;
  l.D = l.D_error = Eigen::MatrixXd::Zero(1, l.B.cols());
  left_out.roles.alpha = std::exchange(left_out.roles.downward_speed, "");
  left_out.roles.speed = "true airspeed";
  CHECK_THROWS_WITH_AS(
      (void)qualities(l, left_out),
      "qualities: true airspeed is in kt; expected gravity, in the units of airspeed and s",
      std::invalid_argument);
}

TEST_CASE("an airspeed that is none is refused") {
  QualitiesOptions options = of_jet(FlightCategory::B);
  for (const double speed : {-3.0, 0.0, std::numeric_limits<double>::infinity()}) {
    options.airspeed = speed;
    CHECK_THROWS_WITH_AS((void)qualities(jet(), options),
                         "qualities: airspeed is not a number above 0", std::invalid_argument);
  }
}

TEST_CASE("levels do not depend on units, and a rotated state is found by its output") {
  LinearModel l = jet();
  const Qualities feet = qualities(l, of_jet(FlightCategory::B));
  constexpr double foot = 0.3048;
  VectorXd T(4);
  T << foot, foot, 1, 1;
  l.A = (T.asDiagonal() * l.A * T.cwiseInverse().asDiagonal()).eval();
  l.B = (T.asDiagonal() * l.B).eval();
  QualitiesOptions o = of_jet(FlightCategory::B);
  o.airspeed *= foot;
  o.gravity *= foot;
  const Qualities metres = qualities(l, o);
  // w replaced by the path angle theta - w/U: the angle of attack is an output of two states.
  MatrixXd R = MatrixXd::Identity(4, 4);
  R.row(1) << 0, -1 / o.airspeed, 0, 1;
  LinearModel path = l;
  MatrixXd back = R;
  back.row(1) << 0, -o.airspeed, 0, o.airspeed;
  path.A = R * l.A * back;
  path.B = R * l.B;
  path.states[1] = {"path", "rad", 0.1};
  path.outputs = {{"attack", "rad", 0.1}};
  path.C = Eigen::RowVector4d(0, -1, 0, 1);
  path.C_error = MatrixXd::Zero(1, 4);
  path.D = path.D_error = MatrixXd::Zero(1, 1);
  o.roles.downward_speed.clear();
  o.roles.alpha = "attack";
  const Qualities turned = qualities(path, o);
  REQUIRE(turned.criteria.size() == feet.criteria.size());
  for (std::size_t k = 1; k < feet.criteria.size(); ++k) {
    CAPTURE(feet.criteria[k].name);
    CHECK(metres.criteria[k].level == feet.criteria[k].level);
    CHECK(turned.criteria[k].level == feet.criteria[k].level);
    CHECK_NEAR(metres.criteria[k].value, feet.criteria[k].value, 1e-10);
    CHECK_NEAR(turned.criteria[k].value, feet.criteria[k].value, 1e-9);
  }
  for (std::size_t k = 0; k < feet.shares.size(); ++k)
    CHECK_NEAR(turned.shares[k].fast, feet.shares[k].fast, 1e-9);
}

TEST_CASE("the F-16 of the book: no short period at its centre of gravity, one further ahead") {
  const TrimSpec level_flight{.free = {"alpha", "theta", "power", "throttle", "elevator"},
                              .steady = {"V", "alpha", "q", "power"},
                              .bounds = {{"gamma", {0, 0}}},
                              .implied = {"theta"}};
  const auto at = [&](double xcg) {
    VectorXd x(5);
    x << 502, 0.1, 0.1, 0, 10;
    const TrimResult r = trim(f16::longitudinal(), level_flight,
                              {x, Eigen::Vector2d{0.2, 0}, Eigen::Vector2d{0, xcg}});
    REQUIRE(r);
    return linearize(f16::longitudinal(), r.point);
  };
  QualitiesOptions o;
  o.roles = {"theta", "q", "alpha", "", "V", "", "", "elevator"};
  o.aircraft = AircraftClass::IV;
  o.category = FlightCategory::A;
  o.gravity = 32.17;
  const Qualities nominal = qualities(at(0.35), o);
  // The printed A of [63], Example 4.4-1 [data/references/f16.json]: the same real roots.
  const auto book = reference("f16.json").at("linear");
  MatrixXd A(4, 4);
  for (Index i = 0; i < 4; ++i)
    for (Index j = 0; j < 4; ++j) A(i, j) = number(book.at("A")[std::size_t(i)][std::size_t(j)]);
  const Signals states{{"V", "", 10}, {"alpha", "", 0.1}, {"theta", "", 0.1}, {"q", "", 0.1}};
  const Qualities printed = qualities(linear_of(states, A, {{"elevator", "", 1}}), o);
  CHECK(nominal.short_period.kind == OscillationKind::absent);
  CHECK(printed.short_period.kind == OscillationKind::absent);
  CHECK(contains(nominal.short_period.message, "no short period: "));
  CHECK(contains(nominal.short_period.message, "1 real root, -1.91"));
  CHECK(named(nominal, "aperiodic stability").level == Level::three);  // doubles in 7.1 s
  CHECK(nominal.level == Level::three);
  CHECK(named(nominal, "control anticipation").level == Level::not_judged);
  CHECK(named(nominal, "aperiodic stability").level == named(printed, "aperiodic stability").level);
  CHECK_NEAR(named(nominal, "aperiodic stability").value,
             named(printed, "aperiodic stability").value, 0.01);
  const LinearModel ahead = at(0.30);
  const Qualities forward = qualities(ahead, o);
  REQUIRE(forward.short_period.kind == OscillationKind::pair);
  // [63], chapter 3, nominal flight condition with xcg = 0.30: -1.2039 ± 1.4922i; cited by chapter.
  const Root book_pair(-1.2039, 1.4922);
  CHECK_NEAR(forward.short_period.frequency.value, std::abs(book_pair), printed_to("1.4922"));
  CHECK_NEAR(forward.short_period.damping.value, -book_pair.real() / std::abs(book_pair), 1e-4);
  CHECK(named(forward, "short-period damping").level == Level::one);    // 0.35
  CHECK(named(forward, "short-period frequency").level == Level::one);  // 1.0 rad/s
  // ω² = 3.676 over 16.76 g/rad: 0.219, between 0.28 and 0.16
  CHECK(named(forward, "control anticipation").level == Level::two);
  CHECK(forward.level == Level::two);
  // n/α by two roads: the turn of the path, and the accelerometer of the book.
  o.roles.normal_acceleration = "load";
  const Qualities measured = qualities(ahead, o);
  CHECK_NEAR(measured.n_per_alpha.value / forward.n_per_alpha.value, 1, 0.02);
}

TEST_CASE("a helicopter near hover is level 3 of MIL-F-83300") {
  QualitiesOptions o;
  o.roles.pitch = "theta";
  o.roles.pitch_rate = "q";
  o.roles.speed = "u";
  o.regime = FlightRegime::hover;
  const Qualities q = qualities(published(4), o);
  // 0.1183 ± 0.3678i doubles in 5.86 s: more than 5, less than 12; ω = 0.386 rad/s, ζ = -0.306
  const Criterion& oscillation = named(q, "oscillation");
  CHECK(oscillation.level == Level::three);
  CHECK(std::numbers::ln2 / oscillation.value == doctest::Approx(5.86).epsilon(1e-3));
  CHECK_NEAR(oscillation.margins[2], std::numbers::ln2 / 5 - 0.1183, printed_to("0.1183"));
  CHECK_NEAR(oscillation.margins[1], std::numbers::ln2 / 12 - 0.1183, printed_to("0.1183"));
  CHECK(named(q, "aperiodic response").level == Level::one);  // -0.6565
  // ADS-33E-PRF 3.3.2.3.2 limits level 1 only, so that the others decide between 2, 3 and none.
  const Criterion& divided = named(q, "oscillation, divided attention");
  CHECK(divided.level == Level::two);
  CHECK(contains(divided.remark, "in 5.86 s, worse than level 1; level 2 has no limit"));
  CHECK(q.level == Level::three);
  CHECK_FALSE(q.attitude);
}

TEST_CASE("limits of oscillations in hover, region by region") {
  QualitiesOptions o = of_roots();
  o.regime = FlightRegime::hover;
  const auto level = [&](double w, double damping) {
    return named(qualities(with_roots(w * w, -2 * damping * w, 0.3), o), "oscillation").level;
  };
  CHECK(level(0.4, -0.05) == Level::one);
  CHECK(level(0.4, -0.12) == Level::two);
  CHECK(level(0.8, 0.05) == Level::one);
  CHECK(level(0.8, -0.05) == Level::two);
  CHECK(level(1.0, -0.02) == Level::three);
  CHECK(level(2.0, 0.31) == Level::one);
  CHECK(level(2.0, 0.29) == Level::two);
  CHECK(level(2.0, -0.01) == Level::none);
}

TEST_CASE("a border within the error bound is undecided, with the distance") {
  QualitiesOptions o = of_roots();
  const double w = 1.0, n = 2.0;
  const auto at = [&](double damping, double error) {
    LinearModel l = with_roots(w * w, -2 * damping * w, n);
    l.A_error(1, 0) = error;
    return qualities(l, o);
  };
  CHECK(named(at(0.3 + 1e-6, 0), "short-period damping").level == Level::one);
  CHECK(named(at(0.3 - 1e-6, 0), "short-period damping").level == Level::two);
  const Qualities near = at(0.3 + 1e-6, 1e-4);
  const Criterion& c = named(near, "short-period damping");
  CHECK(c.level == Level::undecided);
  CHECK(c.nearest() == 0);
  CHECK_NEAR(c.distance(), 1e-6, 1e-12);
  CHECK(c.margin_error > 1e-6);
  CHECK(c.margin_error < 1e-2);
  CHECK(near.level == Level::undecided);
}

TEST_CASE("two real roots stand for an overdamped short period") {
  const Qualities q = qualities(with_roots(1.0, -2.5, 2.0), of_roots());  // -0.5 and -2
  REQUIRE(q.short_period.kind == OscillationKind::two_real);
  CHECK_NEAR(q.short_period.frequency.value, 1.0, q.short_period.frequency.error + 1e-15);
  CHECK_NEAR(q.short_period.damping.value, 1.25, q.short_period.damping.error + 1e-15);
  CHECK(q.short_period.frequency.error < 1e-12);
  CHECK(named(q, "short-period damping").level == Level::one);  // 0.30 to 2.00
  CHECK(contains(named(q, "short-period damping").remark, "two real roots"));
  CHECK(contains(q.short_period.message, "2 real roots"));
}

TEST_CASE("every status is reached and named") {
  QualitiesOptions o = of_roots();
  LinearModel l = with_roots(1.0, -1.0, 2.0);
  // A ring of six states: every mode has a sixth of its participation in each of them.
  MatrixXd A = -2 * MatrixXd::Identity(6, 6);
  for (Index k = 0; k < 6; ++k) A(k, (k + 1) % 6) = 1;
  const LinearModel other = linear_of(
      {{"a", ""}, {"b", ""}, {"theta", ""}, {"q", ""}, {"c", ""}, {"d", ""}}, A, {{"stick", ""}});
  o.roles = {"theta", "q", "", "", "", "", "", "stick"};
  const Qualities none = qualities(other, o);
  CHECK(none.status == QualitiesStatus::no_longitudinal_mode);
  CHECK(to_string(none.status) == "no_longitudinal_mode");
  CHECK(none.level == Level::not_judged);
  o = of_roots();
  o.roles.stick.clear();
  const Qualities without = qualities(l, o);
  CHECK(std::isnan(without.n_per_alpha.value));
  CHECK(named(without, "control anticipation").level == Level::not_judged);
  CHECK(contains(without.remarks.at(0), "stick"));
  o = of_roots();
  o.airspeed = NAN;
  CHECK(contains(qualities(l, o).remarks.at(0), "airspeed"));
  CHECK(to_string(Level::not_judged) == "not judged");
  CHECK(to_string(Level::three) == "3");
}

TEST_CASE("bandwidth judged by borders that the caller gives") {
  QualitiesOptions o = of_roots();
  o.regime = FlightRegime::hover;
  LinearModel l = with_roots(4.0, -2.8, 0.5);
  const double found = qualities(l, o).bandwidth.bandwidth.value;
  CHECK(std::isfinite(found));
  const auto level = [&](double first, double second) {
    o.least_bandwidth = {{{{0.0, first}, {0.2, first}}, {{0.0, second}, {0.2, second}}}};
    return named(qualities(l, o), "attitude bandwidth").level;
  };
  CHECK(level(0.9 * found, 0.5 * found) == Level::one);
  CHECK(level(1.1 * found, 0.5 * found) == Level::two);
  CHECK(level(1.1 * found, 1.05 * found) == Level::three);  // which has no border
  CHECK(level(found, 0.5 * found) == Level::undecided);
  o.least_bandwidth = {{{{0.0, 1.1 * found}}, {}}};
  const Qualities one_border = qualities(l, o);
  CHECK(named(one_border, "attitude bandwidth").level == Level::two);
  CHECK(named(one_border, "attitude bandwidth").remark ==
        "worse than level 1; level 2 has no limit");
  CHECK(one_border.level == Level::two);
}

TEST_CASE("an integrator, as of height, does not diverge; a zero within its error may") {
  for (const FlightRegime regime : {FlightRegime::forward, FlightRegime::hover}) {
    QualitiesOptions o = of_jet(FlightCategory::B);
    o.regime = regime;
    const Qualities without = qualities(jet(), o);
    LinearModel l = jet();
    l.states.push_back({"h", "", 100});
    l.A.conservativeResizeLike(MatrixXd::Zero(5, 5));
    l.A.row(4) << 0, -1, 0, 774, 0;
    l.A_error = MatrixXd::Zero(5, 5);
    l.B.conservativeResizeLike(MatrixXd::Zero(5, 1));
    l.B_error = MatrixXd::Zero(5, 1);
    l.C = l.C_error = MatrixXd::Zero(0, 5);
    o.roles.height = "h";
    const Qualities with = qualities(l, o);
    REQUIRE(with.criteria.size() == without.criteria.size());
    CHECK(with.level == without.level);
    const Criterion& aperiodic = with.criteria.front();
    CHECK(aperiodic.level == Level::not_judged);
    CHECK(aperiodic.remark == "only integrators, which do not diverge");
    l.A_error(0, 4) = 1e-6;
    CHECK(qualities(l, o).criteria.front().level == Level::undecided);
  }
}

TEST_CASE("the worst of several levels") {
  const auto worst = [](std::vector<double> values, double error) {
    std::vector<Criterion> all;
    for (const double v : values)
      all.push_back(within("", "", "", v, error, {{3, 9}, {2, 9}, {1, 9}}));
    return worst_of(all);
  };
  CHECK(worst({4, 4}, 0) == Level::one);
  CHECK(worst({4, 2.5, 1.5}, 0) == Level::three);
  CHECK(worst({4, 3}, 0.1) == Level::undecided);
  CHECK(worst({2.5, 3}, 0.1) == Level::two);  // the other is 1 or 2
  CHECK(worst({0.5, 3}, 0.1) == Level::none);
  const auto first_only = [](double v) { return within("", "", "", v, 0.1, {{3, 9}}); };
  CHECK(worst_of({first_only(4)}) == Level::one);
  CHECK(worst_of({first_only(2)}) == Level::two);
  CHECK(worst_of({first_only(3)}) == Level::undecided);  // 1 or 2
  CHECK(worst_of({first_only(3), first_only(2)}) == Level::two);
  CHECK(worst_of({}) == Level::not_judged);
}

TEST_CASE("mistakes of the caller of qualities") {
  QualitiesOptions o = of_jet(FlightCategory::B);
  CHECK(contains(refusal([&] { (void)qualities({}, o); }), "no linear model"));
  o.roles.stick = "rudder";
  CHECK(contains(refusal([&] { (void)qualities(jet(), o); }), "rudder"));
  o = of_jet(FlightCategory::B);
  o.roles.pitch.clear();
  CHECK(contains(refusal([&] { (void)qualities(jet(), o); }), "pitch"));
  o = of_jet(FlightCategory::B);
  o.n_per_alpha = -1;
  CHECK(contains(refusal([&] { (void)qualities(jet(), o); }), "n_per_alpha"));
  o = of_jet(FlightCategory::B);
  o.roles.speed = "w";
  CHECK(contains(refusal([&] { (void)qualities(jet(), o); }), "another role"));
}

}  // namespace qualities_test
