// Exact derivatives of formulas: against differences of eighth order in long double, closed forms,
// and what happens at kinks.
#include <cmath>
#include <random>

#include "linearize/linearize.hpp"
#include "model/differentiate.hpp"
#include "model/formula.hpp"
#include "model/formula_check.hpp"
#include "model/formulas.hpp"
#include "model/lookup.hpp"
#include "tests/check.hpp"
#include "trim/trim.hpp"

using namespace tiltrim;
using Eigen::Index;
using Eigen::VectorXd;

namespace formula_slopes_test {

namespace {

const VectorXd none(0);
const std::vector<Index> both = {0, 1};

Model sloped(const std::string& text) {
  return model_of({.name = "m",
                   .states = {{"a", ""}, {"b", ""}},
                   .inputs = {},
                   .outputs = {},
                   .parameters = {},
                   .rates = {text, "0"}});
}

Eigen::RowVector2d slopes_at(const std::string& text, double a, double b) {
  return sloped(text).derivatives({Eigen::Vector2d{a, b}, none, none}, both).row(0);
}

// The same formula in long double, and its slope by central differences of eighth order.
struct LongDouble {
  formula::Tape tape;
  long double at[2];

  long double value(int variable, long double step) const {
    formula::Evaluator<long double> evaluate(2, tape.depth);
    for (int i : {0, 1}) evaluate[std::size_t(i)] = at[i] + (i == variable ? step : 0);
    return evaluate(tape);
  }
  long double slope(int variable, long double h) const {
    constexpr long double weights[] = {4.0L / 5, -1.0L / 5, 4.0L / 105, -1.0L / 280};
    long double sum = 0;
    for (int k = 1; k <= 4; ++k)
      sum += weights[k - 1] * (value(variable, k * h) - value(variable, -k * h));
    return sum / h;
  }
};

LongDouble in_long_double(const std::string& text, double a, double b) {
  return {formula::compile(text, {{"a", 0}, {"b", 1}}), {a, b}};
}

constexpr double rounding = 1e-13;  // of a dozen operations, relative to slope and value

// Random formulas of a and b, nested up to `depth`.
std::string random_formula(std::mt19937& draw, int depth) {
  const auto pick = [&](int count) { return int(draw() % unsigned(count)); };
  const auto part = [&] { return random_formula(draw, depth - 1); };
  if (depth == 0 || pick(6) == 0) {
    const char* leaves[] = {"a", "b", "a", "b", "2", "0.7", "pi"};
    return leaves[pick(7)];
  }
  switch (pick(6)) {
    case 0:
      return fmt::format("({} ? {} : {})", part() + (pick(2) ? " < " : " >= ") + part(), part(),
                         part());
    case 1:
      return fmt::format("{}({})", formula_functions()[std::size_t(pick(19))], part());
    case 2:
      return fmt::format("{}({}, {})", formula_functions()[std::size_t(19 + pick(4))], part(),
                         part());
    case 3:
      return fmt::format("(-{})^{}", part(), pick(5));
    default:
      return fmt::format("({} {} {})", part(), std::string("+-*/^")[std::size_t(pick(5))], part());
  }
}

}  // namespace

TEST_CASE("slopes of every function and operator: those of long double to 1e-13") {
  for (const char* text : {"sin(a*b)",
                           "cos(a*b)",
                           "tan(a)",
                           "asin(a)",
                           "acos(a)",
                           "atan(b)",
                           "sinh(b)",
                           "cosh(b)",
                           "tanh(a)",
                           "asinh(b)",
                           "acosh(b)",
                           "atanh(a)",
                           "exp(a*b)",
                           "ln(b)",
                           "log10(b)",
                           "sqrt(b)",
                           "cbrt(-b)",
                           "abs(-b)",
                           "sign(a)*b",
                           "atan2(a, -b)",
                           "hypot(a, b)",
                           "min(b, a, 3)",
                           "max(a, b, -3)",
                           "a + b",
                           "a - b",
                           "a*b",
                           "a/b",
                           "a^b",
                           "a^2",
                           "a^3",
                           "b^-1.5",
                           "2^a",
                           "(-b)^4",
                           "-a^2",
                           "a < b ? a^4 : b",
                           "a > b ? a^4 : b",
                           "a <= b",
                           "a >= b",
                           "a == b",
                           "a != b",
                           "a && b",
                           "a || b",
                           "(a < b && b > 2)*a*b",
                           "a*(b > 9 || a > 0)",
                           "pi*a",
                           "-b"}) {
    CAPTURE(text);
    const LongDouble truth = in_long_double(text, 0.37, 2.9);
    const Eigen::RowVector2d slopes = slopes_at(text, 0.37, 2.9);
    for (int i : {0, 1}) CHECK_NEAR(slopes[i], double(truth.slope(i, 1e-3L)), rounding);
  }
}

TEST_CASE("slopes of random formulas: those of long double to 1e-13") {
  std::mt19937 draw(7);
  int compared = 0, undetermined = 0;
  const int count = trials(3000);
  for (int trial = 0; trial < count; ++trial) {
    const std::string text = random_formula(draw, 4);
    const double a = 0.37 + 0.001 * (trial % 97), b = 1.9 - 0.001 * (trial % 89);
    const LongDouble truth = in_long_double(text, a, b);
    const Eigen::RowVector2d slopes = slopes_at(text, a, b);
    for (int i : {0, 1}) {
      const long double fine = truth.slope(i, 5e-4L), coarse = truth.slope(i, 1e-3L);
      const long double size = std::max({1.0L, std::abs(fine), std::abs(truth.value(i, 0))});
      // Where the differences have not converged, a kink or a singularity is near.
      if (!(std::abs(fine - coarse) < 1e-14L * size)) continue;
      if (!std::isfinite(slopes[i])) {  // a part is not finite, the whole does not feel it
        ++undetermined;
        continue;
      }
      CAPTURE(text);
      CHECK_NEAR(slopes[i], double(fine), rounding * double(size));
      ++compared;
    }
  }
  CHECK(compared > 3 * count / 2);  // of two slopes each
  CHECK(undetermined < count / 20);
}

TEST_CASE("ranges of random formulas contain every value over the box") {
  std::mt19937 draw(9);
  const auto within = [&](double from, double to) {
    return std::uniform_real_distribution(from, to)(draw);
  };
  int known = 0, narrow = 0;
  const int count = trials(6000);
  for (int trial = 0; trial < count; ++trial) {
    const std::string text = random_formula(draw, 4);
    const Model m = sloped(text);
    const double radius = std::vector{0.0, 1e-6, 0.02, 0.5, 2.0}[std::size_t(trial % 5)];
    std::vector<Range> box;
    for (const double middle : {within(-2, 2), within(-2, 2)})
      box.push_back({middle - radius, middle + radius});
    const Range all = m.enclosure(box)[0];
    if (!std::isfinite(all.lower)) continue;
    ++known;
    double low = all.upper, high = all.lower;
    CAPTURE(text);
    for (int sample = 0; sample < 30; ++sample) {
      const auto inside = [&](const Range& r) {
        return sample == 0 ? r.lower : sample == 1 ? r.upper : within(r.lower, r.upper);
      };
      const double y = m.f(Eigen::Vector2d{inside(box[0]), inside(box[1])}, none, none)[0];
      REQUIRE(std::isfinite(y));
      REQUIRE((all.lower <= y && y <= all.upper));
      low = std::min(low, y);
      high = std::max(high, y);
    }
    narrow += all.upper - all.lower <= 10 * (high - low) + 1e-9 * (1 + std::abs(low));
  }
  CHECK(known > count / 2);
  CHECK(narrow > known / 2);
}

TEST_CASE("an equilibrium planted into random formulas is never proved absent") {
  std::mt19937 draw(11);
  const TrimSpec spec{
      .free = {"a", "b"}, .steady = {"a", "b"}, .bounds = {{"a", {-2, 2}}, {"b", {-2, 2}}}};
  int planted = 0, absent = 0;
  const int count = trials(400);
  for (int trial = 0; trial < count; ++trial) {
    const std::string text = random_formula(draw, 3);
    std::uniform_real_distribution<double> inside(-2, 2);
    const Eigen::Vector2d root{inside(draw), inside(draw)};
    const double value = sloped(text).f(root, none, none)[0];
    if (!std::isfinite(value)) continue;
    const auto proved = [&](double off) {
      const Model m = model_of({.name = "planted",
                                .states = {{"a", ""}, {"b", ""}},
                                .inputs = {},
                                .outputs = {},
                                .parameters = {},
                                .rates = {fmt::format("{} - ({:.17g})", text, value + off),
                                          fmt::format("b - ({:.17g})", root[1])}});
      return proved_infeasible(m, spec, {Eigen::Vector2d{0.1, 0.1}, none, none});
    };
    CAPTURE(text);
    CHECK_FALSE(proved(0));
    ++planted;
    absent += proved(50);
  }
  CHECK(planted > count / 2);
  CHECK(absent > planted / 2);
}

TEST_CASE("at a kink, a jump or a singular slope there is none") {
  const char* const texts[] = {"abs(a)",      "sign(a)",          "max(a, 2*a)",
                               "min(0, a)",   "a < 0 ? -a : 3*a", "a == 0 ? 1 : sin(a)/a",
                               "a && b",      "hypot(a, 0)",      "sqrt(a)",
                               "cbrt(a)",     "sqrt(a^2)",        "(a^2)^0.5",
                               "(a^2)^(b/4)", "acos(cos(a))",     "atan2(a, 0)",
                               "atan2(0, a)", "a*abs(a)",         "sqrt(b)*a + abs(a)"};
  for (const std::string text : texts) {
    CAPTURE(text);
    CHECK(std::isnan(slopes_at(text, 0, 2)[0]));
    CHECK(std::isfinite(slopes_at(text, 0.5, 2)[0]));
  }
  // Along the other variable there may be one.
  CHECK_NEAR(slopes_at("sqrt(b)*a + abs(b - 2)", 0, 2)[0], std::sqrt(2), 1e-15);
  CHECK(slopes_at("abs(b - 2) + a", 0, 2)[0] == 1);
  CHECK(slopes_at("a == 0 ? 2*b : 3*b", 0, 2)[1] == 2);
}

TEST_CASE("linearize: differences stand in for such a slope, and none is passed over in silence") {
  const auto linear = [](const std::string& text) {
    return linearize(sloped(text), {Eigen::Vector2d{0, 0}, none, none},
                     {.tolerance = std::numeric_limits<double>::infinity()});
  };
  const LinearModel smooth = linear("sin(a) - 3*b");
  CHECK(smooth.method == Method::exact);
  CHECK(smooth.remarks.empty());
  CHECK(smooth.A_error.maxCoeff() < 1e-13);
  struct Row {
    std::string text;
    double slope;
  };
  for (const Row& row : {Row{"abs(a)", 1},
                         {"max(a, 2*a)", 2},
                         {"b + hypot(a, 0)", 1},
                         {"b + 0.001*max(0, a)", 0.001},
                         {"a == 0 ? 1 : sin(a)/a", 0},
                         {"a*abs(a)", 0},
                         {"cbrt(a^3)", 1}}) {
    CAPTURE(row.text);
    const LinearModel found = linear(row.text);
    REQUIRE(found.status == LinearizeStatus::linear);
    CHECK_NEAR(std::abs(found.A(0, 0)), row.slope, 1e-7 + found.A_error(0, 0));
    CHECK(found.A(0, 1) == (row.text[0] == 'b' ? 1 : 0));
    CHECK_FALSE(found.remarks.empty());
  }
  CHECK(linear("sqrt(a)").status == LinearizeStatus::not_finite);
}

TEST_CASE("for a solver differences stand in for a slope that does not exist") {
  const Model m = sloped("atan2(a, 0) + b");
  const Eigen::MatrixXd J = jacobian(m, {Eigen::Vector2d{0, 0}, none, none}, both);
  CHECK(J.allFinite());
  CHECK(J(0, 1) == 1);
}

TEST_CASE("slopes through let, in inputs, parameters and outputs, more than one pass of them") {
  Formulas f{.name = "m",
             .states = {{"x", ""}},
             .inputs = {{"u", ""}},
             .outputs = {{"y", ""}},
             .parameters = {},
             .let = {{"q", "x*u"}, {"r", "q^2 + p0"}},
             .rates = {"r*p7"},
             .values = {"sin(r) + p3*x"}};
  for (int k = 0; k < 8; ++k) f.parameters.push_back({fmt::format("p{}", k), ""});
  const VectorXd p = VectorXd::LinSpaced(8, 0.5, 4);
  const double x = 0.3, u = 1.7, r = x * u * x * u + 0.5;
  const std::vector<Index> all = {0, 1, 2, 3, 4, 5, 6, 7, 8, 9};
  const Eigen::MatrixXd J =
      model_of(f).derivatives({VectorXd::Constant(1, x), VectorXd::Constant(1, u), p}, all);
  Eigen::MatrixXd truth = Eigen::MatrixXd::Zero(2, 10);
  truth.row(0).head(3) << 2 * x * u * u * 4, 2 * x * x * u * 4, 4;
  truth.row(1).head(3) << std::cos(r) * 2 * x * u * u + 2, std::cos(r) * 2 * x * x * u, std::cos(r);
  truth(0, 9) = r;
  truth(1, 5) = x;
  CHECK((J - truth).cwiseAbs().maxCoeff() < 1e-14);
}

TEST_CASE("slopes of long and deep formulas") {
  std::string deep = "a", sum = "a";
  for (int k = 0; k < 3000; ++k) deep = "-(" + deep + ")";
  for (int k = 0; k < 4000; ++k) sum += " + a";
  CHECK(slopes_at(deep, 0.5, 1)[0] == 1);
  CHECK(slopes_at(sum, 0.5, 1)[0] == 4001);
  std::string right = "a";
  for (int k = 0; k < 4000; ++k) right = "a+(" + right + ")";
  CHECK(slopes_at(right, 0.5, 1)[0] == 4001);
}

TEST_CASE("vectors of a wrong size are refused") {
  const Model m = sloped("a + b");
  CHECK_THROWS_AS((void)m.f(VectorXd::Zero(1), none, none), CallerMistake);
  CHECK_THROWS_AS((void)m.derivatives({VectorXd::Zero(3), none, none}, both), CallerMistake);
}

TEST_CASE("the error of a slope covers what cancels inside a formula or a table") {
  using Wide = DualOf<long double, 2>;
  std::mt19937 draw(23);
  const auto within = [&](double from, double to) {
    return std::uniform_real_distribution(from, to)(draw);
  };
  int tight = 0, compared = 0;
  for (int trial = 0; trial < trials(1500); ++trial) {
    // Cubic tables of one and two arguments with large, close entries, and terms that cancel.
    LookupTable line{"line", {{}}, {}, true},
        sheet{"sheet", {{-1, 0.1, 2}, {-1, 0.3, 1.7, 2}}, {}, true};
    for (double x = -1; x < 2; x += within(0.05, 0.8)) line.at[0].push_back(x);
    line.at[0].push_back(2);
    for (LookupTable* t : {&line, &sheet})
      while (t->values.size() < t->at[0].size() * (t == &sheet ? 4 : 1))
        t->values.push_back(1e3 + within(-1, 1));
    const char* const texts[] = {"line(a)*b", "sheet(a, b)", "1000*(exp(a) - 1 - a)",
                                 "(1 + a)^3 - 1 - 3*a - 3*a*a", "sin(a)/cos(a) - tan(a) + b*a"};
    const char* const text = texts[trial % 5];
    const double a = trial % 5 < 2 ? within(-1, 2) : within(-1e-3, 1e-3), b = within(-1, 2);
    const std::vector<LookupTable> tables{line, sheet};
    const formula::Tape tape = formula::compile(text, {{"a", 0}, {"b", 1}}, tables);
    formula::Evaluator<Wide> wide(2, tape.depth, tables);
    wide[0] = {a, {1, 0}};
    wide[1] = {b, {0, 1}};
    const Wide truth = wide(tape);
    const Model m = model_of({.name = "cancelling",
                              .states = {{"a", ""}, {"b", ""}},
                              .inputs = {},
                              .outputs = {},
                              .parameters = {},
                              .rates = {text, "0"},
                              .tables = tables});
    const Estimate e = exact_bounded(m, {Eigen::Vector2d{a, b}, none, none}, {0, 1});
    CAPTURE(text);
    for (const int i : {0, 1}) {
      const double miss = double(std::abs(truth.slopes[i] - (long double)(e.value(0, i))));
      CHECK(miss <= e.error(0, i));
      tight += e.error(0, i) < 1e-9;
      ++compared;
    }
  }
  CHECK(tight > 0.9 * compared);
}

}  // namespace formula_slopes_test
