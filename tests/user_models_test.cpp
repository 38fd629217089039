// Models that misbehave: the response of each verb. Every failure has a named status or an
// exception, with the model's own message if there is one.
#include <cmath>
#include <functional>
#include <limits>
#include <stdexcept>

#include "follow/follow.hpp"
#include "sweep/sweep.hpp"
#include "tests/check.hpp"
#include "tests/toy_models.hpp"

using Eigen::VectorXd;
using namespace tiltrim;

namespace user_models_test {

namespace {

constexpr double not_a_number = std::numeric_limits<double>::quiet_NaN();
const VectorXd none(0);

VectorXd one(double value) { return VectorXd::Constant(1, value); }

// x' = rate(x, p).
Model scalar(const std::function<VectorXd(double x, double p)>& rate) {
  return flow({"x"}, {"p"},
              [rate](const VectorXd& x, const VectorXd& p) { return rate(x[0], p[0]); });
}

const TrimSpec at_rest{.free = {"x"}, .steady = {"x"}, .bounds = {{"x", {-10, 10}}}};
const OperatingPoint guess{one(0.5), none, one(1.0)};

TrimResult trimmed(const Model& m) { return trim(m, at_rest, guess); }

LinearModel linear_at(const Model& m, double x) { return linearize(m, {one(x), none, one(1.0)}); }

// From x at p = 1 to p = 2.
Branch branch_from(const Model& m, double x) {
  return follow(m, at_rest, {one(x), none, one(1.0)}, "p", 2);
}

// At p = 1, 1.5 and 2.
SweepMap map_of(const Model& m) {
  const std::vector<double> values = {1.0, 1.5, 2.0};
  return sweep({{"mine", m, at_rest, guess, {}}}, {{"p", {{"p", "", "p", values, values}}}});
}

std::vector<TrimStatus> statuses(const SweepMap& map) {
  std::vector<TrimStatus> all;
  for (const std::int8_t status : map.status) all.push_back(TrimStatus(status));
  return all;
}

std::vector<TrimStatus> thrice(TrimStatus status) { return {status, status, status}; }

bool says(const std::string& message, const char* words) {
  return message.find(words) != std::string::npos;
}

}  // namespace

TEST_CASE("it throws") {
  const Model m = scalar([](double, double) -> VectorXd { throw std::runtime_error("no row 7"); });
  const TrimResult r = trimmed(m);
  CHECK(r.status == TrimStatus::model_threw);
  CHECK(says(r.message, "no row 7"));
  const LinearModel linear = linear_at(m, 1);
  CHECK(linear.status == LinearizeStatus::model_threw);
  CHECK(linear.message == "the model threw: no row 7");
  CHECK(linear.A.size() == 0);
  const Branch branch = branch_from(m, 1);
  CHECK(branch.end == BranchEnd::no_start);
  CHECK(says(branch.message, "the model threw: no row 7"));
  const SweepMap map = map_of(m);
  CHECK(statuses(map) == thrice(TrimStatus::model_threw));
  CHECK(says(map.reasons[std::size_t(map.reason[0])], "no row 7"));
}

TEST_CASE("it throws what is no exception of the standard library") {
  const Model m = scalar([](double, double) -> VectorXd { throw 3; });
  CHECK(trimmed(m).status == TrimStatus::model_threw);
  CHECK(linear_at(m, 1).status == LinearizeStatus::model_threw);
  CHECK(branch_from(m, 1).end == BranchEnd::no_start);
  CHECK(statuses(map_of(m)) == thrice(TrimStatus::model_threw));
}

TEST_CASE("it throws, or gives NaN, beyond p = 1.4 alone") {
  for (const bool throws : {true, false}) {
    CAPTURE(throws);
    const Model m = scalar([throws](double x, double p) {
      if (p > 1.4 && throws) throw std::runtime_error("the table ends at 1.4");
      return one(p > 1.4 ? not_a_number : p - x);
    });
    CHECK(trimmed(m));
    CHECK(linear_at(m, 1));
    const Branch branch = branch_from(m, 1);
    CHECK(branch.end == BranchEnd::not_finite);
    CHECK_NEAR(branch.points.back().parameter, 1.4, 1e-3);
    CHECK(says(branch.message, "the table ends at 1.4") == throws);
    const SweepMap map = map_of(m);
    const TrimStatus beyond = throws ? TrimStatus::model_threw : TrimStatus::not_finite;
    CHECK(statuses(map) == std::vector{TrimStatus::converged, beyond, beyond});
    REQUIRE(map.crossings.size() == 1);
    CHECK(map.crossings[0].kind == CrossingKind::end);
    CHECK_NEAR(map.crossings[0].at[0], 1.4, 1e-6);
  }
}

TEST_CASE("an output gives NaN beyond p = 1.4 alone: no trim there, for no verb") {
  Model m = scalar([](double x, double p) { return one(p - x); });
  m.outputs = {{"o", "", 1.0}};
  m.h = [](const VectorXd& x, const VectorXd&, const VectorXd&) {
    return one(std::sqrt(1.4 - x[0]));
  };
  CHECK(trimmed(m));
  const Branch branch = branch_from(m, 1);
  CHECK(branch.end == BranchEnd::not_finite);
  CHECK_NEAR(branch.points.back().parameter, 1.4, 1e-3);
  CHECK(says(branch.message, "o = "));
  CHECK(statuses(map_of(m)) ==
        std::vector{TrimStatus::converged, TrimStatus::not_finite, TrimStatus::not_finite});
}

TEST_CASE("it gives NaN") {
  const Model m = scalar([](double, double) { return one(not_a_number); });
  CHECK(trimmed(m).status == TrimStatus::not_finite);
  const LinearModel linear = linear_at(m, 1);
  CHECK(linear.status == LinearizeStatus::not_finite);
  CHECK(linear.message == "not finite: x' = nan");
  const Branch branch = branch_from(m, 1);
  CHECK(branch.end == BranchEnd::no_start);
  CHECK(says(branch.message, "is not finite"));
  CHECK(statuses(map_of(m)) == thrice(TrimStatus::not_finite));
}

TEST_CASE("it throws, or gives NaN, on both sides of the point that is linearized") {
  for (const bool throws : {true, false}) {
    CAPTURE(throws);
    const LinearModel linear = linear_at(scalar([throws](double x, double) {
                                           if (x == 1) return one(0);
                                           if (throws) throw std::invalid_argument("x above 1");
                                           return one(not_a_number);
                                         }),
                                         1);
    CHECK(linear.status == (throws ? LinearizeStatus::model_threw : LinearizeStatus::not_finite));
    CHECK(linear.rates == one(0));
    CHECK(linear.A.size() == 0);
    CHECK(says(linear.message,
               throws ? "the model threw: x above 1" : "derivative of x' with respect to x"));
  }
}

TEST_CASE("its derivatives throw, its outputs are NaN") {
  Model m = scalar([](double x, double p) { return one(p - x); });
  m.derivatives = [](const OperatingPoint&, const auto&) -> Eigen::MatrixXd {
    throw std::runtime_error("not written yet");
  };
  CHECK(linear_at(m, 1).status == LinearizeStatus::model_threw);
  CHECK(linear_at(m, 1).message == "the model threw: not written yet");
  m.derivatives = nullptr;
  m.outputs = {{"y", "", 1.0}};
  m.h = [](const VectorXd&, const VectorXd&, const VectorXd&) { return one(not_a_number); };
  CHECK(linear_at(m, 1).status == LinearizeStatus::not_finite);
  CHECK(linear_at(m, 1).message == "not finite: y = nan");
}

TEST_CASE("it answers with the wrong length") {
  const Model m = scalar([](double, double) -> VectorXd { return VectorXd::Zero(2); });
  const char* words = "the model's rates f: expected 1 values, got 2";
  CHECK_THROWS_WITH_AS((void)trimmed(m), words, std::invalid_argument);
  CHECK_THROWS_WITH_AS((void)linear_at(m, 1), words, std::invalid_argument);
  CHECK_THROWS_WITH_AS((void)branch_from(m, 1), words, std::invalid_argument);
  CHECK_THROWS_WITH_AS((void)map_of(m), words, std::invalid_argument);
}

TEST_CASE("it answers with the wrong length ahead in a sweep: the map says whose answer it was") {
  Model m = scalar([](double x, double p) -> VectorXd {
    return p > 1.4 ? VectorXd(Eigen::Vector2d::Zero()) : one(p - x);
  });
  m.name = "beam";
  CHECK_THROWS_WITH_AS((void)map_of(m), "model 'beam': its rates f: expected 1 values, got 2",
                       std::invalid_argument);
  CHECK(branch_from(m, 1).end == BranchEnd::not_finite);
}

TEST_CASE("its derivatives are of the wrong size") {
  Model m = scalar([](double x, double p) { return one(p - x); });
  m.name = "beam";
  m.derivatives = [](const OperatingPoint&, const auto&) -> Eigen::MatrixXd {
    return Eigen::MatrixXd::Zero(2, 1);
  };
  const char* words = "model 'beam': its derivatives: expected 1 x 1 values, got 2 x 1";
  CHECK_THROWS_WITH_AS((void)linear_at(m, 1), words, std::invalid_argument);
  const TrimResult r = trimmed(m);
  CHECK_FALSE(r);
  CHECK(says(r.message, words));
}

TEST_CASE("it jumps" * thorough) {
  SUBCASE("over zero: there is no equilibrium") {
    const Model m = scalar([](double x, double p) { return one(x < p - 0.3 ? 1.0 : -1.0); });
    CHECK(trimmed(m).status == TrimStatus::not_found);
    CHECK(linear_at(m, 0.7).status == LinearizeStatus::not_equilibrium);
    CHECK(branch_from(m, 0.7).end == BranchEnd::no_start);
    CHECK(statuses(map_of(m)) == thrice(TrimStatus::not_found));
  }
  SUBCASE("at p = 1.4, from one equilibrium to another") {
    const Model m = scalar([](double x, double p) { return one((p > 1.4 ? p + 1 : p) - x); });
    const Branch branch = branch_from(m, 1);
    CHECK(branch.end == BranchEnd::stuck);
    CHECK(says(branch.message, "jump"));
    CHECK(statuses(map_of(m)) == thrice(TrimStatus::converged));
  }
  SUBCASE("in its slope: a kink at the equilibrium is remarked") {
    const Model m = scalar([](double x, double p) { return one((x < p ? 2 : 1) * (p - x)); });
    const LinearModel linear = linear_at(m, 1);
    REQUIRE(linear);
    REQUIRE(linear.remarks.size() == 1);
    CHECK(says(linear.remarks[0], "at a kink of the model"));
    CHECK(branch_from(m, 1).end == BranchEnd::reached);
  }
}

TEST_CASE("it is stiff: a rate of 1e9 beside one of 1") {
  Model m;
  m.states = {{"x", "", 1.0}, {"y", "", 1.0}};
  m.parameters = {{"p", "", 1.0}};
  m.f = [](const VectorXd& x, const VectorXd&, const VectorXd& p) -> VectorXd {
    return Eigen::Vector2d{1e9 * (p[0] - x[0]), x[0] - x[1]};
  };
  const TrimSpec spec{.free = {"x", "y"}, .steady = {"x", "y"}};
  const TrimResult r = trim(m, spec, {Eigen::Vector2d{0.5, 0.5}, none, one(1)});
  REQUIRE(r);
  CHECK_NEAR(r.point.x[0], 1, 1e-15);
  CHECK_NEAR(r.point.x[1], 1, 1e-9);
  const Modes found = modes(linearize(m, r.point));
  CHECK(found.verdict == Verdict::stable);
  CHECK_NEAR(found.modes[0].eigenvalue.real(), -1e9, 1);
  CHECK_NEAR(found.modes[1].eigenvalue.real(), -1, 1e-6);
  CHECK(follow(m, spec, r.point, "p", 2).end == BranchEnd::reached);
}

TEST_CASE("its Jacobian is singular at the equilibrium" * thorough) {
  const Model m = scalar([](double x, double p) { return one(-std::pow(x - p, 3)); });
  CHECK(trimmed(m).status == TrimStatus::singular);
  const LinearModel linear = linear_at(m, 1);
  REQUIRE(linear);
  CHECK(modes(linear).verdict == Verdict::undecided);
  const BranchEnd end = branch_from(m, trimmed(m).point.x[0]).end;  // its tangent is noise
  CHECK((end == BranchEnd::stuck || end == BranchEnd::singular || end == BranchEnd::reached));
  const SweepMap map = map_of(m);
  CHECK(statuses(map) == thrice(TrimStatus::singular));
  for (const std::int8_t verdict : map.verdict) CHECK(Verdict(verdict) == Verdict::undecided);
}

TEST_CASE("it has no equilibrium" * thorough) {
  const Model m = scalar([](double x, double p) { return one(p + x * x); });
  const TrimResult r = trimmed(m);
  CHECK(r.status == TrimStatus::not_found);
  CHECK(says(r.message, "the closest point has residual rate x' = 1"));
  CHECK(linear_at(m, 0).status == LinearizeStatus::not_equilibrium);
  const Branch branch = branch_from(m, 0);
  CHECK(branch.end == BranchEnd::no_start);
  CHECK(says(branch.message, "1 nominal sizes per second"));
  CHECK(statuses(map_of(m)) == thrice(TrimStatus::not_found));
}

TEST_CASE("a rate that vanishes nowhere is printed as what is left, however little") {
  TrimSpec free = at_rest;
  free.bounds.clear();
  const TrimResult r =
      trim(scalar([](double x, double) { return one(-std::exp(-x)); }), free, guess);
  CHECK(r.status == TrimStatus::not_found);
  CHECK(r.rates[0] < 0);
  CHECK(std::abs(r.rates[0]) < 1e-12);
  CHECK(says(r.message, fmt::format("residual rate x' = {:.3g}", r.rates[0]).c_str()));
}

TEST_CASE("it is at rest everywhere: a continuum of equilibria") {
  const Model m = scalar([](double, double) { return one(0); });
  CHECK(trimmed(m).status == TrimStatus::singular);
  const LinearModel linear = linear_at(m, 1);
  REQUIRE(linear);
  CHECK(modes(linear).verdict == Verdict::undecided);
  const Branch branch = branch_from(m, 1);
  CHECK(branch.end == BranchEnd::singular);
  CHECK(says(branch.message, "continuum"));
  const SweepMap map = map_of(m);
  CHECK(statuses(map) == thrice(TrimStatus::singular));
  for (const std::int8_t verdict : map.verdict) CHECK(Verdict(verdict) == Verdict::undecided);
}

}  // namespace user_models_test
