// Trim of the tiltrotor, against reference cases and against an independent scan for equilibria.
#include <Eigen/Core>
#include <cstring>
#include <fstream>
#include <nlohmann/json.hpp>
#include <numbers>
#include <random>

#include "model/in_place.hpp"
#include "tests/check.hpp"
#include "vehicles/tiltrotor/along.hpp"
#include "vehicles/tiltrotor/corridor.hpp"
#include "vehicles/tiltrotor/formulations.hpp"
#include "vehicles/tiltrotor/numbers.hpp"
#include "vehicles/tiltrotor/table_trim.hpp"

using namespace tiltrim;
using Eigen::VectorXd;

namespace trim_vehicle_test {

static constexpr double pi = std::numbers::pi, degree = pi / 180;

static const Vehicle& reference() {
  static const Vehicle vehicle = [] {
    Vehicle v;
    v.polar = std::make_shared<const Polar>(
        load_polar(std::string(TILTRIM_SOURCE_DIR) + "/data/naca8h12_re150k.csv"));
    return v;
  }();
  return vehicle;
}

namespace {

struct ReferenceCase {
  std::string name;
  Command command;
  std::map<std::string, double> state, input;
};

}  // namespace

static std::vector<ReferenceCase> reference_cases() {
  std::ifstream file(std::string(TILTRIM_SOURCE_DIR) + "/data/reference_cases.json");
  const nlohmann::json read = nlohmann::json::parse(file);
  std::vector<ReferenceCase> cases;
  for (const auto& c : read.at("cases")) {
    const auto& asked = c["condition"];
    cases.push_back({asked["name"],
                     {asked["V"], asked["gamma_deg"].get<double>() * degree,
                      asked["eta_deg"].get<double>() * degree},
                     c["state"],
                     c["input"]});
  }
  REQUIRE(cases.size() == 7);
  return cases;
}

// ---- docs/model.md again, in plain arithmetic ----

namespace {

struct Controls {
  double theta0, a1s, delta_e, eta;
};

struct Attitude {
  double V, gamma, theta, q;
};

struct Aerodynamics {
  double L, D, M, T, hub;
};

}  // namespace

static double induced(const Aircraft& a, double theta0) {
  const double c1 = a.blade_lift_slope * a.blade_count * a.blade_chord / (pi * a.rotor_radius);
  const double tip = a.rotor_speed_rpm * 2 * pi / 60 * a.rotor_radius;
  const double x = a.pitch_scale * theta0;
  return std::copysign(tip * c1 / 16 * (std::sqrt(1 + 32 * std::abs(x) / c1) - 1), x);
}

static Aerodynamics aerodynamics(const Vehicle& v, double alpha, const Attitude& at,
                                 const Controls& u) {
  const Aircraft& a = v.aircraft;
  const Coefficients C = v.polar->at(alpha);
  const double W = at.V + a.wake_immersion * induced(a, u.theta0);
  const double Q = 0.5 * a.air_density * W * W * a.wing_area;
  const double qh = W > 0 ? at.q * a.chord / (2 * W) : 0.0;
  const double tail = u.delta_e * std::cos(alpha);
  return {Q * (C.CL + a.CL_q * qh + a.CL_de * tail), Q * C.CD,
          Q * a.chord * (C.CM + a.CM_q * qh + a.CM_de * tail),
          a.thrust_excess * a.mass * a.gravity * u.theta0,
          a.rotor_x * std::sin(u.eta - u.a1s) - a.rotor_z * std::sin(u.a1s)};
}

namespace {

struct Rates {
  double V, gamma, q;
};

}  // namespace

static Rates rates(const Vehicle& v, const Attitude& at, const Controls& u) {
  const double m = v.aircraft.mass, g = v.aircraft.gravity;
  const double alpha = at.theta - at.gamma, phi = alpha + u.eta - u.a1s;
  const auto [L, D, M, T, hub] = aerodynamics(v, alpha, at, u);
  return {(T * std::cos(phi) - D) / m - g * std::sin(at.gamma),
          (T * std::sin(phi) + L - m * g * std::cos(at.gamma)) / (m * at.V),
          (hub * T + M) / v.aircraft.inertia_yy};
}

static double effort(const Controls& u) {
  return std::pow(u.theta0, 2) + std::pow(u.a1s / 0.35, 2) + std::pow(u.delta_e / 0.53, 2);
}

// Margin to the limits; negative: exceeded.
static double room(double theta, const Controls& u) {
  return std::min({u.theta0, 1 - u.theta0, 0.35 - std::abs(u.a1s), 0.53 - std::abs(u.delta_e),
                   1.3 - std::abs(theta)});
}

// ---- every equilibrium of a condition, by sign changes over theta ----

template <class Function>
static double bisect(const Function& f, double a, double b) {
  const bool rising = f(b) > 0;
  for (double middle = 0.5 * (a + b); middle != a && middle != b; middle = 0.5 * (a + b))
    ((f(middle) > 0) == rising ? b : a) = middle;
  return a;
}

namespace {

struct Equilibrium {
  double theta;
  Controls u;
};

// At each theta the speed row gives theta0; the moment row then gives the elevator or, where the
// cyclic is active, a1s, both in closed form; the path row remains as a function of theta.
class Scan {
 public:
  Scan(const Vehicle& v, const Command& d)
      : v_(v), d_(d), cyclic_(d.eta >= v.aircraft.cyclic_off) {}

  std::vector<Equilibrium> equilibria() const {
    constexpr int steps = 1301;  // of two milliradians
    std::vector<Equilibrium> found;
    std::vector<Branch> last = branches(-1.301);
    for (int i = 1; i <= steps; ++i) {
      const double theta = -1.301 + 2.602 * i / steps;
      std::vector<Branch> next = branches(theta);
      for (const Branch& a : last)
        for (const Branch& b : next)
          if (&b == nearest(next, a.theta0) && std::abs(b.theta0 - a.theta0) < 0.05 &&
              (a.path > 0) != (b.path > 0))
            found.push_back(between(a, b));
      last = std::move(next);
    }
    return found;
  }

 private:
  struct Branch {
    double theta, theta0, path;
  };

  static const Branch* nearest(const std::vector<Branch>& all, double theta0) {
    const auto apart = [&](const Branch& b) { return std::abs(b.theta0 - theta0); };
    return all.empty() ? nullptr : &*std::ranges::min_element(all, {}, apart);
  }

  Controls controls(double theta0, double alpha, const Coefficients& C) const {
    const Aircraft& a = v_.aircraft;
    const double W = d_.V + a.wake_immersion * induced(a, theta0);
    const double arm = a.chord * 0.5 * a.air_density * W * W * a.wing_area;
    const double T = a.thrust_excess * a.mass * a.gravity * theta0;
    if (!cyclic_) {
      const double needed = -(a.rotor_x * std::sin(d_.eta) * T / arm + C.CM);
      return {theta0, 0, needed / (a.CM_de * std::cos(alpha)), d_.eta};
    }
    // xR sin(η - a) - zH sin a = -hyp sin(a - δ) balances c̄ Q CM / T; beyond reach: a right angle
    const double P = a.rotor_x * std::sin(d_.eta);
    const double R = a.rotor_x * std::cos(d_.eta) + a.rotor_z;
    const double lever = std::clamp(arm * C.CM / (T * std::hypot(P, R)), -1.0, 1.0);
    return {theta0, std::atan2(P, R) + std::asin(lever), 0, d_.eta};
  }

  std::vector<Branch> branches(double theta) const {
    constexpr int parts = 16;
    const double from = cyclic_ ? 1e-6 : -0.05, to = 1.05;  // beyond the limits: tested later
    const double alpha = theta - d_.gamma;
    const Coefficients C = v_.polar->at(alpha);
    const Aircraft& a = v_.aircraft;
    const double weight = a.mass * a.gravity;
    struct Force {
      double along, across;
    };
    const auto force = [&](double theta0) -> Force {
      const Controls u = controls(theta0, alpha, C);
      const double W = d_.V + a.wake_immersion * induced(a, theta0);
      const double Q = 0.5 * a.air_density * W * W * a.wing_area;
      const double T = a.thrust_excess * weight * theta0, phi = alpha + d_.eta - u.a1s;
      return {T * std::cos(phi) - Q * C.CD - weight * std::sin(d_.gamma),
              T * std::sin(phi) + Q * (C.CL + a.CL_de * u.delta_e * std::cos(alpha)) -
                  weight * std::cos(d_.gamma)};
    };
    const auto along = [&](double theta0) { return force(theta0).along; };
    std::vector<Branch> roots;
    double t = from, f = along(from);
    for (int i = 1; i <= parts; ++i) {
      const double t2 = from + (to - from) * i / parts, f2 = along(t2);
      if ((f > 0) != (f2 > 0)) {
        const double theta0 = bisect(along, t, t2);
        roots.push_back({theta, theta0, force(theta0).across});
      }
      t = t2;
      f = f2;
    }
    return roots;
  }

  Equilibrium between(Branch a, Branch b) const {
    for (double theta = 0.5 * (a.theta + b.theta); theta != a.theta && theta != b.theta;
         theta = 0.5 * (a.theta + b.theta)) {
      const std::vector<Branch> all = branches(theta);
      const Branch* const middle = nearest(all, 0.5 * (a.theta0 + b.theta0));
      if (!middle) break;
      ((middle->path > 0) == (b.path > 0) ? b : a) = *middle;
    }
    const double alpha = a.theta - d_.gamma;
    return {a.theta, controls(a.theta0, alpha, v_.polar->at(alpha))};
  }

  const Vehicle& v_;
  Command d_;
  bool cyclic_;
};

// The scan's equilibria of a condition: those within the limits, by rising effort.
struct Truth {
  std::vector<Equilibrium> within;
  bool clear = true;  // no equilibrium lies on the edge of the limits
};

}  // namespace

static Truth truth(const Vehicle& vehicle, const Command& command) {
  constexpr double edge = 1e-6;
  Truth t;
  for (const Equilibrium& e : Scan(vehicle, command).equilibria()) {
    const Rates left = rates(vehicle, {command.V, command.gamma, e.theta, 0}, e.u);
    if (std::abs(left.V) + std::abs(left.gamma) + std::abs(left.q) > 1e-6) continue;  // a jump
    if (std::abs(room(e.theta, e.u)) < edge) t.clear = false;
    if (room(e.theta, e.u) >= 0) t.within.push_back(e);
  }
  std::ranges::sort(t.within, {}, [](const Equilibrium& e) { return effort(e.u); });
  return t;
}

static Controls controls_of(const TrimResult& r, double eta) {
  return {r.outputs[0], r.outputs[1], r.outputs[2], eta};
}

// The closed loop's equations at a result, law and airframe, by the arithmetic above.
static double closed_loop_residual(const Vehicle& v, const Command& d, const TrimResult& r) {
  const Aircraft& a = v.aircraft;
  const Gains& k = v.gains;
  const double theta = r.point.x[2], x1 = r.point.x[4], x2 = r.point.x[5];
  const double drag = 0.5 * a.air_density * d.V * d.V * a.wing_area *
                      v.polar->at(theta - d.gamma).CD / (a.mass * a.gravity);
  const double common = std::sin(d.gamma) + drag;
  const double s = d.eta >= a.cyclic_off ? 1.0 : 0.0;
  const double a_hat = (k.K_Lp * common + k.K_Li * x2) / (1 + k.K_Lp);
  const Controls u{(k.K_Ep * common + k.K_Ei * x1) / (1 + a.thrust_excess * k.K_Ep),
                   s * (a_hat + k.k_pa * theta), (1 - s) * (k.K_Li * x2 + k.k_pe * theta), d.eta};
  const Controls told = controls_of(r, d.eta);
  const Rates left = rates(v, {d.V, d.gamma, theta, 0}, u);
  return std::max({std::abs(left.V), std::abs(left.gamma), std::abs(left.q),
                   std::abs(u.theta0 - told.theta0), std::abs(u.a1s - told.a1s),
                   std::abs(u.delta_e - told.delta_e)});
}

// ---- formulation 1 ----

TEST_CASE("the reference cases") {
  for (const ReferenceCase& c : reference_cases())
    for (const TrimMethod method : {TrimMethod::ipopt, TrimMethod::newton}) {
      CAPTURE(c.name);
      CAPTURE(int(method));
      const TrimResult r = trim_closed_loop(reference(), c.command, {.method = method});
      REQUIRE(r.status == TrimStatus::converged);
      CHECK(r.residual <= 1e-11);
      CHECK(closed_loop_residual(reference(), c.command, r) <= 1e-11);
      // The reference's own solver stopped at 1e-13 of its residuals; conditions are near 1e3.
      CHECK_NEAR(r.point.x[2], c.state.at("theta"), 1e-8);
      CHECK_NEAR(r.outputs[0], c.input.at("theta0"), 1e-8);
      CHECK_NEAR(r.outputs[1], c.input.at("a1s"), 1e-8);
      CHECK_NEAR(r.outputs[2], c.input.at("delta_e"), 1e-8);
      // An integral moves an input by its gain over (1 + Ep K_Ep) or (1 + K_Lp): 1/10 to 1/20.
      CHECK_NEAR(r.point.x[4], c.state.at("energy_integral"), 2e-7);
      CHECK_NEAR(r.point.x[5], c.state.at("distribution_integral"), 2e-7);
      CHECK_NEAR(r.effort, effort(controls_of(r, c.command.eta)), 1e-12);
      CHECK(r.limits_active.empty());

      const Truth t = truth(reference(), c.command);
      REQUIRE(t.clear);
      REQUIRE(!t.within.empty());
      CHECK_NEAR(r.point.x[2], t.within[0].theta, 1e-8);
      CHECK(r.others.size() == t.within.size() - 1);
    }
}

TEST_CASE("near stall: the least effort of all equilibria, and the others counted" * thorough) {
  std::size_t most = 0;
  for (const double gamma : {0.0, 5 * degree})
    for (double V = 6.5; V <= 11.0; V += 0.25) {
      CAPTURE(V);
      CAPTURE(gamma);
      const Command command{V, gamma, 0.0};
      const TrimResult r = trim_closed_loop(reference(), command);
      const Truth t = truth(reference(), command);
      REQUIRE(t.clear);
      CHECK(bool(r) == !t.within.empty());
      CHECK(r.status == (t.within.empty() ? TrimStatus::infeasible : TrimStatus::converged));
      if (!r || t.within.empty()) continue;
      CHECK(closed_loop_residual(reference(), command, r) <= 1e-10);
      CHECK_NEAR(r.point.x[2], t.within[0].theta, 1e-8);
      REQUIRE(r.others.size() == t.within.size() - 1);
      for (std::size_t i = 0; i < r.others.size(); ++i)
        CHECK_NEAR(r.others[i].x[2], t.within[i + 1].theta, 1e-8);
      most = std::max(most, t.within.size());
    }
  CHECK(most >= 3);
}

TEST_CASE("(3) as printed cannot climb: shown" * thorough) {
  Vehicle printed = reference();
  printed.aircraft.pitch_scale = 1;
  printed.aircraft.wake_immersion = 1;
  const Command climb{2.0, pi / 2, pi / 2};
  const TrimResult r = trim_closed_loop(printed, climb);
  CHECK(r.status == TrimStatus::infeasible);
  CHECK(r.message.find("proved") != std::string::npos);
  CHECK(truth(printed, climb).within.empty());
  // Proved, though no time is left for the closest point.
  const TrimResult hasty = trim_closed_loop(printed, climb, {.time_limit = 1e-9});
  CHECK(hasty.status == TrimStatus::infeasible);
  CHECK(hasty.message ==
        "whatever the control law does, no point within the limits is an equilibrium");
}

TEST_CASE("random aircraft along the corridor: each trimmed, or shown not to be" * thorough) {
  std::mt19937_64 g(2013);
  const auto within = [&](double lower, double upper) {
    return std::uniform_real_distribution<double>(lower, upper)(g);
  };
  int converged = 0, infeasible = 0, scanned = 0;
  constexpr int aircraft = trials(400);
  for (int i = 0; i < aircraft; ++i) {
    CAPTURE(i);
    Vehicle v = reference();
    for (std::size_t k = 0; k < aircraft_signals().size(); ++k)
      aircraft_value(v.aircraft, k) *= within(0.85, 1.15);
    for (std::size_t k = 0; k < gain_signals().size(); ++k)
      gain_value(v.gains, k) *= within(0.6, 1.4);
    const Command command = corridor(within(0, 120));
    const TrimMethod method = i % 8 ? TrimMethod::newton : TrimMethod::ipopt;
    const TrimResult r = trim_closed_loop(v, command, {.method = method});
    if (r.status == TrimStatus::converged) {
      ++converged;
      CHECK(closed_loop_residual(v, command, r) <= 1e-9);  // the tolerance, and K_Li's leverage
      CHECK(room(r.point.x[2], controls_of(r, command.eta)) >= -1e-10);
    } else {
      CHECK_MESSAGE(r.status == TrimStatus::infeasible,
                    fmt::format("{}: {}", to_string(r.status), r.message));
      ++infeasible;
    }
    if (r && i % 8 != 0) continue;  // an answer needs the scan only to be the least effort
    const Truth t = truth(v, command);
    if (!t.clear) continue;
    ++scanned;
    CHECK(bool(r) == !t.within.empty());
    if (r && !t.within.empty()) CHECK_NEAR(r.point.x[2], t.within[0].theta, 1e-7);
  }
  CHECK(converged > aircraft / 2);
  CHECK((infeasible > 0 || sanitized));
  CHECK(scanned > aircraft / 9);
}

static TrimResult solve(const TrimProblem& problem, const TrimOptions& options = {}) {
  return trim(problem.model, problem.spec, problem.guess, options);
}

TEST_CASE("wind axes and body axes trim alike") {
  for (const ReferenceCase& c : reference_cases()) {
    CAPTURE(c.name);
    const TrimResult wind = solve(closed_loop_problem(reference(), c.command, Axes::wind));
    const TrimResult body = solve(closed_loop_problem(reference(), c.command, Axes::body));
    REQUIRE(wind.status == TrimStatus::converged);
    REQUIRE(body.status == TrimStatus::converged);
    for (const int i : {2, 3}) CHECK_NEAR(body.point.x[i], wind.point.x[i], 1e-9);
    for (const int i : {0, 1, 2}) CHECK_NEAR(body.outputs[i], wind.outputs[i], 1e-9);
    for (const int i : {4, 5}) CHECK_NEAR(body.point.x[i], wind.point.x[i], 1e-8);  // of up to 100
    CHECK_NEAR(std::hypot(body.point.x[0], body.point.x[1]), c.command.V, 1e-9);
  }
}

TEST_CASE("exact derivatives and differences trim alike") {
  for (const ReferenceCase& c : reference_cases()) {
    CAPTURE(c.name);
    TrimProblem problem = closed_loop_problem(reference(), c.command);
    const TrimResult exact = solve(problem);
    problem.model.derivatives = {};
    const TrimResult differences = solve(problem);
    REQUIRE(differences.status == TrimStatus::converged);
    CHECK_NEAR(differences.point.x[2], exact.point.x[2], 1e-9);
    for (const int i : {0, 1, 2}) CHECK_NEAR(differences.outputs[i], exact.outputs[i], 1e-9);
    for (const int i : {4, 5})
      CHECK_NEAR(differences.point.x[i], exact.point.x[i], 1e-8);  // of up to 100
  }
}

TEST_CASE("trimming a trimmed point changes nothing; the same input gives the same bytes") {
  for (const ReferenceCase& c : reference_cases()) {
    CAPTURE(c.name);
    TrimProblem problem = closed_loop_problem(reference(), c.command);
    const TrimResult once = solve(problem), twice = solve(problem);
    const auto bytes = [](const VectorXd& v) {
      return std::string(reinterpret_cast<const char*>(v.data()),
                         std::size_t(v.size()) * sizeof(double));
    };
    CHECK(bytes(once.point.x) == bytes(twice.point.x));
    CHECK(bytes(once.rates) == bytes(twice.rates));
    CHECK(bytes(once.outputs) == bytes(twice.outputs));
    CHECK(once.evaluations == twice.evaluations);
    problem.guess = once.point;
    const TrimResult again = solve(problem);
    REQUIRE(again.status == TrimStatus::converged);
    for (int i = 0; i < 6; ++i)  // rounding of the last Newton step
      CHECK_NEAR(again.point.x[i], once.point.x[i], 1e-12 * (1 + std::abs(once.point.x[i])));
  }
}

static TrimResult newton_alone(const TrimProblem& problem) {
  return trim(problem.model, problem.spec, problem.guess,
              {.method = TrimMethod::newton, .starts = 0});
}

TEST_CASE("f and h in one call: the same bits, and never those of a function that was replaced") {
  const TrimProblem problem = closed_loop_problem(reference(), {6.0, pi / 4, pi / 4});
  REQUIRE(in_place(problem.model));
  const TrimResult own = newton_alone(problem);
  REQUIRE(own);
  TrimProblem other = problem;
  SUBCASE("the same f: the same point, rates and outputs") {
    other.model.f = [f = problem.model.f](const auto& x, const auto& u, const auto& p) -> VectorXd {
      return f(x, u, p);
    };
    REQUIRE(!in_place(other.model));
    const TrimResult r = newton_alone(other);
    REQUIRE(r);
    CHECK(r.point.x == own.point.x);
    CHECK(r.rates == own.rates);
    CHECK(r.outputs == own.outputs);
    CHECK(r.rcond == own.rcond);
    CHECK(r.evaluations == own.evaluations + 2);  // for the sizes of its results, and at the answer
  }
  SUBCASE("another f: its trim") {
    constexpr double pitching = 0.05;  // rad/s²
    other.model.f = [f = problem.model.f](const auto& x, const auto& u, const auto& p) -> VectorXd {
      VectorXd rates = f(x, u, p);
      rates[3] += pitching;
      return rates;
    };
    REQUIRE(!in_place(other.model));
    const TrimResult r = newton_alone(other);
    REQUIRE(r);
    const VectorXd before = problem.model.f(r.point.x, r.point.u, r.point.p);
    CHECK_NEAR(before[3], -pitching, 2 * TrimOptions{}.tolerance);
  }
  SUBCASE("another h: its outputs, and its limits") {
    other.model.h = [h = problem.model.h](const auto& x, const auto& u, const auto& p) -> VectorXd {
      VectorXd outputs = h(x, u, p);
      outputs[0] += 5;
      return outputs;
    };
    REQUIRE(!in_place(other.model));
    const TrimResult r = newton_alone(other);
    CHECK(r.status == TrimStatus::not_found);  // theta0 is beyond its limit
    CHECK(r.outputs[0] == problem.model.h(r.point.x, r.point.u, r.point.p)[0] + 5);
  }
}

TEST_CASE("f and h in one call: a model that is not repeatable is refused") {
  const auto calls = std::make_shared<int>(0);
  const auto both = std::make_shared<const InPlace>(InPlace{
      1, 1, [calls](const double* x, const double*, const double*, double* rates, double* outputs) {
        if (rates) *rates = *x - 1 + 1e-14 * ++*calls;
        if (outputs) *outputs = *x;
      }});
  Model model;
  model.states = {{"x", "", 1.0}};
  model.outputs = {{"y", "", 1.0}};
  model.f = InPlaceFunction<false>{both};
  model.h = InPlaceFunction<true>{both};
  REQUIRE(in_place(model));
  const OperatingPoint guess{VectorXd::Zero(1), VectorXd(0), VectorXd(0)};
  const TrimSpec spec{.free = {"x"}, .steady = {"x"}};
  CHECK(newton_alone({model, spec, guess}).status == TrimStatus::not_repeatable);
}

// ---- at rest ----

TEST_CASE("hover, body axes: forces and moment balance") {
  const TrimProblem problem =
      airframe_problem(reference(), {.values = {{"V", {0, 0}}, {"eta", {pi / 2, pi / 2}}}});
  const TrimResult r = solve(problem);
  REQUIRE(r.status == TrimStatus::converged);
  CHECK(r.point.x[0] == 0.0);
  CHECK(r.point.x[1] == 0.0);
  const double theta = r.point.x[2], alpha = 0.0;  // by convention
  const Controls u{r.point.u[0], r.point.u[1], r.point.u[2], r.point.u[3]};
  CHECK(room(theta, u) > 0);
  const auto [L, D, M, T, hub] = aerodynamics(reference(), alpha, {0, 0, theta, 0}, u);
  const double weight = reference().aircraft.mass * reference().aircraft.gravity;
  CHECK_NEAR(T * std::cos(u.eta - u.a1s) + L * std::sin(alpha) - D * std::cos(alpha),
             weight * std::sin(theta), 1e-9);
  CHECK_NEAR(T * std::sin(u.eta - u.a1s) + L * std::cos(alpha) + D * std::sin(alpha),
             weight * std::cos(theta), 1e-9);
  CHECK_NEAR(hub * T + M, 0.0, 1e-9);
}

// Without wake on the wing only thrust and weight act at rest.
static Vehicle without_wake() {
  Vehicle v = reference();
  v.aircraft.wake_immersion = 0;
  return v;
}

TEST_CASE("hover without a wake: in closed form") {
  // T = m g, its line through the centre of gravity: tan a1s = xR/zH, and theta = a1s keeps it up.
  const double leaning = std::atan(0.01 / 0.08);
  const TrimResult open = solve(
      airframe_problem(without_wake(), {.values = {{"V", {0, 0}}, {"eta", {pi / 2, pi / 2}}}}));
  REQUIRE(open.status == TrimStatus::converged);
  CHECK_NEAR(open.point.u[0], 1 / 1.4, 1e-9);
  CHECK_NEAR(open.point.u[1], leaning, 1e-9);
  CHECK_NEAR(open.point.u[2], 0.0, 1e-9);  // without effect, so unchanged
  CHECK_NEAR(open.point.x[2], leaning, 1e-9);

  const TrimResult closed = trim_closed_loop(without_wake(), {0.0, 0.0, pi / 2});
  REQUIRE(closed.status == TrimStatus::converged);
  CHECK_NEAR(closed.outputs[0], 1 / 1.4, 1e-9);
  CHECK_NEAR(closed.outputs[1], leaning, 1e-9);
  CHECK_NEAR(closed.point.x[2], leaning, 1e-9);
}

TEST_CASE("the closed loop's trim is continuous down to rest" * thorough) {
  for (const double gamma : {0.0, pi / 2})
    for (const bool wake : {true, false}) {
      CAPTURE(gamma);
      CAPTURE(wake);
      const Vehicle v = wake ? reference() : without_wake();
      const auto theta_at = [&](double V) {
        const TrimResult r = trim_closed_loop(v, {V, gamma, pi / 2});
        REQUIRE(r.status == TrimStatus::converged);
        return r.point.x[2];
      };
      const double at_rest = theta_at(0);
      // Dynamic pressure: W² = (V + w)² leaves an error of first order in V, with w = 0 of second.
      const double order = std::log2((theta_at(2e-3) - at_rest) / (theta_at(1e-3) - at_rest));
      CHECK_NEAR(order, wake ? 1.0 : 2.0, 0.02);
      CHECK_NEAR(theta_at(body_axes_below * (1 - 1e-9)), theta_at(body_axes_below), 1e-8);
    }
}

// ---- formulation 2 ----

TEST_CASE("the airframe alone: derivatives held at targets") {
  const Range cruise{15, 15}, airplane{0, 0};
  SUBCASE("speeding up") {
    const TrimResult r = solve(airframe_problem(
        reference(),
        {.values = {{"V", cruise}, {"eta", airplane}, {"a1s", {0, 0}}}, .rates = {{"V", 0.5}}}));
    REQUIRE(r.status == TrimStatus::converged);
    const Rates left =
        rates(reference(), {15, 0, r.point.x[2], 0}, {r.point.u[0], 0, r.point.u[2], 0});
    CHECK_NEAR(left.V, 0.5, 1e-10);
    CHECK_NEAR(left.gamma, 0.0, 1e-10);
    CHECK_NEAR(left.q, 0.0, 1e-10);
  }
  SUBCASE("pulling up") {
    const TrimResult r = solve(airframe_problem(
        reference(),
        {.values = {{"V", {20, 20}}, {"eta", airplane}, {"a1s", {0, 0}}, {"q", {0.3, 0.3}}},
         .rates = {{"gamma", 0.3}}}));
    REQUIRE(r.status == TrimStatus::converged);
    const Rates left =
        rates(reference(), {20, 0, r.point.x[2], 0.3}, {r.point.u[0], 0, r.point.u[2], 0});
    CHECK_NEAR(left.V, 0.0, 1e-10);
    CHECK_NEAR(left.gamma, 0.3, 1e-10);
    CHECK_NEAR(left.q, 0.0, 1e-10);
    CHECK_NEAR(r.rates[2], 0.3, 1e-15);  // theta' = q: alpha stays
  }
  SUBCASE("angle of attack given, speed free") {
    const TrimResult r = solve(airframe_problem(
        reference(),
        {.values = {{"V", {5, 40}}, {"eta", airplane}, {"a1s", {0, 0}}, {"alpha", {0.06, 0.06}}}}));
    REQUIRE(r.status == TrimStatus::converged);
    CHECK_NEAR(r.point.x[2], 0.06, 1e-10);
    const Rates left =
        rates(reference(), {r.point.x[0], 0, 0.06, 0}, {r.point.u[0], 0, r.point.u[2], 0});
    CHECK_NEAR(left.V, 0.0, 1e-9);
    CHECK_NEAR(left.gamma, 0.0, 1e-9);
    CHECK_NEAR(left.q, 0.0, 1e-9);
  }
  SUBCASE("all controls free: no more effort than any other equilibrium") {
    const AirframeCondition condition{.values = {{"V", {6, 6}},
                                                 {"gamma", {45 * degree, 45 * degree}},
                                                 {"eta", {45 * degree, 45 * degree}}}};
    const TrimResult r = solve(airframe_problem(reference(), condition));
    REQUIRE(r.status == TrimStatus::converged);
    const Controls best{r.point.u[0], r.point.u[1], r.point.u[2], 45 * degree};
    const Rates left = rates(reference(), {6, 45 * degree, r.point.x[2], 0}, best);
    CHECK(std::abs(left.V) + std::abs(left.gamma) + std::abs(left.q) <= 1e-9);
    // The curve of equilibria, one per cyclic angle: lowest at the solution.
    for (const double step : {-0.02, -0.001, 0.001, 0.02}) {
      AirframeCondition held = condition;
      held.values["a1s"] = {best.a1s + step, best.a1s + step};
      const TrimResult near = solve(airframe_problem(reference(), held));
      REQUIRE(near.status == TrimStatus::converged);
      CHECK(near.effort > r.effort);
      // Second order: the effort rises by the square of the step.
      CHECK(near.effort - r.effort < 100 * step * step);
    }
  }
}

TEST_CASE("the airframe alone: what cannot be asked") {
  CHECK_THROWS_AS(airframe_problem(reference(), {.values = {{"V", {15, 15}}}}),
                  std::invalid_argument);
  CHECK_THROWS_AS(
      airframe_problem(reference(),
                       {.values = {{"V", {15, 15}}, {"eta", {0, 0}}, {"beta", {0, 0}}}}),
      std::invalid_argument);
  CHECK_THROWS_AS(airframe_problem(reference(), {.values = {{"V", {15, 15}}, {"eta", {0, 0}}},
                                                 .rates = {{"theta0", 0.0}}}),
                  std::invalid_argument);
}

TEST_CASE("a thrust that is too weak is shown to be, and where it ends" * thorough) {
  Vehicle weak = reference();
  weak.aircraft.thrust_excess = 0.7;
  const TrimResult r = trim_closed_loop(weak, {1.0, pi / 2, pi / 2});
  CHECK(r.status == TrimStatus::infeasible);
  CHECK(r.message.find("theta0 at its upper limit 1") != std::string::npos);
}

// ---- formulation 3 ----

TEST_CASE("table trim: the closed forms behind Table 3") {
  // Coefficients of Table 2; attitude and path of its first column; k from the paper's speeds.
  const double CL[] = {0.0512, 1.3229, 0.1792}, CD[] = {3.4994, 1.6217, 0.01707},
               CM[] = {0.6145, -0.1707, 0.0204};
  for (const double k : {0.01, 0.0425, 0.1})
    for (int i = 0; i < 3; ++i) {
      CAPTURE(k);
      CAPTURE(i);
      const TableTrim t = trim_table(reference(), {.gamma = -pi / 2,
                                                   .alpha = -pi / 2,
                                                   .eta = pi / 2,
                                                   .CL = CL[i],
                                                   .CD = CD[i],
                                                   .CM = CM[i],
                                                   .k = k});
      REQUIRE(t.trim.status == TrimStatus::converged);
      CHECK_NEAR(std::abs(t.theta0), std::hypot(1 - k * CD[i], k * CL[i]) / 1.4, 1e-10);
      CHECK_NEAR(std::abs(t.a1s), std::atan(k * CL[i] / (1 - k * CD[i])), 1e-10);
      // What is required balances the hub's moment over Q S c̄ = k m g c̄.
      const double hub = 0.01 * std::sin(pi / 2 - t.a1s) - 0.08 * std::sin(t.a1s);
      CHECK_NEAR(hub * 1.4 * t.theta0 + k * 0.36 * t.CM_required, 0.0, 1e-12);
      CHECK_NEAR(t.CM_elevator, t.CM_required - CM[i], 1e-15);
    }
}

TEST_CASE("where the proof makes the search needless the closest point is no farther" * thorough) {
  int proved = 0;
  for (const double eta : {0.0, 45 * degree, 90 * degree})
    for (const double gamma : {-10 * degree, 40 * degree, 90 * degree})
      for (const double V : {2.0, 8.0, 14.0}) {
        CAPTURE(V);
        CAPTURE(gamma);
        CAPTURE(eta);
        const TrimProblem problem = airframe_problem(
            reference(),
            {.values = {{"V", {V, V}}, {"gamma", {gamma, gamma}}, {"eta", {eta, eta}}}});
        const auto distance = [&](const TrimResult& r) {
          double sum = 0.0;
          for (const char* state : {"V", "gamma", "q"}) {
            const Eigen::Index i = find(problem.model.states, state);
            sum += std::pow(r.rates[i] / problem.model.states[std::size_t(i)].nominal, 2);
          }
          return std::sqrt(sum);
        };
        const TrimResult first = solve(problem);
        if (first.status != TrimStatus::infeasible) continue;
        const TrimResult searched = solve(problem, {.max_boxes = 0});
        CHECK(searched.status == TrimStatus::not_found);
        CHECK(first.starts == 0);
        CHECK(searched.starts > 30);
        CHECK(distance(first) <= distance(searched) * (1 + 1e-6) + 1e-9);
        ++proved;
      }
  CHECK(proved > 10);
}

// The proof that there is no trim comes before the search.
TEST_CASE("the proof that comes before the search excludes no trim of the scan") {
  int flown = 0, excluded = 0;
  for (const double eta : {0.0, 45 * degree, 90 * degree})
    for (const double gamma : {-10 * degree, 0.0, 40 * degree, 90 * degree})
      for (const double V : {1.0, 4.0, 7.0, 10.0}) {
        const Command command{V, gamma, eta};
        CAPTURE(V);
        CAPTURE(gamma);
        CAPTURE(eta);
        const Truth t = truth(reference(), command);
        if (!t.clear) continue;
        const TrimResult r = trim_closed_loop(reference(), command, {.closest = false});
        CHECK((r || t.within.empty()));  // the scan misses three, at φ from 86° to 90°
        if (r) CHECK(closed_loop_residual(reference(), command, r) <= 1e-10);
        flown += !t.within.empty();
        if (r.status != TrimStatus::infeasible) continue;
        CHECK(r.message.starts_with("whatever the control law does, no point within"));
        excluded += r.starts == 0;
      }
  CHECK(flown > 10);
  CHECK(excluded > 10);
}

}  // namespace trim_vehicle_test
