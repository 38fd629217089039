// Branches of trims against closed forms, published limit points and re-trims; laws; ends.
#include "follow/follow.hpp"

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <functional>
#include <limits>
#include <map>
#include <numbers>
#include <random>
#include <stdexcept>

#include "model/lookup.hpp"
#include "study/reference_vehicle.hpp"
#include "study/study.hpp"
#include "tests/algebra.hpp"
#include "tests/check.hpp"
#include "tests/toy_models.hpp"
#include "vehicles/tiltrotor/formulations.hpp"

using namespace tiltrim;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace follow_test {

static constexpr double NaN = std::numeric_limits<double>::quiet_NaN();
static constexpr double located = 1e-10;     // of an event: Newton's convergence, with margin
static constexpr double differences = 1e-8;  // of an event with differenced slopes (1e-10)

// ---- models without inputs ----

static OperatingPoint at(VectorXd x, VectorXd p) { return {std::move(x), {}, std::move(p)}; }

namespace {

/// A branch to follow.
struct Route {
  Model model;
  TrimSpec spec;
  OperatingPoint start;
  std::string parameter;
  double to;
};

}  // namespace

// All states free, all rates zero.
static Route equilibria(const Model& m, OperatingPoint start, const std::string& parameter,
                        double to, const std::map<std::string, Range>& bounds = {}) {
  const std::vector<std::string> states = names(m.states);
  return {m, {.free = states, .steady = states, .bounds = bounds}, std::move(start), parameter, to};
}

static Route scalar_route(const std::function<double(double x, double p)>& rate, double x, double p,
                          double to, const std::map<std::string, Range>& bounds = {}) {
  return equilibria(scalar(rate), at(vec({x}), vec({p})), "p", to, bounds);
}

static double line(double x, double p) { return p - x; }

// x' = p + x², between p = -1.5 and 1: both branches, x = ∓√-p.
static Route fold_route(double x) {
  return scalar_route([](double y, double p) { return p + y * y; }, x, -x * x, 1.0,
                      {{"p", {-1.5, 1.0}}});
}

// x' = p + q x - x³ with its exact slopes.
static Model cusp() {
  const Model m = flow({"x"}, {"p", "q"}, [](const VectorXd& x, const VectorXd& p) {
    return vec({p[0] + p[1] * x[0] - std::pow(x[0], 3)});
  });
  return with_jacobian(m, [](const OperatingPoint& o) -> MatrixXd {
    return Eigen::RowVector3d(o.p[1] - 3 * o.x[0] * o.x[0], 1, o.x[0]);
  });
}

static Route cusp_route(double q, double x) {
  return equilibria(cusp(), at(vec({x}), vec({std::pow(x, 3) - q * x, q})), "p", 3.0);
}

// Lorenz' equations and their slopes.
static constexpr double sigma = 10, b = 8.0 / 3;

static Model lorenz() {
  const Model m = flow({"x", "y", "z"}, {"r"}, [](const VectorXd& x, const VectorXd& r) {
    return vec({sigma * (x[1] - x[0]), x[0] * (r[0] - x[2]) - x[1], x[0] * x[1] - b * x[2]});
  });
  return with_jacobian(m, [](const OperatingPoint& o) {
    MatrixXd J(3, 4);
    J << -sigma, sigma, 0, 0, o.p[0] - o.x[2], -1, -o.x[0], o.x[0], o.x[1], o.x[0], -b, 0;
    return J;
  });
}

static Route lorenz_route(double r, double to) {
  const double c = std::sqrt(b * (r - 1));
  return equilibria(lorenz(), at(vec({c, c, r - 1}), vec({r})), "r", to, {{"r", {0.1, 40.0}}});
}

// Two inputs for one equation, rate(u1, u2) = p; the state is fixed and decays.
static Route allocation(const std::function<double(double u1, double u2)>& rate, double weight,
                        double most1, double most2, OperatingPoint start, double to) {
  Model m;
  m.states = {{"x", "", 1.0}};
  m.inputs = {{"u1", "", 1.0}, {"u2", "", 1.0}};
  m.parameters = {{"p", "", 1.0}};
  m.f = [rate](const VectorXd& x, const VectorXd& u, const VectorXd& p) {
    return vec({rate(u[0], u[1]) - p[0] - x[0]});
  };
  TrimSpec spec{.free = {"u1", "u2"}, .steady = {"x"}};
  spec.bounds = {{"u1", {-5, most1}}, {"u2", {-5, most2}}};
  spec.effort = {{"u1", 1.0}, {"u2", 1 / std::sqrt(weight)}};
  return {m, spec, std::move(start), "p", to};
}

// u1 + u2 = p of least u1² + 2 u2²: u = (2p/3, p/3) until u1 = 1, then (1, p - 1) until u2 = 0.75.
static Route corner_route(double u1, double u2, double to) {
  return allocation([](double v1, double v2) { return v1 + v2; }, 2.0, 1.0, 0.75,
                    {vec({0}), vec({u1, u2}), vec({u1 + u2})}, to);
}

// ---- following, with checks of every branch ----

static double left_over(const Route& r, const OperatingPoint& point) {
  const VectorXd rates = evaluate(r.model, point).rates;
  double most = 0;
  for (const std::string& name : r.spec.steady) {
    const auto i = index_of(r.model.states, name, "state");
    most = std::max(most, std::abs(rates[i]) / r.model.states[std::size_t(i)].nominal);
  }
  return most;
}

static double value(const Model& m, const OperatingPoint& point, const std::string& name) {
  return value_of(point, variable(m, name));
}

// Violation of a bound on a free variable.
static double beyond_bounds(const Route& r, const OperatingPoint& point) {
  double most = 0;
  for (const std::string& name : r.spec.free)
    if (const auto bound = r.spec.bounds.find(name); bound != r.spec.bounds.end()) {
      const double v = value(r.model, point, name);
      most = std::max({most, bound->second.lower - v, v - bound->second.upper});
    }
  return most;
}

static Branch walk(const Route& r, const FollowOptions& options = {}) {
  const Branch branch = follow(r.model, r.spec, r.start, r.parameter, r.to, options);
  REQUIRE(!branch.events.empty());
  CHECK(branch.events.back().kind == EventKind::end);
  CHECK(std::ranges::count(branch.events, EventKind::end, &BranchEvent::kind) == 1);
  CHECK(branch.events.back().which == branch.message);
  CHECK(std::ssize(branch.points) <= options.max_points);
  CHECK(std::ranges::is_sorted(branch.events, {}, &BranchEvent::after));
  CHECK(branch.events.back().after == branch.points.size());
  double residual = 0, step = 0, excess = 0, misnamed = 0;
  const auto judge = [&](const BranchPoint& p) {
    residual = std::max({residual, p.residual, left_over(r, p.point)});
    step = std::max(step, p.step);
    excess = std::max(excess, beyond_bounds(r, p.point));
    misnamed = std::max(misnamed, std::abs(p.parameter - value(r.model, p.point, r.parameter)));
  };
  for (const BranchPoint& p : branch.points) judge(p);
  for (const BranchEvent& e : branch.events) judge(e.at);
  CHECK(residual <= options.tolerance);
  CHECK(step <= options.step_tolerance);
  CHECK(excess <= options.tolerance);
  CHECK(misnamed <= 1e-14);  // one rounding by the nominal size
  return branch;
}

// "fold, limit u1 upper, end: reached"
static std::string story(const Branch& branch) {
  std::string words;
  for (const BranchEvent& e : branch.events) {
    words += to_string(e.kind);
    if (e.kind == EventKind::limit || e.kind == EventKind::limit_left) words += " " + e.which;
    words += e.kind == EventKind::end ? ": " + to_string(branch.end) : ", ";
  }
  return words;
}

static std::vector<BranchEvent> of(const Branch& branch, EventKind kind) {
  std::vector<BranchEvent> found;
  std::ranges::copy_if(branch.events, std::back_inserter(found),
                       [kind](const BranchEvent& e) { return e.kind == kind; });
  return found;
}

// Largest difference of the events' parameters, without the ends.
static double apart(const Branch& one, const Branch& other) {
  REQUIRE(one.events.size() == other.events.size());
  double most = 0;
  for (std::size_t i = 0; i + 1 < one.events.size(); ++i)
    most = std::max(most, std::abs(one.events[i].at.parameter - other.events[i].at.parameter));
  return most;
}

// From the other end the same events come in reverse order, and the start is reached.
static void check_way_back(const Route& there, const Branch& branch) {
  Route back = there;
  back.start = branch.events.back().at.point;
  back.to = value(there.model, there.start, there.parameter);
  const Branch again = walk(back);
  CHECK(again.end == BranchEnd::reached);
  auto expected = branch.events;
  expected.pop_back();
  if (branch.end == BranchEnd::limit) expected.pop_back();  // the reverse branch starts on it
  std::ranges::reverse(expected);
  REQUIRE(again.events.size() == expected.size() + 1);
  for (std::size_t i = 0; i < expected.size(); ++i) {
    const bool limit = expected[i].kind == EventKind::limit;
    CHECK(again.events[i].kind == (limit ? EventKind::limit_left : expected[i].kind));
    CHECK(again.events[i].which == expected[i].which);
    CHECK_NEAR(again.events[i].at.parameter, expected[i].at.parameter, 1e-9);
  }
}

// ---- closed forms ----

TEST_CASE("kinds and ends are spelt") {
  const std::vector<std::string> kinds = {"fold", "limit",        "limit_left", "zero",
                                          "hopf", "branch_point", "end"};
  const std::vector<std::string> ends = {"reached",     "limit",    "closed",     "switched",
                                         "not_implied", "stuck",    "not_finite", "singular",
                                         "points",      "no_start", "interrupted"};
  for (std::size_t i = 0; i < kinds.size(); ++i) CHECK(to_string(EventKind(i)) == kinds[i]);
  for (std::size_t i = 0; i < ends.size(); ++i) CHECK(to_string(BranchEnd(i)) == ends[i]);
}

TEST_CASE("x' = p + x²: two branches meet in a fold at the origin") {
  for (const double from : {-1.0, 1.0}) {
    const Branch branch = walk(fold_route(from));
    CHECK(story(branch) == "fold, limit p lower, end: limit");
    const BranchEvent& fold = branch.events[0];
    CHECK_NEAR(fold.at.parameter, 0.0, located);
    CHECK_NEAR(fold.at.point.x[0], 0.0, located);
    CHECK_NEAR(std::abs(fold.eigenvalue.value()), 0.0, 2 * located);  // λ = 2x
    CHECK_NEAR(branch.events[1].at.point.x[0], std::copysign(std::sqrt(1.5), -from), located);
    for (const BranchPoint& p : branch.points) {
      CHECK_NEAR(p.parameter, -p.point.x[0] * p.point.x[0], 1e-10);  // the rate's tolerance
      REQUIRE(p.unstable.has_value());
      CHECK(*p.unstable == (p.point.x[0] > 0 ? 1 : 0));
    }
  }
}

TEST_CASE("x' = p + x², followed in the state: the eigenvalue 2x crosses zero without a fold") {
  Route r = fold_route(-1);
  r.spec = {.free = {"p"}, .steady = {"x"}};
  r.parameter = "x";
  const Branch branch = walk(r);
  CHECK(story(branch) == "zero, end: reached");
  CHECK_NEAR(branch.events[0].at.parameter, 0.0, differences);
  CHECK_NEAR(branch.events[1].at.point.p[0], -1.0, located);
}

TEST_CASE("cusp p + q x - x³: folds at ±2 (q/3)^(3/2), x = ∓√(q/3)") {
  for (const double q : {0.1, 0.5, 1.0, 2.0, 3.0}) {
    const Branch branch = walk(cusp_route(q, -2.2));
    CHECK(story(branch) == "fold, fold, end: reached");
    for (const int i : {0, 1}) {
      const double side = i == 0 ? 1 : -1;
      const BranchEvent& fold = branch.events[std::size_t(i)];
      CHECK_NEAR(fold.at.parameter, side * 2 * std::pow(q / 3, 1.5), located);
      CHECK_NEAR(fold.at.point.x[0], -side * std::sqrt(q / 3), located);
    }
    CHECK(branch.events.back().at.parameter == 3.0);
    for (const BranchPoint& p : branch.points)
      CHECK(*p.unstable == (3 * p.point.x[0] * p.point.x[0] < q ? 1 : 0));
  }
}

TEST_CASE("the Hopf normal form: a pair ±i at μ = 0") {
  const Model m = flow({"x", "y"}, {"mu"}, [](const VectorXd& x, const VectorXd& p) {
    const double r2 = x.squaredNorm();
    return vec({p[0] * x[0] - x[1] - x[0] * r2, x[0] + p[0] * x[1] - x[1] * r2});
  });
  const Branch branch = walk(equilibria(m, at(vec({0, 0}), vec({-1})), "mu", 1));
  CHECK(story(branch) == "hopf, end: reached");
  CHECK_NEAR(branch.events[0].at.parameter, 0.0, differences);
  CHECK_NEAR(branch.events[0].eigenvalue.value().real(), 0.0, differences);
  CHECK_NEAR(branch.events[0].eigenvalue.value().imag(), 1.0, differences);
  for (const BranchPoint& p : branch.points) CHECK(*p.unstable == (p.parameter > 0 ? 2 : 0));
}

TEST_CASE("Lorenz: the Hopf point of C+ at r = σ(σ + b + 3)/(σ - b - 1)") {
  const double r = sigma * (sigma + b + 3) / (sigma - b - 1);  // 470/19
  const Branch branch = walk(lorenz_route(10, 30));
  CHECK(story(branch) == "hopf, end: reached");
  CHECK_NEAR(branch.events[0].at.parameter, r, 1e-9);
  CHECK_NEAR(branch.events[0].at.point.x[0], std::sqrt(b * (r - 1)), 1e-9);
  CHECK_NEAR(branch.events[0].eigenvalue.value().real(), 0.0, 1e-9);
  CHECK_NEAR(branch.events[0].eigenvalue.value().imag(), std::sqrt(b * (r + sigma)), 1e-9);
}

// ---- published limit points ----

// The aircraft stability problem of ACM Transactions on Mathematical Software, algorithm 596
// (W. C. Rheinboldt, J. V. Burkardt: PITCON, 1983), equations and limit points as quoted in its
// sample program; the first table is that of R. Melhem, W. Rheinboldt: A comparison of methods for
// determining turning points of nonlinear equations, Computing 29, 201-226, 1982. The elevator acts
// on the angle of attack by -0.168: the -1.168 of the CUTEst copy contradicts both tables.
static Model rolling_aircraft() {
  return flow(
      {"roll", "pitch", "yaw", "alpha", "beta"}, {"elevator", "aileron", "rudder"},
      [](const VectorXd& x, const VectorXd& control) {
        const double p = x[0], q = x[1], r = x[2], alpha = x[3], beta = x[4];
        const double de = control[0], da = control[1], dr = control[2];
        return vec({-3.933 * p + 0.107 * q + 0.126 * r - 9.99 * beta - 45.83 * da - 7.64 * dr -
                        0.727 * q * r + 8.39 * r * alpha - 684.4 * alpha * beta + 63.5 * alpha * da,
                    -0.987 * q - 22.95 * alpha - 28.37 * de + 0.949 * p * r + 0.173 * p * beta,
                    0.002 * p - 0.235 * r + 5.67 * beta - 0.921 * da - 6.51 * dr - 0.716 * p * q -
                        1.578 * p * alpha + 1.132 * alpha * da,
                    q - alpha - 0.168 * de - p * beta,
                    -r - 0.196 * beta - 0.0071 * da + p * alpha});
      });
}

namespace {

/// Roll to beta, elevator, aileron as printed, in the order along the branch. Eight entries are
/// misprinted: seven are corrected from the others, with the printed value in a comment.
struct LimitPoints {
  double towards;
  std::vector<std::array<std::string, 7>> rows;
};

}  // namespace

static const LimitPoints published[] = {
    {0.75,
     {{"-2.9691", "0.83074", "-0.072748", "0.041029" /* 0.41029 */, "-0.26880", "-.05", "0.50919"},
      {"-2.8158", "-0.17481", "-0.089469", "0.026319", "0.070951", "-.008", "0.20442"},
      {"-3.7571", "-0.64911", "-0.38350" /* -0.39350 */, "0.091810", "0.19685", "-.008",
       "-.0038238"},
      {"-4.1637", "0.092284", "-0.092610", "0.022402", "-0.017106", "-.008", "0.37823"},
      {"-2.5839", "-0.22128", "-0.054079", "0.013524", "0.090871", "0.0", "0.18608"},
      {"-3.9007", "-1.1421", "-0.57863", "0.13284", "0.32685", "0.0", "-0.50703"},
      {"-2.3610", "-0.72360", "0.032739", "-0.039108", "0.29347", "0.05", "0.29272"},
      {"-2.2982", "-1.4033" /* 1.4033 */, "0.063244", "-0.079383", "0.58336", "0.10",
       "" /* 0.58336, beta again */}}},
    {-0.75,
     {{"2.9648", "0.82556", "0.07366", "0.041309", "0.26734", "-0.050", "-.50481" /* -.050481 */},
      {"2.8173", "-0.17628", "0.08992", "0.026429", "-0.07147", "-0.008", "-.204973"},
      {"3.7579", "-0.65541", "0.38658", "0.092520", "-0.19867", "-0.008", "0.0062" /* 0.006200 */},
      {"4.1638", "0.08913", "0.09480", "0.022888", "0.016232" /* 0.16232 */, "-0.008", "-.377660"},
      {"2.5873", "-0.22354", "0.05468", "0.013676", "-0.09168", "0.000", "-.186908"},
      {"3.9005", "-1.14815", "0.58156", "0.133516", "-0.32858", "0.000", ".510158"},
      {"2.3639", "-0.72974", "-0.031604" /* -0.31604 */, "-0.038785", "-0.29583", "0.050",
       "-.295772"},
      {"2.2992", "-1.41023", "-0.06184", "-0.079009", "-0.58629", "0.100", "-.689717"}}}};

TEST_CASE("ACM algorithm 596: the limit points of a rolling aircraft, to their printed digits") {
  const Model m = rolling_aircraft();
  for (const LimitPoints& table : published)
    for (std::size_t row = 0; row < table.rows.size();) {
      const std::string elevator = table.rows[row][5];
      Route r = equilibria(m, at(VectorXd::Zero(5), vec({std::stod(elevator), 0, 0})), "aileron",
                           table.towards, {{"aileron", {-0.8, 0.8}}});
      const TrimResult start = trim(m, r.spec, r.start, {.method = TrimMethod::newton});
      REQUIRE(start);
      r.start = start.point;
      for (const BranchEvent& fold : of(walk(r, {.stability = false}), EventKind::fold)) {
        CAPTURE(row);
        REQUIRE(row < table.rows.size());
        REQUIRE(table.rows[row][5] == elevator);
        for (std::size_t k = 0; k < 7; ++k)
          if (const std::string& printed = table.rows[row][k]; !printed.empty()) {
            const double here = k < 5 ? fold.at.point.x[int(k)] : fold.at.point.p[int(k) - 5];
            // Two units of the last digit: the tables chop, and one digit is off by 1.1 units.
            CHECK_NEAR(here, std::stod(printed), 4 * printed_to(printed));
          }
        ++row;
      }
      REQUIRE((row == table.rows.size() || table.rows[row][5] != elevator));
    }
}

// ---- limits of minimum-effort trims ----

static Model with_output(Model m) {
  m.outputs = {{"load", "", 1.0}};
  m.h = [](const VectorXd&, const VectorXd& u, const VectorXd&) { return vec({2 * u[0]}); };
  return m;
}

TEST_CASE("the least effort goes on along a limit until nothing is free") {
  Route r = corner_route(0, 0, 3);
  std::string limited = "u1";
  SUBCASE("a limit on an input") {}
  SUBCASE("the same limit through an output, load = 2 u1") {
    limited = "load";
    r.model = with_output(r.model);
    r.spec.bounds.erase("u1");
    r.spec.bounds["load"] = {-10, 2};
  }
  const Branch there = walk(r);
  CHECK(story(there) == "limit " + limited + " upper, limit u2 upper, end: limit");
  CHECK_NEAR(there.events[0].at.parameter, 1.5, located);
  CHECK_NEAR(there.events[1].at.parameter, 1.75, located);

  r.start = {vec({0}), vec({1, 0.7}), vec({1.7})};
  r.to = 0;
  const Branch back = walk(r);
  CHECK(story(back) == "limit_left " + limited + " upper, end: reached");
  CHECK_NEAR(back.events[0].at.parameter, 1.5, located);

  for (const Branch& branch : {there, back})
    for (const BranchPoint& p : branch.points) {
      const double u1 = std::min(2 * p.parameter / 3, 1.0);
      CHECK_NEAR(p.point.u[0], u1, differences);
      CHECK_NEAR(p.point.u[1], p.parameter - u1, differences);
    }
}

TEST_CASE("a start that satisfies the equations is first brought to the least effort") {
  const Branch branch = walk(corner_route(0.1, 0.5, 3));
  CHECK_NEAR(branch.points[0].parameter, 0.6, 1e-15);
  CHECK_NEAR(branch.points[0].point.u[0], 0.4, located);
  CHECK_NEAR(branch.points[0].point.u[1], 0.2, located);
}

TEST_CASE("u1 u2 = p of least u1² + 4 u2²: (√2p, √p/2) until u1 = 1, then (1, p)") {
  const Route r = allocation([](double u1, double u2) { return u1 * u2; }, 4.0, 1.0, 0.8,
                             {vec({0}), vec({std::sqrt(0.2), std::sqrt(0.05)}), vec({0.1})}, 3);
  const Branch branch = walk(r);
  CHECK(story(branch) == "limit u1 upper, limit u2 upper, end: limit");
  CHECK_NEAR(branch.events[0].at.parameter, 0.5, 1e-9);
  CHECK_NEAR(branch.events[1].at.parameter, 0.8, 1e-9);
  for (const BranchPoint& p : branch.points) {
    const bool held = p.parameter > 0.5;
    CHECK_NEAR(p.point.u[0], held ? 1.0 : std::sqrt(2 * p.parameter), differences);
    CHECK_NEAR(p.point.u[1], held ? p.parameter : std::sqrt(p.parameter / 2), differences);
  }
}

// ---- ends ----

static Route jump_route() {
  return scalar_route([](double x, double p) { return p - x + (x > 1 ? 0.5 : 0.0); }, 0, 0, 3);
}

// The kink and the jump at x = 1 that a model may declare.
static void declare(Model& m) {
  m.switches = {{"x passes one", [](const OperatingPoint& o) { return o.x[0] - 1; }}};
}

static MatrixXd line_slopes(const OperatingPoint&) { return Eigen::RowVector2d(-1, 1); }

TEST_CASE("every end is reached and named") {
  SUBCASE("reached") {
    const Branch branch = walk(scalar_route(line, 0, 0, 3));
    CHECK(story(branch) == "end: reached");
    CHECK_NEAR(branch.events[0].at.parameter, 3.0, 1e-14);
    CHECK_NEAR(branch.events[0].at.point.x[0], 3.0, located);
  }
  SUBCASE("limit: where nothing is free, a limit ends the branch") {
    const Branch branch = walk(scalar_route(line, 0, 0, 3, {{"x", {-1, 1}}}));
    CHECK(story(branch) == "limit x upper, end: limit");
    CHECK_NEAR(branch.events[1].at.parameter, 1.0, located);
  }
  SUBCASE("closed: a circle, from several of its points") {
    for (const double angle : {0.0, 0.3, 1.0, 2.0}) {
      const auto circle = [](double x, double p) { return x * x + p * p - 1; };
      const double x = std::cos(angle), p = std::sin(angle);
      const Branch branch = walk(scalar_route(circle, x, p, 5), {.max_step = 0.1});
      CHECK(story(branch) == "fold, fold, end: closed");
      for (const BranchEvent& fold : of(branch, EventKind::fold)) {
        CHECK_NEAR(std::abs(fold.at.parameter), 1.0, located);
        CHECK_NEAR(fold.at.point.x[0], 0.0, located);
      }
      CHECK_NEAR(branch.events.back().at.point.x[0], x, located);
      CHECK_NEAR(branch.events.back().at.parameter, p, located);
    }
  }
  SUBCASE("not_implied: what should follow from the equations does not beyond p = 1") {
    Route r = equilibria(flow({"x", "y"}, {"p"},
                              [](const VectorXd& x, const VectorXd& p) {
                                return vec({p[0] - x[0], std::max(0.0, x[0] - 1)});
                              }),
                         at(vec({0, 0}), vec({0})), "p", 3);
    r.spec.free = {"x"};
    r.spec.steady = {"x"};
    r.spec.implied = {"y"};
    const Branch branch = follow(r.model, r.spec, r.start, "p", 3);
    CHECK(story(branch) == "end: not_implied");
    CHECK(branch.message.find("y'") != std::string::npos);
    CHECK(branch.points.back().parameter <= 1 + 1e-10);
  }
  SUBCASE("switched: a jump that the model declares") {
    Route r = jump_route();
    r.model = with_jacobian(r.model, line_slopes);
    declare(r.model);
    const Branch branch = walk(r);
    CHECK(story(branch) == "end: switched");
    CHECK(branch.message.find("x passes one") != std::string::npos);
    CHECK_NEAR(branch.events[0].at.parameter, 1.0, 1e-8);  // ten of the shortest steps
  }
  SUBCASE("a kink that the model declares is no end") {
    Route r = scalar_route([](double x, double p) { return p - std::max(x, 2 * x - 1); }, 0, 0, 3);
    r.model = with_jacobian(r.model, [](const OperatingPoint& o) -> MatrixXd {
      return Eigen::RowVector2d(o.x[0] > 1 ? -2 : -1, 1);
    });
    declare(r.model);
    const Branch branch = walk(r);
    CHECK(story(branch) == "end: reached");
    CHECK_NEAR(branch.events[0].at.point.x[0], 2.0, located);
  }
  SUBCASE("stuck: a jump that nobody declared") {
    const Branch branch = walk(jump_route());
    CHECK(story(branch) == "end: stuck");
    CHECK_NEAR(branch.events[0].at.parameter, 1.0, 1e-5);  // within a step of the differences
  }
  SUBCASE("not_finite: no numbers ahead") {
    const Branch branch =
        walk(scalar_route([](double x, double p) { return p > 1 ? NaN : p - x; }, 0, 0, 3));
    CHECK(story(branch) == "end: not_finite");
    CHECK_NEAR(branch.events[0].at.parameter, 1.0, 1e-5);
  }
  SUBCASE("not_finite: the model throws ahead, and its words are kept") {
    const auto rate = [](double x, double p) {
      if (p > 1) throw std::runtime_error("beyond the table");
      return p - x;
    };
    const Branch branch = walk(scalar_route(rate, 0, 0, 3));
    CHECK(story(branch) == "end: not_finite");
    CHECK(branch.message.find("beyond the table") != std::string::npos);
    CHECK_NEAR(branch.events[0].at.parameter, 1.0, 1e-5);
  }
  SUBCASE("reached: the table ends at the target") {
    const auto rate = [](double x, double p) {
      if (p > 0.5) throw std::domain_error("the table ends");
      return p - std::sin(x);
    };
    Route r = scalar_route(rate, 0, 0, 0.5);
    r.model = with_jacobian(r.model, [](const OperatingPoint& o) -> MatrixXd {
      return Eigen::RowVector2d(-std::cos(o.x[0]), 1);
    });
    const Branch branch = walk(r);
    CHECK(story(branch) == "end: reached");
    CHECK(branch.events[0].at.parameter == 0.5);
    CHECK_NEAR(branch.events[0].at.point.x[0], std::asin(0.5), located);
  }
  SUBCASE("not_finite: the branch's own edge, of infinite slope, both ways") {
    const auto down = [](double x, double p) { return x - std::sqrt(1 - p); };
    const auto up = [](double x, double p) { return (p >= 0 ? std::sqrt(p) : NaN) - x; };
    const auto throws = [](double x, double p) {
      if (p < 0) throw std::domain_error("no root");
      return std::sqrt(p) - x;
    };
    const struct {
      Route route;
      double edge;
      std::string words;
    } all[] = {{scalar_route(down, 1, 0, 3), 1.0, "x' = nan"},
               {scalar_route(down, 1, 0, 2), 1.0, "x' = nan"},
               {scalar_route(up, 1, 1, -3), 0.0, "x' = nan"},
               {scalar_route(throws, 1, 1, -3), 0.0, "the model threw: no root"}};
    for (const auto& [route, edge, words] : all) {
      const Branch branch = walk(route);
      CHECK(story(branch) == "end: not_finite");
      CHECK(branch.message.find("the model is not finite beyond the point at p = ") == 0);
      CHECK(branch.message.find(words) != std::string::npos);
      CHECK_NEAR(branch.events[0].at.parameter, edge, 1e-5);
    }
  }
  SUBCASE("singular: two equations that say the same") {
    const Model m = flow({"x", "y"}, {"p"}, [](const VectorXd& x, const VectorXd& p) {
      const double rate = p[0] - x[0] - x[1];
      return vec({rate, 2 * rate});
    });
    CHECK(story(walk(equilibria(m, at(vec({0.5, 0.5}), vec({1})), "p", 3))) == "end: singular");
  }
  SUBCASE("singular: every point is a trim") {
    CHECK(story(walk(scalar_route([](double, double) { return 0.0; }, 0, 0, 3))) ==
          "end: singular");
  }
  SUBCASE("points: a branch that never comes to where it was to go") {
    const Branch branch = walk(
        scalar_route([](double x, double p) { return p + x * x; }, -1, -1, 1), {.max_points = 50});
    CHECK(story(branch) == "fold, end: points");
  }
  SUBCASE("no_start: the rates do not vanish, are no numbers, or the model throws") {
    const auto threw = [](double, double) -> double { throw std::runtime_error("no"); };
    for (const Route& r :
         {scalar_route(line, 1, 5, 8), scalar_route([](double, double) { return NaN; }, 0, 0, 1),
          scalar_route(threw, 0, 0, 1)}) {
      const Branch branch = follow(r.model, r.spec, r.start, r.parameter, r.to);
      CHECK(branch.end == BranchEnd::no_start);
      CHECK(branch.points.empty());
      CHECK(!branch.message.empty());
    }
  }
  SUBCASE("interrupted: before the first step, and from the observer") {
    std::stop_source stop;
    FollowOptions options{.stop = stop.get_token()};
    options.observe = [&](double, std::size_t points) {
      if (points == 7) stop.request_stop();
    };
    const Branch branch = walk(scalar_route(line, 0, 0, 3), options);
    CHECK(story(branch) == "end: interrupted");
    CHECK(branch.points.size() == 7);
    CHECK(story(walk(scalar_route(line, 0, 0, 3), options)) == "end: interrupted");
  }
}

TEST_CASE("no verdict on stability where it is not asked or there is no equilibrium") {
  const Branch unasked = walk(fold_route(-1), {.stability = false});
  CHECK(story(unasked) == "fold, limit p lower, end: limit");
  CHECK(!unasked.points[0].unstable.has_value());
  Route r = scalar_route(line, -2, 0, 3);
  r.spec.steady.clear();
  r.spec.rates["x"] = 2;  // x' = 2: moving
  const Branch moving = follow(r.model, r.spec, r.start, "p", 3);
  CHECK(moving.end == BranchEnd::reached);
  CHECK(!moving.points[0].unstable.has_value());
  CHECK_NEAR(moving.events.back().at.point.x[0], 1.0, located);
}

// ---- laws ----

static std::vector<Route> sample() {
  return {cusp_route(1, -2.2), lorenz_route(10, 30), corner_route(0, 0, 3)};
}

TEST_CASE("the way back meets the same events") {
  for (const Route& r : sample()) check_way_back(r, walk(r));
}

TEST_CASE("slopes by differences lead to the same events") {
  for (Route r : {cusp_route(1, -2.2), lorenz_route(10, 30)}) {
    const Branch with_slopes = walk(r);
    r.model.derivatives = nullptr;
    const Branch without = walk(r);
    CHECK(story(without) == story(with_slopes));
    CHECK(apart(without, with_slopes) <= differences);
  }
}

TEST_CASE("the nominal sizes are only a scale") {
  for (Route r : sample()) {
    const Branch as_given = walk(r);
    for (Signals* signals : {&r.model.states, &r.model.inputs, &r.model.parameters})
      for (Signal& s : *signals) s.nominal *= 10;
    const Branch larger = walk(r);
    CHECK(story(larger) == story(as_given));
    CHECK(apart(larger, as_given) <= 1e-8);
  }
}

TEST_CASE("trim() finds the branch's points again") {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> aside(-1e-3, 1e-3);
  for (const Route& r : {cusp_route(1, -2.2), lorenz_route(10, 30)}) {
    const Branch branch = walk(r);
    const std::vector<BranchEvent> folds = of(branch, EventKind::fold);
    for (const BranchPoint& p : branch.points) {
      const bool at_fold = std::ranges::any_of(folds, [&](const BranchEvent& fold) {
        return (fold.at.point.x - p.point.x).norm() < 0.05;  // two solutions, near each other
      });
      if (at_fold) continue;
      OperatingPoint guess = p.point;
      for (double& x : guess.x) x += aside(random);
      const TrimResult again =
          trim(r.model, r.spec, guess, {.method = TrimMethod::newton, .starts = 0});
      REQUIRE(again);
      CHECK_NEAR((again.point.x - p.point.x).norm(), 0.0, 1e-8);  // tolerance over slope, 1e-2
    }
  }
}

// ---- events hidden within a step ----

TEST_CASE("two folds within one step are both found") {
  std::mt19937 random(11);
  std::uniform_real_distribution<double> from(-2, -1);
  for (const double q : {1e-1, 1e-2, 1e-3, 1e-4})
    for (int trial = 0; trial < trials(20); ++trial) {
      const Branch branch = walk(cusp_route(q, from(random)), {.max_step = 5.0});
      CHECK(story(branch) == "fold, fold, end: reached");
      for (const BranchEvent& fold : of(branch, EventKind::fold))
        CHECK_NEAR(std::abs(fold.at.parameter), 2 * std::pow(q / 3, 1.5), located);
    }
}

TEST_CASE("a limit touched and left within one step ends the branch") {
  const auto bump = [](double p) { return 1 / (1 + p * p); };
  std::mt19937 random(13);
  std::uniform_real_distribution<double> from(-2, -1);
  for (const double over : {1e-1, 1e-2, 1e-3, 1e-4, 1e-5})
    for (int trial = 0; trial < trials(20); ++trial) {
      const double p = from(random);
      const Branch branch = walk(scalar_route([&](double x, double q) { return bump(q) - x; },
                                              bump(p), p, 3, {{"x", {-1, 1 - over}}}));
      CHECK(story(branch) == "limit x upper, end: limit");
      // 1/(1 + p²) = 1 - over, where the slope 2p magnifies the residual of x.
      CHECK_NEAR(branch.events[0].at.parameter, -std::sqrt(over / (1 - over)), 1e-9);
    }
}

// ---- the caller's mistakes ----

TEST_CASE("the caller's mistakes throw") {
  const Route r = scalar_route(line, 0, 0, 3);
  const auto asked = [&](const std::string& parameter, double to) {
    return follow(r.model, r.spec, r.start, parameter, to);
  };
  CHECK_THROWS_AS(asked("speed", 3), std::invalid_argument);  // unknown
  CHECK_THROWS_AS(asked("x", 3), std::invalid_argument);      // free in the trim
  CHECK_THROWS_AS(asked("p", 0), std::invalid_argument);      // the start already
  CHECK_THROWS_AS(asked("p", NaN), std::invalid_argument);
  CHECK_THROWS_AS(asked("p", std::numeric_limits<double>::infinity()), std::invalid_argument);
  CHECK_THROWS_AS((void)follow(r.model, r.spec, at(vec({0, 0}), vec({0})), "p", 3),
                  std::invalid_argument);  // a start of the wrong size
  for (const FollowOptions& options : {FollowOptions{.max_step = NaN},
                                       {.max_step = 0},
                                       {.max_points = -1},
                                       {.tolerance = NaN},
                                       {.step_tolerance = -1}})
    CHECK_THROWS_AS((void)follow(r.model, r.spec, r.start, "p", 3, options), std::invalid_argument);
}

// ---- the tiltrotor ----

static constexpr double degree = std::numbers::pi / 180;

static Route flight(double V, double gamma, double to) {
  const TrimProblem problem = closed_loop_problem(reference_vehicle(), {V, gamma, 0}, Axes::wind);
  const TrimResult start =
      trim(problem.model, problem.spec, problem.guess, {.method = TrimMethod::newton});
  REQUIRE(start);
  return {problem.model, problem.spec, start.point, "V", to};
}

// ∂(rates of `rows`)/∂(variables) by central differences of the model's f.
static MatrixXd slopes(const Model& m, const OperatingPoint& point,
                       const std::vector<std::string>& rows,
                       const std::vector<std::string>& variables) {
  MatrixXd J(std::ssize(rows), std::ssize(variables));
  for (Eigen::Index k = 0; k < J.cols(); ++k) {
    const auto j = variable(m, variables[std::size_t(k)]);
    const double h = 1e-5 * signal_of(m, j).nominal;
    OperatingPoint ahead = point, behind = point;
    set_value(ahead, j, value_of(point, j) + h);
    set_value(behind, j, value_of(point, j) - h);
    const VectorXd slope = (evaluate(m, ahead).rates - evaluate(m, behind).rates) / (2 * h);
    for (Eigen::Index i = 0; i < J.rows(); ++i)
      J(i, k) = slope[index_of(m.states, rows[std::size_t(i)], "state")];
  }
  return J;
}

// The trim nearest to a guess with one variable fixed and another freed instead.
static TrimResult retrim(const Route& r, OperatingPoint guess, const std::string& given, double v,
                         const std::string& instead = "") {
  TrimSpec spec = r.spec;
  if (!instead.empty()) std::ranges::replace(spec.free, given, instead);
  set_value(guess, variable(r.model, given), v);
  return trim(r.model, spec, guess, {.method = TrimMethod::newton, .starts = 0});
}

// V(θ), from trim() with the speed free, has its extremum at the fold; on one side of it two trims
// exist, on the other none nearby.
static void check_fold(const Route& r, const BranchEvent& fold) {
  const double theta = value(r.model, fold.at.point, "theta"), V = fold.at.parameter;
  constexpr double h = 2e-3;
  const TrimResult lower = retrim(r, fold.at.point, "theta", theta - h, "V");
  const TrimResult upper = retrim(r, fold.at.point, "theta", theta + h, "V");
  REQUIRE((lower && upper));
  const double rise_lower = value(r.model, lower.point, "V") - V;
  const double rise_upper = value(r.model, upper.point, "V") - V;
  CHECK(rise_lower * rise_upper > 0);
  // The vertex of the parabola through the three; V''' h³ is left out.
  const double slope = (rise_upper - rise_lower) / (2 * h);
  const double curvature = (rise_upper + rise_lower) / (h * h);
  CHECK_NEAR(slope / curvature, 0.0, 5e-2 * h);
  CHECK_NEAR(slope * slope / (2 * curvature), 0.0, 1e-2 * std::abs(rise_lower));

  const double beside = 0.5 * std::min(std::abs(rise_lower), std::abs(rise_upper));
  const double inside = V + std::copysign(beside, rise_lower);
  const double outside = V - std::copysign(beside, rise_lower);
  const TrimResult one = retrim(r, lower.point, "V", inside);
  const TrimResult other = retrim(r, upper.point, "V", inside);
  REQUIRE((one && other));
  CHECK(value(r.model, one.point, "theta") < theta);
  CHECK(value(r.model, other.point, "theta") > theta);
  for (const OperatingPoint& guess : {lower.point, fold.at.point, upper.point}) {
    const TrimResult none = retrim(r, guess, "V", outside);
    CHECK((!none || std::abs(value(r.model, none.point, "theta") - theta) > 10 * h));
  }
}

// The pair on the axis, by Eigen's own solver on differences of f.
static void check_hopf(const Route& r, const BranchEvent& hopf) {
  const std::vector<std::string> states = names(r.model.states);
  const MatrixXd A = slopes(r.model, hopf.at.point, states, states);
  const Eigen::VectorXcd lambda = algebra::eigenvalues(A);
  const std::complex<double> nearest = *std::ranges::min_element(
      lambda, {}, [&](const std::complex<double>& l) { return std::abs(l - *hopf.eigenvalue); });
  CHECK(hopf.eigenvalue.value().imag() > 0);
  CHECK_NEAR(nearest.real(), 0.0, 1e-6);  // differences: 1e-9 of entries of 1e2
  CHECK_NEAR(nearest.imag(), hopf.eigenvalue.value().imag(), 1e-6);
}

// At the limit the trim holds; slightly further it would exceed the limit.
static void check_limit(const Route& r, const BranchEvent& limit, const std::string& signal,
                        double bound, double further) {
  CHECK(limit.which == signal + " lower");
  const auto i = index_of(r.model.outputs, signal, "output");
  CHECK_NEAR(evaluate(r.model, limit.at.point).outputs[i], bound, 1e-9);
  Route wider = r;
  wider.spec.bounds.erase(signal);
  const TrimResult beyond =
      retrim(wider, limit.at.point, "V", limit.at.parameter + std::copysign(1e-3, further));
  REQUIRE(beyond);
  CHECK(evaluate(r.model, beyond.point).outputs[i] < bound);
}

// Checks of the branch by independent methods.
static void check_flight(const Route& r, const Branch& branch) {
  for (const BranchEvent& fold : of(branch, EventKind::fold)) check_fold(r, fold);
  for (const BranchEvent& hopf : of(branch, EventKind::hopf)) check_hopf(r, hopf);
  const std::vector<std::string> states = names(r.model.states);
  int turns = 0;
  double last = 0;
  for (const BranchPoint& p : branch.points) {
    // Between folds the determinant of ∂(rates held)/∂(unknowns) keeps its sign.
    const double det = algebra::determinant(slopes(r.model, p.point, r.spec.steady, r.spec.free));
    turns += det * last < 0;
    last = det;
    const Eigen::VectorXcd lambda = algebra::eigenvalues(slopes(r.model, p.point, states, states));
    CHECK(*p.unstable == (lambda.real().array() > 0).count());
  }
  CHECK(turns == std::ssize(of(branch, EventKind::fold)));
}

TEST_CASE(
    "tiltrotor, from 20 m/s to 5 m/s: back and forth over two folds, to the elevator's limit" *
    thorough) {
  struct Case {
    double gamma;
    double folds[2], limit;  // as check_fold and check_limit confirm them
  };
  for (const Case& c :
       {Case{0, {9.1501, 10.2807}, 6.6856}, Case{5 * degree, {9.0128, 10.0698}, 6.3950}}) {
    CAPTURE(c.gamma);
    const Route r = flight(20, c.gamma, 5);
    const Branch branch = walk(r);
    CHECK(story(branch) == "hopf, fold, hopf, fold, hopf, limit delta_e lower, end: limit");
    check_flight(r, branch);
    check_limit(r, of(branch, EventKind::limit).at(0), "delta_e", -0.53, -1);
    check_way_back(r, branch);
    const std::vector<BranchEvent> folds = of(branch, EventKind::fold);
    CHECK_NEAR(folds.at(0).at.parameter, c.folds[0], printed_to("9.1501"));
    CHECK_NEAR(folds.at(1).at.parameter, c.folds[1], printed_to("10.2807"));
    CHECK_NEAR(branch.events.back().at.parameter, c.limit, printed_to("6.6856"));
  }
}

TEST_CASE("tiltrotor, 5° down from 8 m/s: a fold, and no thrust or no elevator left at the ends") {
  const Route up = flight(8, -5 * degree, 20);
  const Branch faster = walk(up);
  CHECK(story(faster) == "hopf, fold, limit theta0 lower, end: limit");
  check_flight(up, faster);
  check_limit(up, of(faster, EventKind::limit).at(0), "theta0", 0.0, -1);
  CHECK_NEAR(of(faster, EventKind::fold).at(0).at.parameter, 10.4529, printed_to("10.4529"));
  CHECK_NEAR(faster.events.back().at.parameter, 9.7555, printed_to("9.7555"));

  Route down = up;
  down.to = 5;
  const Branch slower = walk(down);
  CHECK(story(slower) == "limit delta_e lower, end: limit");
  check_limit(down, slower.events[0], "delta_e", -0.53, -1);
  CHECK_NEAR(slower.events.back().at.parameter, 6.9436, printed_to("6.9436"));

  Route whole = up;  // from the one end to the other
  whole.start = faster.events.back().at.point;
  const Branch all = walk(whole);
  CHECK(story(all) == "fold, hopf, limit delta_e lower, end: limit");
  CHECK_NEAR(all.events[0].at.parameter, faster.events[1].at.parameter, 1e-9);
  CHECK_NEAR(all.events[1].at.parameter, faster.events[0].at.parameter, 1e-9);
  CHECK_NEAR(all.events[2].at.parameter, slower.events[0].at.parameter, 1e-9);
}

TEST_CASE("tiltrotor: between the folds the branch passes every trim that many starts find") {
  const Route r = flight(20, 0, 5);
  const double V = 9.7;
  const std::vector<BranchPoint> points = walk(r).points;
  std::vector<double> on_branch;
  for (std::size_t i = 1; i < points.size(); ++i)
    if ((points[i - 1].parameter - V) * (points[i].parameter - V) < 0) {
      const TrimResult found = retrim(r, points[i].point, "V", V);
      REQUIRE(found);
      on_branch.push_back(value(r.model, found.point, "theta"));
    }
  const TrimProblem problem = closed_loop_problem(reference_vehicle(), {V, 0, 0}, Axes::wind);
  const TrimResult all = trim(problem.model, problem.spec, problem.guess,
                              {.method = TrimMethod::newton, .starts = 200});
  std::vector<double> everywhere = {value(r.model, all.point, "theta")};
  for (const OperatingPoint& other : all.others)
    everywhere.push_back(value(r.model, other, "theta"));
  std::ranges::sort(on_branch);
  std::ranges::sort(everywhere);
  REQUIRE(on_branch.size() == 3);
  REQUIRE(everywhere.size() == 3);
  for (std::size_t i = 0; i < 3; ++i) CHECK_NEAR(on_branch[i], everywhere[i], 1e-8);
}

TEST_CASE("tiltrotor: with more inputs than equations the branch is what trim() finds least" *
          thorough) {
  AirframeCondition condition;
  condition.values = {{"V", {10, 10}}, {"eta", {90 * degree, 90 * degree}}};
  const TrimProblem problem = airframe_problem(reference_vehicle(), condition, Axes::wind);
  const TrimResult start = trim(problem.model, problem.spec, problem.guess);
  REQUIRE(start);
  const Route r{problem.model, problem.spec, start.point, "eta", 0};
  const Branch branch = walk(r);
  CHECK(story(branch) == "end: reached");
  TrimSpec spec = r.spec;
  spec.bounds.erase("eta");
  for (std::size_t i = 0; i < branch.points.size(); i += 10) {
    const OperatingPoint& p = branch.points[i].point;
    const TrimResult least = trim(r.model, spec, p, {.starts = 1});
    REQUIRE(least);
    // The gradient of the effort, of size one, vanishes to the solvers' 1e-9; 100 for its slopes.
    CHECK_NEAR((least.point.x - p.x).norm() + (least.point.u - p.u).norm(), 0.0, 1e-7);
  }
}

// ---- regressions ----

TEST_CASE("branch points are located and passed: x' = q x - x³ on x = 0") {
  for (const double from : {-1.0, -0.7}) {
    const Branch branch = walk(equilibria(cusp(), at(vec({0}), vec({0, from})), "q", 1));
    CHECK(branch.end == BranchEnd::reached);
    const std::vector<BranchEvent> crossing = of(branch, EventKind::branch_point);
    REQUIRE(crossing.size() == 1);
    CHECK(crossing[0].error < 1e-11);
    CHECK_NEAR(crossing[0].at.parameter, 0.0, crossing[0].error);
    for (const BranchPoint& p : branch.points) CHECK(*p.unstable == (p.parameter > 0 ? 1 : 0));
  }
}

TEST_CASE("branch points are located and passed: x' = q x - x³ on x² = q") {
  const Branch branch =
      walk(equilibria(cusp(), at(vec({1}), vec({0, 1})), "q", -1, {{"q", {-2, 1.5}}}));
  CHECK(branch.end == BranchEnd::limit);
  CHECK_NEAR(branch.events.back().at.point.x[0], -std::sqrt(1.5), located);
  const std::vector<BranchEvent> crossing = of(branch, EventKind::branch_point);
  REQUIRE(crossing.size() == 1);
  CHECK(crossing[0].error < 1e-11);
  CHECK_NEAR(crossing[0].at.parameter, 0.0, crossing[0].error);
  CHECK_NEAR(crossing[0].at.point.x[0], 0.0, 1e-11);
}

TEST_CASE("branch points are located and passed: Lorenz at r = 1") {
  Route origin = lorenz_route(2, 2);
  origin.start = at(vec({0, 0, 0}), vec({0.5}));
  for (const Route& r : {origin, lorenz_route(10, 0.5)}) {
    const std::vector<BranchEvent> crossing = of(walk(r), EventKind::branch_point);
    REQUIRE(crossing.size() == 1);
    CHECK(crossing[0].error < 1e-6);  // by differences
    CHECK_NEAR(crossing[0].at.parameter, 1.0, std::min(crossing[0].error, 1e-8));
  }
}

TEST_CASE("a transcritical point is where it is") {
  const Model exact = with_jacobian(scalar([](double x, double p) { return x * (p - x); }),
                                    [](const OperatingPoint& o) -> MatrixXd {
                                      return Eigen::RowVector2d(o.p[0] - 2 * o.x[0], o.x[0]);
                                    });
  for (const double x : {0.0, -0.73}) {
    const Branch branch = walk(equilibria(exact, at(vec({x}), vec({-0.73})), "p", 1.1));
    const std::vector<BranchEvent> crossing = of(branch, EventKind::branch_point);
    REQUIRE(crossing.size() == 1);
    CHECK(crossing[0].error < 1e-12);
    CHECK_NEAR(crossing[0].at.parameter, 0.0, crossing[0].error);
  }
}

TEST_CASE("every event lies within its error") {
  const double r = sigma * (sigma + b + 3) / (sigma - b - 1);
  const BranchEvent hopf = of(walk(lorenz_route(10, 30)), EventKind::hopf).at(0);
  CHECK(hopf.error < 1e-6);
  CHECK_NEAR(hopf.at.parameter, r, hopf.error);
  const BranchEvent fold = of(walk(cusp_route(1, -2.2)), EventKind::fold).at(0);
  CHECK(fold.error < 1e-9);
  CHECK_NEAR(std::abs(fold.at.parameter), 2 * std::pow(1 / 3.0, 1.5), fold.error);
  for (const Route& route : sample())
    for (const BranchEvent& e : walk(route).events) CHECK(std::isfinite(e.error));
}

TEST_CASE("two eigenvalues that cross together, where the trims are no curve: within the error") {
  const Model m = flow({"x", "y", "z"}, {"p"}, [](const VectorXd& x, const VectorXd& p) {
    return vec({p[0] * x[0], p[0] * x[1], 1 - x[2]});
  });
  for (const double from : {-1.0, -0.73}) {
    const Branch branch = walk(equilibria(m, at(vec({0, 0, 1}), vec({from})), "p", 1));
    const std::vector<BranchEvent> crossing = of(branch, EventKind::zero);
    REQUIRE(crossing.size() == 1);
    CHECK(crossing[0].error < 1e-4);
    CHECK_NEAR(crossing[0].at.parameter, 0.0, crossing[0].error);
    CHECK(branch.points.front().unstable == 0);
    CHECK(branch.points.back().unstable == 2);
  }
}

TEST_CASE("an eigenvalue that crosses with little or no slope: within the error") {
  // x'' = -x + r(p) x': r = p³ - 1e-3 and (p - 0.1)³ cross at 0.1
  for (const bool flat : {false, true}) {
    const Model m = flow({"x", "v"}, {"p"}, [flat](const VectorXd& x, const VectorXd& p) {
      const double r = flat ? std::pow(p[0] - 0.1, 3) : std::pow(p[0], 3) - 1e-3;
      return vec({x[1], r * x[1] - x[0]});
    });
    const Branch branch = walk(equilibria(m, at(vec({0, 0}), vec({-1})), "p", 1));
    const std::vector<BranchEvent> hopf = of(branch, EventKind::hopf);
    REQUIRE(hopf.size() == 1);
    CHECK(hopf[0].error < 0.1);
    CHECK_NEAR(hopf[0].at.parameter, 0.1, hopf[0].error);
  }
}

TEST_CASE("a position that moves takes no stability from a branch") {
  const Model m = flow({"position", "speed"}, {"thrust"}, [](const auto& x, const auto& p) {
    return vec({x[1], p[0] - x[1] * std::abs(x[1])});
  });
  const OperatingPoint start = at(vec({0, 1}), vec({1}));
  const TrimSpec spec{.free = {"speed"}, .moving = {"position"}};
  const Branch branch = follow(m, spec, start, "thrust", 4);
  CHECK(branch.end == BranchEnd::reached);
  CHECK(branch.no_stability.empty());
  for (const BranchPoint& p : branch.points) CHECK(p.unstable == 0);
  // So does a rate held at a value, if no rate depends on the state, as on the heading in a turn.
  const Model turning =
      flow({"heading", "speed"}, {"bank", "thrust"}, [](const auto& x, const auto& p) {
        return vec({p[0] / x[1], p[1] - x[1] * std::abs(x[1])});
      });
  const Branch turn = follow(turning, {.free = {"bank", "speed"}, .rates = {{"heading", 0.2}}},
                             at(vec({0, 1}), vec({0.2, 1})), "thrust", 4);
  CHECK(turn.end == BranchEnd::reached);
  CHECK(turn.no_stability.empty());
  for (const BranchPoint& p : turn.points) CHECK(p.unstable == 0);
  // If a rate depends on it the branch explains why eigenvalues are not counted.
  const TrimSpec held{.free = {"speed", "position"}, .rates = {{"position", 1}, {"speed", 0.5}}};
  CHECK(contains(follow(m, held, at(vec({0, 1}), vec({1.5})), "thrust", 4).no_stability,
                 "not an equilibrium"));
}

TEST_CASE("an eigenvalue that is zero all along is no crossing") {
  Route r = corner_route(0, 0, 3);
  r.model.f = [](const VectorXd&, const VectorXd& u, const VectorXd& p) {
    return vec({u[0] + u[1] - p[0]});  // the same without the state
  };
  CHECK(story(walk(r)) == "limit u1 upper, limit u2 upper, end: limit");
}

TEST_CASE("a start in the corner itself stays with the least effort") {
  const Branch branch = walk(corner_route(1, 0.5, 0));
  CHECK(branch.end == BranchEnd::reached);
  CHECK_NEAR(branch.events.back().at.point.u[0], 0.0, differences);
}

TEST_CASE("along a limit to where the unknowns left to it fold") {
  // p = u2² - u1 with u1 <= 1: along the limit u2 = √(p + 1) until p = -1, where λ = (1 - u2)/u2.
  Route r = allocation([](double u1, double u2) { return u2 * u2 - u1; }, 1.0, 1.0, 5.0,
                       {vec({0}), vec({1, 0.8}), vec({-0.36})}, -3);
  r.spec.effort = {{"u1", 10.0}, {"u2", 1.0, 1.0}};
  const Branch branch = walk(r);
  CHECK(branch.end != BranchEnd::points);
  CHECK_NEAR(branch.events.back().at.parameter, -1.0, 1e-6);
}

TEST_CASE("the airframe at its least speed, a1s at its limit: no crawl") {
  const TrimProblem problem = airframe_problem(
      reference_vehicle(), {.values = {{"V", {20, 20}}, {"eta", {0, 0}}}}, Axes::wind);
  const TrimResult start = trim(problem.model, problem.spec, problem.guess);
  REQUIRE(start);
  const Branch branch =
      walk({problem.model, problem.spec, start.point, "V", 5}, {.max_points = 1000});
  CHECK(branch.end != BranchEnd::points);
}

TEST_CASE("a circle closes with the default step") {
  const auto circle = [](double x, double p) { return x * x + p * p - 1; };
  CHECK(story(walk(scalar_route(circle, 1, 0, 5), {.max_points = 500})) ==
        "fold, fold, end: closed");
}

TEST_CASE("a declared jump is named with slopes by differences too") {
  Route r = jump_route();
  declare(r.model);
  CHECK(walk(r).end == BranchEnd::switched);
}

TEST_CASE("to declare a kink that is passed undeclared is no end") {
  Route r = scalar_route([](double x, double p) { return p - std::max(x, 2 * x - 1); }, 0, 0, 3);
  REQUIRE(walk(r).end == BranchEnd::reached);
  declare(r.model);
  CHECK(walk(r).end == BranchEnd::reached);
}

TEST_CASE("a start beyond a limit is no trim") {
  const Route r = scalar_route(line, 2, 2, 3, {{"x", {-1, 1}}});
  CHECK(follow(r.model, r.spec, r.start, "p", 3).end == BranchEnd::no_start);
}

TEST_CASE("a start on a limit does not leave through it") {
  CHECK(walk(scalar_route(line, 1, 1, 3, {{"x", {-1, 1}}})).end == BranchEnd::limit);
}

TEST_CASE("as many points as were allowed") {
  for (const int most : {1, 2, 5})
    CHECK(walk(scalar_route(line, 0, 0, 3), {.max_points = most}).points.size() ==
          std::size_t(most));
}

TEST_CASE("the last event is the end, without a start too") {
  const Route r = scalar_route(line, 1, 5, 8);
  const Branch branch = follow(r.model, r.spec, r.start, "p", 8);
  REQUIRE(!branch.events.empty());
  CHECK(branch.events.back().kind == EventKind::end);
}

}  // namespace follow_test
