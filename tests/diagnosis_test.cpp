// What would have to give: diagnoses against closed forms, the tiltrotor's against its equations.
#include <Eigen/Dense>
#include <algorithm>
#include <numbers>
#include <random>

#include "model/study.hpp"
#include "tests/check.hpp"
#include "trim/conditions.hpp"
#include "trim/explain.hpp"

using namespace tiltrim;
using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using Generator = std::mt19937_64;

static constexpr double pi = std::numbers::pi, degree = pi / 180;
static constexpr double infinity = std::numeric_limits<double>::infinity();
static const TrimOptions one_start{.starts = 0};  // of convex problems any start finds all there is

static double uniform(Generator& g, double lower, double upper) {
  return std::uniform_real_distribution<double>(lower, upper)(g);
}
static double sign(Generator& g) { return g() % 2 ? 1.0 : -1.0; }

static VectorXd column(std::initializer_list<double> numbers) {
  return Eigen::Map<const VectorXd>(numbers.begin(), Index(numbers.size()));
}

// States x, y held where they are, inputs u1, u2, ... to be found within a box, a parameter p. The
// rates, and an output z if there is one, are polynomials.
struct Asked {
  Model model;
  TrimSpec spec;
  OperatingPoint guess;

  using Values = std::function<VectorXd(const VectorXd& u, double p)>;

  Asked(Index m, const std::vector<Range>& box, double p, const Values& y, bool output = false) {
    const Index n = std::ssize(box);
    for (Index i = 0; i < m; ++i) model.states.push_back({i ? "y" : "x", "", 1.0});
    model.parameters = {{"p", "", 1.0}};
    guess = {VectorXd::Zero(m), VectorXd::Constant(n, 0.3), column({p})};
    for (Index k = 0; k < n; ++k) {
      const Range& r = box[std::size_t(k)];
      model.inputs.push_back({fmt::format("u{}", k + 1), "", 1.0});
      spec.bounds[model.inputs.back().name] = r;
      if (std::isfinite(r.upper - r.lower)) guess.u[k] = 0.5 * (r.lower + r.upper);
    }
    spec.free = names(model.inputs);
    spec.still = names(model.states);
    using V = const VectorXd&;
    model.f = [=](V, V u, V q) -> VectorXd { return y(u, q[0]).head(m); };
    model.h = [=](V, V u, V q) -> VectorXd { return y(u, q[0]).tail(output); };
    if (output) model.outputs = {{"z", "", 1.0}};
    // Of polynomials to the fourth degree these differences are exact, at any step.
    model.derivatives = [=](const OperatingPoint& at, const std::vector<Index>& variables) {
      MatrixXd J = MatrixXd::Zero(m + output, std::ssize(variables));
      for (Index c = 0; c < J.cols(); ++c) {
        const auto step = [&, j = variables[std::size_t(c)]](double h) {
          OperatingPoint moved = at;
          set_value(moved, j, value_of(at, j) + h);
          return y(moved.u, moved.p[0]);
        };
        J.col(c) = (8 * (step(0.5) - step(-0.5)) - (step(1) - step(-1))) / 6;
      }
      return J;
    };
  }
};

static Diagnosis diagnosed(const Asked& q, const TrimOptions& options = {}) {
  const TrimResult none = trim(q.model, q.spec, q.guess, options);
  CHECK(none.status >= TrimStatus::infeasible);
  return diagnose(q.model, q.spec, q.guess, none.point, {{"p", {-100, 100}}}, options);
}

static const Remedy& of(const Diagnosis& d, RemedyKind kind, const std::string& signal, bool upper) {
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
  return of(d, RemedyKind::equation, state, false);
}
static const Remedy& lever(const Diagnosis& d, const std::string& signal) {
  return of(d, RemedyKind::lever, signal, false);
}

// A verified optimum solves its conditions to 1e-9, and no slope here is below 0.01.
static void check_helps(const Remedy& r, double from, double to) {
  CAPTURE(r.signal);
  CAPTURE(r.upper);
  CHECK(r.trim.status == TrimStatus::converged);
  CHECK(r.from == from);
  CHECK_NEAR(r.to, to, 1e-6);
}

static void check_no_limit_helps_but(const Diagnosis& d, const std::string& signal, bool upper) {
  for (const Remedy& r : d.remedies)
    if (r.kind == RemedyKind::limit && (r.signal != signal || r.upper != upper))
      CHECK_FALSE(r.helps());
}

// ---- boxes that do not reach ----

// Each limit, equation and lever alone, of x' = c·u - p over random boxes beyond which p lies. Every
// third is u1 + u2 = p with u1 in [0, a], u2 in [0, b].
TEST_CASE("c·u = p out of reach: the nearest corner, and what each limit would have to give") {
  Generator g(1);
  for (int i = 0; i < trials(300); ++i) {
    const bool plain = i % 3 == 0;
    const Index n = plain ? 2 : 2 + Index(g() % 2);
    const double missing = (plain ? 1 : sign(g)) * uniform(g, 0.2, 3);
    const double rate_size = plain ? 1 : std::pow(10, uniform(g, -0.5, 0.5));
    VectorXd c = VectorXd::Ones(n), size = VectorXd::Ones(n), corner(n);
    std::vector<Range> box;
    for (Index k = 0; k < n; ++k) {
      if (!plain) c[k] = sign(g) * uniform(g, 0.3, 3), size[k] = std::pow(10, uniform(g, -0.5, 0.5));
      const double lower = plain ? 0 : uniform(g, -2, 2);
      box.push_back({lower, lower + uniform(g, 0.1, 2)});
      corner[k] = c[k] * missing > 0 ? box.back().upper : box.back().lower;
    }
    const double p = c.dot(corner) + missing;
    Asked q(n > 0, box, p, [c](const VectorXd& u, double to) { return column({c.dot(u) - to}); });
    q.model.states[0].nominal = rate_size;
    for (Index k = 0; k < n; ++k) q.model.inputs[std::size_t(k)].nominal = size[k];
    const Diagnosis d = diagnosed(q, one_start);

    CHECK(d.remedies.size() == std::size_t(2 * n + 2));
    check_helps(equation(d, "x"), 0, -missing);
    check_helps(lever(d, "p"), p, p - missing);
    REQUIRE(std::ssize(d.holding) == n);
    CHECK(std::ranges::is_sorted(d.holding, {}, &Holding::pull));
    for (Index k = 0; k < n; ++k) {
      const std::string& name = q.model.inputs[std::size_t(k)].name;
      const bool upper = c[k] * missing > 0;
      CHECK_NEAR(d.closest.u[k], corner[k], 1e-6 * size[k]);
      const auto h = std::ranges::find(d.holding, name, [](auto& held) { return held.limit.signal; });
      REQUIRE(h != d.holding.end());
      CHECK(h->limit.upper == upper);
      CHECK_NEAR(h->limit.value, corner[k], 1e-12);
      // of ½ (residual / rate size)², per nominal size of the input
      const double pull = -std::abs(missing * c[k]) * size[k] / (rate_size * rate_size);
      CHECK_NEAR(h->pull, pull, 1e-5 * std::abs(pull));

      CHECK_FALSE(limit(d, name, !upper).helps());
      const Remedy& r = limit(d, name, upper);
      const Range own = box[std::size_t(k)];
      const double more = missing / c[k], reach = 10 * (own.upper - own.lower);  // how far it looks
      CHECK_NEAR(upper ? r.searched.upper : r.searched.lower, corner[k] + std::copysign(reach, more),
                 1e-12);
      if (std::abs(more) > 1.001 * reach) CHECK_FALSE(r.helps());
      if (std::abs(more) < 0.999 * reach) check_helps(r, corner[k], corner[k] + more);
    }
  }
}

static Asked circle(const std::vector<Range>& box, double p) {
  return {1, box, p, [](const VectorXd& u, double r) { return column({u.squaredNorm() - r * r}); }};
}

TEST_CASE("u1² + u2² = p², the box within the circle or beyond it: a corner") {
  Generator g(2);
  for (int i = 0; i < trials(40); ++i) {
    const bool within = i % 2;
    const double a = uniform(g, 0.5, 2), b = uniform(g, 0.5, 2), corner = std::hypot(a, b);
    const double p = corner * (within ? uniform(g, 1.1, 1.7) : uniform(g, 0.3, 0.9));
    if (std::min(std::abs(p - a), std::abs(p - b)) < 0.01) continue;  // they would only touch
    const double r = corner * corner - p * p, u1 = std::sqrt(p * p - b * b),
                 u2 = std::sqrt(p * p - a * a);
    const Diagnosis d = diagnosed(
        within ? circle({{0, a}, {0, b}}, p) : circle({{a, a + 1}, {b, b + 1}}, p));
    CHECK_NEAR(d.closest.u[0], a, 1e-6);
    CHECK_NEAR(d.closest.u[1], b, 1e-6);
    REQUIRE(d.holding.size() == 2);
    CHECK(d.holding[0].limit.signal == (a > b ? "u1" : "u2"));
    CHECK(d.holding[0].limit.upper == within);
    CHECK_NEAR(d.holding[0].pull, -2 * std::abs(r) * std::max(a, b), 1e-5);
    CHECK_NEAR(d.holding[1].pull, -2 * std::abs(r) * std::min(a, b), 1e-5);
    check_helps(equation(d, "x"), 0, r);
    check_helps(lever(d, "p"), p, corner);
    if (p > b) check_helps(limit(d, "u1", within), a, u1);
    if (p > a) check_helps(limit(d, "u2", within), b, u2);
    if (within) check_helps(limit(d, "u1", false), 0, -u1);  // the circle's other side
    if (within) check_helps(limit(d, "u2", false), 0, -u2);
    if (p < b) CHECK_FALSE(limit(d, "u1", false).helps());
    if (p < a) CHECK_FALSE(limit(d, "u2", false).helps());
  }
}

// x' = u1² + u2² + u3² - R²,  y' = n·(u1, u2) - u4 - p,  u3, u4 >= 0, |n| = 1: in the disc and beyond
// the line at p > R.
TEST_CASE("a disc that a half-plane does not reach") {
  Generator g(3);
  for (int i = 0; i < trials(20); ++i) {
    const double R = uniform(g, 0.5, 2), p = R + uniform(g, 0.2, 2), turn = uniform(g, 0, 2 * pi);
    const double c = std::cos(turn), s = std::sin(turn);
    const Asked q(2, {{-5, 5}, {-5, 5}, {0, 5}, {0, 5}}, p, [=](const VectorXd& u, double to) {
      return column({u.head(3).squaredNorm() - R * R, c * u[0] + s * u[1] - u[3] - to});
    });
    const Diagnosis d = diagnosed(q, one_start);
    // The closest point lies at ρ n: a root of d/dρ (½(ρ² - R²)² + ½(ρ - p)²).
    double rho = p;
    for (int step = 0; step < 50; ++step)
      rho -= (2 * rho * (rho * rho - R * R) + rho - p) / (6 * rho * rho - 2 * R * R + 1);
    CHECK_NEAR(d.closest.u[0], rho * c, 1e-6);
    CHECK_NEAR(d.closest.u[1], rho * s, 1e-6);
    REQUIRE(d.holding.size() >= 1);
    CHECK(d.holding[0].limit.signal == "u4");
    CHECK_FALSE(d.holding[0].limit.upper);
    CHECK_NEAR(d.holding[0].pull, rho - p, 1e-6);
    for (std::size_t k = 1; k < d.holding.size(); ++k) CHECK_NEAR(d.holding[k].pull, 0, 1e-4);  // u3
    check_helps(limit(d, "u4", false), 0, R - p);
    check_no_limit_helps_but(d, "u4", false);
    check_helps(equation(d, "x"), 0, p * p - R * R);
    check_helps(equation(d, "y"), 0, R - p);
    check_helps(lever(d, "p"), p, R);
  }
}

// x' = u1 + u2 - p,  z = u1² + u2² <= Z < p²/2.
TEST_CASE("an output's limit in conflict with an equation") {
  Generator g(4);
  for (int i = 0; i < trials(20); ++i) {
    const double Z = uniform(g, 0.5, 2), reached = std::sqrt(2 * Z);
    const double p = reached + uniform(g, 0.1, 1.5);
    Asked q(1, {{-5, 5}, {-5, 5}}, p,
            [](const VectorXd& u, double to) { return column({u.sum() - to, u.squaredNorm()}); },
            true);
    q.spec.bounds["z"] = {i % 2 ? -infinity : -1, Z};
    const Diagnosis d = diagnosed(q, one_start);
    REQUIRE(d.holding.size() == 1);
    CHECK(d.holding[0].limit.signal == "z");
    CHECK(d.holding[0].limit.upper);
    CHECK(d.holding[0].limit.value == Z);
    CHECK_NEAR(d.holding[0].pull, (reached - p) / reached, 1e-6);
    check_helps(limit(d, "z", true), Z, p * p / 2);
    check_no_limit_helps_but(d, "z", true);
    CHECK(d.remedies.size() == (i % 2 ? 7 : 8));  // an infinite limit cannot give way
    check_helps(equation(d, "x"), 0, reached - p);
    check_helps(lever(d, "p"), p, reached);
  }
}

// x' = a·u - p,  y' = k a·u - b  with b ≠ k p.
static Asked conflict(double a1, double a2, double k, double b, double p, const Range& range) {
  return {2, {range, range}, p, [=](const VectorXd& u, double to) {
            const double sum = a1 * u[0] + a2 * u[1];
            return column({sum - to, k * sum - b});
          }};
}

TEST_CASE("two equations in conflict with each other: no limit has to do with it") {
  Generator g(5);
  for (int i = 0; i < trials(40); ++i) {
    const double a1 = sign(g) * uniform(g, 0.5, 2), a2 = sign(g) * uniform(g, 0.5, 2);
    const double k = i ? sign(g) * uniform(g, 0.5, 2) : 1, p = i ? uniform(g, -2, 2) : 1;
    const double b = i ? k * p + sign(g) * uniform(g, 0.3, 2) : 2;
    const bool bounded = i % 2;
    const Diagnosis d =
        diagnosed(conflict(a1, a2, k, b, p, bounded ? Range{-50, 50} : Range{}), one_start);
    CHECK(d.holding.empty());
    CHECK(d.remedies.size() == (bounded ? 7 : 3));
    check_no_limit_helps_but(d, "", false);
    check_helps(equation(d, "x"), 0, b / k - p);
    check_helps(equation(d, "y"), 0, k * p - b);
    if (bounded) check_helps(lever(d, "p"), p, b / k);
  }
}

// ---- shown, or only not found ----

// x' = 1 + u1 + u2² + p² + x²
TEST_CASE("a lever that cannot help: shown where the model has an enclosure of it") {
  Model model{.name = {}, .states = {{"x", ""}}, .inputs = {{"u1", ""}, {"u2", ""}}};
}
