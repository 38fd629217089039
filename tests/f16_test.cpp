// A nonlinear model with tables against the published numbers.
#include "examples/f16.hpp"

#include <fstream>
#include <nlohmann/json.hpp>
#include <string>

#include "follow/follow.hpp"
#include "sweep/sweep.hpp"
#include "tests/check.hpp"

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using namespace tiltrim;

namespace f16_test {

namespace {

constexpr double degree = std::numbers::pi / 180;

nlohmann::json printed() {
  std::ifstream file(TILTRIM_SOURCE_DIR "/data/references/f16.json");
  return nlohmann::json::parse(file);
}

double number(const std::string& text) { return std::stod(text); }

const TrimSpec level_flight{.free = {"alpha", "theta", "power", "throttle", "elevator"},
                            .steady = {"V", "alpha", "q", "power"},
                            .bounds = {{"gamma", {0, 0}}},
                            .implied = {"theta"}};

// One guess for all speeds.
TrimResult level(double V, double xcg) {
  VectorXd x(5);
  x << V, 0.1, 0.1, 0, 10;
  const OperatingPoint guess{x, Eigen::Vector2d{0.2, 0}, Eigen::Vector2d{0, xcg}};
  return trim(f16::longitudinal(), level_flight, guess);
}

void check_printed(double value, const std::string& text) {
  CHECK_NEAR(value, number(text), printed_to(text));
}

}  // namespace

TEST_CASE("level flight at every printed speed, to every digit printed" * thorough) {
  const auto table = printed().at("level").at("rows");
  CHECK(table.size() == 16);
  for (const auto& row : table) {
    CAPTURE(row.dump());
    const TrimResult r = level(number(row[0]), 0.35);
    REQUIRE(r);
    check_printed(r.point.u[0], row[1]);
    check_printed(r.point.x[1] / degree, row[2]);
    check_printed(r.point.u[1], row[3]);
  }
}

TEST_CASE("the same with the centre of gravity ahead and behind, to every digit printed") {
  const auto table = printed().at("balance").at("rows");
  CHECK(table.size() == 3);
  for (const auto& row : table) {
    CAPTURE(row.dump());
    const TrimResult r = level(502, number(row[0]));
    REQUIRE(r);
    check_printed(r.point.u[0], row[1]);
    check_printed(r.point.x[1], row[2]);
    check_printed(r.point.u[1], row[3]);
  }
}

TEST_CASE("its printed linear model") {
  const auto book = printed().at("linear");
  const TrimResult r = level(502, 0.35);
  REQUIRE(r);
  const LinearModel lin = linearize(f16::longitudinal(), r.point);
  REQUIRE(lin);
  CHECK(lin.remarks.empty());
  for (Index i = 0; i < 4; ++i) {
    CAPTURE(i);
    check_printed(lin.B(i, 1), book.at("B")[std::size_t(i)][0]);
    for (Index j = 0; j < 4; ++j) {
      CAPTURE(j);
      const std::string text = book.at("A")[std::size_t(i)][std::size_t(j)];
      if (i == 0 && j == 1) continue;  // the next test
      if (i == 3 && j == 0)            // zero at every speed: the book prints round-off
        CHECK_NEAR(lin.A(i, j), 0, 1e-11);
      else
        check_printed(lin.A(i, j), text);
    }
  }
  const auto& load = book.at("normal_load");
  check_printed(lin.C(1, 1), load.at("alpha"));
  check_printed(lin.C(1, 3), load.at("q"));
  // 5e-6 from the printed -0.048523, or 1e-4 of the two terms that cancel in it, although the
  // pitching moment in the larger one agrees with the printed B. The reason is unknown.
  const std::string elevator = load.at("elevator");
  CHECK_NEAR(lin.D(1, 1), number(elevator) - 5.02e-6, 1e-8);
}

TEST_CASE("one printed derivative is a difference over some 0.005 rad") {
  const std::string text = printed().at("linear").at("A")[0][1];
  const Model m = f16::longitudinal();
  const OperatingPoint at = level(502, 0.35).point;
  const double exact = linearize(m, at).A(0, 1);
  CHECK(exact - number(text) > 2 * printed_to(text));  // 1.2 units of the last digit
  CHECK(exact - number(text) < 3 * printed_to(text));
  constexpr double h = 0.005;
  OperatingPoint ahead = at, behind = at;
  ahead.x[1] += h;
  behind.x[1] -= h;
  const VectorXd slope = (evaluate(m, ahead).rates - evaluate(m, behind).rates) / (2 * h);
  check_printed(slope[0], text);  // its error: mostly the weight's, g h²/6
}

TEST_CASE("the printed matrix and the model's have the same modes") {
  const auto book = printed().at("linear");
  MatrixXd A(4, 4), rounding(4, 4);
  for (Index i = 0; i < 4; ++i)
    for (Index j = 0; j < 4; ++j) {
      const std::string text = book.at("A")[std::size_t(i)][std::size_t(j)];
      A(i, j) = number(text);
      rounding(i, j) = A(i, j) == 0 || A(i, j) == 1 ? 0 : 3 * printed_to(text);
    }
  const Modes theirs = modes(A, rounding);
  const Modes ours = modes(linearize(f16::longitudinal(), level(502, 0.35).point));
  CHECK(theirs.verdict == Verdict::unstable);
  for (const Mode& mode : theirs.modes) {
    double nearest = INFINITY;
    for (const Mode& own : ours.modes)
      nearest = std::min(nearest, std::abs(own.eigenvalue - mode.eigenvalue));
    CHECK(nearest <= mode.error);
    CHECK(mode.error < 0.01);
  }
}

TEST_CASE("at an entry of its tables a slope is one-sided, and the table is named") {
  const Model m = f16::longitudinal();
  const TrimSpec spec{.free = {"V", "theta", "power", "throttle", "elevator"},
                      .steady = {"V", "alpha", "q", "power"},
                      .bounds = {{"gamma", {0, 0}}, {"alpha", {5 * degree, 5 * degree}}}};
  VectorXd x(5);
  x << 380, 5 * degree, 5 * degree, 0, 7;
  const TrimResult r = trim(m, spec, {x, Eigen::Vector2d{0.1, 0}, Eigen::Vector2d{0, 0.35}});
  REQUIRE(r);
  const LinearModel lin = linearize(m, r.point);
  REQUIRE(lin);
  REQUIRE(lin.remarks.size() == 1);
  CAPTURE(lin.remarks[0]);
  CHECK(lin.remarks[0].find("an entry of the tables over alpha") != std::string::npos);
  const auto pitch = [&](double step) {  // linear tables: any step within an interval is exact
    OperatingPoint aside = r.point;
    aside.x[1] += step;
    return (evaluate(m, aside).rates[3] - r.rates[3]) / step;
  };
  const double above = pitch(0.01), below = pitch(-0.01);
  CHECK(std::abs(above - below) > 0.1);
  CHECK_NEAR(lin.A(3, 1), lin.remarks[0].find("above") != std::string::npos ? above : below, 1e-6);
}

TEST_CASE("where the centre of gravity makes it unstable, by a map and by a branch") {
  const Model m = f16::longitudinal();
  const OperatingPoint ahead = level(502, 0.30).point;
  const std::vector<double> values = {0.30, 0.32, 0.34, 0.36, 0.38, 0.40};
  const SweepMap map = sweep({{"502 ft/s", m, level_flight, ahead, {}}},
                             {{"xcg", {{"xcg", "", "xcg", values, values}}}});
  for (const std::int8_t status : map.status) CHECK(TrimStatus(status) == TrimStatus::converged);
  REQUIRE(map.crossings.size() == 1);
  CHECK(map.crossings[0].unstable_before == 0);
  CHECK(map.crossings[0].unstable_after == 1);
  const Branch aft = follow(m, level_flight, ahead, "xcg", 0.36);
  REQUIRE(aft.end == BranchEnd::reached);
  REQUIRE(aft.events.front().kind == EventKind::zero);
  CHECK_NEAR(aft.events.front().at.parameter, map.crossings[0].at[0], 1e-7);
}

TEST_CASE("a branch that ends at an entry of a table names it") {
  const Model m = f16::longitudinal();
  const Branch slower = follow(m, level_flight, level(502, 0.35).point, "V", 170);
  CHECK(slower.end == BranchEnd::switched);
  CHECK(slower.message.find("an entry of the tables over alpha") != std::string::npos);
  CHECK_NEAR(slower.points.back().point.x[1], 5 * degree, 1e-6);
}

TEST_CASE("beyond its ends a table goes on as in its last interval; the engine's lag") {
  CHECK_NEAR(f16::between(f16::C_z, f16::at_alpha(50)), -2.210, 1e-12);
  CHECK_NEAR(f16::between(f16::C_z, f16::at_alpha(-12)), 0.770 + 0.4 * (0.770 - 0.241), 1e-12);
  CHECK_NEAR(f16::thrust(100, 0, 1.2), 28886 + (28886 - 26070), 1e-9);
  CHECK_NEAR(f16::thrust(0, 5000, 0.1), (1060 + 670 + 635 + 425) / 4.0, 1e-9);
  CHECK_NEAR(f16::power_rate(20, 90), (1.9 - 0.036 * 40) * 40, 1e-12);  // towards 60
  CHECK_NEAR(f16::power_rate(60, 30), 5.0 * (40 - 60), 1e-12);
  CHECK_NEAR(f16::power_rate(60, 80), 5.0 * (80 - 60), 1e-12);
  CHECK_NEAR(f16::power_rate(10, 30), 1.0 * (30 - 10), 1e-12);
}

}  // namespace f16_test
