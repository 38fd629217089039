// Diagnoses of infeasible trims: against closed forms, the tiltrotor's against its equations.
#include <Eigen/Core>
#include <algorithm>
#include <numbers>

#include "model/lookup.hpp"
#include "study/analyses.hpp"
#include "study/reference_vehicle.hpp"
#include "study/study.hpp"
#include "tests/check.hpp"
#include "tests/random_draws.hpp"
#include "tests/toy_models.hpp"
#include "trim/remedy.hpp"
#include "vehicles/tiltrotor/corridor.hpp"
#include "vehicles/tiltrotor/formulations.hpp"
#include "vehicles/tiltrotor/table_trim.hpp"

using namespace tiltrim;
using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using enum RemedyKind;

namespace diagnosis_test {

static constexpr double pi = std::numbers::pi, degree = pi / 180;
static constexpr double infinity = std::numeric_limits<double>::infinity();

static double sign(Random& g) { return g() % 2 ? 1.0 : -1.0; }

namespace {

// States x, y held at their values, inputs u1, u2, ... free within a box, a parameter p. The rates,
// and an optional output z, are polynomials.
struct Asked {
  Model model;
  TrimSpec spec;
  OperatingPoint guess;

  using Values = std::function<VectorXd(const VectorXd& u, double p)>;

  Asked(Index m, const std::vector<Range>& box, double p, const Values& y, bool output = false) {
    const Index n = std::ssize(box);
    for (Index i = 0; i < m; ++i) model.states.push_back({i ? "y" : "x", "", 1.0});
    model.parameters = {{"p", "", 1.0}};
    guess = {VectorXd::Zero(m), VectorXd::Constant(n, 0.3), vec({p})};
    for (Index k = 0; k < n; ++k) {
      const Range& r = box[std::size_t(k)];
      model.inputs.push_back({fmt::format("u{}", k + 1), "", 1.0});
      spec.bounds[model.inputs.back().name] = r;
      if (std::isfinite(r.upper - r.lower)) guess.u[k] = 0.5 * (r.lower + r.upper);
    }
    spec.free = names(model.inputs);
    spec.steady = names(model.states);
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

}  // namespace

static Diagnosis diagnosed(const Asked& q, const TrimOptions& options = {}) {
  const TrimResult none = trim(q.model, q.spec, q.guess, options);
  CHECK(none.status >= TrimStatus::infeasible);
  return diagnose(q.model, q.spec, q.guess, none.point, {{"p", {-100, 100}}}, options);
}

// ---- infeasible problems with known causes and remedies ----

namespace {

struct Way {
  RemedyKind kind;
  std::string signal;
  bool upper;
  double from, to;
};

struct Known {
  Asked asked;
  VectorXd closest;  // of the first inputs
  std::vector<Diagnosis::Holding> holding;
  std::vector<Way> ways;
  int starts = 0;  // beyond the guess: for convex problems one start finds everything
};

}  // namespace

static void check(const Known& known) {
  const Diagnosis d = diagnosed(known.asked, {.starts = known.starts});
  const VectorXd off = d.closest.u.head(known.closest.size()) - known.closest;
  CHECK_NEAR(off.lpNorm<Eigen::Infinity>(), 0, 1e-6);

  CHECK(std::ranges::is_sorted(d.holding, {}, &Diagnosis::Holding::pull));
  REQUIRE(d.holding.size() >= known.holding.size());
  for (std::size_t i = 0; i < d.holding.size(); ++i) {
    const Diagnosis::Holding& h = d.holding[i];
    const auto is_same = [&](const Diagnosis::Holding& k) {
      return k.limit.signal == h.limit.signal;
    };
    const auto same = std::ranges::find_if(known.holding, is_same);
    const bool pulls = same != known.holding.end();
    CHECK(pulls == (i < known.holding.size()));
    // Inputs without effect stay about 1e-5 from their limit: the interior point's distance.
    CHECK_NEAR(h.pull, pulls ? same->pull : 0, pulls ? 1e-6 + 1e-5 * std::abs(h.pull) : 1e-4);
    if (!pulls) continue;
    CHECK(h.limit.upper == same->limit.upper);
    CHECK_NEAR(h.limit.value, same->limit.value, 1e-12);
  }

  std::size_t limits = 0, helped = 0;
  for (const auto& [name, range] : known.asked.spec.bounds)
    limits += std::size_t(std::isfinite(range.lower) + std::isfinite(range.upper));
  CHECK(d.remedies.size() == limits + known.asked.model.states.size() + 1);
  for (const Remedy& r : d.remedies) {
    CAPTURE(r.signal);
    CAPTURE(r.upper);
    const auto way = std::ranges::find_if(known.ways, [&](const Way& w) {
      return w.kind == r.kind && w.signal == r.signal && w.upper == r.upper;
    });
    CHECK(r.helps() == (way != known.ways.end()));
    if (way == known.ways.end()) continue;
    ++helped;
    CHECK(r.trim.status <= TrimStatus::singular);  // what has no cost may stay undetermined
    CHECK(r.from == way->from);
    CHECK_NEAR(r.to, way->to, 1e-6);  // conditions met to 1e-9, no slope below 0.01
  }
  CHECK(helped == known.ways.size());
}

// x' = c·u - p, p beyond what the box reaches. `plain`: u1 + u2 = p, u1 in [0, a], u2 in [0, b].
static Known line(Random& g, bool plain) {
  const Index n = plain ? 2 : 2 + Index(g() % 2);
  const double missing = (plain ? 1 : sign(g)) * uniform(g, 0.2, 3);
  const double rate_size = plain ? 1 : std::pow(10, uniform(g, -0.5, 0.5));
  VectorXd c = VectorXd::Ones(n), corner(n);
  std::vector<Range> box;
  for (Index k = 0; k < n; ++k) {
    if (!plain) c[k] = sign(g) * uniform(g, 0.3, 3);
    const double lower = plain ? 0 : uniform(g, -2, 2);
    box.push_back({lower, lower + uniform(g, 0.1, 2)});
    corner[k] = c[k] * missing > 0 ? box.back().upper : box.back().lower;
  }
  const double p = c.dot(corner) + missing;
  Known known{
      {1, box, p, [c](const VectorXd& u, double to) { return vec({c.dot(u) - to}); }},
      corner,
      {},
      {{equation, "x", false, 0, -missing}, {decision_variable, "p", false, p, p - missing}}};
  known.asked.model.states[0].nominal = rate_size;
  for (Index k = 0; k < n; ++k) {
    Signal& u = known.asked.model.inputs[std::size_t(k)];
    if (!plain) u.nominal = std::pow(10, uniform(g, -0.5, 0.5));
    const double more = missing / c[k], pull = -std::abs(missing * c[k]) * u.nominal;
    known.holding.push_back({{u.name, more > 0, corner[k]}, pull / (rate_size * rate_size)});
    const Range& own = box[std::size_t(k)];
    if (std::abs(more) < 10 * (own.upper - own.lower))  // search range
      known.ways.push_back({limit, u.name, more > 0, corner[k], corner[k] + more});
  }
  return known;
}

// x' = u1² + u2² - p², a corner (a, b) of the box nearest to the circle.
static Known circle(Random& g, bool within) {
  const double a = uniform(g, 0.5, 2), b = uniform(g, 0.5, 2), corner = std::hypot(a, b);
  const double p = corner * (within ? uniform(g, 1.1, 1.7) : uniform(g, 0.3, 0.9));
  const double left = corner * corner - p * p, pull = -2 * std::abs(left);
  const std::vector<Range> box =
      within ? std::vector<Range>{{0, a}, {0, b}} : std::vector<Range>{{a, a + 1}, {b, b + 1}};
  Known known{
      {1, box, p, [](const VectorXd& u, double r) { return vec({u.squaredNorm() - r * r}); }},
      vec({a, b}),
      {{{"u1", within, a}, pull * a}, {{"u2", within, b}, pull * b}},
      {{equation, "x", false, 0, left}, {decision_variable, "p", false, p, corner}}};
  const double u1 = std::sqrt(p * p - b * b), u2 = std::sqrt(p * p - a * a);
  if (p > b) known.ways.push_back({limit, "u1", within, a, u1});
  if (p > a) known.ways.push_back({limit, "u2", within, b, u2});
  if (within) known.ways.push_back({limit, "u1", false, 0, -u1});  // the circle's other side
  if (within) known.ways.push_back({limit, "u2", false, 0, -u2});
  known.starts = TrimOptions{}.starts;  // not convex
  return known;
}

// x' = u1² + u2² + u3² - R²,  y' = n·(u1, u2) - u4 - p,  u3, u4 >= 0, |n| = 1: in the disc and
// beyond the line at p > R.
static Known disc(Random& g) {
  const double R = uniform(g, 0.5, 2), p = R + uniform(g, 0.2, 2), turn = uniform(g, 0, 2 * pi);
  const double c = std::cos(turn), s = std::sin(turn);
  // The closest point lies at ρ n: a root of d/dρ (½(ρ² - R²)² + ½(ρ - p)²).
  double rho = p;
  for (int step = 0; step < 50; ++step)
    rho -= (2 * rho * (rho * rho - R * R) + rho - p) / (6 * rho * rho - 2 * R * R + 1);
  const auto rates = [=](const VectorXd& u, double to) {
    return vec({u.head(3).squaredNorm() - R * R, c * u[0] + s * u[1] - u[3] - to});
  };
  return {{2, {{-5, 5}, {-5, 5}, {0, 5}, {0, 5}}, p, rates},
          vec({rho * c, rho * s}),
          {{{"u4", false, 0}, rho - p}},
          {{limit, "u4", false, 0, R - p},
           {equation, "x", false, 0, p * p - R * R},
           {equation, "y", false, 0, R - p},
           {decision_variable, "p", false, p, R}}};
}

// x' = u1 + u2 - p,  z = u1² + u2² <= Z < p²/2.
static Known output(Random& g) {
  const double Z = uniform(g, 0.5, 2), most = std::sqrt(2 * Z), p = most + uniform(g, 0.1, 1.5);
  const auto values = [](const VectorXd& u, double to) {
    return vec({u.sum() - to, u.squaredNorm()});
  };
  Known known{{1, {{-5, 5}, {-5, 5}}, p, values, true},
              vec({most / 2, most / 2}),
              {{{"z", true, Z}, (most - p) / most}},
              {{limit, "z", true, Z, p * p / 2},
               {equation, "x", false, 0, most - p},
               {decision_variable, "p", false, p, most}}};
  known.asked.spec.bounds["z"] = {g() % 2 ? -infinity : -1, Z};
  return known;
}

// x' = a·u - p,  y' = k a·u - b  with b ≠ k p: no limit is involved.
static Asked conflict(double a1, double a2, double k, double b, double p, const Range& range) {
  return {2, {range, range}, p, [=](const VectorXd& u, double to) {
            const double sum = a1 * u[0] + a2 * u[1];
            return vec({sum - to, k * sum - b});
          }};
}

static Known two_equations(Random& g) {
  const double a1 = sign(g) * uniform(g, 0.5, 2), a2 = sign(g) * uniform(g, 0.5, 2);
  const double k = sign(g) * uniform(g, 0.5, 2), p = uniform(g, -2, 2);
  const double b = k * p + sign(g) * uniform(g, 0.3, 2);
  return {conflict(a1, a2, k, b, p, {-50, 50}),
          {},
          {},
          {{equation, "x", false, 0, b / k - p},
           {equation, "y", false, 0, k * p - b},
           {decision_variable, "p", false, p, b / k}}};
}

TEST_CASE("out of reach: the closest point, what holds it back, what each thing alone would give") {
  Random g(1);
  for (int i = 0; i < trials(120); ++i) check(line(g, i % 3 == 0));
  for (int i = 0; i < trials(10); ++i) check(circle(g, i % 2));
  for (int i = 0; i < trials(10); ++i) check(disc(g));
  for (int i = 0; i < trials(10); ++i) check(output(g));
  for (int i = 0; i < trials(20); ++i) check(two_equations(g));
}

TEST_CASE("u1 + u2 = 1 and = 2, without limits" * thorough) {
  const Diagnosis d = diagnosed(conflict(1, 1, 1, 2, 1, Range{}));
  CHECK(d.holding.empty());
  REQUIRE(d.remedies.size() == 3);
  CHECK_NEAR(d.remedies[0].to, 1, 1e-9);   // x'
  CHECK_NEAR(d.remedies[1].to, -1, 1e-9);  // y'
  CHECK_NEAR(d.remedies[2].to, 2, 1e-9);   // p
}

// ---- proved, or only not found ----

static Range squared(const Range& r) {
  const double a = r.lower * r.lower, b = r.upper * r.upper;
  return {r.lower < 0 && r.upper > 0 ? 0.0 : std::min(a, b), std::max(a, b)};
}
static Range operator+(const Range& a, const Range& b) {
  return {a.lower + b.lower, a.upper + b.upper};
}
static Range operator*(double c, const Range& r) {
  return {std::min(c * r.lower, c * r.upper), std::max(c * r.lower, c * r.upper)};
}

TEST_CASE("a variable that cannot help: shown where the model has an enclosure of it" * thorough) {
  Asked q(1, {{0, 1}, {0, 0}}, 0,
          [](const VectorXd& u, double p) { return vec({1 + u[0] + u[1] * u[1] + p * p}); });
  const auto status = [&](const char* signal) {
    const Remedy r = nearest(q.model, q.spec, q.guess, {signal, {-2, 3}});
    CHECK_FALSE(r.helps());
    return r.trim.status;
  };
  for (const char* signal : {"x", "u2", "p"}) CHECK(status(signal) == TrimStatus::not_found);
  q.model.enclosure = [](const std::vector<Range>& at) -> std::vector<Range> {
    return {Range{1, 1} + at[1] + squared(at[2]) + squared(at[3])};
  };
  CHECK(status("x") == TrimStatus::infeasible);
  CHECK(status("u2") == TrimStatus::infeasible);
  CHECK(status("p") == TrimStatus::not_found);  // no enclosure spans parameters
}

namespace {

// x' = sum of the first unknowns' terms - level,  y' = last unknown's term - level + mix x': a
// solution exists if and only if each level lies within the range of its terms.
struct Sums {
  struct Term {
    double slope, curvature;

    double at(double u) const { return u * (slope + curvature * u); }
    Range range(const Range& u) const {
      const double a = at(u.lower), b = at(u.upper), turn = -0.5 * slope / curvature;
      const double c = u.lower < turn && turn < u.upper ? at(turn) : a;
      return {std::min({a, b, c}), std::max({a, b, c})};
    }
  };
  std::vector<Term> terms;
  std::vector<Range> box;
  std::vector<double> levels;
  double mix;
  double depth = infinity;  // of the levels within the ranges; negative: outside

  explicit Sums(Random& g) : levels(1 + g() % 2), mix(uniform(g, -3, 3)) {
    const bool linear = g() % 3 == 0;
    for (auto n = 2 + g() % 2; n > 0; --n) {
      const double lower = uniform(g, -1.5, 1);
      box.push_back({lower, lower + uniform(g, 0.2, 1.5)});
      terms.push_back({sign(g) * uniform(g, 0.3, 2), linear ? 0 : uniform(g, -1, 1)});
    }
    const std::vector<Range> reached = ranges(box);
    const std::size_t out = g() % 2 ? g() % levels.size() : 2;
    for (std::size_t i = 0; i < levels.size(); ++i) {
      const auto [low, high] = reached[i];
      const double off = (i == out ? -1 : 0.5) * (high - low) * std::pow(10, uniform(g, -6, 0));
      levels[i] = g() % 2 ? low + off : high - off;
      depth = std::min({depth, levels[i] - low, high - levels[i]});
    }
  }

  std::vector<Range> ranges(const std::vector<Range>& of) const {
    std::vector<Range> sums(levels.size(), Range{0, 0});
    for (std::size_t k = 0; k < terms.size(); ++k) {
      Range& sum = k + 1 < terms.size() ? sums.front() : sums.back();
      sum = sum + terms[k].range(of[k]);
    }
    return sums;
  }

  // A number is a range without width.
  VectorXd rates(const VectorXd& u) const {
    std::vector<Range> all(levels.size(), Range{0, 0});
    for (const double x : u) all.push_back({x, x});
    all.push_back({0, 0});
    VectorXd y(Index(levels.size()));
    std::ranges::transform(enclosure(all), y.begin(), &Range::lower);
    return y;
  }

  // Over a box of all variables: states, inputs, p.
  std::vector<Range> enclosure(const std::vector<Range>& all) const {
    std::vector<Range> y = ranges({all.begin() + std::ssize(levels), all.end() - 1});
    for (std::size_t i = 0; i < y.size(); ++i) y[i] = y[i] + Range{-levels[i], -levels[i]};
    if (y.size() == 2) y[1] = y[1] + mix * y[0];
    return y;
  }
};

}  // namespace

// k of n drawn is a share of at least `least`, to three standard deviations: few are drawn under
// sanitizers.
static bool at_least(double least, int k, int n) {
  return k >= least * n - 3 * std::sqrt(least * (1 - least) * n);
}

TEST_CASE("random boxes: never infeasible where there is a solution, nor converged without one") {
  Random g(6);
  int with = 0, without = 0, solved = 0, shown = 0;
  constexpr int boxes = trials(1000);
  for (int i = 0; i < boxes; ++i) {
    const Sums sums(g);
    if (std::abs(sums.depth) < 1e-6) continue;
    const bool solvable = sums.depth > 0;
    Asked q(std::ssize(sums.levels), sums.box, 0,
            [&](const VectorXd& u, double) { return sums.rates(u); });
    q.model.enclosure = [&](const std::vector<Range>& all) { return sums.enclosure(all); };
    const TrimResult r = trim(q.model, q.spec, q.guess, {.starts = 0, .closest = i % 4 == 0});
    CAPTURE(i);
    CAPTURE(sums.depth);
    (solvable ? with : without) += 1;
    solved += bool(r);
    shown += r.status == TrimStatus::infeasible;
    if (solvable) CHECK(r.status != TrimStatus::infeasible);
    if (!solvable) CHECK(r.status >= TrimStatus::infeasible);
    // The enclosure of one sum is its exact range: a single box proves it.
    if (!solvable && sums.levels.size() == 1) CHECK(r.status == TrimStatus::infeasible);
    if (r) CHECK(sums.rates(r.point.u).lpNorm<Eigen::Infinity>() <= TrimOptions{}.tolerance);
  }
  CHECK(with > boxes / 4);
  CHECK(without > boxes / 4);
  CHECK(at_least(0.95, solved, with));
  CHECK(at_least(0.8, shown, without));  // two sums, near the border: left open
}

// ---- the tiltrotor ----
// Under sanitizers each of these seconds becomes minutes: two cases suffice there.

static const Remedy& of(const Diagnosis& d, RemedyKind kind, const std::string& signal) {
  const auto at = std::ranges::find_if(
      d.remedies, [&](const Remedy& r) { return r.kind == kind && r.signal == signal; });
  REQUIRE(at != d.remedies.end());
  return *at;
}

namespace {

// The airframe's equations again, in plain arithmetic, without pitch rate.
struct Forces {
  double thrust_up, wing_up, weight;  // N
  double V_rate, gamma_rate, q_rate;
};

}  // namespace

static Forces forces(const Vehicle& v, const Model& model, const OperatingPoint& point) {
  const auto at = [&](const char* name) { return value_of(point, variable(model, name)); };
  const Aircraft& a = v.aircraft;
  const double V = at("V"), gamma = at("gamma"), alpha = at("theta") - gamma;
  const double theta0 = at("theta0"), a1s = at("a1s"), tail = at("delta_e") * std::cos(alpha);
  const double c1 = a.blade_lift_slope * a.blade_count * a.blade_chord / (pi * a.rotor_radius);
  const double tip = a.rotor_speed_rpm * 2 * pi / 60 * a.rotor_radius, x = a.pitch_scale * theta0;
  const double vi =
      std::copysign(tip * c1 / 16 * (std::sqrt(1 + 32 * std::abs(x) / c1) - 1), x);  // (3)
  const double W = V + at("aircraft.wake_immersion") * vi;
  const double Q = 0.5 * a.air_density * W * W * a.wing_area, mg = a.mass * a.gravity;
  const double T = at("aircraft.thrust_excess") * mg * theta0;  // (4)
  const Coefficients C = v.polar->at(alpha);
  const double L = Q * (C.CL + a.CL_de * tail), D = Q * C.CD;
  const double phi = alpha + at("eta") - a1s;
  const double hub = a.rotor_x * std::sin(at("eta") - a1s) - a.rotor_z * std::sin(a1s);
  return {.thrust_up = T * std::sin(phi + gamma),
          .wing_up = L * std::cos(gamma) - D * std::sin(gamma),
          .weight = mg,
          .V_rate = (T * std::cos(phi) - D) / a.mass - a.gravity * std::sin(gamma),
          .gamma_rate = (T * std::sin(phi) + L - mg * std::cos(gamma)) / (a.mass * V),
          .q_rate = (hub * T + a.chord * Q * (C.CM + a.CM_de * tail)) / a.inertia_yy};
}

static std::string in_words(const Forces& f) {
  const double thrust = std::abs(f.thrust_up) < 0.05 ? 0 : f.thrust_up;  // no minus before a zero
  return fmt::format("thrust {:.1f} N up, weight {:.1f} N, wing force {:.1f} N {}", thrust,
                     f.weight, std::abs(f.wing_up), f.wing_up < 0 ? "down" : "up");
}

// Whether the airframe has an equilibrium with the pitch control available at the tilt.
static bool flies(const Vehicle& v, const Command& d) {
  AirframeCondition c;
  c.values = {{"V", {d.V, d.V}}, {"gamma", {d.gamma, d.gamma}}, {"eta", {d.eta, d.eta}}};
  if (authority(v.aircraft, d.eta) == 0) c.values["a1s"] = {0, 0};
  if (authority(v.aircraft, d.eta) == 1) c.values["delta_e"] = {0, 0};
  const TrimProblem p = airframe_problem(v, c, Axes::wind);
  return bool(trim(p.model, p.spec, p.guess, {.method = TrimMethod::newton, .closest = false}));
}

static Condition asked(const Command& command) {
  Condition condition;
  condition.asked = command;
  return condition;
}

namespace {

struct Explained {
  Vehicle vehicle;
  Command command;
  Explanation why;

  Explained(const Vehicle& v, const Command& d) : vehicle(v), command(d) {
    REQUIRE_FALSE(flies(v, d));
    why = explain(v, asked(d)).value();
    REQUIRE(why.diagnosis.has_value());
  }

  const Diagnosis& d() const { return *why.diagnosis; }
  double value(const OperatingPoint& at, const char* name) const {
    return value_of(at, variable(why.airframe, name));
  }
  Forces at(const OperatingPoint& point) const { return forces(vehicle, why.airframe, point); }
  bool says(const std::string& words) const {
    return std::ranges::any_of(
        why.words, [&](const std::string& w) { return w.find(words) != std::string::npos; });
  }

  void check_held_back(const std::string& strongest, const std::string& words) const {
    CHECK(d().holding.front().limit.signal == strongest);
    CHECK_FALSE(d().holding.front().limit.upper);
    CHECK(says("closest point: " + in_words(at(d().closest)) + "; limited by " + words));
  }

  // At the remedy's point everything balances, within all limits except the relaxed one.
  void check_balanced(const Remedy& r) const {
    REQUIRE(r.trim.status == TrimStatus::converged);
    const Forces f = at(r.trim.point);
    for (const double rate : {f.V_rate, f.gamma_rate, f.q_rate})
      CHECK_NEAR(rate, 0, 1e-9);  // trim's own 1e-10, and rounding
    const Limits& l = vehicle.limits;
    for (const auto& [name, within] : {std::pair{"theta0", l.theta0},
                                       {"a1s", l.a1s},
                                       {"delta_e", l.delta_e},
                                       {"theta", l.theta}}) {
      const bool given = r.kind == limit && r.signal == name;
      const double at = value(r.trim.point, name);
      CHECK(at >= (given ? r.to : within.lower) - 1e-9);
      CHECK(at <= within.upper + 1e-9);
    }
  }

  // Nothing can be flown nearer than `to` on either side; just beyond it, something can.
  void check_nearest(const char* signal, double Command::*member) const {
    const Remedy& r = of(d(), decision_variable, signal);
    CAPTURE(signal);
    check_balanced(r);
    CHECK(r.from == command.*member);
    const auto flies_at = [&](double value) {
      Command c = command;
      c.*member = value;
      return flies(vehicle, c);
    };
    const double away = r.to - r.from;
    CHECK(flies_at(r.to + std::copysign(1e-4, away)));
    CHECK_FALSE(flies_at(r.to - std::copysign(1e-4, away)));
    for (int i = 1; i <= trials(10); ++i)
      for (const double there : {r.from + away * i / 10.1, r.from - away * i / 10.1})
        if (there >= r.searched.lower && there <= r.searched.upper) CHECK_FALSE(flies_at(there));
  }

  // A relaxed lower limit: just that far is enough, and anything less is not.
  void check_down(const char* signal, Range Limits::*limits, double unit, const char* name) const {
    const Remedy& r = of(d(), limit, signal);  // the lower one comes first
    check_balanced(r);
    for (const double more : {-1e-6, 1e-6}) {
      Vehicle wider = vehicle;
      (wider.limits.*limits).lower = r.to - more;
      CHECK(flies(wider, command) == (more > 0));
    }
    CHECK(says(fmt::format("{} down to {:.6g}{} instead of {:.6g}{}", signal, r.to / unit, name,
                           r.from / unit, name)));
  }
};

}  // namespace

TEST_CASE("(3) as printed: no climb, for the wing's download" * doctest::skip(sanitized)) {
  Vehicle v = reference_vehicle();
  v.aircraft.pitch_scale = v.aircraft.wake_immersion = 1;
  const Explained climb(v, {2, pi / 2, pi / 2});
  const Diagnosis& d = climb.d();
  climb.check_held_back("theta0", "theta0 at its lower limit 0, theta at its upper limit 74.48°");

  // With maximum thrust straight up: theta0 = 1, and the wing normal to the wake.
  OperatingPoint full = d.closest;
  for (const auto& [name, to] : {std::pair{"theta0", 1.0}, {"theta", 0.0}, {"a1s", 0.0}})
    set_value(full, variable(climb.why.airframe, name), to);
  const Forces f = climb.at(full);
  const Aircraft& a = v.aircraft;
  const double mg = a.mass * a.gravity;
  CHECK_NEAR(f.thrust_up, a.thrust_excess * mg, 1e-12 * mg);
  CHECK(climb.says("at the thrust limit, theta0 = 1: " + in_words(f)));
  CHECK(climb.says(
      fmt::format("thrust would have to be {:.1f} N, or the download on the wing at most {:.1f} N",
                  mg - f.wing_up, (a.thrust_excess - 1) * mg)));

  CHECK(of(d, decision_variable, "V").trim.status == TrimStatus::infeasible);
  CHECK(climb.says("does not help: any V between 0.5 m/s and 60 m/s (proved)"));
  for (int i = 0; i < trials(10); ++i) CHECK_FALSE(flies(v, {0.5 + 6 * i, pi / 2, pi / 2}));
  for (const Remedy& r : d.remedies)
    if (r.signal == "eta") CHECK(r.trim.status == TrimStatus::infeasible);

  const auto check_design = [&](const char* signal, double Aircraft::*member) {
    const Remedy& r = of(d, decision_variable, signal);
    climb.check_balanced(r);
    CHECK(r.from == v.aircraft.*member);
    CHECK(climb.says(fmt::format("{} = {:.6g} instead of {:.6g} ({})", signal, r.to, r.from,
                                 in_words(climb.at(r.trim.point)))));
    Vehicle changed = v;
    for (const double share : {0.99, 1.01}) {
      changed.aircraft.*member = r.from + share * (r.to - r.from);
      CHECK(flies(changed, climb.command) == (share > 1));
    }
  };
  check_design("aircraft.thrust_excess", &Aircraft::thrust_excess);
  check_design("aircraft.wake_immersion", &Aircraft::wake_immersion);
  climb.check_nearest("gamma", &Command::gamma);
}

TEST_CASE("level flight at 5 m/s: the elevator's limit") {
  const Explained slow(reference_vehicle(), {5, 0, 0});
  slow.check_held_back("delta_e", "delta_e at its lower limit -30.37°");
  slow.check_down("delta_e", &Limits::delta_e, degree, "°");
  slow.check_nearest("V", &Command::V);
  slow.check_nearest("gamma", &Command::gamma);
  slow.check_nearest("eta", &Command::eta);
  const Remedy& V = of(slow.d(), decision_variable, "V");
  CHECK(V.to > 5);
  CHECK_NEAR(slow.value(V.trim.point, "delta_e"), -0.53, 1e-9);
}

TEST_CASE("a descent at 20 m/s: less than no thrust" * doctest::skip(sanitized)) {
  const Explained descent(reference_vehicle(), {20, -5 * degree, 0});
  descent.check_held_back("theta0", "theta0 at its lower limit 0");
  descent.check_down("theta0", &Limits::theta0, 1, "");
  descent.check_nearest("V", &Command::V);
  descent.check_nearest("gamma", &Command::gamma);
  descent.check_nearest("eta", &Command::eta);
  CHECK_NEAR(of(descent.d(), limit, "theta0").to, -0.025, 0.025);
  const Remedy& speeding = of(descent.d(), equation, "V");
  CHECK_NEAR(descent.at(speeding.trim.point).V_rate, speeding.to, 1e-9);
}

TEST_CASE("what is not explained") {
  const Vehicle v = reference_vehicle();
  Condition table;
  table.asked = TableCondition{};
  CHECK_FALSE(explain(v, table).has_value());
  CHECK_FALSE(explain(v, asked({0, pi / 2, pi / 2})).has_value());  // at rest
  const auto level = explain(v, asked({15, 0, 0}));
  REQUIRE(level.has_value());
  CHECK_FALSE(level->diagnosis.has_value());
  REQUIRE(level->words.size() == 1);
  CHECK(level->words[0].starts_with("the airframe has an equilibrium"));
}

// ---- the caller's mistakes, and messages ----

TEST_CASE("the caller's mistakes throw") {
  const Asked q = conflict(1, 1, 1, 2, 1, Range{});
  for (const DecisionVariable& wrong :
       {DecisionVariable{"q", {0, 1}}, DecisionVariable{"p", {1, 0}},
        DecisionVariable{"p", {NAN, 1}}}) {
    CHECK_THROWS_AS((void)nearest(q.model, q.spec, q.guess, wrong), std::invalid_argument);
    CHECK_THROWS_AS((void)diagnose(q.model, q.spec, q.guess, q.guess, {wrong}),
                    std::invalid_argument);
  }
  TrimSpec wrong = q.spec;
  wrong.steady = {"z"};
  CHECK_THROWS_AS((void)diagnose(q.model, wrong, q.guess, q.guess, {}), std::invalid_argument);
}

TEST_CASE("remedies in words") {
  const auto words = [](RemedyKind kind, bool upper, TrimStatus status, double factor = 1,
                        const std::string& unit = "") {
    TrimResult trim;
    trim.status = status;
    trim.starts = 5;
    return tiltrim::in_words({kind, "s", upper, 1, 1.25, {-2, 3}, trim}, factor, unit);
  };
  using enum TrimStatus;
  CHECK(words(limit, true, converged) == "s up to 1.25 instead of 1");
  CHECK(words(limit, false, converged, 2, "m") == "s down to 2.5 m instead of 2 m");
  CHECK(words(limit, true, not_optimal) == "s up to at most 1.25 instead of 1");
  CHECK(words(limit, true, not_found) == "s up to 3 (no equilibrium found from 5 starts)");
  CHECK(words(limit, false, infeasible, 10, "°") == "s down to -20° (proved)");
  CHECK(words(equation, false, converged) == "s' = 1.25 instead of 1");
  CHECK(words(equation, false, not_found) == "any s' (no equilibrium found from 5 starts)");
  CHECK(words(decision_variable, false, converged, 1, "m/s") == "s = 1.25 m/s instead of 1 m/s");
  CHECK(words(decision_variable, false, not_found) ==
        "any s between -2 and 3 (no equilibrium found from 5 starts)");
  CHECK(words(decision_variable, false, infeasible, 2, "°") == "any s between -4° and 6° (proved)");
}

// ---- regressions ----

// The optimality test decomposed Jᵀ with no rows active, once the equation is omitted.
TEST_CASE("a single equation, nothing at its limit" * thorough) {
  const Asked q(1, {{-1, 2}}, 0, [](const VectorXd& u, double) { return vec({u[0] * u[0] + 1}); });
  CHECK_NEAR(of(diagnosed(q), equation, "x").to, 1, 1e-9);
}

TEST_CASE("a closest point of the wrong size throws") {
  const Asked q = conflict(1, 1, 1, 2, 1, Range{});
  CHECK_THROWS_AS((void)diagnose(q.model, q.spec, q.guess, {}, {}), std::invalid_argument);
}

// u1 + u2 = p with p beyond the corner (1, 2) by 1e-4; y' = u3 - ½ is there for the case above.
TEST_CASE("barely out of reach: held back by the limits all the same" * thorough) {
  const Asked q(2, {{0, 1}, {0, 2}, {0, 1}}, 3.0001, [](const VectorXd& u, double p) {
    return vec({u[0] + u[1] - p, u[2] - 0.5});
  });
  CHECK(diagnosed(q).holding.size() == 2);
}

// x' = u + g(p), g(p) = p²/4 + sin 8p + ½, u in [0, ½]: from p = 1 down g vanishes at 0.70133, from
// p = 1 up at 1.33233.
TEST_CASE("a converged decision variable is the nearest") {
  Asked q(1, {{0, 0.5}}, 1, [](const VectorXd& u, double p) {
    return vec({u[0] + p * p / 4 + std::sin(8 * p) + 0.5});
  });
  q.model.derivatives = {};  // no polynomial
  const Remedy r = nearest(q.model, q.spec, q.guess, {"p", {-3, 3}});
  CHECK_NEAR(r.to, 0.70133, printed_to("0.70133"));
}

// u1 - 1.5 u2 = p and = 8/3: one direction of (u1, u2) is undetermined, and u runs off along it.
TEST_CASE("a decision variable with a free direction left over") {
  const Asked q = conflict(1, -1.5, 0.75, 2, 0, Range{});
  CHECK(nearest(q.model, q.spec, q.guess, {"p", {-100, 100}}).helps());
}

TEST_CASE("a glide at 16 m/s: V = 10.66 flies, 40.7 is not the nearest" *
          doctest::skip(sanitized)) {
  const Explained glide(reference_vehicle(), {16, -15 * degree, 15 * degree});
  REQUIRE(flies(glide.vehicle, {10.65, -15 * degree, 15 * degree}));
  CHECK(of(glide.d(), decision_variable, "V").to < 16);
}

// From above, the elevator's tilts end just before 60°: at 60° the cyclic is already active.
TEST_CASE("the nearest tilt flies" * doctest::skip(sanitized)) {
  const Explained descent(reference_vehicle(), {10, -20 * degree, 70 * degree});
  const Remedy& r = of(descent.d(), decision_variable, "eta");
  REQUIRE(r.trim.status == TrimStatus::converged);
  CHECK(flies(descent.vehicle, {10, -20 * degree, r.to}));
}

TEST_CASE("tilts are looked for from 0 to 90°" * doctest::skip(sanitized)) {
  Vehicle v = reference_vehicle();
  v.aircraft.cyclic_off = -30 * degree;
  v.aircraft.cyclic_blend = 40 * degree;
  const Explained slow(v, {5, 0, 0});
  CHECK(of(slow.d(), decision_variable, "eta").to >= 0);
}

}  // namespace diagnosis_test
