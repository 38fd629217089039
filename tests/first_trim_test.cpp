// The search that ends with the first verified equilibrium.
#include <cmath>
#include <memory>
#include <stop_token>

#include "tests/algebra.hpp"
#include "tests/check.hpp"
#include "trim/trim.hpp"

using namespace tiltrim;
using Eigen::Index;
using Eigen::VectorXd;

namespace first_trim_test {

static constexpr double NaN = std::numeric_limits<double>::quiet_NaN();
static const TrimOptions first{.others = false};

namespace {

struct Calls {
  long f = 0, h = 0;
};

}  // namespace

// x' = A x + b + curved terms with A near the identity, an equilibrium near 1; y = its sum.
static Model curved(Index n, const std::shared_ptr<Calls>& calls) {
  Model m;
  m.name = "curved";
  for (Index i = 0; i < n; ++i) m.states.push_back({fmt::format("x{}", i), "", 1.0});
  m.outputs = {{"sum", "", 1.0}};
  m.f = [n, calls](const VectorXd& x, const VectorXd&, const VectorXd&) {
    ++calls->f;
    VectorXd rates(n);
    for (Index i = 0; i < n; ++i)
      rates[i] = x[i] + 0.2 * std::sin(x[(i + 1) % n]) + 0.1 * x[i] * x[i] - 1.25;
    return rates;
  };
  m.h = [calls](const VectorXd& x, const VectorXd&, const VectorXd&) {
    ++calls->h;
    return VectorXd::Constant(1, x.sum());
  };
  return m;
}

static OperatingPoint at(const VectorXd& x) { return {x, VectorXd(), VectorXd()}; }

static TrimSpec all_free(const Model& m) {
  TrimSpec spec;
  for (const Signal& s : m.states) spec.free.push_back(s.name);
  return spec;
}

// x' = f(x).
static Model scalar(const std::function<double(double)>& f) {
  Model m;
  m.name = "scalar";
  m.states = {{"x", "", 1.0}};
  m.f = [f](const VectorXd& x, const VectorXd&, const VectorXd&) {
    return VectorXd::Constant(1, f(x[0]));
  };
  return m;
}

static TrimResult scalar_trim(const std::function<double(double)>& f, double guess,
                              std::optional<Range> range = {}, TrimOptions options = first) {
  const Model m = scalar(f);
  TrimSpec spec{.free = {"x"}};
  if (range) spec.bounds["x"] = *range;
  return trim(m, spec, at(VectorXd::Constant(1, guess)), options);
}

TEST_CASE("the first trim is that of Newton's method, for few evaluations") {
  for (const Index n : {1, 3, 6, 12}) {
    const auto calls = std::make_shared<Calls>();
    const Model m = curved(n, calls);
    TrimSpec spec = all_free(m);
    spec.bounds["sum"] = {0, 100};  // a limit: looked at where the equations hold
    const OperatingPoint guess = at(VectorXd::Constant(n, 0.4));
    const TrimResult few = trim(m, spec, guess, first);
    const Calls spent = *calls;
    const TrimResult all =
        trim(m, spec, guess, {.method = TrimMethod::newton, .starts = 0, .others = true});
    REQUIRE(few);
    REQUIRE(all);
    CHECK(few.starts == 1);
    CHECK((few.point.x - all.point.x).lpNorm<Eigen::Infinity>() <= 1e-12);
    CHECK_NEAR(few.rcond, all.rcond, 1e-8);
    CHECK(few.step <= 1e-12);
    CHECK_NEAR(few.outputs[0], few.point.x.sum(), 0);
    const long steps = 12;
    CHECK(spent.f <= n + 2 * n + steps);  // slopes at the guess, and at the answer
    CHECK(spent.h == 3);                  // of a size that fits; at the answer, and there once more
  }
}

TEST_CASE("the first trim: from the guess, whatever effort others have") {
  const auto two = [](double x) { return (x - 1) * (x + 3); };
  for (const double guess : {1.3, -2.5}) {
    const TrimResult r = scalar_trim(two, guess, Range{-5, 5});
    REQUIRE(r);
    CHECK_NEAR(r.point.x[0], guess > 0 ? 1 : -3, 1e-12);
    CHECK(r.others.empty());
    CHECK(scalar_trim(two, guess, Range{-5, 5}, {}).others.size() == 1);
  }
}

TEST_CASE("the first trim lies within the bounds, else a further start is tried") {
  const auto two = [](double x) { return (x - 1) * (x + 3); };
  const TrimResult r = scalar_trim(two, 2.0, Range{-4, 0.5});
  REQUIRE(r);
  CHECK_NEAR(r.point.x[0], -3, 1e-12);
  CHECK(r.starts > 1);
  const TrimResult none = scalar_trim(two, 2.0, Range{2, 4});
  CHECK(none.status == TrimStatus::not_found);
}

TEST_CASE("the first trim is verified as every other") {
  const auto calls = std::make_shared<long>(0);
  const auto restless = [calls](double x) { return x - 0.5 + 1e-12 * double(++*calls % 2); };
  CHECK(scalar_trim(restless, 0.4).status == TrimStatus::not_repeatable);
  CHECK(scalar_trim([](double x) { return x * x; }, 1.0).status == TrimStatus::singular);
  CHECK(scalar_trim([](double x) { return std::exp(-x); }, 1.0).status == TrimStatus::not_found);
  Model m = scalar([](double x) { return x - 0.5; });
  m.states.push_back({"y", "", 1.0});
  m.f = [](const VectorXd& x, const VectorXd&, const VectorXd&) {
    return VectorXd{{x[0] - 0.5, x[0]}};
  };
  TrimSpec spec{.free = {"x"}, .steady = {"x"}, .implied = {"y"}};
  CHECK(trim(m, spec, at(VectorXd::Zero(2)), first).status == TrimStatus::not_implied);
}

TEST_CASE("where there is no first trim, the search and its answer are the whole ones") {
  const auto none = [](double x) { return x * x + 1; };
  const TrimResult few = scalar_trim(none, 0.7, Range{-2, 2});
  const TrimResult all = scalar_trim(none, 0.7, Range{-2, 2}, {});
  CHECK(few.status == TrimStatus::not_found);
  CHECK(few.message == all.message);
  CHECK(few.point.x == all.point.x);
  CHECK(few.starts == all.starts);
}

TEST_CASE("the first trim: at the edge of the model's domain, and beyond it") {
  const auto up_to_one = [](double x) { return x <= 1 ? x - 0.3 : NaN; };
  CHECK_NEAR(scalar_trim(up_to_one, 1.0).point.x[0], 0.3, 1e-12);
  const TrimResult led_back = scalar_trim(up_to_one, 1.5, Range{-1, 2});
  REQUIRE(led_back);
  CHECK_NEAR(led_back.point.x[0], 0.3, 1e-12);
  const TrimResult nowhere = scalar_trim([](double) { return NaN; }, 0.0);
  CHECK(nowhere.status == TrimStatus::not_finite);
  const TrimResult threw =
      scalar_trim([](double) -> double { throw std::runtime_error("no table"); }, 0.0);
  CHECK(threw.status == TrimStatus::model_threw);
  CHECK(threw.thrown == "no table");
}

TEST_CASE("the first trim ends when asked to") {
  std::stop_source source;
  source.request_stop();
  TrimOptions options = first;
  options.stop = source.get_token();
  options.starts = 1'000'000'000;
  CHECK(scalar_trim([](double x) { return x * x + 1; }, 0.7, Range{-2, 2}, options).status ==
        TrimStatus::interrupted);
}

}  // namespace first_trim_test
