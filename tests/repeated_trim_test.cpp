// RepeatedTrim: from every guess what trim() returns, whatever was trimmed before.
#include <Eigen/Core>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "model/lookup.hpp"
#include "study/reference_vehicle.hpp"
#include "tests/algebra.hpp"
#include "tests/check.hpp"
#include "tests/same_trim.hpp"
#include "tests/toy_models.hpp"
#include "trim/repeated.hpp"
#include "vehicles/tiltrotor/formulations.hpp"

using namespace tiltrim;
using Eigen::VectorXd;

namespace repeated_trim_test {

static OperatingPoint with(const Model& m, OperatingPoint at, const char* name, double value) {
  set_value(at, variable(m, name), value);
  return at;
}

TEST_CASE("RepeatedTrim: the bits of trim() from every guess, in any order" * thorough) {
  const TrimProblem p = closed_loop_problem(reference_vehicle(), {15.0, 0.0, 0.0});
  const TrimResult level = trim(p.model, p.spec, p.guess);
  REQUIRE(level);
  const std::vector<OperatingPoint> guesses{p.guess,
                                            level.point,
                                            with(p.model, level.point, "V", 15.5),
                                            with(p.model, level.point, "V", 300.0),
                                            level.point,
                                            p.guess};
  const std::vector<TrimOptions> ways{{.method = TrimMethod::newton, .starts = 0},
                                      {.method = TrimMethod::newton, .starts = 3, .max_boxes = 0},
                                      {.starts = 2, .max_boxes = 0},
                                      {.starts = 2, .others = false, .max_boxes = 0}};
  RepeatedTrim first(p.model, p.spec);
  RepeatedTrim again = std::move(first);
  for (const TrimOptions& options : ways)
    for (const OperatingPoint& guess : guesses)
      check_same(again(guess, options), trim(p.model, p.spec, guess, options));
}

TEST_CASE("RepeatedTrim: nothing that was evaluated for another guess is taken for this one") {
  TrimProblem p = closed_loop_problem(reference_vehicle(), {15.0, 0.0, 0.0});
  const TrimResult level = trim(p.model, p.spec, p.guess);
  REQUIRE(level);
  p.spec.bounds["V"] = {0.0, 10.0};  // refused, and verified where it is: at the guess
  RepeatedTrim again(p.model, p.spec);
  // At one z: V changes the rates, and the gain of pitch rate at a trim the slopes alone.
  for (const auto& guess : {level.point, with(p.model, level.point, "gains.k_de", 0.5),
                            with(p.model, level.point, "V", 14.0), level.point}) {
    const TrimResult one = trim(p.model, p.spec, guess);
    CHECK(one.status == TrimStatus::infeasible);
    check_same(again(guess), one);
  }
}

TEST_CASE("RepeatedTrim: what the guess fixes, and what the model throws, belong to one guess") {
  Model m = scalar([](double x, double p) {
    if (p > 5) throw std::runtime_error("too far");
    return p - x;
  });
  const TrimSpec spec{.free = {"x"}, .steady = {"x"}, .effort = {{"p", 2.0, 1.0}}};
  RepeatedTrim again(m, spec);
  const TrimOptions few{.starts = 1, .max_boxes = 0};
  for (const double p : {2.0, 6.0, 3.0, 3.0}) {
    const OperatingPoint guess{vec({1.0}), {}, vec({p})};
    check_same(again(guess, few), trim(m, spec, guess, few));
  }
  TrimOptions limited = few;
  limited.time_limit = 100.0;
  check_same(again({vec({1.0}), {}, vec({2.0})}, limited),
             trim(m, spec, {vec({1.0}), {}, vec({2.0})}, limited));
}

TEST_CASE("RepeatedTrim: mistakes throw as those of trim(), and the next guess is trimmed") {
  const Model m = scalar([](double x, double p) { return p - x; });
  CHECK_THROWS_AS(RepeatedTrim(m, {.free = {"y"}, .steady = {"x"}}), std::invalid_argument);
  CHECK_THROWS_AS(RepeatedTrim(m, {.free = {}, .steady = {"x"}}), std::invalid_argument);
  RepeatedTrim again(m, {.free = {"x", "p"}, .steady = {"x"}});
  CHECK_THROWS_AS((void)again({vec({1.0, 2.0}), {}, vec({1.0})}), std::invalid_argument);
  CHECK_THROWS_AS((void)again({vec({NAN}), {}, vec({1.0})}), std::invalid_argument);
  CHECK_THROWS_AS((void)again({vec({1.0}), {}, vec({1.0})}, {.method = TrimMethod::newton}),
                  std::invalid_argument);
  CHECK(again({vec({1.0}), {}, vec({1.0})}).residual <= TrimOptions{}.tolerance);
}

}  // namespace repeated_trim_test
