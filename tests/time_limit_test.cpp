// Models that take too long: the results up to then, and a status. The models react to the number
// of calls, so no time is measured here.
#include <Eigen/Core>
#include <chrono>
#include <cmath>
#include <thread>

#include "linearize/linearize.hpp"
#include "tests/check.hpp"
#include "tests/toy_models.hpp"
#include "trim/diagnosis.hpp"

using namespace tiltrim;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace time_limit_test {

namespace {

constexpr double allowed = 0.2;  // s
constexpr double at_once = 1e-9;

void take_too_long() { std::this_thread::sleep_for(std::chrono::duration<double>(1.2 * allowed)); }

bool contains(const std::string& text, const std::string& words) {
  return text.find(words) != std::string::npos;
}

// x' = 1 - x - x³/10 with its exact slope; `before` is called ahead of each evaluation of x'.
Model slow(const std::function<void(double x)>& before) {
  const Model m = scalar([before](double x, double) {
    before(x);
    return 1 - x - 0.1 * x * x * x;
  });
  return with_jacobian(m, [](const OperatingPoint& at) {
    return MatrixXd{{-1 - 0.3 * at.x[0] * at.x[0], 0.0}};
  });
}

const TrimSpec asked{.free = {"x"}, .bounds = {{"x", {-9.0, 9.0}}}};
const OperatingPoint zero{vec({0}), {}, vec({1})};

}  // namespace

TEST_CASE("a trim that takes too long ends with the best point so far") {
  for (const TrimMethod method : {TrimMethod::newton, TrimMethod::ipopt}) {
    int calls = 0;
    const Model m = slow([&](double) {
      if (++calls == 4) take_too_long();
    });
    const TrimResult r = trim(m, asked, zero, {.method = method, .time_limit = allowed});
    CAPTURE(int(method));
    CHECK(r.status == TrimStatus::time_limit);
    CHECK_FALSE(r);
    CHECK(calls == 4);  // no call after the one that took too long
    CHECK(contains(r.message, "the model exceeded the time limit of 0.2 s: "));
    CHECK(contains(r.message, fmt::format(": {} evaluations; ", r.evaluations)));
    const double x = r.point.x[0];
    CHECK_NEAR(r.rates[0], 1 - x - 0.1 * x * x * x, 1e-15);
    CHECK_NEAR(r.residual, std::abs(r.rates[0]), 1e-15);
    CHECK(r.residual <= 1);  // that of the guess
    if (method == TrimMethod::ipopt) continue;
    CHECK(r.evaluations == 6);          // and the slope at 0 and 1
    CHECK_NEAR(x, 12.0 / 13.0, 1e-12);  // Newton: 0, 1, 1 - 0.1/1.3
  }
}

TEST_CASE("a model too slow for a second call: the guess is the best point") {
  const Model m = slow([](double) { take_too_long(); });
  const TrimResult r = trim(m, asked, zero, {.time_limit = allowed});
  CHECK(r.status == TrimStatus::time_limit);
  CHECK(r.evaluations == 1);
  CHECK(contains(r.message, ": 1 evaluation; the closest point has a residual of 1 1/s"));
  CHECK(r.point.x == zero.x);
  CHECK(r.rates == vec({1}));
  // No time at all: only the guess is known.
  const TrimResult none = trim(m, asked, zero, {.time_limit = at_once});
  CHECK(none.status == TrimStatus::time_limit);
  CHECK(none.evaluations == 0);
  CHECK(none.point.x == zero.x);
  CHECK(std::isinf(none.residual));
}

TEST_CASE("what was verified in time is the answer, with a remark") {
  const Model m = slow([](double x) {
    if (x > 2) take_too_long();  // only where further starts look
  });
  const TrimResult r = trim(m, asked, zero, {.method = TrimMethod::newton, .time_limit = allowed});
  CHECK(r.status == TrimStatus::converged);
  CHECK_NEAR(r.point.x[0] + 0.1 * std::pow(r.point.x[0], 3), 1.0, 1e-10);
  CHECK(contains(r.message, "the time limit of 0.2 s was reached after "));
  CHECK(r.starts < 33);
  // With enough time no remark, and the same result to the last bit.
  const TrimResult whole =
      trim(slow([](double) {}), asked, zero, {.method = TrimMethod::newton, .time_limit = 1e6});
  CHECK(whole.message.empty());
  CHECK(whole.starts == 33);
  CHECK(whole.point.x == r.point.x);
}

TEST_CASE("the proof that there is none ends in time too") {
  Model m = scalar([](double x, double) { return 1 + x * x; });
  int boxes = 0;
  m.enclosure = [&boxes](const std::vector<Range>&) -> std::vector<Range> {
    if (++boxes == 3) take_too_long();
    return {{-1.0, 1.0}};
  };
  const TrimOptions options{
      .method = TrimMethod::newton, .starts = 1, .closest = false, .time_limit = allowed};
  CHECK(trim(m, asked, zero, options).status == TrimStatus::time_limit);
  CHECK(boxes == 3);
}

TEST_CASE("remedies that took too long are not called useless") {
  Model m = scalar([](double x, double p) { return p + 1 + x * x; });
  const OperatingPoint here{vec({0}), {}, vec({0})};
  const Diagnosis d = diagnose(m, asked, here, here, {{"p", {-9.0, 9.0}}}, {.time_limit = at_once});
  CHECK(d.out_of_time);
  CHECK(d.remedies.empty());
  const Diagnosis whole = diagnose(m, asked, here, here, {{"p", {-9.0, 9.0}}}, {});
  CHECK_FALSE(whole.out_of_time);
  CHECK_FALSE(whole.remedies.empty());
}

TEST_CASE("a linear model that takes too long") {
  int calls = 0;
  const Model m = scalar([&calls](double x, double) {
    if (++calls == 5) take_too_long();
    return -x;
  });
  const LinearModel linear = linearize(m, zero, {.time_limit = allowed});
  CHECK(linear.status == LinearizeStatus::time_limit);
  CHECK(to_string(linear.status) == "time_limit");
  CHECK(linear.message == "the model exceeded the time limit of 0.2 s");
  CHECK(calls == 5);
  CHECK(linearize(m, zero, {.time_limit = 1e6}));
}

TEST_CASE("a limit that is no time is the caller's mistake") {
  for (const double limit : {0.0, -1.0, std::nan("")}) {
    const Model m = slow([](double) {});
    CHECK_THROWS_AS((void)trim(m, asked, zero, {.time_limit = limit}), std::invalid_argument);
    CHECK_THROWS_AS((void)linearize(m, zero, {.time_limit = limit}), std::invalid_argument);
  }
}

}  // namespace time_limit_test
