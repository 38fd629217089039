// Formulas against <cmath>, and messages for invalid ones.
#include "model/formulas.hpp"

#include <bit>
#include <cmath>
#include <functional>
#include <limits>
#include <numbers>
#include <stdexcept>
#include <thread>

#include "model/formula_check.hpp"
#include "tests/check.hpp"

using Eigen::VectorXd;
using namespace tiltrim;

namespace formulas_test {

using ::refusal;

namespace {

constexpr double a = 0.37, b = 2.9;
const VectorXd none(0);

// x' = the formula, of states a and b.
Model model_with(const std::string& text) {
  return model_of({.name = "m",
                   .states = {{"a", ""}, {"b", ""}},
                   .inputs = {},
                   .outputs = {},
                   .parameters = {},
                   .rates = {text, "0"}});
}

double value_of(const std::string& text, double at_a = a, double at_b = b) {
  return model_with(text).f(Eigen::Vector2d{at_a, at_b}, none, none)[0];
}

std::string refusal(const std::string& text) {
  return ::refusal([&] { check_formula(text, {"alpha", "beta", "thrust"}); });
}

bool says(const std::string& message, std::string_view words) {
  return message.find(words) != std::string::npos;
}

// Two states, an input, two parameters, values in between, two outputs and a switch.
Formulas pendulum() {
  return {.name = "pendulum",
          .states = {{"angle", "rad", 0.1}, {"rate", "rad/s", 0.1}},
          .inputs = {{"torque", "N m", 1.0}},
          .outputs = {{"height", "m", 1.0}, {"pull", "N", 1.0}},
          .parameters = {{"mass", "kg", 1.0}, {"length", "m", 1.0}},
          .let = {{"inertia", "mass*length^2"}, {"weight", "9.81*mass"}},
          .rates = {"rate", "(torque - weight*length*sin(angle))/inertia"},
          .values = {"-length*cos(angle)", "weight*cos(angle) + mass*length*rate^2"},
          .switches = {{"upright", "cos(angle)"}}};
}

}  // namespace

TEST_CASE("every function is that of the field") {
  struct Row {
    const char* name;
    double (*function)(double);
    double at;
  };
  const Row rows[] = {{"sin", std::sin, a},     {"cos", std::cos, a},     {"tan", std::tan, a},
                      {"asin", std::asin, a},   {"acos", std::acos, a},   {"atan", std::atan, b},
                      {"sinh", std::sinh, b},   {"cosh", std::cosh, b},   {"tanh", std::tanh, a},
                      {"asinh", std::asinh, b}, {"acosh", std::acosh, b}, {"atanh", std::atanh, a},
                      {"exp", std::exp, b},     {"ln", std::log, b},      {"log10", std::log10, b},
                      {"sqrt", std::sqrt, b},   {"cbrt", std::cbrt, -b},  {"abs", std::fabs, -b}};
  for (const Row& row : rows) {
    CAPTURE(row.name);
    CHECK(value_of(fmt::format("{}(a)", row.name), row.at) == row.function(row.at));
  }
  CHECK(value_of("atan2(a, -b)") == std::atan2(a, -b));
  CHECK(value_of("hypot(a, b)") == std::hypot(a, b));
  CHECK(value_of("min(b, a, 3)") == a);
  CHECK(value_of("max(a, b, -3)") == b);
  CHECK(value_of("min(a)") == a);
  CHECK(value_of("sign(a)") == 1);
  CHECK(value_of("sign(-a)") == -1);
  CHECK(value_of("sign(a)", 0) == 0);
  CHECK(value_of("pi") == std::numbers::pi);
  CHECK(formula_functions().size() == std::size(rows) + 5);
}

TEST_CASE("no argument that is NaN is lost") {
  for (const char* text : {"min(0/0, a)", "min(a, 0/0)", "min(a, 0/0, b)", "max(0/0, a)",
                           "max(a, 0/0)", "max(a, 0/0, b)", "sign(0/0)", "abs(0/0)", "0*(a/0)",
                           "sqrt(-a)", "(-a)^0.5", "ln(-a)", "acos(b)"}) {
    CAPTURE(text);
    CHECK(std::isnan(value_of(text)));
  }
  CHECK(value_of("a/0") == std::numeric_limits<double>::infinity());
  CHECK(value_of("-a/0") == -std::numeric_limits<double>::infinity());
}

TEST_CASE("operators and what binds before what") {
  struct Row {
    const char* text;
    double value;
  };
  const Row rows[] = {{"1 + 2*3", 7},
                      {"(1 + 2)*3", 9},
                      {"1 - 2 - 3", -4},
                      {"8/4/2", 1},
                      {"8/(4/2)", 4},
                      {"-2^2", -4},
                      {"(-2)^2", 4},
                      {"2^3^2", 512},
                      {"2^-1", 0.5},
                      {"2*-3", -6},
                      {"+3 - -3", 6},
                      {"2*3^2", 18},
                      {"1e3 + .5 + 2.", 1002.5},
                      {"1.5e-3*1E+3", 1.5},
                      {"1 < 2", 1},
                      {"2 < 1", 0},
                      {"2 <= 2", 1},
                      {"3 >= 4", 0},
                      {"1 == 1", 1},
                      {"1 != 1", 0},
                      {"1 + 1 > 1", 1},
                      {"1 || 0 && 0", 1},
                      {"(1 || 0) && 0", 0},
                      {"1 < 2 && 2 < 3", 1},
                      {"1 > 2 ? 3 : 4", 4},
                      {"0 ? 1 : 0 ? 2 : 3", 3},
                      {"1 ? 0 ? 1 : 2 : 3", 2},
                      {"1 + (2 > 1 ? 10 : 20)", 11},
                      {"2\n * (1\t+ 2)\n", 6}};
  for (const Row& row : rows) {
    CAPTURE(row.text);
    CHECK(value_of(row.text) == row.value);
  }
  CHECK(value_of("a + b*a - b/a") == doctest::Approx(a + b * a - b / a).epsilon(1e-15));
  CHECK_NEAR(value_of("a^b"), std::pow(a, b), 1e-16);
  CHECK(value_of("a < 0 ? sqrt(a) : -1") == -1);  // the branch not taken gives no NaN
}

TEST_CASE("a name not known is said with the nearest and with all") {
  CHECK(refusal("alpha*beta - thrust") == "");
  const std::string slip = refusal("2*alpah + 1");
  CHECK(says(slip, "'alpah' at character 3 is not a known name; did you mean 'alpha'?"));
  CHECK(says(slip, "there are: alpha, beta, thrust, sin, cos, "));
  CHECK(slip.ends_with("min, max, pi"));
  CHECK(says(refusal("log(alpha)"), "did you mean 'ln' or 'log10'?"));
  CHECK(says(refusal("sinn(alpha)"), "did you mean 'sin'?"));
  CHECK_FALSE(says(refusal("qwertyuiop"), "did you mean"));
  for (const char* other : {"e", "_pi", "rint(1)", "sum(1, 2)", "avg(1, 2)", "log2(1)", "ans"}) {
    CAPTURE(other);
    CHECK(says(refusal(other), "is not a known name;"));
  }
}

TEST_CASE("what is no formula is said with its place") {
  struct Row {
    const char *text, *words;
  };
  const Row rows[] = {{"alpha = 1", "has a single =, which would assign; expected == to compare"},
                      {"alpha += 1", "single ="},
                      {"alpha == 1 ? beta = 2 : 3", "single ="},
                      {"(alpha + 1", "a closing parenthesis is missing"},
                      {"1 + alpha)", "')' at character 10 is not allowed there"},
                      {"sin alpha", "'sin' at character 1 has no arguments; expected sin(...)"},
                      {"alpha**2", "'**' at character 6 is no operator; expected ^ for a power"},
                      {"sin()", "too few arguments for sin at character 5"},
                      {"sin(1, 2)", "too many arguments for sin"},
                      {"atan2(alpha)", "too few arguments for atan2"},
                      {"atan2(alpha, 1, 2)", "too many arguments for atan2"},
                      {"min()", "too few arguments for min"},
                      {"1, 2", "has 2 values; expected one formula"},
                      {"(1, 2)", "has a comma outside of a function's arguments"},
                      {"1 +", "ends where a value is expected"},
                      {"", "ends where a value is expected"},
                      {" \n", "ends where a value is expected"},
                      {"2alpha", "'alpha' at character 2 is not allowed there"},
                      {"alpha beta", "'beta' at character 7 is not allowed there"},
                      {"alpha* *2", "'*' at character 8 is not allowed there"},
                      {"--alpha", "'-' at character 2 is not allowed there"},
                      {"1.2.3", "'.3' at character 4 is not allowed there"},
                      {"1e", "'1e' at character 1 is not a number"},
                      {"1e400", "'1e400' at character 1 is not a number"},
                      {"alpha ? 1", "has a ? without a : or a : without a ?; expected a ? b : c"},
                      {"1 : 2", "has a ? without a : or a : without a ?;"},
                      {"!alpha", "'!alpha' at character 1 has no meaning here; expected + - * /"},
                      {"alpha % 2", "'% 2' at character 7 has no meaning here"},
                      {"alpha & 1", "has no meaning here"},
                      {"1; 2", "has no meaning here"},
                      {"alpha²", "'²' at character 6 has no meaning here"},
                      {"'alpha'", "has no meaning here"},
                      {"\"alpha\"", "has text in quotes; expected numbers, names and functions"},
                      {"\"alpha", "has text in quotes"}};
  for (const Row& row : rows) {
    const std::string message = refusal(row.text);
    CAPTURE(row.text);
    CAPTURE(message);
    CHECK(says(message, row.words));
  }
}

TEST_CASE("long and deep formulas are evaluated or refused, whatever they are made of") {
  const auto repeated = [](const std::string& part, int count) {
    std::string text;
    for (int i = 0; i < count; ++i) text += part;
    return text;
  };
  CHECK(value_of(repeated("(", 6000) + "a" + repeated(")", 6000)) == a);
  CHECK(value_of(repeated("-(", 6000) + "a" + repeated(")", 6000)) == a);
  CHECK(value_of(repeated("cos(", 3000) + "0.7390851332151607" + repeated(")", 3000)) ==
        doctest::Approx(0.7390851332151607).epsilon(1e-15));
  CHECK(value_of(repeated("a ? ", 2000) + "b" + repeated(" : 0", 2000)) == b);
  CHECK(value_of("1" + repeated(" + 1", 4000)) == 4001);
  for (const char* part : {"(", "-(", "sin(", "1 ? ", "1^", "1 - "}) {
    CAPTURE(part);
    CHECK(says(refusal(repeated(part, 200'000) + "1"), "characters long; expected at most 20000"));
    CHECK(refusal(repeated(part, 4000)) != "");
  }
  CHECK(refusal(repeated("(", 200'000) + "1" + repeated(")", 200'000)) ==
        "400001 characters long; expected at most 20000");
}

TEST_CASE("names") {
  const auto named = [](const std::string& name) {
    return refusal([&] { check_formula_name(name); });
  };
  for (const char* good : {"x", "_", "x1", "Long_Name_2", "e", "E3", "sine", "log"}) {
    CAPTURE(good);
    CHECK(named(good) == "");
  }
  for (const char* bad : {"", "1x", "a b", "a.b", "a-b", "é", "a\n", "x'"}) {
    CAPTURE(bad);
    CHECK(says(named(bad), "expected letters, digits and _, not starting with a digit"));
  }
  for (const std::string& function : formula_functions()) {
    CAPTURE(function);
    CHECK(named(function) ==
          fmt::format("'{}' has another meaning in formulas; expected another name", function));
  }
  CHECK(says(named("pi"), "has another meaning"));
  CHECK(named(std::string(100, 'n')) == "");
  CHECK(says(named(std::string(101, 'n')), "101 characters long; expected at most 100"));
}

TEST_CASE("a model: states, inputs, parameters, what stands between, outputs, switches") {
  const Model m = model_of(pendulum());
  CHECK(m.name == "pendulum");
  const Eigen::Vector2d x{0.3, -0.7}, p{1.7, 0.8};
  const VectorXd u = VectorXd::Constant(1, 2.5);
  const double inertia = 1.7 * 0.8 * 0.8, weight = 9.81 * 1.7;
  const VectorXd rates = m.f(x, u, p);
  REQUIRE(rates.size() == 2);
  CHECK(rates[0] == -0.7);
  CHECK_NEAR(rates[1], (2.5 - weight * 0.8 * std::sin(0.3)) / inertia, 1e-14);
  const VectorXd y = m.h(x, u, p);
  REQUIRE(y.size() == 2);
  CHECK_NEAR(y[0], -0.8 * std::cos(0.3), 1e-15);
  CHECK_NEAR(y[1], weight * std::cos(0.3) + 1.7 * 0.8 * 0.49, 1e-13);
  REQUIRE(m.switches.size() == 1);
  CHECK(m.switches[0].name == "upright");
  CHECK(m.switches[0].distance({x, u, p}) == std::cos(0.3));
  const Model copy = m;
  CHECK(copy.f(x, u, p) == rates);
}

TEST_CASE("a model without outputs has none") {
  Formulas f = pendulum();
  f.outputs.clear();
  f.values.clear();
  CHECK_FALSE(model_of(f).h);
}

TEST_CASE("what is no model") {
  struct Row {
    std::function<void(Formulas&)> spoil;
    const char* words;
  };
  const Row rows[] = {
      {[](Formulas& f) { f.rates.pop_back(); }, "1 formulas for 2 states"},
      {[](Formulas& f) { f.values.emplace_back("1"); }, "3 formulas for 2 outputs"},
      {[](Formulas& f) { f.states[1].name = "angle"; }, "'angle' occurs twice"},
      {[](Formulas& f) { f.inputs[0].name = "angle"; }, "'angle' occurs twice"},
      {[](Formulas& f) { f.parameters[0].name = "torque"; }, "'torque' occurs twice"},
      {[](Formulas& f) { f.let[0].name = "mass"; }, "'mass' occurs twice"},
      {[](Formulas& f) { f.let[1].name = "inertia"; }, "'inertia' occurs twice"},
      {[](Formulas& f) { f.let[1].name = "sin"; }, "'sin' has another meaning in formulas;"},
      {[](Formulas& f) { f.states[0].name = "1st"; }, "'1st' cannot be a name in a formula;"},
      {[](Formulas& f) { f.let[0].text = "weight"; },
       "'weight' at character 1 is not a known name;"},
      {[](Formulas& f) { f.let[0].text = "inertia"; },
       "'inertia' at character 1 is not a known name;"},
      {[](Formulas& f) { f.rates[0] = "height"; }, "'height' at character 1 is not a known name;"},
      {[](Formulas& f) { f.values[0] = "t"; }, "'t' at character 1 is not a known name;"},
      {[](Formulas& f) { f.switches[0].text = "angle <"; }, "ends where a value is expected"},
      {[](Formulas& f) { f.states[0].nominal = 0; }, "angle"}};
  for (const Row& row : rows) {
    Formulas f = pendulum();
    row.spoil(f);
    const std::string message = refusal([&] { (void)model_of(f); });
    CAPTURE(row.words);
    CAPTURE(message);
    CHECK(says(message, row.words));
  }
  CHECK_NOTHROW((void)model_of(pendulum()));
}

TEST_CASE("eight threads at once get the bits that one gets") {
  const Model m = model_of(pendulum());
  const auto bits_at = [&](int i) {
    const Eigen::Vector2d x{0.001 * i, std::sin(i)}, p{1 + 0.01 * i, 0.5};
    const VectorXd u = VectorXd::Constant(1, std::cos(i));
    return std::bit_cast<std::uint64_t>(m.f(x, u, p)[1]) ^
           std::bit_cast<std::uint64_t>(m.h(x, u, p)[1]) ^
           std::bit_cast<std::uint64_t>(m.switches[0].distance({x, u, p}));
  };
  constexpr int count = 2000, threads = 8;
  std::vector<std::uint64_t> alone;
  for (int i = 0; i < count; ++i) alone.push_back(bits_at(i));
  std::vector<std::vector<std::uint64_t>> together(threads);
  {
    std::vector<std::jthread> running;
    for (auto& own : together)
      running.emplace_back([&] {
        for (int i = 0; i < count; ++i) own.push_back(bits_at(i));
      });
  }
  for (const auto& own : together) CHECK(own == alone);
}

}  // namespace formulas_test
