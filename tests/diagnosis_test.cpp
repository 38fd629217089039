// What would have to give: diagnoses against closed forms, and the tiltrotor's against its
// equations.
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

static constexpr double pi = std::numbers::pi, degree = pi / 180;
static constexpr double infinity = std::numeric_limits<double>::infinity();
using Generator = std::mt19937_64;

static double uniform(Generator& g, double lower, double upper) {
  return std::uniform_real_distribution<double>(lower, upper)(g);
}

static double sign(Generator& g) { return g() % 2 ? 1.0 : -1.0; }

// ---- problems: states x, y held where they are, inputs u1, u2, ... to be found, a parameter p
// ----

using ValuesOf = std::function<VectorXd(const VectorXd& u, double p)>;
using SlopesOf = std::function<MatrixXd(const VectorXd& u, double p)>;  // along u1, u2, ..., p

struct Asked {
  Model model;
  TrimSpec spec;
  OperatingPoint guess;

  // `box`: one range per input. Rows of `values` and `slopes` beyond the equations: outputs z.
  Asked(Index equations, const std::vector<Range>& box, double p, const ValuesOf& values,
        const SlopesOf& slopes, bool output = false) {
    const std::array<const char*, 2> states{"x", "y"};
    for (Index i = 0; i < equations; ++i) model.states.push_back({states[std::size_t(i)], "", 1.0});
    spec.still = names(model.states);
    for (const Range& range : box) {
      model.inputs.push_back({fmt::format("u{}", model.inputs.size() + 1), "", 1.0});
      spec.bounds[model.inputs.back().name] = range;
    }
    spec.free = names(model.inputs);
    model.parameters = {{"p", "", 1.0}};
    model.f = [=](const VectorXd&, const VectorXd& u, const VectorXd& q) -> VectorXd {
      return values(u, q[0]).head(equations);
    };
    if (output) model.outputs = {{"z", "", 1.0}};
    model.h = [=](const VectorXd&, const VectorXd& u, const VectorXd& q) -> VectorXd {
      return values(u, q[0]).tail(output);
    };
    model.derivatives = [=](const OperatingPoint& at, const std::vector<Index>& variables) {
      const MatrixXd J = slopes(at.u, at.p[0]);
      MatrixXd all = MatrixXd::Zero(J.rows(), equations + J.cols());
      all.rightCols(J.cols()) = J;
      return MatrixXd(all(Eigen::all, variables));
    };
    const Index n = std::ssize(box);
    guess = {VectorXd::Zero(equations), VectorXd::Zero(n), VectorXd::Constant(1, p)};
    for (Index k = 0; k < n; ++k) {
      const Range& r = box[std::size_t(k)];
      guess.u[k] = std::isfinite(r.upper - r.lower) ? 0.5 * (r.lower + r.upper) : 0.3;
    }
  }
};

static VectorXd column(std::initializer_list<double> numbers) {
  return Eigen::Map<const VectorXd>(numbers.begin(), Index(numbers.size()));
}
static MatrixXd row(std::initializer_list<double> numbers) { return column(numbers).transpose(); }
static MatrixXd rows(const MatrixXd& above, const MatrixXd& below) {
  MatrixXd both(above.rows() + below.rows(), above.cols());
  both << above, below;
  return both;
}

static Diagnosis diagnosed(const Asked& q, const std::vector<Lever>& levers,
                           const TrimOptions& options = {}) {
  const TrimResult none = trim(q.model, q.spec, q.guess, options);
  CHECK(none.status >= TrimStatus::infeasible);
  return diagnose(q.model, q.spec, q.guess, none.point, levers, options);
}

// Of convex problems any start finds all there is.
static const TrimOptions one_start{.starts = 0};

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
    Asked q(
        1, box, p, [a = c](const VectorXd& u, double to) { return column({a.dot(u) - to}); },
        [a = c](const VectorXd&, double) -> MatrixXd {
          return (VectorXd(a.size() + 1) << a, -1).finished().transpose();
        });
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
    pulls.push_back({-std::abs(l.missing * l.c[k]) * l.size[k] / (l.rate_size * l.rate_size), k});
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
    const Asked q(
        1, {{0, a}, {0, b}}, p,
        [](const VectorXd& u, double to) { return column({u[0] + u[1] - to}); },
        [](const VectorXd&, double) {
          return row({1, 1, -1});
        });
    const Diagnosis d = diagnosed(q, {{"p", {0, 20}}}, one_start);
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
    const Linear l(g, 2 + i % 2, 0.5);
    const Asked q = l.problem();
    const Diagnosis d = diagnosed(q, {{"p", {-100, 100}}}, one_start);
    for (Index k = 0; k < l.c.size(); ++k)
      CHECK_NEAR(d.closest.u[k], l.corner[k], 1e-6 * l.size[k]);
    check_holding(l, d);
    check_limits(l, q, d);
  }
}

// ---- curved boxes: a circle, a disc and a half-plane, an output's limit ----

static Asked circle(const std::vector<Range>& box, double p) {
  return {1, box, p, [](const VectorXd& u, double r) { return column({u.squaredNorm() - r * r}); },
          [](const VectorXd& u, double r) {
            return row({2 * u[0], 2 * u[1], -2 * r});
          }};
}

TEST_CASE("u1² + u2² = p², the box too small: its far corner") {
  Generator g(3);
  for (int i = 0; i < trials(20); ++i) {
    const double a = uniform(g, 0.5, 2), b = uniform(g, 0.5, 2);
    const double p = std::hypot(a, b) * uniform(g, 1.1, 1.7), r = a * a + b * b - p * p;
    const Diagnosis d = diagnosed(circle({{0, a}, {0, b}}, p), {{"p", {0, 10}}});
    CHECK_NEAR(d.closest.u[0], a, 1e-6);
    CHECK_NEAR(d.closest.u[1], b, 1e-6);
    REQUIRE(d.holding.size() == 2);
    CHECK(d.holding[0].limit.signal == (a > b ? "u1" : "u2"));
    CHECK_NEAR(d.holding[0].pull, 2 * r * std::max(a, b), 1e-5);
    CHECK_NEAR(d.holding[1].pull, 2 * r * std::min(a, b), 1e-5);
    const double u1 = std::sqrt(p * p - b * b), u2 = std::sqrt(p * p - a * a);
    check_helps(limit(d, "u1", true), a, u1);
    check_helps(limit(d, "u2", true), b, u2);
    check_helps(limit(d, "u1", false), 0, -u1);  // the circle's other side
    check_helps(limit(d, "u2", false), 0, -u2);
    check_helps(equation(d, "x"), 0, r);
    check_helps(lever(d, "p"), p, std::hypot(a, b));
  }
}

TEST_CASE("u1² + u2² = p², the box too far out: its near corner") {
  Generator g(4);
  for (int i = 0; i < trials(20); ++i) {
    const double a = uniform(g, 0.5, 2), b = uniform(g, 0.5, 2);
    const double p = std::hypot(a, b) * uniform(g, 0.3, 0.9), r = a * a + b * b - p * p;
    if (std::min(std::abs(p - a), std::abs(p - b)) < 0.01) continue;  // they only touch
    const Diagnosis d = diagnosed(circle({{a, a + 1}, {b, b + 1}}, p), {{"p", {0, 10}}});
    REQUIRE(d.holding.size() == 2);
    CHECK_FALSE(d.holding[0].limit.upper);
    CHECK_FALSE(d.holding[1].limit.upper);
    CHECK_NEAR(d.holding[0].pull, -2 * r * std::max(a, b), 1e-5);
    const auto alone = [&](const char* name, double own, double other) {
      CHECK_FALSE(limit(d, name, true).helps());
      CHECK(limit(d, name, false).helps() == (p > other));
      if (p > other) check_helps(limit(d, name, false), own, std::sqrt(p * p - other * other));
    };
    alone("u1", a, b);
    alone("u2", b, a);
    check_helps(equation(d, "x"), 0, r);
    check_helps(lever(d, "p"), p, std::hypot(a, b));
  }
}

// x' = u1² + u2² + u3² - R²,  y' = n·(u1, u2) - u4 - p  with u3, u4 >= 0 and |n| = 1: within the
// disc of radius R and beyond the line at p > R.
TEST_CASE("a disc that a half-plane does not reach") {
  Generator g(5);
  for (int i = 0; i < trials(20); ++i) {
    const double R = uniform(g, 0.5, 2), p = R + uniform(g, 0.2, 2), turn = uniform(g, 0, 2 * pi);
    const double c = std::cos(turn), s = std::sin(turn);
    const Asked q(
        2, {{-5, 5}, {-5, 5}, {0, 5}, {0, 5}}, p,
        [=](const VectorXd& u, double to) {
          return column({u.head(3).squaredNorm() - R * R, c * u[0] + s * u[1] - u[3] - to});
        },
        [=](const VectorXd& u, double) {
          return rows(row({2 * u[0], 2 * u[1], 2 * u[2], 0, 0}), row({c, s, 0, -1, -1}));
        });
    const Diagnosis d = diagnosed(q, {{"p", {-10, 10}}}, one_start);
    // The closest point lies at ρ n: the root of d/dρ (½(ρ² - R²)² + ½(ρ - p)²) beyond R.
    double rho = p;
    for (int step = 0; step < 50; ++step)
      rho -= (2 * rho * (rho * rho - R * R) + rho - p) / (6 * rho * rho - 2 * R * R + 1);
    CHECK_NEAR(d.closest.u[0], rho * c, 1e-6);
    CHECK_NEAR(d.closest.u[1], rho * s, 1e-6);
    REQUIRE(d.holding.size() >= 1);
    CHECK(d.holding[0].limit.signal == "u4");
    CHECK_FALSE(d.holding[0].limit.upper);
    CHECK_NEAR(d.holding[0].pull, rho - p, 1e-6);
    for (std::size_t k = 1; k < d.holding.size(); ++k) CHECK_NEAR(d.holding[k].pull, 0, 1e-4);
    check_helps(limit(d, "u4", false), 0, R - p);
    for (const char* name : {"u1", "u2", "u3"})
      for (const bool upper : {false, true}) CHECK_FALSE(limit(d, name, upper).helps());
    CHECK_FALSE(limit(d, "u4", true).helps());
    check_helps(equation(d, "x"), 0, p * p - R * R);
    check_helps(equation(d, "y"), 0, R - p);
    check_helps(lever(d, "p"), p, R);
  }
}

// x' = u1 + u2 - p,  z = u1² + u2² <= Z < p²/2.
TEST_CASE("an output's limit in conflict with an equation") {
  Generator g(6);
  for (int i = 0; i < trials(20); ++i) {
    const double Z = uniform(g, 0.5, 2), reached = std::sqrt(2 * Z);
    const double p = reached + uniform(g, 0.1, 1.5);
    Asked q(
        1, {{-5, 5}, {-5, 5}}, p,
        [](const VectorXd& u, double to) {
          return column({u.sum() - to, u.squaredNorm()});
        },
        [](const VectorXd& u, double) {
          return rows(row({1, 1, -1}), row({2 * u[0], 2 * u[1], 0}));
        },
        true);
    q.spec.bounds["z"] = {i % 2 ? -infinity : -1, Z};
    const Diagnosis d = diagnosed(q, {{"p", {-10, 10}}}, one_start);
    REQUIRE(d.holding.size() == 1);
    CHECK(d.holding[0].limit.signal == "z");
    CHECK(d.holding[0].limit.upper);
    CHECK(d.holding[0].limit.value == Z);
    CHECK_NEAR(d.holding[0].pull, (reached - p) / reached, 1e-6);
    check_helps(limit(d, "z", true), Z, p * p / 2);
    CHECK(d.remedies.size() == (i % 2 ? 7 : 8));  // an infinite limit cannot give way
    for (const Remedy& r : d.remedies)
      if (r.kind == RemedyKind::limit) CHECK(r.helps() == (r.signal == "z" && r.upper));
    check_helps(equation(d, "x"), 0, reached - p);
    check_helps(lever(d, "p"), p, reached);
  }
}

// x' = a·u - p,  y' = k a·u - b  with b ≠ k p: no limit has to do with it.
TEST_CASE("two equations in conflict with each other") {
  Generator g(7);
  for (int i = 0; i < trials(40); ++i) {
    const double a1 = sign(g) * uniform(g, 0.5, 2), a2 = sign(g) * uniform(g, 0.5, 2);
    const double k = i ? sign(g) * uniform(g, 0.5, 2) : 1, p = i ? uniform(g, -2, 2) : 1;
    const double b = i ? k * p + sign(g) * uniform(g, 0.3, 2) : 2;
    const Range wide = i % 2 ? Range{-50, 50} : Range{};
    const Asked q(
        2, {wide, wide}, p,
        [=](const VectorXd& u, double to) {
          const double sum = a1 * u[0] + a2 * u[1];
          return column({sum - to, k * sum - b});
        },
        [=](const VectorXd&, double) {
          return rows(row({a1, a2, -1}), row({k * a1, k * a2, 0}));
        });
    const Diagnosis d = diagnosed(q, {{"p", {-10, 10}}}, one_start);
    CHECK(d.holding.empty());
    CHECK(d.remedies.size() == (i % 2 ? 7 : 3));
    for (const Remedy& r : d.remedies)
      if (r.kind == RemedyKind::limit) CHECK_FALSE(r.helps());
    check_helps(equation(d, "x"), 0, b / k - p);
    check_helps(equation(d, "y"), 0, k * p - b);
    if (i % 2) check_helps(lever(d, "p"), p, b / k);
  }
}

// ---- shown, or only not found ----

// x' = 1 + u1 + u2² + p² + x²: nothing makes it vanish for u1 in [0, 1].
TEST_CASE("a lever that cannot help: shown where the model has an enclosure of it") {
  Model model;
  model.states = {{"x", "", 1.0}};
  model.inputs = {{"u1", "", 1.0}, {"u2", "", 1.0}};
  model.parameters = {{"p", "", 1.0}};
  model.f = [](const VectorXd& x, const VectorXd& u, const VectorXd& p) {
    return column({1 + u[0] + u[1] * u[1] + p[0] * p[0] + x[0] * x[0]});
  };
  const TrimSpec spec{.free = {"u1"}, .still = {"x"}, .bounds = {{"u1", {0, 1}}}};
  const OperatingPoint guess{column({0}), column({0.5, 0}), column({0})};
  const auto status = [&](const char* signal) {
    const Remedy r = nearest(model, spec, guess, {signal, {-2, 3}});
    CHECK_FALSE(r.helps());
    CHECK(r.searched.lower == -2);
    CHECK(r.searched.upper == 3);
    return r.trim.status;
  };
  for (const char* signal : {"x", "u2", "p"}) CHECK(status(signal) == TrimStatus::not_found);
  model.enclosure = [](const std::vector<Range>& box) -> std::vector<Range> {
    Range sum{1 + box[1].lower, 1 + box[1].upper};
    for (const std::size_t j : {0, 2, 3}) {
      const double a = box[j].lower * box[j].lower, b = box[j].upper * box[j].upper;
      sum.lower += box[j].lower <= 0 && box[j].upper >= 0 ? 0.0 : std::min(a, b);
      sum.upper += std::max(a, b);
    }
    return {sum};
  };
  CHECK(status("x") == TrimStatus::infeasible);
  CHECK(status("u2") == TrimStatus::infeasible);
  CHECK(status("p") == TrimStatus::not_found);  // no enclosure spans parameters
}

// A term of one unknown, and its exact range.
struct Term {
  int kind;  // linear, quadratic, cubic
  double a, m;

  double at(double u) const {
    return kind == 0 ? a * u : kind == 1 ? a * (u - m) * (u - m) : a * (u + u * u * u);
  }
  double slope(double u) const {
    return kind == 0 ? a : kind == 1 ? 2 * a * (u - m) : a * (1 + 3 * u * u);
  }
  Range range(const Range& u) const {
    const double low = at(u.lower), high = at(u.upper);
    const double dip = kind == 1 && u.lower < m && m < u.upper ? 0.0 : low;
    return {std::min({low, high, dip}), std::max({low, high, dip})};
  }
};

// C (sums - levels), sums of one term of each unknown, and none in two sums: there is a solution
// exactly where each level lies within the range of its sum.
struct Sums {
  std::vector<Term> terms;
  std::vector<Range> box;
  std::vector<Index> sum_of;  // of each unknown
  MatrixXd C;
  VectorXd levels;
  double depth = infinity;  // of the levels within the ranges; negative: outside

  explicit Sums(Generator& g) {
    const Index m = 1 + Index(g() % 2), n = 2 + Index(g() % 2);
    const bool linear = g() % 3 == 0;
    for (Index k = 0; k < n; ++k) {
      terms.push_back({linear ? 0 : int(g() % 3), sign(g) * uniform(g, 0.3, 2), uniform(g, -1, 1)});
      const double lower = uniform(g, -1.5, 1);
      box.push_back({lower, lower + uniform(g, 0.2, 1.5)});
      sum_of.push_back(k == n - 1 ? m - 1 : 0);
    }
    C = MatrixXd::Identity(m, m) * sign(g);
    if (m == 2) C(0, 1) = uniform(g, -1, 1), C(1, 0) = -C(0, 1);
    levels.resize(m);
    const Index out = g() % 2 ? Index(g() % std::uint64_t(m)) : -1;
    const std::vector<Range> reached = ranges(box);
    for (Index i = 0; i < m; ++i) {
      const auto [low, high] = reached[std::size_t(i)];
      const double off = (i == out ? -1 : 0.5) * (high - low) * std::pow(10, uniform(g, -6, 0));
      levels[i] = g() % 2 ? low + off : high - off;
      depth = std::min({depth, levels[i] - low, high - levels[i]});
    }
  }

  std::vector<Range> ranges(const std::vector<Range>& of) const {
    std::vector<Range> sums(std::size_t(C.rows()), Range{0, 0});
    for (std::size_t k = 0; k < terms.size(); ++k) {
      const Range r = terms[k].range(of[k]);
      sums[std::size_t(sum_of[k])].lower += r.lower;
      sums[std::size_t(sum_of[k])].upper += r.upper;
    }
    return sums;
  }

  VectorXd values(const VectorXd& u) const {
    VectorXd sums = -levels;
    for (Index k = 0; k < u.size(); ++k)
      sums[sum_of[std::size_t(k)]] += terms[std::size_t(k)].at(u[k]);
    return C * sums;
  }

  MatrixXd slopes(const VectorXd& u) const {
    MatrixXd J = MatrixXd::Zero(C.rows(), u.size() + 1);
    for (Index k = 0; k < u.size(); ++k)
      J(sum_of[std::size_t(k)], k) = terms[std::size_t(k)].slope(u[k]);
    return C * J;
  }

  // Over a box of all variables: states, inputs, p.
  std::vector<Range> enclosure(const std::vector<Range>& all) const {
    const auto m = std::size_t(C.rows());
    const std::vector<Range> sums = ranges({all.begin() + std::ptrdiff_t(m), all.end() - 1});
    std::vector<Range> y(m, Range{0, 0});
    for (std::size_t i = 0; i < m; ++i)
      for (std::size_t j = 0; j < m; ++j) {
        const double c = C(Index(i), Index(j)), level = levels[Index(j)];
        const double a = c * (sums[j].lower - level), b = c * (sums[j].upper - level);
        y[i].lower += std::min(a, b);
        y[i].upper += std::max(a, b);
      }
    return y;
  }
};

TEST_CASE("random boxes: never infeasible where there is a solution, nor converged without one") {
  Generator g(8);
  int with = 0, without = 0, solved = 0, shown = 0;
  constexpr int boxes = trials(2000);
  for (int i = 0; i < boxes; ++i) {
    const Sums sums(g);
    if (std::abs(sums.depth) < 1e-6) continue;
    Asked q(
        sums.C.rows(), sums.box, 0, [&](const VectorXd& u, double) { return sums.values(u); },
        [&](const VectorXd& u, double) { return sums.slopes(u); });
    q.model.enclosure = [&](const std::vector<Range>& all) { return sums.enclosure(all); };
    const TrimResult r = trim(q.model, q.spec, q.guess, {.starts = 0, .closest = i % 4 == 0});
    CAPTURE(i);
    CAPTURE(sums.depth);
    (sums.depth > 0 ? with : without) += 1;
    if (sums.depth > 0) CHECK(r.status != TrimStatus::infeasible);
    if (sums.depth < 0) CHECK(r.status >= TrimStatus::infeasible);
    // One sum's enclosure is its exact range: a single box shows it.
    if (sums.depth < 0 && sums.C.rows() == 1) CHECK(r.status == TrimStatus::infeasible);
    solved += bool(r);
    shown += r.status == TrimStatus::infeasible;
    if (r)
      CHECK(sums.values(r.point.u).lpNorm<Eigen::Infinity>() <= 1.01 * TrimOptions{}.tolerance);
  }
  CHECK(with > boxes / 4);
  CHECK(without > boxes / 4);
  CHECK(solved > 0.95 * with);
  CHECK(shown > 0.8 * without);  // two sums, near the border: left open
}

// ---- the tiltrotor ----

// The airframe's equations once more, in plain arithmetic: (2)-(4) and (14) at rest in pitch.
struct Forces {
  double thrust_up, wing_up, weight;        // N
  double V_rate, gamma_rate, pitching, vi;  // m/s², rad/s, N m, m/s
};

static Forces forces(const Vehicle& v, const Model& model, const OperatingPoint& point) {
  const auto at = [&](const char* name) { return value_of(point, variable(model, name)); };
  const double V = at("V"), gamma = at("gamma"), alpha = at("theta") - gamma;
  const double theta0 = at("theta0"), a1s = at("a1s"), tail = at("delta_e") * std::cos(alpha);
  const Aircraft& a = v.aircraft;
  const double Ep = at("aircraft.thrust_excess"), wake = at("aircraft.wake_immersion");
  const double c1 = a.blade_lift_slope * a.blade_count * a.blade_chord / (pi * a.rotor_radius);
  const double tip = a.rotor_speed_rpm * 2 * pi / 60 * a.rotor_radius, x = a.pitch_scale * theta0;
  const double vi =
      std::copysign(tip * c1 / 16 * (std::sqrt(1 + 32 * std::abs(x) / c1) - 1), x);  // (3)
  const double W = V + wake * vi, Q = 0.5 * a.air_density * W * W * a.wing_area;
  const double mg = a.mass * a.gravity, T = Ep * mg * theta0;  // (4)
  const Coefficients C = v.polar->at(alpha);
  const double L = Q * (C.CL + a.CL_de * tail), D = Q * C.CD;
  const double phi = alpha + at("eta") - a1s;
  const double hub = a.rotor_x * std::sin(at("eta") - a1s) - a.rotor_z * std::sin(a1s);
  return {T * std::sin(phi + gamma),
          L * std::cos(gamma) - D * std::sin(gamma),
          mg,
          (T * std::cos(phi) - D) / a.mass - a.gravity * std::sin(gamma),
          (T * std::sin(phi) + L - mg * std::cos(gamma)) / (a.mass * V),
          hub * T + a.chord * Q * (C.CM + a.CM_de * tail),
          vi};
}

static std::string in_words(const Forces& f) {
  return fmt::format("thrust {:.1f} N up, weight {:.1f} N, the wing {:.1f} N {}", f.thrust_up,
                     f.weight, std::abs(f.wing_up), f.wing_up < 0 ? "down" : "up");
}

// Is there an equilibrium of the airframe, with the pitch control that the tilt leaves?
static TrimStatus flown(const Vehicle& v, const Command& d) {
  AirframeCondition c;
  c.values = {{"V", {d.V, d.V}}, {"gamma", {d.gamma, d.gamma}}, {"eta", {d.eta, d.eta}}};
  c.values[d.eta < v.aircraft.cyclic_off ? "a1s" : "delta_e"] = {0, 0};
  const TrimProblem p = airframe_problem(v, c, Axes::wind);
  return trim(p.model, p.spec, p.guess, {.method = TrimMethod::newton, .closest = false}).status;
}

static bool flies(const Vehicle& v, const Command& d) {
  return flown(v, d) == TrimStatus::converged;
}

static Condition asked(const Command& command) {
  Condition condition;
  condition.command = command;
  return condition;
}

struct Explained {
  Vehicle vehicle;
  Command command;
  Explanation why;

  Explained(const Vehicle& v, const Command& d) : vehicle(v), command(d) {
    CHECK_FALSE(flies(v, d));
    std::optional<Explanation> e = explain(v, asked(d));
    REQUIRE(e.has_value());
    REQUIRE(e->diagnosis.has_value());
    why = *e;
  }

  const Diagnosis& d() const { return *why.diagnosis; }

  bool says(const std::string& words) const {
    return std::ranges::any_of(
        why.words, [&](const std::string& w) { return w.find(words) != std::string::npos; });
  }

  // At the remedy's own point the forces balance, within all limits but the one that gave way.
  void check_balanced(const Remedy& r) const {
    CAPTURE(r.signal);
    REQUIRE(r.trim.status == TrimStatus::converged);
    const Forces f = forces(vehicle, why.airframe, r.trim.point);
    CHECK_NEAR(f.V_rate, 0, 1e-9);  // trim's own 1e-10, and rounding
    CHECK_NEAR(f.gamma_rate, 0, 1e-9);
    CHECK_NEAR(f.pitching / vehicle.aircraft.inertia_yy, 0, 1e-9);
    const Limits& l = vehicle.limits;
    for (const auto& [name, range] : {std::pair{"theta0", l.theta0},
                                      {"a1s", l.a1s},
                                      {"delta_e", l.delta_e},
                                      {"theta", l.theta}}) {
      const double at = value_of(r.trim.point, variable(why.airframe, name));
      if (r.kind == RemedyKind::limit && r.signal == name)
        CHECK(at == r.to);
      else
        CHECK((at >= range.lower - 1e-9 && at <= range.upper + 1e-9));
    }
  }

  // Nothing flies nearer to the command than `to`, on either side; just beyond, it does.
  void check_nearest(const char* signal, double Command::*member) const {
    const Remedy& r = lever(d(), signal);
    check_balanced(r);
    CHECK(r.from == command.*member);
    const auto flies_at = [&](double value) {
      Command c = command;
      c.*member = value;
      return flies(vehicle, c);
    };
    const double away = r.to - r.from, beyond = std::copysign(1e-4, away);
    CHECK(flies_at(r.to + beyond));
    CHECK_FALSE(flies_at(r.to - beyond));
    constexpr int samples = trials(10);
    for (int i = 1; i <= samples; ++i) {
      const double part = away * i / (samples + 1.0);
      CHECK_FALSE(flies_at(r.from + part));
      if (r.from - part >= r.searched.lower && r.from - part <= r.searched.upper)
        CHECK_FALSE(flies_at(r.from - part));
    }
  }
};

TEST_CASE("(3) as printed: no climb, for the wing's download") {
  Vehicle v = reference_vehicle();
  v.aircraft.pitch_scale = v.aircraft.wake_immersion = 1;
  const Explained climb(v, {2, pi / 2, pi / 2});
  const Diagnosis& d = climb.d();
  const Model& model = climb.why.airframe;

  CHECK(d.holding.front().limit.signal == "theta0");
  CHECK(climb.says("held back by theta0 at its lower limit 0"));
  CHECK(climb.says("closest point: " + in_words(forces(v, model, d.closest))));

  // With all the thrust there is, straight up: theta0 = 1, and the wing square in its wake.
  OperatingPoint full = d.closest;
  for (const auto& [name, value] : {std::pair{"theta0", 1.0}, {"theta", 0.0}, {"a1s", 0.0}})
    set_value(full, variable(model, name), value);
  const Forces f = forces(v, model, full);
  const Aircraft& a = v.aircraft;
  const double mg = a.mass * a.gravity, W = 2 + f.vi;
  CHECK_NEAR(f.thrust_up, a.thrust_excess * mg, 1e-12 * mg);
  CHECK_NEAR(f.wing_up, -0.5 * a.air_density * a.wing_area * W * W * v.polar->at(-pi / 2).CD,
             1e-9 * mg);
  CHECK(climb.says("at the thrust limit, theta0 = 1: " + in_words(f)));
  CHECK(
      climb.says(fmt::format("thrust would have to be {:.1f} N, or the wing's download {:.1f} N "
                             "at most",
                             mg - f.wing_up, (a.thrust_excess - 1) * mg)));

  const Remedy& V = lever(d, "V");
  CHECK(V.trim.status == TrimStatus::infeasible);
  CHECK(V.searched.lower == 0.5);
  CHECK(V.searched.upper == 60);
  CHECK(climb.says("does not help: any V between 0.5 m/s and 60 m/s (shown)"));
  for (int i = 0; i < trials(10); ++i) CHECK_FALSE(flies(v, {0.5 + 6 * i, pi / 2, pi / 2}));
  for (const Remedy& r : d.remedies)
    if (r.signal == "eta") CHECK(r.trim.status == TrimStatus::infeasible);

  const auto check_design = [&](const char* signal, double Aircraft::*member) {
    const Remedy& r = lever(d, signal);
    climb.check_balanced(r);
    CHECK(climb.says(in_words(forces(v, model, r.trim.point))));
    Vehicle changed = v;
    const double from = v.aircraft.*member;
    CHECK(r.from == from);
    for (const double share : {0.99, 1.01}) {
      changed.aircraft.*member = from + share * (r.to - from);
      CHECK(flies(changed, climb.command) == (share > 1));
    }
  };
  check_design("aircraft.thrust_excess", &Aircraft::thrust_excess);
  check_design("aircraft.wake_immersion", &Aircraft::wake_immersion);
  climb.check_nearest("gamma", &Command::gamma);
}

TEST_CASE("level flight at 5 m/s: the elevator's limit") {
  const Vehicle v = reference_vehicle();
  const Explained slow(v, {5, 0, 0});
  REQUIRE(slow.d().holding.size() == 1);
  CHECK(slow.d().holding[0].limit.signal == "delta_e");
  CHECK_FALSE(slow.d().holding[0].limit.upper);
  CHECK(slow.says("held back by delta_e at its lower limit -30.37°"));
  CHECK(slow.says("closest point: " + in_words(forces(v, slow.why.airframe, slow.d().closest))));
  slow.check_nearest("V", &Command::V);
  slow.check_nearest("gamma", &Command::gamma);
  slow.check_nearest("eta", &Command::eta);
  const Remedy& V = lever(slow.d(), "V");
  CHECK(V.to > 5);
  CHECK_NEAR(value_of(V.trim.point, variable(slow.why.airframe, "delta_e")), -0.53, 1e-9);

  const Remedy& down = limit(slow.d(), "delta_e", false);
  slow.check_balanced(down);
  for (const double more : {-1e-6, 1e-6}) {
    Vehicle wider = v;
    wider.limits.delta_e.lower = down.to - more;
    CHECK(flies(wider, slow.command) == (more > 0));
  }
  CHECK(slow.says(
      fmt::format("delta_e down to {:.6g}° instead of {:.6g}°", down.to / degree, -0.53 / degree)));
}

TEST_CASE("a descent at 20 m/s: less than no thrust") {
  const Vehicle v = reference_vehicle();
  const Explained descent(v, {20, -5 * degree, 0});
  REQUIRE(descent.d().holding.size() == 1);
  CHECK(descent.d().holding[0].limit.signal == "theta0");
  CHECK_FALSE(descent.d().holding[0].limit.upper);
  const Remedy& down = limit(descent.d(), "theta0", false);
  descent.check_balanced(down);
  CHECK(down.to < 0);
  CHECK(down.to > -0.05);
  for (const double more : {-1e-6, 1e-6}) {
    Vehicle wider = v;
    wider.limits.theta0.lower = down.to - more;
    CHECK(flies(wider, descent.command) == (more > 0));
  }
  CHECK(descent.says(fmt::format("theta0 down to {:.6g} instead of 0", down.to)));
  // V' alone: what the drag lacks of the weight's pull, with no thrust.
  const Remedy& speeding = equation(descent.d(), "V");
  CHECK_NEAR(forces(v, descent.why.airframe, speeding.trim.point).V_rate, speeding.to, 1e-9);
  descent.check_nearest("V", &Command::V);
  descent.check_nearest("gamma", &Command::gamma);
  descent.check_nearest("eta", &Command::eta);
}

TEST_CASE("what is not explained") {
  const Vehicle v = reference_vehicle();
  Condition table;
  table.formulation = Formulation::table;
  CHECK_FALSE(explain(v, table).has_value());
  const auto hover = explain(v, asked({0, pi / 2, pi / 2}));
  CHECK_FALSE(hover.has_value());
  const auto level = explain(v, asked({15, 0, 0}));
  REQUIRE(level.has_value());
  CHECK_FALSE(level->diagnosis.has_value());
  REQUIRE(level->words.size() == 1);
  CHECK(level->words[0].starts_with("the airframe alone has an equilibrium"));
}

// ---- the caller's mistakes, and the words ----

TEST_CASE("the caller's mistakes throw") {
  const Asked q = circle({{0, 1}, {0, 1}}, 2);
  const auto with = [&](const Lever& lever) { return nearest(q.model, q.spec, q.guess, lever); };
  CHECK_THROWS_AS(with({"q", {0, 1}}), std::invalid_argument);
  CHECK_THROWS_AS(with({"p", {1, 0}}), std::invalid_argument);
  CHECK_THROWS_AS(with({"p", {NAN, 1}}), std::invalid_argument);
  CHECK_THROWS_AS(diagnosed(q, {{"q", {0, 1}}}), std::invalid_argument);
  TrimSpec wrong = q.spec;
  wrong.still = {"y"};
  CHECK_THROWS_AS(diagnose(q.model, wrong, q.guess, q.guess, {}), std::invalid_argument);
  OperatingPoint no_guess = q.guess;
  no_guess.u.resize(1);
  CHECK_THROWS_AS(diagnose(q.model, q.spec, no_guess, q.guess, {}), std::invalid_argument);
}

TEST_CASE("remedies in words") {
  TrimResult good, open, nothing, shown;
  good.status = TrimStatus::converged;
  open.status = TrimStatus::not_optimal;
  nothing.status = TrimStatus::not_found;
  nothing.starts = 5;
  shown.status = TrimStatus::infeasible;
  const auto words = [](RemedyKind kind, bool upper, const TrimResult& trim, double factor = 1,
                        const std::string& unit = "") {
    return tiltrim::in_words({kind, "s", upper, 1, 1.25, {-2, 3}, trim}, factor, unit);
  };
  CHECK(words(RemedyKind::limit, true, good) == "s up to 1.25 instead of 1");
  CHECK(words(RemedyKind::limit, false, good, 2, "m") == "s down to 2.5 m instead of 2 m");
  CHECK(words(RemedyKind::limit, true, open) == "s up to at most 1.25 instead of 1");
  CHECK(words(RemedyKind::limit, true, nothing) == "s up to 3 (none found in 5 starts)");
  CHECK(words(RemedyKind::limit, false, shown, 10, "°") == "s down to -20° (shown)");
  CHECK(words(RemedyKind::equation, false, good) == "s' = 1.25 instead of 1");
  CHECK(words(RemedyKind::equation, false, nothing) == "any s' (none found in 5 starts)");
  CHECK(words(RemedyKind::equation, false, shown) == "any s' (shown)");
  CHECK(words(RemedyKind::lever, false, good, 1, "m/s") == "s = 1.25 m/s instead of 1 m/s");
  CHECK(words(RemedyKind::lever, false, nothing) ==
        "any s between -2 and 3 (none found in 5 starts)");
  CHECK(words(RemedyKind::lever, false, shown, 2, "°") == "any s between -4° and 6° (shown)");
}
