// Formulas on ranges: that they contain values and slopes, and what they leave open.
#include <random>

#include "model/branches.hpp"
#include "model/formula.hpp"
#include "model/formulas.hpp"
#include "model/jet.hpp"
#include "tests/check.hpp"
#include "tests/quadratics.hpp"

using namespace tiltrim;

namespace formula_jets_test {

namespace {

Model rate_of(const std::string& text) {
  return model_of({.name = "m",
                   .states = {{"a", ""}, {"b", ""}},
                   .inputs = {},
                   .outputs = {},
                   .parameters = {},
                   .rates = {text, "0"}});
}

// a and b within their radii as unknowns.
std::vector<Jet> around(double a, double b, double radius_a, double radius_b) {
  return {Jet::number(a, radius_a, 0, 2).unknown(0, 2),
          Jet::number(b, radius_b, 1, 2).unknown(1, 2)};
}

// What blocked or is not known where a is within [-0.1, 0.1] and b is 1.
std::string trouble(const std::string& text, double radius = 0.1) {
  Branches sides;
  const BranchScope scope(sides);
  const Jet rate = rate_of(text).jets(around(0, 1, radius, 0), {}, {})[0];
  const bool given = !sides.blocked && rate.known();
  CHECK(given == sides.trouble.empty());
  return sides.trouble;
}

// Every function and operator; a and b are between -1.3 and 1.3.
const std::vector<std::string> formulas = {
    "a + b*a - 2*b",
    "-a^2 / (2.5 + b)",
    "a^3 + b^4 - a^1",
    "(a + 2)^-3",
    "(a + 2)^0.7",
    "(a + 2)^b",
    "2.5^(a*b)",
    "sin(a)*cos(b)",
    "tan(a)",
    "asin(0.6*a)",
    "acos(0.6*b)",
    "atan(2*a)",
    "sinh(a)",
    "cosh(a)",
    "tanh(a)",
    "asinh(3*a)",
    "asinh(b - 2)",
    "acosh(2.5 + a)",
    "atanh(0.6*a)",
    "exp(a*b)",
    "ln(2 + a)",
    "log10(2 + b)",
    "sqrt(2 + a)",
    "cbrt(2 + a)",
    "cbrt(a - 2)",
    "abs(a + 2)*abs(b - 2)",
    "sign(a - 2)*b",
    "atan2(a, 2 + b)",
    "atan2(2 + a, b)",
    "atan2(a - 2, b)",
    "hypot(a, 2 + b)",
    "min(a, 3 + b)*max(a, b - 3, -5)",
    "a > -2 && b != 3 ? a*b : a",
    "a >= 2 || b == 3 ? a*b : a^2*b",
    "(a < 2)*b + (a <= 2)*a",
};

}  // namespace

TEST_CASE("every function of a formula is contained in its ranges, with its slopes") {
  using Exact = DualOf<long double, 2>;
  std::mt19937_64 draw(7);
  std::uniform_real_distribution<double> any(-1, 1);
  for (const std::string& text : formulas) {
    CAPTURE(text);
    const Model model = rate_of(text);
    const formula::Tape tape = formula::compile(text, {{"a", 0}, {"b", 1}});
    for (int i = 0; i < trials(300); ++i) {
      const double a = any(draw), b = any(draw);
      const double r = 0.3 * std::abs(any(draw)), s = 0.3 * std::abs(any(draw));
      const Jet form = model.jets(around(a, b, r, s), {}, {})[0];
      REQUIRE(form.known());
      const long double d = any(draw), e = any(draw);
      formula::Evaluator<Exact> evaluate(2, tape.depth);
      evaluate[0] = a + r * d;
      evaluate[1] = b + s * e;
      for (Eigen::Index k : {0, 1}) evaluate[std::size_t(k)].slopes[k] = 1;
      const Exact exact = evaluate(tape);
      REQUIRE(contains(form.value(), d, e, exact.value));
      REQUIRE(contains(form.slope(0), d, e, exact.slopes[0]));
      REQUIRE(contains(form.slope(1), d, e, exact.slopes[1]));
    }
  }
}

TEST_CASE("the ranges of every function shrink by the cube of the box") {
  for (const std::string& text : formulas) {
    CAPTURE(text);
    const Model model = rate_of(text);
    const auto rest = [&](double r) {
      return model.jets(around(0.4, 0.3, r, r), {}, {})[0].value().rest();
    };
    CHECK(rest(2e-3) <= 8.5 * rest(1e-3) + 1e-14);
  }
}

TEST_CASE("a kink, a jump or a comparison that the ranges leave open blocks, by name") {
  for (const char* text : {"abs", "sign"})
    CHECK(trouble(fmt::format("{}(a)", text)) ==
          fmt::format("switch: {} in the rate of 'a'", text));
  CHECK(trouble("min(a, 0)") == "switch: min in the rate of 'a'");
  CHECK(trouble("max(-1, 2*a, a)") == "switch: max in the rate of 'a'");
  for (const char* text : {"<", "<=", ">", ">=", "==", "!="})
    CHECK(trouble(fmt::format("a {} 0.05 ? 1 : b", text)) ==
          fmt::format("switch: {} in the rate of 'a'", text));
  CHECK(trouble("a ? 1 : 2") == "switch: ? : in the rate of 'a'");
  CHECK(trouble("a && b") == "switch: && in the rate of 'a'");
  CHECK(trouble("abs(a)", 0) == "switch: abs in the rate of 'a'");  // at the kink
  CHECK(trouble("a*abs(a)", 0) == "switch: abs in the rate of 'a'");
  CHECK(trouble("max(a, 0)", 0) == "switch: max in the rate of 'a'");
  CHECK(trouble("a == 0 ? 1 : sin(a)/a", 0) == "switch: == in the rate of 'a'");
  CHECK(trouble("abs(a + 1) + max(a, 2) + (a < 1 && b > 0.5)").empty());
}

TEST_CASE("a function that may be undefined or without a slope has no known value, by name") {
  for (const char* text : {"sqrt", "ln", "log10", "cbrt", "atanh", "asin", "acos", "acosh"}) {
    const bool at_one = std::string(text).starts_with("a");
    CHECK(trouble(fmt::format("{}({} + a)", text, at_one ? 1 : 0)) ==
          fmt::format("undefined: {} in the rate of 'a'", text));
  }
  CHECK(trouble("b/a") == "undefined: / in the rate of 'a'");
  CHECK(trouble("a^0.5") == "undefined: ^ in the rate of 'a'");
  CHECK(trouble("a^-2") == "undefined: ^ in the rate of 'a'");
  CHECK(trouble("a^b") == "undefined: ^ in the rate of 'a'");
  CHECK(trouble("hypot(a, a)") == "undefined: hypot in the rate of 'a'");
  CHECK(trouble("atan2(a, -b)") == "undefined: atan2 in the rate of 'a'");
  CHECK(trouble("exp(1000*b)") == "undefined: exp in the rate of 'a'");
  CHECK(trouble("sqrt(a)", 0) == "undefined: sqrt in the rate of 'a'");
  CHECK(trouble("tan(pi/2 + a)") == "undefined: tan in the rate of 'a'");
}

}  // namespace formula_jets_test
