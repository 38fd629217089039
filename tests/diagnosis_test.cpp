// What would have to give: diagnoses against closed forms, and the tiltrotor's against its equations.
#include <Eigen/Dense>
#include <algorithm>
#include <numbers>
#include <random>

#include "model/study.hpp"
#include "tests/check.hpp"
#include "trim/explain.hpp"

using namespace tiltrim;
using Eigen::Index;
using Eigen::VectorXd;

static constexpr double pi = std::numbers::pi, degree = pi / 180;
static constexpr double infinity = std::numeric_limits<double>::infinity();
using Generator = std::mt19937_64;

static double uniform(Generator& g, double lower, double upper) {
  return std::uniform_real_distribution<double>(lower, upper)(g);
}

static double sign(Generator& g) { return g() % 2 ? 1.0 : -1.0; }

// ---- problems: states x, y held where they are, inputs u1, u2, ... to be found, a parameter p ----

using RatesOf = std::function<VectorXd(const VectorXd& u, double p)>;

struct Asked {
  Model model;
  TrimSpec spec;
  OperatingPoint guess;

  // `box`: one range per input.
  Asked(Index equations, const std::vector<Range>& box, double p, const RatesOf& rates) {
    const std::array<const char*, 2> states{"x", "y"};
    for (Index i = 0; i < equations; ++i) model.states.push_back({states[std::size_t(i)], "", 1.0});
    spec.still = names(model.states);
    for (const Range& range : box) {
      model.inputs.push_back({fmt::format("u{}", model.inputs.size() + 1), "", 1.0});
      spec.bounds[model.inputs.back().name] = range;
    }
    spec.free = names(model.inputs);
    model.parameters = {{"p", "", 1.0}};
    model.f = [rates](const VectorXd&, const VectorXd& u, const VectorXd& q) {
      return rates(u, q[0]);
    };
    const Index n = std::ssize(box);
    guess = {VectorXd::Zero(equations), VectorXd::Zero(n), VectorXd::Constant(1, p)};
    for (Index k = 0; k < n; ++k) {
      const Range& r = box[std::size_t(k)];
      guess.u[k] = std::isfinite(r.upper - r.lower) ? 0.5 * (r.lower + r.upper) : 0.3;
    }
  }
};

static VectorXd one(double rate) { return VectorXd::Constant(1, rate); }

static Diagnosis diagnosed(const Asked& q, const std::vector<Lever>& levers) {
  const TrimResult none = trim(q.model, q.spec, q.guess);
  CHECK(none.status >= TrimStatus::infeasible);
  return diagnose(q.model, q.spec, q.guess, none.point, levers);
}

static const Remedy& of(const Diagnosis& d, RemedyKind kind, const std::string& signal,
                        bool upper = false) {
  const auto at = std::ranges::find_if(d.remedies, [&](const Remedy& r) {
    return r.kind == kind && r.signal == signal && r.upper == upper;
  });
  REQUIRE(at != d.remedies.end());
  return *at;
}

static const Remedy& limit(const Diagnosis& d, const std::string& signal, bool upper) {
  return of(d, RemedyKind::limit, signal, upper);
}
static const Remedy& equation(const Diagnosis& d, const std::string& state) {
  return of(d, RemedyKind::equation, state);
}
static const Remedy& lever(const Diagnosis& d, const std::string& signal) {
  return of(d, RemedyKind::lever, signal);
}

// A verified optimum is a root of its own conditions to 1e-9; no slope here is below 0.01.
static void check_helps(const Remedy& r, double from, double to, double tolerance = 1e-6) {
  CAPTURE(r.signal);
  CAPTURE(r.upper);
  CHECK(r.trim.status == TrimStatus::converged);
  CHECK(r.from == from);
  CHECK_NEAR(r.to, to, tolerance);
}

// ---- one linear equation: everything in closed form ----

// x' = c·u - p over a box whose range of c·u ends `missing` before p.
struct Linear {
  VectorXd c, size;  // nominal sizes of the inputs
  std::vector<Range> box;
  double p, missing, rate_size;  // missing > 0: p lies above
  VectorXd corner;               // the point of the box nearest to p

  Linear(Generator& g, Index n, double spread) : c(n), size(n), corner(n) {
    missing = sign(g) * uniform(g, 0.2, 3);
    rate_size = std::pow(10, uniform(g, -spread, spread));
    for (Index k = 0; k < n; ++k) {
      c[k] = sign(g) * uniform(g, 0.3, 3);
      size[k] = std::pow(10, uniform(g, -spread, spread));
      const double lower = uniform(g, -2, 2);
      box.push_back({lower, lower + uniform(g, 0.1, 2)});
      corner[k] = helping_side(k) ? box.back().upper : box.back().lower;
    }
    p = c.dot(corner) + missing;
  }

  bool helping_side(Index k) const { return c[k] * missing > 0; }  // true: the upper limit

  Asked problem() const {
    const VectorXd slope = c;
    Asked q(1, box, p, [slope](const VectorXd& u, double to) { return one(slope.dot(u) - to); });
    q.model.states[0].nominal = rate_size;
    for (Index k = 0; k < c.size(); ++k) q.model.inputs[std::size_t(k)].nominal = size[k];
    return q;
  }
};

static void check_limits(const Linear& l, const Asked& q, const Diagnosis& d) {
  for (Index k = 0; k < l.c.size(); ++k) {
    const std::string& name = q.model.inputs[std::size_t(k)].name;
    const auto [low, high] = l.box[std::size_t(k)];
    const bool side = l.helping_side(k);
    CHECK_FALSE(limit(d, name, !side).helps());
    // Limits are looked for up to ten times their own room.
    const double more = l.missing / l.c[k], reach = 10 * (high - low);
    if (std::abs(std::abs(more) - reach) < 1e-3) continue;
    const Remedy& r = limit(d, name, side);
    CHECK_NEAR(side ? r.searched.upper : r.searched.lower, l.corner[k] + (side ? reach : -reach),
               1e-12);
    CHECK(r.helps() == (std::abs(more) < reach));
    if (r.helps()) check_helps(r, l.corner[k], l.corner[k] + more);
  }
  CHECK(equation(d, "x").helps());
  check_helps(equation(d, "x"), 0.0, -l.missing);
  check_helps(lever(d, "p"), l.p, l.p - l.missing);
}

// ½ (residual / rate size)² falls by |residual| |c| size / rate size² per input's nominal size.
static void check_holding(const Linear& l, const Diagnosis& d) {
  std::vector<std::pair<double, Index>> pulls;
  for (Index k = 0; k < l.c.size(); ++k)
    pulls.push_back(
        {-std::abs(l.missing * l.c[k]) * l.size[k] / (l.rate_size * l.rate_size), k});
  std::ranges::sort(pulls);
  REQUIRE(d.holding.size() == pulls.size());
  for (std::size_t i = 0; i < pulls.size(); ++i) {
    const auto& [pull, k] = pulls[i];
    CHECK(d.holding[i].limit.signal == fmt::format("u{}", k + 1));
    CHECK(d.holding[i].limit.upper == l.helping_side(k));
    CHECK_NEAR(d.holding[i].limit.value, l.corner[k], 1e-12);
    CHECK_NEAR(d.holding[i].pull, pull, 1e-5 * std::abs(pull));
  }
}

TEST_CASE("u1 + u2 = p out of reach: by hand") {
  Generator g(1);
  for (int i = 0; i < trials(200); ++i) {
    const double a = uniform(g, 0.5, 3), b = uniform(g, 0.5, 3), p = a + b + uniform(g, 0.1, 4);
    const Asked q(1, {{0, a}, {0, b}}, p,
                    [](const VectorXd& u, double to) { return one(u[0] + u[1] - to); });
    const Diagnosis d = diagnosed(q, {{"p", {0, 20}}});
    CHECK_NEAR(d.closest.u[0], a, 1e-6);
    CHECK_NEAR(d.closest.u[1], b, 1e-6);
    REQUIRE(d.holding.size() == 2);
    for (const Holding& h : d.holding) {
      CHECK(h.limit.upper);
      CHECK(h.limit.value == (h.limit.signal == "u1" ? a : b));
      CHECK_NEAR(h.pull, a + b - p, 1e-6);
    }
    CHECK(d.holding[0].limit.signal != d.holding[1].limit.signal);
    CHECK(d.remedies.size() == 6);
    if (p - b < 10.9 * a) check_helps(limit(d, "u1", true), a, p - b);
    if (p - a < 10.9 * b) check_helps(limit(d, "u2", true), b, p - a);
    CHECK_FALSE(limit(d, "u1", false).helps());
    CHECK_FALSE(limit(d, "u2", false).helps());
    check_helps(equation(d, "x"), 0.0, a + b - p);
    check_helps(lever(d, "p"), p, a + b);
  }
}

TEST_CASE("c·u = p out of reach: the signs say which side of a limit helps") {
  Generator g(2);
  for (int i = 0; i < trials(200); ++i) {
    const Linear l(g, 2, 0.5);
    const Asked q = l.problem();
    const Diagnosis d = diagnosed(q, {{"p", {-100, 100}}});
    for (Index k = 0; k < 2; ++k) CHECK_NEAR(d.closest.u[k], l.corner[k], 1e-6 * l.size[k]);
    check_holding(l, d);
    check_limits(l, q, d);
  }
}
