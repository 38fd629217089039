// Two constants from six numbers: planted ones are found, and every refusal is reached.
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <numbers>
#include <random>

#include "tables/tables.hpp"
#include "tests/check.hpp"
#include "tests/random_draws.hpp"

using namespace tiltrim;

namespace identify_test {

namespace {

SixNumbers published_numbers() {
  return six_numbers(
      load_published_tables(std::filesystem::path(TILTRIM_SOURCE_DIR) / "data/paper_tables.json"));
}

// Digits as a table would print them, cut off.
Printed cut(double value, int decimals) {
  const double unit = std::pow(10.0, decimals);
  return read_printed(fmt::format("{:.{}f}", std::trunc(value * unit) / unit, decimals));
}

SixNumbers made_table(double Ep, double k, const Columns<double>& CL, const Columns<double>& CD) {
  SixNumbers six{{"a", "b", "c"}, CL, CD, {}, {}};
  for (std::size_t i = 0; i < 3; ++i) {
    six.theta0[i] = cut(std::hypot(1 - k * CD[i], k * CL[i]) / Ep, 5);
    six.a1s[i] = cut(std::atan2(k * CL[i], 1 - k * CD[i]), 6);
  }
  return six;
}

// Whether some Ep fits k, in closed form: a1s bounds k alone, and each theta0 bounds Ep at k.
struct Allowed {
  double lower, upper;
  bool any;
};
Allowed excess_at(const SixNumbers& six, double k) {
  Allowed all{0.0, 1e9, true};
  for (std::size_t i = 0; i < 3; ++i) {
    const double force = std::hypot(1 - k * six.CD[i], k * six.CL[i]);
    const double theta0 = std::abs(six.theta0[i].value), a1s = std::abs(six.a1s[i].value);
    const double a = std::atan(k * six.CL[i] / (1 - k * six.CD[i]));
    all.any = all.any && a >= a1s && a <= a1s + six.a1s[i].unit;
    all.lower = std::max(all.lower, force / (theta0 + six.theta0[i].unit));
    all.upper = std::min(all.upper, force / theta0);
  }
  all.any = all.any && all.lower <= all.upper;
  return all;
}

template <class Predicate>
double edge(double inside, double outside, Predicate holds) {
  for (int i = 0; i < 200; ++i) {
    const double middle = 0.5 * (inside + outside);
    (holds(middle) ? inside : outside) = middle;
  }
  return inside;
}

}  // namespace

TEST_CASE("identification: NLopt's ranges are those of the closed form") {
  const SixNumbers six = published_numbers();
  const Identification id = identify(six, Aircraft{});
  const Identification fixed = identify(six, Aircraft{}, {.thrust_excess = {1.4, 1.4}});
  const auto some = [&](double k) { return excess_at(six, k).any; };
  const double low = edge(id.k, 0.042, some), high = edge(id.k, 0.043, some);
  const double tolerance = 1e-8 * 1e-5;  // the misses' noise (units) times a unit, over slopes of 1
  CHECK_NEAR(id.k_range->lower, low, tolerance);
  CHECK_NEAR(id.k_range->upper, high, tolerance);
  const auto at_1_4 = [&](double k) {
    const Allowed a = excess_at(six, k);
    return a.any && a.lower <= 1.4 && 1.4 <= a.upper;
  };
  const double k = fixed.k;
  CHECK_NEAR(fixed.k_range->lower, edge(k, 0.042, at_1_4), tolerance);
  CHECK_NEAR(fixed.k_range->upper, edge(k, 0.043, at_1_4), tolerance);
  double least = 2.0, most = 1.0;
  for (int i = 0; i <= 1000; ++i) {
    const Allowed a = excess_at(six, low + (high - low) * i / 1000);
    if (!a.any) continue;
    least = std::min(least, a.lower);
    most = std::max(most, a.upper);
  }
  CHECK_NEAR(id.thrust_excess_range->lower, least, 1e-8);  // the grid's step times dEp/dk
  CHECK_NEAR(id.thrust_excess_range->upper, most, 1e-8);
}

TEST_CASE("identification: planted constants are found" * thorough) {
  std::mt19937 random(1);
  const auto draw = [&](double from, double to) { return from + (to - from) * uniform(random); };
  for (int trial = 0; trial < 200; ++trial) {
    const double Ep = draw(1.05, 2.5), k = draw(0.01, 0.15);
    const SixNumbers six = made_table(Ep, k, {draw(0.05, 0.2), draw(0.8, 1.5), draw(0.1, 0.5)},
                                      {draw(2.0, 3.5), draw(1.0, 2.0), draw(0.01, 0.05)});
    const Identification id = identify(six, Aircraft{});
    CAPTURE(Ep);
    CAPTURE(k);
    CHECK_MESSAGE(id.status == IdentifyStatus::reproduced, id.message);
    if (id.status != IdentifyStatus::reproduced) continue;
    constexpr double noise = 1e-12;
    CHECK((id.thrust_excess_range->lower - noise <= Ep &&
           Ep <= id.thrust_excess_range->upper + noise));
    CHECK((id.k_range->lower - noise <= k && k <= id.k_range->upper + noise));
  }
}

TEST_CASE("identification: every way of failing is reached and named") {
  const SixNumbers six = published_numbers();
  SUBCASE("not_reproduced: one number of another condition") {
    SixNumbers wrong = six;
    wrong.a1s[1] = read_printed("-0.0703");
    const Identification id = identify(wrong, Aircraft{});
    CHECK(id.status == IdentifyStatus::not_reproduced);
    CHECK(id.worst > 0.5);
    CHECK(id.message.find("units of its last digit") != std::string::npos);
    CHECK_FALSE(id.k_range.has_value());
  }
  SUBCASE("not_determined: without coefficients any k will do") {
    SixNumbers empty{{"a", "b", "c"}, {}, {}, {}, {}};
    empty.theta0.fill(read_printed("0.500"));
    empty.a1s.fill(read_printed("0.000"));
    const Identification id = identify(empty, Aircraft{});
    CHECK(id.status == IdentifyStatus::not_determined);
    CHECK(id.message.find("k is not determined") != std::string::npos);
  }
  SUBCASE("evaluation_limit: at every budget, never a wrong answer") {
    const long enough = identify(six, Aircraft{}).evaluations;
    for (const long budget : {1L, 50L, 4010L, enough - 1}) {
      const Identification id = identify(six, Aircraft{}, {.max_evaluations = budget});
      CAPTURE(budget);
      CHECK(id.status == IdentifyStatus::evaluation_limit);
      CHECK(id.evaluations <= budget);
    }
    CHECK(identify(six, Aircraft{}, {.max_evaluations = enough}).status ==
          IdentifyStatus::reproduced);
  }
  SUBCASE("the caller's mistakes throw") {
    SixNumbers bad = six;
    bad.CD[2] = std::nan("");
    CHECK_THROWS_WITH_AS((void)identify(bad, Aircraft{}),
                         "identify: a number of column level is not finite", std::invalid_argument);
    CHECK_THROWS_AS((void)identify(six, Aircraft{}, {.max_evaluations = 0}), std::invalid_argument);
    CHECK_THROWS_AS((void)identify(six, Aircraft{}, {.k = {0.2, 0.1}}), std::invalid_argument);
    CHECK_THROWS_AS((void)identify(six, Aircraft{}, {.thrust_excess = {0.0, 2.0}}),
                    std::invalid_argument);
  }
}

}  // namespace identify_test
