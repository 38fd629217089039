// Look-up tables in formulas: laws of the interpolation, slopes, ranges, what is no table, and the
// F-16's published tables against the same model in C++.
#include <cmath>
#include <fstream>
#include <functional>
#include <nlohmann/json.hpp>
#include <random>
#include <stdexcept>

#include "examples/f16.hpp"
#include "model/branches.hpp"
#include "model/formula.hpp"
#include "model/formula_check.hpp"
#include "model/formula_ranges.hpp"
#include "model/formulas.hpp"
#include "model/jet.hpp"
#include "study/problems.hpp"
#include "study/study.hpp"
#include "study/user_model.hpp"
#include "tests/check.hpp"
#include "tests/quadratics.hpp"

using namespace tiltrim;
using Eigen::VectorXd;

namespace formula_table_test {

namespace {

const VectorXd none(0);
const std::vector<double> uneven{-2, -1.5, 0.25, 1, 2.5, 4}, few{0, 2, 5};

LookupTable table_of(std::string name, std::vector<std::vector<double>> at, bool smooth,
                     const std::function<double(double, double)>& value) {
  LookupTable table{std::move(name), std::move(at), {}, smooth};
  for (const double x : table.at[0])
    for (const double y : table.at.size() > 1 ? table.at[1] : std::vector<double>{0})
      table.values.push_back(value(x, y));
  return table;
}

double wavy(double x, double y) { return std::sin(1.3 * x) + y * std::cos(x) - 0.3 * y * y; }

// A linear and a smooth table of one argument and of two.
const std::vector<LookupTable> tables{
    table_of("line", {uneven}, false, wavy), table_of("curve", {uneven}, true, wavy),
    table_of("plane", {uneven, few}, false, wavy), table_of("sheet", {uneven, few}, true, wavy)};

// x' = the formula, of states a and b.
Model rate_of(const std::string& text, const std::vector<LookupTable>& with = tables) {
  return model_of({.name = "m",
                   .states = {{"a", ""}, {"b", ""}},
                   .inputs = {},
                   .outputs = {},
                   .parameters = {},
                   .rates = {text, "0"},
                   .tables = with});
}

double value_of(const Model& m, double a, double b = 0) {
  return m.f(Eigen::Vector2d{a, b}, none, none)[0];
}

Eigen::RowVector2d slopes_of(const Model& m, double a, double b) {
  return m.derivatives({Eigen::Vector2d{a, b}, none, none}, {0, 1}).row(0);
}

bool says(const std::string& message, std::string_view words) {
  return message.find(words) != std::string::npos;
}

}  // namespace

TEST_CASE("every entry is met, in one argument, two and three") {
  for (const char* text : {"line(a)", "curve(a)"}) {
    const Model m = rate_of(text);
    for (const double at : uneven) CHECK_NEAR(value_of(m, at), wavy(at, 0), 1e-15);
  }
  for (const char* text : {"plane(a, b)", "sheet(a, b)"}) {
    const Model m = rate_of(text);
    for (const double at : uneven)
      for (const double over : few) CHECK_NEAR(value_of(m, at, over), wavy(at, over), 1e-14);
  }
  const LookupTable cube{"cube", {{0, 1}, {0, 1}, {0, 1}}, {1, 2, 3, 4, 5, 6, 7, 8}, false};
  const Model m = rate_of("cube(a, b, 1) - 10*cube(1 - a, b, 0)", {cube});
  CHECK(value_of(m, 0, 0) == 2 - 50);
  CHECK(value_of(m, 1, 0) == 6 - 10);
  CHECK(value_of(m, 1, 1) == 8 - 30);
  CHECK_NEAR(value_of(m, 0.5, 0.25), (2 + 6) / 2.0 + 0.5 - 10 * ((1 + 5) / 2.0 + 0.5), 1e-13);
}

TEST_CASE("between entries: linear, and cubics that keep parabolas and converge by the cube") {
  const Model line = rate_of("line(a)"), plane = rate_of("plane(a, b)");
  CHECK_NEAR(value_of(line, 0.5), wavy(0.25, 0) / 1.5 + wavy(1, 0) / 3, 1e-15);
  CHECK_NEAR(value_of(plane, 0.625, 3),
             (wavy(0.25, 2) + wavy(1, 2)) / 3 + (wavy(0.25, 5) + wavy(1, 5)) / 6, 1e-14);
  const auto parabolic = [](double x, double y) { return 1 - x + 3 * x * x + x * x * y - y * y; };
  const Model m = rate_of("p(a, b)", {table_of("p", {uneven, few}, true, parabolic)});
  std::mt19937_64 draw(3);
  std::uniform_real_distribution<double> a(-2, 4), b(0, 5);
  for (int i = 0; i < 100; ++i) {
    const double x = a(draw), y = b(draw);
    CHECK_NEAR(value_of(m, x, y), parabolic(x, y), 1e-12);
    CHECK_NEAR(slopes_of(m, x, y)[0], -1 + 6 * x + 2 * x * y, 1e-11);
    CHECK_NEAR(slopes_of(m, x, y)[1], x * x - 2 * y, 1e-11);
  }
  const auto error = [&](int n) {
    std::vector<double> at;
    for (int i = 0; i <= n; ++i) at.push_back(-2 + 6.0 * i / n);
    const Model fine = rate_of("c(a)", {table_of("c", {at}, true, wavy)});
    double most = 0;
    for (double x = -1.99; x < 4; x += 0.0137)
      most = std::max(most, std::abs(value_of(fine, x) - wavy(x, 0)));
    return most;
  };
  CHECK(std::log2(error(40) / error(80)) > 2.8);
}

TEST_CASE(
    "slopes are exact; at a kink of a linear table they are in doubt, of a cubic continuous") {
  for (const char* text : {"line(a)*b", "curve(a)*b", "plane(a, b)", "sheet(a, b)^2"}) {
    CAPTURE(text);
    const Model m = rate_of(text);
    constexpr double h = 1e-5;
    for (const double a : {-1.9, 0.1, 0.7, 3.3})
      for (const double b : {0.3, 2.5}) {
        const Eigen::RowVector2d slopes = slopes_of(m, a, b);
        CHECK_NEAR(slopes[0], (value_of(m, a + h, b) - value_of(m, a - h, b)) / (2 * h), 1e-8);
        CHECK_NEAR(slopes[1], (value_of(m, a, b + h) - value_of(m, a, b - h)) / (2 * h), 1e-8);
      }
  }
  CHECK(std::isnan(slopes_of(rate_of("line(a)"), 0.25, 0)[0]));
  CHECK(slopes_of(rate_of("line(a)"), 0.25, 0)[1] == 0);
  CHECK(std::isnan(slopes_of(rate_of("plane(a, b)"), 0, 2)[1]));
  for (const double at : {-1.5, 0.25, 1.0, 2.5})
    CHECK_NEAR(slopes_of(rate_of("curve(a)"), at, 0)[0],
               slopes_of(rate_of("curve(a)"), std::nextafter(at, -9), 0)[0], 1e-12);
  CHECK_FALSE(slopes_of(rate_of("line(a)"), -2, 0).hasNaN());  // of an end, that from within
}

TEST_CASE("the slope of a plateau is zero, and that of nearly equal entries has all its digits") {
  const std::vector<double> at{0, 0.1, 0.3, 0.7, 1.1};
  for (const bool smooth : {false, true}) {
    const Model flat = rate_of(
        "flat(a)", {table_of("flat", {at}, smooth, [](double, double) { return 101325.3; })});
    // In the density alone: nothing of the Mach number, however the first varies.
    const auto density = [](double x, double) { return 1e5 * std::exp(-x / 3); };
    const Model layered = rate_of("layer(a, b)", {table_of("layer", {at, few}, smooth, density)});
    const auto mach = [](double, double y) { return 1e5 * std::exp(-y / 3); };
    const Model other = rate_of(
        "layer(b, a)",
        {table_of("layer", {few, at}, smooth, [&](double x, double y) { return mach(y, x); })});
    for (double a = 0.0137; a < 1.1; a += 0.07) {
      CHECK(slopes_of(flat, a, 0)[0] == 0);
      CHECK(value_of(flat, a) == 101325.3);
      CHECK(slopes_of(layered, a, 1.7)[1] == 0);
      CHECK(slopes_of(other, a, 1.7)[0] == 0);
    }
  }
  const LookupTable steep{"steep", {{0, 0.3, 0.7}}, {1e6, 1000000.001, 1000000.002}, false};
  const double rise = 1000000.001 - 1e6;  // exact
  const Model m = rate_of("steep(a)", {steep});
  CHECK_NEAR(slopes_of(m, 0.1, 0)[0] / (rise / 0.3), 1, 1e-15);
}

TEST_CASE("outside its entries a table has no value, and says so") {
  const auto thrown = [](const std::string& text, double a, double b = 0) {
    try {
      (void)value_of(rate_of(text), a, b);
    } catch (const std::domain_error& e) {
      return std::string(e.what());
    }
    return std::string();
  };
  CHECK(thrown("line(a)", 4.5) ==
        "the table 'line' has no value at argument = 4.5; it covers -2 to 4");
  CHECK(thrown("sheet(a, b)", 1, -0.1) ==
        "the table 'sheet' has no value at argument 2 = -0.1; it covers 0 to 5");
  CHECK(says(thrown("line(a)", 4.0000001), "argument = 4.0000001; it covers -2 to 4"));
  CHECK(thrown("line(a)", INFINITY) != "");
  CHECK(thrown("a < 4 ? line(a) : 7", 4.5) == "");  // only the branch taken counts
  CHECK(thrown("line(min(a, 4))", 4.5) == "");
  CHECK(thrown("line(a)", std::nextafter(4, 5)) == "");  // rounding
  CHECK(std::isnan(value_of(rate_of("plane(1, a)"), NAN)));
}

TEST_CASE("ranges contain every value, and shrink with the box") {
  std::mt19937_64 draw(5);
  std::uniform_real_distribution<double> any(0, 1);
  for (const char* text : {"line(a)", "curve(a)", "plane(a, b)", "sheet(a, b)"}) {
    CAPTURE(text);
    const Model m = rate_of(text);
    for (int i = 0; i < trials(300); ++i) {
      const double width = std::pow(10, -4 * any(draw));
      const double a = -2 + (6 - 5.9 * width) * any(draw), b = (5 - 4.9 * width) * any(draw);
      const Range box[] = {{a, a + 5.9 * width}, {b, b + 4.9 * width}};
      const Range row = m.enclosure({box[0], box[1]})[0];
      for (int k = 0; k < 20; ++k) {
        const double value = value_of(m, box[0].lower + any(draw) * 5.9 * width,
                                      box[1].lower + any(draw) * 4.9 * width);
        REQUIRE(row.lower <= value + 1e-13);
        REQUIRE(value <= row.upper + 1e-13);
      }
      REQUIRE(row.upper - row.lower < 100 * width + 3000 * width * width);
    }
    CHECK(std::isnan(m.enclosure({{0, 4.1}, {0, 1}})[0].lower));
  }
  const Range whole = rate_of("line(a)").enclosure({{-2, 4}, {0, 0}})[0];
  CHECK_NEAR(whole.upper, std::sin(1.3), 1e-12);  // the largest entry
}

TEST_CASE("on ranges with derivatives: smooth tables across their entries, kinks as switches") {
  using Exact = DualOf<long double, 2>;
  std::mt19937_64 draw(7);
  std::uniform_real_distribution<double> any(-1, 1);
  for (const char* text :
       {"curve(a)", "sheet(a, b)*b", "sheet(a, 2)", "sheet(1, b)", "line(a)*b", "plane(a, b)"}) {
    CAPTURE(text);
    const Model model = rate_of(text);
    const formula::Tape tape = formula::compile(text, {{"a", 0}, {"b", 1}}, tables);
    int known = 0;
    for (int i = 0; i < trials(300); ++i) {
      const double r = 0.4 * std::abs(any(draw)), s = 0.4 * std::abs(any(draw));
      const double a = 1 + 2.5 * any(draw), b = 2.5 + 2 * any(draw);
      Branches sides;
      const BranchScope scope(sides);
      const Jet form =
          model.jets({Jet::number(a, r, 0, 2).unknown(0, 2), Jet::number(b, s, 1, 2).unknown(1, 2)},
                     {}, {})[0];
      if (sides.blocked) continue;  // an unknown may cross a kink
      REQUIRE(form.known());
      ++known;
      for (int k = 0; k < 10; ++k) {
        const long double d = any(draw), e = any(draw);
        formula::Evaluator<Exact> evaluate(2, tape.depth, tables);
        evaluate[0] = a + r * d;
        evaluate[1] = b + s * e;
        for (Eigen::Index n : {0, 1}) evaluate[std::size_t(n)].slopes[n] = 1;
        const Exact exact = evaluate(tape);
        REQUIRE(contains(form.value(), d, e, exact.value));
        REQUIRE(contains(form.slope(0), d, e, exact.slopes[0]));
        REQUIRE(contains(form.slope(1), d, e, exact.slopes[1]));
      }
    }
    const bool smooth = text[0] == 'c' || text[0] == 's';
    CHECK(known >= (smooth ? trials(300) : trials(300) / 5));
  }
}

TEST_CASE("calls that are none") {
  const auto refused = [](const std::string& text) {
    return refusal([&] { check_formula(text, {"alpha"}, tables); });
  };
  CHECK(refused("2*plane(alpha, line(alpha))^2") == "");
  CHECK(refused("line(alpha, 2)") == "too many arguments for line at character 14");
  CHECK(refused("plane(alpha)") == "too few arguments for plane at character 12");
  CHECK(refused("line()") == "too few arguments for line at character 6");
  CHECK(refused("2*line") == "'line' at character 3 has no arguments; expected line(...)");
  CHECK(says(refused("lines(alpha)"), "did you mean 'line'?"));
  CHECK(says(refused("alpha(2)"), "'(' at character 6 is not allowed there"));
}

TEST_CASE("what is no table") {
  const auto refused = [](const std::function<void(LookupTable&)>& spoil) {
    LookupTable table = tables[2];
    spoil(table);
    return refusal([&] { (void)rate_of("1", {table}); });
  };
  CHECK(refused([](LookupTable&) {}) == "");
  CHECK(refused([](LookupTable& t) { t.name = "sin"; }) ==
        "'sin' has another meaning in formulas; expected another name");
  CHECK(refused([](LookupTable& t) { t.name = "a"; }) == "'a' occurs twice");
  CHECK(says(refused([](LookupTable& t) { t.at.clear(); }), "0 arguments; expected 1 to 3"));
  CHECK(says(refused([](LookupTable& t) { t.at[1] = {1}; }), "fewer than two entries"));
  CHECK(says(refused([](LookupTable& t) { t.at[1][2] = 2; }), "not finite and rising"));
  CHECK(
      says(refused([](LookupTable& t) { t.values.pop_back(); }), "17 values for 18 combinations"));
  CHECK(says(refused([](LookupTable& t) { t.values[3] = NAN; }), "a value is not finite"));
  CHECK(refusal([] { (void)rate_of("1", {tables[0], tables[0]}); }) == "'line' occurs twice");
}

TEST_CASE("the F-16's study is the F-16 of examples/") {
  const Study study = load_study(TILTRIM_SOURCE_DIR "/studies/f16.toml");
  const Model& ours = study.user_model->model;
  const Model book = f16::longitudinal();
  std::mt19937_64 draw(11);
  std::uniform_real_distribution<double> any(0, 1);
  const auto within = [&](double low, double high) { return low + (high - low) * any(draw); };
  for (int i = 0; i < 1000; ++i) {
    VectorXd x(5);
    x << within(150, 900), within(-0.17, 0.78), within(-1, 1), within(-1, 1), within(0, 100);
    const Eigen::Vector2d u{within(0, 1), within(-24, 24)}, p{within(0, 45000), within(0.3, 0.4)};
    const VectorXd rates = ours.f(x, u, p) - book.f(x, u, p), y = ours.h(x, u, p) - book.h(x, u, p);
    CHECK_NEAR(rates.cwiseAbs().maxCoeff(), 0, 1e-10);
    CHECK_NEAR(y.cwiseAbs().maxCoeff(), 0, 1e-11);
    for (std::size_t k = 0; k < book.switches.size(); ++k) {
      const OperatingPoint point{x, u, p};
      const double distance = book.switches[k].distance(point);
      CHECK_NEAR(ours.switches[k].distance(point), distance, 1e-9 * (1 + std::abs(distance)));
    }
  }
}

TEST_CASE("trims of the F-16's study have the book's printed digits") {
  const Study study = load_study(TILTRIM_SOURCE_DIR "/studies/f16.toml");
  std::ifstream file(TILTRIM_SOURCE_DIR "/data/references/f16.json");
  const nlohmann::json printed_trims = nlohmann::json::parse(file).at("balance").at("rows");
  int compared = 0;
  for (const auto& row : printed_trims) {
    const std::string xcg = row[0];
    for (const Condition& condition : study.conditions) {
      if (condition.name != fmt::format("level, {} c", xcg)) continue;
      const Answer level = answer(study.vehicle, condition);
      REQUIRE(level.has_equilibrium());
      const OperatingPoint& at = level.trim.point;
      const double found[] = {at.u[0], at.x[1], at.u[1]};
      for (std::size_t k = 0; k < 3; ++k) {
        const std::string printed = row[k + 1];
        CHECK_NEAR(found[k], std::stod(printed), printed_to(printed));
        ++compared;
      }
    }
  }
  CHECK(compared == 6);
}

}  // namespace formula_table_test
