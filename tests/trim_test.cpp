#include "trim/trim.hpp"

#include <Eigen/Core>
#include <memory>
#include <numbers>
#include <optional>
#include <random>
#include <stdexcept>

#include "model/lookup.hpp"
#include "tests/algebra.hpp"
#include "tests/check.hpp"
#include "tests/same_trim.hpp"
#include "tests/toy_models.hpp"
#include "trim/problem.hpp"

using namespace tiltrim;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace trim_test {

static constexpr double infinity = std::numeric_limits<double>::infinity();
static constexpr double NaN = std::numeric_limits<double>::quiet_NaN();
static const double converged_to = TrimOptions{}.tolerance;  // of rates over nominal sizes

// ---- three models unrelated to the tiltrotor ----

// x' = p + x²: equilibria ±√-p that meet and vanish at p = 0.
static Model fold() {
  Model m;
  m.name = "fold";
  m.states = {{"x", "m", 1.0}};
  m.parameters = {{"p", "m/s", 1.0}};
  m.f = [](const VectorXd& x, const VectorXd&, const VectorXd& p) {
    return vec({p[0] + x[0] * x[0]});
  };
  m.derivatives = [](const OperatingPoint& at, const std::vector<Eigen::Index>& variables) {
    MatrixXd J(1, std::ssize(variables));
    for (Eigen::Index k = 0; k < J.cols(); ++k)
      J(0, k) = variables[std::size_t(k)] == 0 ? 2 * at.x[0] : 1.0;
    return J;
  };
  m.enclosure = [](const std::vector<Range>& box) {
    const auto [low, high] = box[0];
    const double least = low <= 0 && high >= 0 ? 0.0 : std::min(low * low, high * high);
    return std::vector<Range>{
        {box[1].lower + least, box[1].upper + std::max(low * low, high * high)}};
  };
  return m;
}

static OperatingPoint at_fold(double x, double p) { return {vec({x}), VectorXd(), vec({p})}; }

// A rod with a torque at its hinge: θ' = ω,  ω' = (τ - c ω - m g l sin θ)/(m l²).
static constexpr double m_g_l = 2.5 * 9.81 * 0.4, m_l_l = 2.5 * 0.4 * 0.4, friction = 0.3;

static Model pendulum() {
  Model m;
  m.name = "damped pendulum";
  m.states = {{"theta", "rad", 0.1}, {"omega", "rad/s", 0.1}};
  m.inputs = {{"torque", "N m", 1.0}};
  m.outputs = {{"height", "m", 0.1}};
  m.f = [](const VectorXd& x, const VectorXd& u, const VectorXd&) {
    return vec({x[1], (u[0] - friction * x[1] - m_g_l * std::sin(x[0])) / m_l_l});
  };
  m.h = [](const VectorXd& x, const VectorXd&, const VectorXd&) {
    return vec({0.4 * (1 - std::cos(x[0]))});
  };
  m.derivatives = [](const OperatingPoint& at, const std::vector<Eigen::Index>& variables) {
    MatrixXd all = MatrixXd::Zero(3, 3);
    all << 0, 1, 0, -m_g_l * std::cos(at.x[0]) / m_l_l, -friction / m_l_l, 1 / m_l_l,
        0.4 * std::sin(at.x[0]), 0, 0;
    return MatrixXd(all(Eigen::all, variables));
  };
  return m;
}

static OperatingPoint hanging() { return {vec({0, 0}), vec({0}), VectorXd()}; }

namespace {

// An aircraft with five surfaces for three rates: ω' = A ω + B u + d.
struct Redundant {
  MatrixXd A, B;
  VectorXd d;
  static constexpr double sizes[5] = {0.1, 0.2, 0.05, 0.4, 0.1};  // of the surfaces

  Redundant() : A(3, 3), B(3, 5), d(vec({0.7, -0.4, 0.2})) {
    A << -1.2, 0.1, 0.4, 0.0, -0.8, 0.0, -0.3, 0.05, -0.5;
    B << 3.0, -3.0, 0.4, 0.3, 0.1, 1.1, 1.2, 2.5, 0.0, 0.3, 0.2, -0.1, 0.0, 1.4, -0.9;
  }

  Model model() const {
    Model m;
    m.name = "aircraft with redundant surfaces";
    m.states = {{"roll", "rad/s", 0.1}, {"pitch", "rad/s", 0.1}, {"yaw", "rad/s", 0.1}};
    for (int k = 0; k < 5; ++k) m.inputs.push_back({fmt::format("u{}", k), "rad", sizes[k]});
    m.f = [*this](const VectorXd& x, const VectorXd& u, const VectorXd&) -> VectorXd {
      return A * x + B * u + d;
    };
    m.derivatives = [*this](const OperatingPoint&, const std::vector<Eigen::Index>& variables) {
      MatrixXd all(3, 8);
      all << A, B;
      return MatrixXd(all(Eigen::all, variables));
    };
    return m;
  }

  static TrimSpec spec() {
    TrimSpec s;
    s.free = {"u0", "u1", "u2", "u3", "u4"};
    s.steady = {"roll", "pitch", "yaw"};
    return s;
  }

  static OperatingPoint guess() { return {VectorXd::Zero(3), VectorXd::Zero(5), VectorXd()}; }

  // The least Σ (u/size)² with B u = -d and some surfaces held: the pseudo-inverse does it.
  VectorXd least_norm(const std::vector<std::optional<double>>& held) const {
    VectorXd u = VectorXd::Zero(5), left = -d;
    MatrixXd scaled = MatrixXd::Zero(3, 5);
    for (int k = 0; k < 5; ++k) {
      if (held[std::size_t(k)]) {
        u[k] = *held[std::size_t(k)];
        left -= B.col(k) * u[k];
      } else {
        scaled.col(k) = B.col(k) * sizes[k];
      }
    }
    const VectorXd v = algebra::pseudo_inverse(scaled) * left;
    for (int k = 0; k < 5; ++k)
      if (!held[std::size_t(k)]) u[k] = sizes[k] * v[k];
    return u;
  }

  static double effort(const VectorXd& u) {
    double sum = 0;
    for (int k = 0; k < 5; ++k) sum += std::pow(u[k] / sizes[k], 2);
    return sum;
  }

  // The optimum within bounds, by trying every set of active ones.
  std::optional<VectorXd> bounded(const VectorXd& lower, const VectorXd& upper) const {
    std::optional<VectorXd> best;
    for (int set = 0; set < 243; ++set) {
      std::vector<std::optional<double>> held(5);
      for (int k = 0, digits = set; k < 5; ++k, digits /= 3)
        if (digits % 3 != 0) held[std::size_t(k)] = digits % 3 == 1 ? lower[k] : upper[k];
      const VectorXd u = least_norm(held);
      const bool inside =
          ((u - lower).array() >= -1e-12).all() && ((upper - u).array() >= -1e-12).all();
      if ((B * u + d).norm() > 1e-12 || !inside) continue;
      if (!best || effort(u) < effort(*best)) best = u;
    }
    return best;
  }
};

}  // namespace

// ---- ways of ending ----

static TrimSpec still_fold() {
  TrimSpec spec;
  spec.free = {"x"};
  spec.steady = {"x"};
  return spec;
}

static TrimSpec bounded_fold(double lower, double upper) {
  TrimSpec spec = still_fold();
  spec.bounds["x"] = {lower, upper};
  return spec;
}

// One state, one input, with a given rate.
static Model plain(const std::function<double(double x, double u)>& rate) {
  Model m;
  m.states = {{"x", "m", 1.0}};
  m.inputs = {{"u", "", 1.0}};
  m.f = [rate](const VectorXd& x, const VectorXd& u, const VectorXd&) {
    return vec({rate(x[0], u[0])});
  };
  return m;
}

static const OperatingPoint plain_guess{vec({0.5}), vec({0.0}), VectorXd()};

// Fewer further starts than the default: enough here, and faster if there is no solution.
static TrimOptions few_starts(TrimMethod method) { return {.method = method, .starts = 4}; }

// All trim methods, with everything else equal.
static std::vector<TrimOptions> both_methods() {
  return {few_starts(TrimMethod::ipopt), few_starts(TrimMethod::newton)};
}

TEST_CASE("every status is spelt as the contract says") {
  const std::vector<std::string> words = {
      "converged",  "singular",    "not_optimal",    "not_implied", "infeasible", "not_found",
      "not_finite", "model_threw", "not_repeatable", "interrupted", "time_limit"};
  for (std::size_t i = 0; i < words.size(); ++i) CHECK(to_string(TrimStatus(i)) == words[i]);
}

TEST_CASE("infeasible: proved before any search") {
  for (const bool closest : {false, true}) {
    const TrimResult r =
        trim(fold(), bounded_fold(-2, 3), at_fold(2, 0.25), TrimOptions{.closest = closest});
    CHECK(r.status == TrimStatus::infeasible);
    CHECK(r.starts == 0);
    CHECK(r.message.find("no point within the limits is an equilibrium (proved over ") == 0);
  }
  const TrimResult known = closest_point(fold(), bounded_fold(-2, 3), at_fold(2, 0.25));
  CHECK(known.status == TrimStatus::infeasible);
  CHECK(known.message.starts_with("no point within the limits is an equilibrium; the closest "));
  CHECK(known.starts == 0);
  CHECK_NEAR(known.residual, 0.25, 1e-9);
  CHECK(proved_infeasible(fold(), bounded_fold(-2, 3), at_fold(2, 0.25)));
  CHECK_FALSE(proved_infeasible(fold(), bounded_fold(-2, 3), at_fold(2, -0.25)));
  CHECK_FALSE(proved_infeasible(fold(), still_fold(), at_fold(2, 0.25)));  // x has no bounds
  const TrimOptions no_proof{.max_boxes = 0};
  CHECK_FALSE(proved_infeasible(fold(), bounded_fold(-2, 3), at_fold(2, 0.25), no_proof));
}

static void every_way_of_ending(const TrimOptions& options) {
  SUBCASE("converged") {
    const TrimResult r = trim(fold(), still_fold(), at_fold(2, -1), options);
    CHECK(r.status == TrimStatus::converged);
    CHECK(bool(r));
    CHECK(r.message.empty());
    CHECK(r.residual <= converged_to);
    CHECK(r.step <= options.step_tolerance);
    CHECK(r.starts >= 1);
    CHECK(r.evaluations > 0);
  }
  SUBCASE("singular: two equilibria meet") {
    const TrimResult r = trim(fold(), still_fold(), at_fold(1, 0), options);
    CHECK(r.status == TrimStatus::singular);
    CHECK_FALSE(bool(r));
    CHECK(r.residual <= converged_to);
    CHECK(r.message.find("'") == std::string::npos);
    CHECK(r.message.find("singular") != std::string::npos);
  }
  SUBCASE("singular: the free variable has no effect") {
    const TrimResult r = trim(plain([](double, double) { return 0.0; }),
                              {.free = {"u"}, .steady = {"x"}}, plain_guess, options);
    CHECK(r.status == TrimStatus::singular);
    CHECK(r.rcond == 0);
    CHECK(r.message.find("do not determine u") != std::string::npos);
  }
  SUBCASE("not_implied: the equations hold, what should follow does not") {
    Model m = pendulum();
    TrimSpec spec{.free = {"torque"}, .steady = {"omega"}, .implied = {"theta"}};
    OperatingPoint guess = hanging();
    guess.x[1] = 0.2;  // turning: θ' cannot vanish
    const TrimResult r = trim(m, spec, guess, options);
    CHECK(r.status == TrimStatus::not_implied);
    CHECK(r.message.find("theta' = 0.2 rad/s") != std::string::npos);
  }
  SUBCASE("infeasible: shown, with the closest point") {
    const TrimResult r = trim(fold(), bounded_fold(-2, 3), at_fold(2, 0.25), options);
    CHECK(r.status == TrimStatus::infeasible);
    CHECK(r.message.find("proved") != std::string::npos);
    CHECK(r.message.find("x' = 0.25 m/s²") == std::string::npos);  // a metre's rate is m/s
    CHECK(r.message.find("x' = 0.25 m/s") != std::string::npos);
    // Ipopt's own tolerance, on the gradient 2 x (p + x²) of ½ x'², leaves x near 1e-8.
    CHECK_NEAR(r.point.x[0], 0.0, 1e-5);
    CHECK_NEAR(r.residual, 0.25, 1e-9);
  }
  SUBCASE("infeasible: the bound that stops it is named") {
    const TrimResult r = trim(fold(), bounded_fold(2, 3), at_fold(2.5, -1), options);
    CHECK(r.status == TrimStatus::infeasible);
    REQUIRE(r.limits_active.size() == 1);
    CHECK(r.limits_active[0].signal == "x");
    CHECK_FALSE(r.limits_active[0].upper);
    CHECK(r.limits_active[0].value == 2.0);
    CHECK(r.message.find("x at its lower limit 2") != std::string::npos);
  }
  SUBCASE("infeasible: a fixed variable outside its bounds") {
    TrimSpec spec = still_fold();
    spec.bounds["p"] = {-3, -2};
    const TrimResult r = trim(fold(), spec, at_fold(1, -1), options);
    CHECK(r.status == TrimStatus::infeasible);
    CHECK(r.message == "p is fixed at -1, outside its limits [-3, -2]");
  }
  SUBCASE("not_found: the same without an enclosure, or without a proof") {
    Model m = fold();
    TrimOptions no_proof = options;
    no_proof.max_boxes = 0;
    CHECK(trim(m, bounded_fold(-2, 3), at_fold(2, 0.25), no_proof).status == TrimStatus::not_found);
    CHECK(trim(m, still_fold(), at_fold(2, 0.25), options).status == TrimStatus::not_found);
    m.enclosure = {};
    const TrimResult r = trim(m, bounded_fold(-2, 3), at_fold(2, 0.25), options);
    CHECK(r.status == TrimStatus::not_found);
    CHECK(r.message.find(fmt::format("no equilibrium found from {} starts", r.starts)) == 0);
  }
  SUBCASE("not_finite: everywhere") {
    for (const double sign : {1.0, -1.0}) {
      const TrimResult r = trim(plain([=](double, double) { return std::copysign(NaN, sign); }),
                                {.free = {"x"}, .steady = {"x"}}, plain_guess, options);
      CHECK(r.status == TrimStatus::not_finite);
      CHECK(r.message.find("x' = nan") != std::string::npos);
    }
  }
  SUBCASE("not_finite: a rate that nobody asked for") {
    Model m = pendulum();
    m.f = [](const VectorXd& x, const VectorXd& u, const VectorXd&) {
      return vec({NaN, u[0] - m_g_l * std::sin(x[0])});
    };
    m.derivatives = {};
    const TrimResult r = trim(m, {.free = {"torque"}, .steady = {"omega"}}, hanging(), options);
    CHECK(r.status == TrimStatus::not_finite);
    CHECK(r.message.find("theta' = nan") != std::string::npos);
  }
  SUBCASE("not_finite: an output") {
    Model m = pendulum();
    m.h = [](const VectorXd&, const VectorXd&, const VectorXd&) { return vec({-infinity}); };
    const TrimResult r = trim(m, {.free = {"torque"}, .steady = {"omega"}}, hanging(), options);
    CHECK(r.status == TrimStatus::not_finite);
    CHECK(r.message.find("height = -inf") != std::string::npos);
  }
  SUBCASE("model_threw: its words are kept") {
    const auto never = [](double, double) -> double { throw std::runtime_error("no table"); };
    const TrimResult r = trim(plain(never), {.free = {"x"}, .steady = {"x"}}, plain_guess, options);
    CHECK(r.status == TrimStatus::model_threw);
    CHECK(r.message == "the model threw: no table");
    const auto odd = [](double, double) -> double { throw 42; };
    CHECK(trim(plain(odd), {.free = {"x"}, .steady = {"x"}}, plain_guess, options).status ==
          TrimStatus::model_threw);
  }
  SUBCASE("not_repeatable: the model keeps a counter") {
    const auto calls = std::make_shared<int>(0);
    const auto rate = [calls](double x, double) { return x - 1 + 1e-14 * ++*calls; };
    const TrimResult r = trim(plain(rate), {.free = {"x"}, .steady = {"x"}}, plain_guess, options);
    CHECK(r.status == TrimStatus::not_repeatable);
    CHECK(r.message.find("two different values") != std::string::npos);
  }
  SUBCASE("interrupted: before the first step") {
    std::stop_source caller;
    caller.request_stop();
    TrimOptions stopped = options;
    stopped.stop = caller.get_token();
    const TrimResult r = trim(fold(), still_fold(), at_fold(2, -1), stopped);
    CHECK(r.status == TrimStatus::interrupted);
    CHECK(r.starts <= 1);
    CHECK(r.point.x[0] == 2.0);
  }
  SUBCASE("interrupted: from the observer") {
    std::stop_source caller;
    TrimOptions stopped = options;
    stopped.stop = caller.get_token();
    int seen = 0;
    stopped.observe = [&](const OperatingPoint&) {
      if (++seen == 1) caller.request_stop();
    };
    // No equilibrium: the search would go on for all its starts.
    const TrimResult r = trim(fold(), still_fold(), at_fold(2, 1), stopped);
    CHECK(r.status == TrimStatus::interrupted);
    CHECK(seen == 1);
    CHECK(r.starts <= 2);
    CHECK(r.message.find("stopped by the caller") == 0);
  }
}

TEST_CASE("every way of ending is reached and named") {
  SUBCASE("by Ipopt") { every_way_of_ending(few_starts(TrimMethod::ipopt)); }
  SUBCASE("by Newton") { every_way_of_ending(few_starts(TrimMethod::newton)); }
}

TEST_CASE("an optimum that cannot be verified is not called one" * thorough) {
  Model m = plain([](double x, double u) { return x + u; });
  m.outputs = {{"cost", "", 1.0}};
  const TrimSpec spec{.free = {"x", "u"}, .steady = {"x"}, .effort = {{"cost", 1.0, 0.0}}};
  SUBCASE("not smooth where it is least") {
    m.h = [](const VectorXd&, const VectorXd& u, const VectorXd&) {
      return vec({1 + std::max(u[0] - 0.3, 3 * (0.3 - u[0]))});
    };
    const TrimResult r = trim(m, spec, plain_guess, few_starts(TrimMethod::ipopt));
    CHECK(r.status == TrimStatus::not_optimal);
    CHECK_FALSE(bool(r));
    CHECK(r.residual <= converged_to);
    CHECK(r.message.find("not proved to be the one of least effort") != std::string::npos);
  }
  SUBCASE("a greatest effort is stationary too") {
    m.h = [](const VectorXd&, const VectorXd& u, const VectorXd&) { return vec({std::cos(u[0])}); };
    TrimSpec bounded = spec;
    bounded.bounds["u"] = {-1, 1.25};
    OperatingPoint greatest = plain_guess;
    greatest.x[0] = greatest.u[0] = 0.0;
    const TrimResult r = trim(m, bounded, greatest);
    CHECK(r.status == TrimStatus::converged);
    CHECK(r.point.u[0] == 1.25);  // on its bound, exactly
    REQUIRE(r.limits_active.size() == 1);
    CHECK(r.limits_active[0].signal == "u");
    CHECK(r.limits_active[0].upper);
    bounded.bounds["u"] = {-1, 1};  // alike to both sides: nothing drives the solver off
    TrimOptions alone;
    alone.starts = 0;  // the guess only
    CHECK(trim(m, bounded, greatest, alone).status == TrimStatus::not_optimal);
  }
  SUBCASE("without curvature, but lower a little further on") {
    OperatingPoint flat = plain_guess;
    flat.x[0] = flat.u[0] = 0.0;
    TrimSpec bounded = spec;
    bounded.bounds["u"] = {-1, 1};
    TrimOptions alone;
    alone.starts = 0;
    for (const int power : {3, 4}) {
      m.h = [power](const VectorXd&, const VectorXd& u, const VectorXd&) {
        return vec({2 - std::pow(u[0], power)});
      };
      const TrimResult r = trim(m, bounded, flat, alone);
      CHECK((r.status == TrimStatus::not_optimal || std::abs(r.point.u[0]) == 1));
    }
    m.h = [](const VectorXd&, const VectorXd& u, const VectorXd&) {
      return vec({2 + std::pow(u[0], 4)});
    };
    CHECK(trim(m, bounded, flat, alone).status == TrimStatus::converged);
  }
  SUBCASE("the same on smooth ground converges") {
    m.h = [](const VectorXd&, const VectorXd& u, const VectorXd&) {
      return vec({std::hypot(1, u[0] - 0.3)});
    };
    const TrimResult r = trim(m, spec, plain_guess);
    CHECK(r.status == TrimStatus::converged);
    CHECK_NEAR(r.point.u[0], 0.3, 1e-9);  // gradient 2 (u - 0.3), verified to 1e-9
    CHECK_NEAR(r.point.x[0], -0.3, 1e-9);
  }
}

static void fails_at_single_points(const TrimOptions& options) {
  SUBCASE("no number beyond a wall") {  // ln x = 1, from where the full step leaves x > 0
    const auto rate = [](double x, double) { return std::log(x) - 1; };
    const TrimResult r = trim(plain(rate), {.free = {"x"}, .steady = {"x"}},
                              {vec({8.0}), vec({0}), VectorXd()}, options);
    CHECK(r.status == TrimStatus::converged);
    CHECK_NEAR(r.point.x[0], std::numbers::e, 2 * converged_to * std::numbers::e);
  }
  SUBCASE("an exception at the guess") {
    const auto rate = [](double x, double) {
      if (x == 0.5) throw std::domain_error("one half");
      return x - 2;
    };
    const TrimResult r = trim(plain(rate), {.free = {"x"}, .steady = {"x"}}, plain_guess, options);
    CHECK(r.status == TrimStatus::converged);
    CHECK_NEAR(r.point.x[0], 2.0, converged_to);
  }
  SUBCASE("an answer of the wrong size away from the guess") {
    Model m = plain([](double x, double) { return x; });
    m.f = [](const VectorXd& x, const VectorXd&, const VectorXd&) -> VectorXd {
      return VectorXd::Constant(x[0] == 0.5 ? 1 : 3, 1.0);
    };
    const TrimResult r = trim(m, {.free = {"x"}, .steady = {"x"}}, plain_guess, options);
    CHECK(r.status == TrimStatus::not_found);
    CHECK(r.message.find("expected 1 values, got 3") != std::string::npos);
  }
}

TEST_CASE("what fails at single points does not fail the search") {
  SUBCASE("by Ipopt") { fails_at_single_points(few_starts(TrimMethod::ipopt)); }
  SUBCASE("by Newton") { fails_at_single_points(few_starts(TrimMethod::newton)); }
}

TEST_CASE("the caller's mistakes throw, in real names") {
  const auto refusal = [](const Model& m, const TrimSpec& spec, const OperatingPoint& guess,
                          const TrimOptions& options = {}) -> std::string {
    try {
      (void)trim(m, spec, guess, options);
    } catch (const std::invalid_argument& e) {
      return e.what();
    }
    return "";
  };
  const auto said = [&](const TrimSpec& spec, const std::vector<std::string>& words) {
    const std::string message = refusal(pendulum(), spec, hanging());
    CAPTURE(message);
    REQUIRE_FALSE(message.empty());
    for (const std::string& word : words) {
      CAPTURE(word);
      CHECK(message.find(word) != std::string::npos);
    }
  };
  const std::vector<std::string> torque = {"torque"}, omega = {"omega"};

  said({.free = {"torqe"}, .steady = omega}, {"'torqe'", "nearest: 'torque'", "theta, omega"});
  said({.free = torque, .steady = {"omga"}}, {"no state 'omga'", "theta, omega"});
  said({.free = torque, .rates = {{"omga", 1.0}}}, {"no state 'omga'", "theta, omega"});
  said({.free = torque, .steady = omega, .implied = {"phi"}}, {"no state 'phi'", "theta, omega"});
  said({.free = torque, .steady = omega, .bounds = {{"heigth", {0, 1}}}},
       {"'heigth'", "nearest: 'height'"});
  said({.free = torque, .steady = omega, .effort = {{"toque", 1.0, 0.0}}},
       {"'toque'", "nearest: 'torque'"});
  said({.free = torque, .steady = omega, .bounds = {{"torque", {1, -1}}}},
       {"'torque'", "reversed", "[1, -1]"});
  said({.free = torque, .steady = omega, .bounds = {{"torque", {NaN, 1}}}},
       {"'torque'", "not a number"});
  said({.free = torque, .steady = omega, .bounds = {{"height", {0, NaN}}}},
       {"'height'", "not a number"});
  said({.free = {"torque", "theta"}, .steady = omega, .bounds = {{"theta", {infinity, infinity}}}},
       {"'theta'", "inf"});
  said({.free = {"torque", "torque"}, .steady = omega}, {"'torque'", "listed twice"});
  said({.free = torque, .steady = omega, .rates = {{"omega", 0.1}}}, {"'omega'", "held twice"});
  said({.free = torque, .rates = {{"omega", NaN}}}, {"'omega'", "not finite"});
  said({.free = torque, .steady = {"theta", "omega"}},
       {"1 free variable (torque)", "2 conditions (theta', omega')", "1 more"});
  said({.free = torque, .steady = omega, .bounds = {{"torque", {2, 2}}}},
       {"nothing is free to hold", "1 condition (omega')"});
  said({.free = torque, .steady = omega, .effort = {{"torque", 0.0, 0.0}}},
       {"'torque'", "positive"});
  said({.free = torque, .steady = omega, .effort = {{"torque", -1.0, 0.0}}},
       {"'torque'", "positive"});
  said({.free = torque, .steady = omega, .effort = {{"torque", 1.0, NaN}}}, {"'torque'", "finite"});

  const TrimSpec spec{.free = torque, .steady = omega};
  OperatingPoint guess = hanging();
  guess.x.resize(3);
  guess.x.setZero();
  CHECK(refusal(pendulum(), spec, guess) == "state x: expected 2 values, got 3");
  guess = hanging();
  guess.x[1] = infinity;
  CHECK(refusal(pendulum(), spec, guess) == "'omega' is inf");

  Model m = pendulum();
  m.f = [](const VectorXd&, const VectorXd&, const VectorXd&) { return vec({1, 2, 3}); };
  CHECK(refusal(m, spec, hanging()) ==
        "model 'damped pendulum': its rates f: expected 2 values, got 3");
  m = pendulum();
  m.h = [](const VectorXd&, const VectorXd&, const VectorXd&) { return vec({1, 2}); };
  CHECK(refusal(m, spec, hanging()) ==
        "model 'damped pendulum': its outputs h: expected 1 values, got 2");
  m = pendulum();
  m.inputs[0].nominal = 0;
  CHECK(refusal(m, spec, hanging()).find("'torque'") != std::string::npos);

  const std::string newton = refusal(Redundant().model(), Redundant::spec(), Redundant::guess(),
                                     {.method = TrimMethod::newton});
  CHECK(newton == "method newton needs as many unknowns as equations, not 5 and 3");
  const auto with = [&](const TrimOptions& options) {
    return refusal(pendulum(), spec, hanging(), options);
  };
  CHECK(with({.tolerance = NaN}) == "a tolerance of nan; expected more than 0");
  CHECK(with({.tolerance = 0}) == "a tolerance of 0; expected more than 0");
  CHECK(with({.step_tolerance = -1}) == "a step tolerance of -1; expected more than 0");
  CHECK(with({.starts = -1}) == "-1 starts; expected at least 0");
  CHECK(with({.max_iterations = 0}) == "0 iterations; expected at least 1");
  CHECK(with({.max_boxes = -1}) == "-1 boxes; expected at least 0");
}

// ---- three models with known answers ----

TEST_CASE("a pendulum: the torque for an angle, the angles for a torque" * thorough) {
  for (const bool exact : {true, false})
    for (const TrimOptions& options : both_methods()) {
      CAPTURE(exact);
      CAPTURE(int(options.method));
      Model m = pendulum();
      if (!exact) m.derivatives = {};

      OperatingPoint guess = hanging();
      guess.x[0] = 0.7;
      const TrimResult torque =
          trim(m, {.free = {"torque"}, .steady = {"omega"}, .implied = {"theta"}}, guess, options);
      CHECK(torque.status == TrimStatus::converged);
      // ω' over 0.1 rad/s within the tolerance leaves this much torque.
      CHECK_NEAR(torque.point.u[0], m_g_l * std::sin(0.7), converged_to * 0.1 * m_l_l + 1e-15);
      CHECK_NEAR(torque.outputs[0], 0.4 * (1 - std::cos(0.7)), 1e-15);  // one rounding

      guess = hanging();
      guess.u[0] = 0.6 * m_g_l;
      const TrimSpec spec{.free = {"theta", "omega"},
                          .steady = {"theta", "omega"},
                          .bounds = {{"theta", {-std::numbers::pi, std::numbers::pi}}}};
      TrimOptions more = options;
      more.starts = 16;  // some of them above the hinge
      const TrimResult angle = trim(m, spec, guess, more);
      const double leaning = std::asin(0.6);
      CHECK(angle.status == TrimStatus::converged);
      const double miss = converged_to * 0.1 * m_l_l / (m_g_l * std::cos(leaning)) + 1e-15;
      CHECK_NEAR(angle.point.x[0], leaning, miss);
      CHECK_NEAR(angle.point.x[1], 0.0, converged_to);
      REQUIRE(angle.others.size() == 1);  // the rod above the hinge
      CHECK_NEAR(angle.others[0].x[0], std::numbers::pi - leaning, miss);

      guess.u[0] = 1.001 * m_g_l;
      const TrimResult none = trim(m, spec, guess, options);
      CHECK(none.status == TrimStatus::not_found);
      // The closest it comes, in least squares: horizontal, and friction takes a share of the
      // excess.
      //   min ω² + ((δ - c ω)/(m l²))²  at  ω = c δ/((m l²)² + c²)
      const double excess = 0.001 * m_g_l;
      const double creep = friction * excess / (m_l_l * m_l_l + friction * friction);
      // Ipopt's 1e-8 on the gradient, and the angle's miss squared.
      CHECK_NEAR(none.rates[0], creep, 1e-6);
      CHECK_NEAR(none.rates[1], (excess - friction * creep) / m_l_l, 1e-6);
    }
}

TEST_CASE("a fold: both branches, and its parameter as the unknown") {
  for (const bool exact : {true, false})
    for (const TrimOptions& options : both_methods()) {
      CAPTURE(exact);
      CAPTURE(int(options.method));
      Model m = fold();
      if (!exact) m.derivatives = {};
      for (const double side : {-1.0, 1.0}) {
        const TrimResult r = trim(m, bounded_fold(-5, 5), at_fold(3 * side, -2), options);
        CHECK(r.status == TrimStatus::converged);
        // x' = 2 x δx: the tolerance over the slope.
        CHECK_NEAR(r.point.x[0], side * std::sqrt(2.0), converged_to / 2);
        REQUIRE(r.others.size() == 1);
        CHECK_NEAR(r.others[0].x[0], -side * std::sqrt(2.0), converged_to / 2);
        CHECK_NEAR(r.rcond, 1.0, 0.0);  // one equation, one unknown, slope above one
      }
      const TrimResult p = trim(m, {.free = {"p"}, .steady = {"x"}}, at_fold(1.7, 0.3), options);
      CHECK(p.status == TrimStatus::converged);
      CHECK_NEAR(p.point.p[0], -1.7 * 1.7, converged_to);

      const TrimResult rising =
          trim(m, {.free = {"p"}, .rates = {{"x", 0.8}}}, at_fold(1.7, 0.3), options);
      CHECK_NEAR(rising.point.p[0], 0.8 - 1.7 * 1.7, converged_to);
      CHECK_NEAR(rising.rates[0], 0.8, converged_to);
    }
}

TEST_CASE("a variable with equal bounds is held there, whether free or not") {
  TrimSpec spec = still_fold();
  spec.bounds["p"] = {-4, -4};
  CHECK_NEAR(trim(fold(), spec, at_fold(1, 9)).point.x[0], 2.0, converged_to);
  spec.free.push_back("p");
  CHECK_NEAR(trim(fold(), spec, at_fold(1, 9)).point.x[0], 2.0, converged_to);
}

TEST_CASE("redundant surfaces: the least-norm solution, with and without a bound" * thorough) {
  const Redundant aircraft;
  for (const bool exact : {true, false}) {
    CAPTURE(exact);
    Model m = aircraft.model();
    if (!exact) m.derivatives = {};
    const double same = exact ? 1e-10 : 1e-9;  // differences: slopes to 1e-10 of a nominal size

    const TrimResult free = trim(m, Redundant::spec(), Redundant::guess());
    CHECK(free.status == TrimStatus::converged);
    CHECK(free.limits_active.empty());
    const VectorXd least = aircraft.least_norm(std::vector<std::optional<double>>(5));
    for (int k = 0; k < 5; ++k) CHECK_NEAR(free.point.u[k], least[k], same);
    CHECK_NEAR(free.effort, Redundant::effort(least), same * 10);  // slope of the effort

    std::mt19937_64 g(5);
    std::uniform_real_distribution<double> width(0.02, 0.3);
    std::vector<int> active(3);
    int none = 0;
    for (int i = 0; i < (exact ? 30 : 8); ++i) {
      CAPTURE(i);
      VectorXd lower(5), upper(5);
      TrimSpec spec = Redundant::spec();
      for (int k = 0; k < 5; ++k) {
        lower[k] = -width(g);
        upper[k] = width(g);
        spec.bounds[fmt::format("u{}", k)] = {lower[k], upper[k]};
      }
      const TrimResult r = trim(m, spec, Redundant::guess(), {.starts = 1});  // convex
      const std::optional<VectorXd> best = aircraft.bounded(lower, upper);
      CHECK(r.status == (best ? TrimStatus::converged : TrimStatus::not_found));
      none += !best;
      if (!best || !r) continue;
      for (int k = 0; k < 5; ++k) CHECK_NEAR(r.point.u[k], (*best)[k], same);
      REQUIRE(r.limits_active.size() <= 2);  // five surfaces, three equations
      ++active[r.limits_active.size()];
      for (const ActiveLimit& a : r.limits_active) {
        const int k = a.signal[1] - '0';
        CHECK_NEAR(a.value, a.upper ? upper[k] : lower[k], 1e-16);  // one rounding
      }
    }
    if (!exact) continue;
    CHECK(none > 0);
    for (const int count : active) CHECK(count > 0);
  }
}

TEST_CASE("an effort of one's own decides otherwise") {
  const Redundant aircraft;
  TrimSpec spec = Redundant::spec();
  spec.effort = {{"u0", 1.0, 0.0}, {"u4", 1.0, 0.25}};
  const TrimResult r = trim(aircraft.model(), spec, Redundant::guess());
  CHECK(r.status == TrimStatus::converged);  // two surfaces to spare: both wishes come true
  CHECK_NEAR(r.point.u[0], 0.0, 1e-9);
  CHECK_NEAR(r.point.u[4], 0.25, 1e-9);
  CHECK_NEAR(r.effort, 0.0, 1e-17);

  // p + x² = 0 nearest to p = -4: either branch is best, and both are equilibria.
  TrimSpec curve{.free = {"x", "p"}, .steady = {"x"}, .effort = {{"p", 1.0, -4.0}}};
  const TrimResult c = trim(fold(), curve, at_fold(1.5, -1));
  CHECK(c.status == TrimStatus::converged);
  CHECK_NEAR(c.point.p[0], -4.0, 1e-9);
  CHECK_NEAR(c.point.x[0], 2.0, 1e-9);
}

TEST_CASE("nothing to find is found at once") {
  const TrimResult r = trim(fold(), {.implied = {"x"}}, at_fold(1, -1));
  CHECK(r.status == TrimStatus::converged);
  CHECK(r.point.x[0] == 1.0);
}

// ---- laws ----

TEST_CASE("near the answer each Newton step squares the error") {
  std::vector<double> errors;
  const double answer = std::numbers::pi / 6;
  const TrimOptions options{.method = TrimMethod::newton, .observe = [&](const OperatingPoint& at) {
                              errors.push_back(at.x[0] - answer);
                            }};
  OperatingPoint guess{vec({0.9, 0}), vec({0.5 * m_g_l}), VectorXd()};
  const TrimResult r =
      trim(pendulum(), {.free = {"theta", "omega"}, .steady = {"theta", "omega"}}, guess, options);
  CHECK(r.status == TrimStatus::converged);
  REQUIRE(errors.size() >= 4);
  CHECK(errors[0] == 0.9 - answer);
  // eₖ₊₁ = ½ f''/f' eₖ² = -½ tan θ eₖ², to the next order: a few eₖ
  for (std::size_t k = 1; k < 3; ++k) {
    CAPTURE(k);
    const double ratio = errors[k + 1] / (errors[k] * errors[k]);
    const double rounding = 1e-15 / (errors[k] * errors[k]);
    CHECK_NEAR(ratio, -0.5 * std::tan(answer), 3 * std::abs(errors[k]) + rounding);
  }
}

TEST_CASE("the closest point keeps the limits, or says which ones cannot be kept" * thorough) {
  Model m;  // V' = (thrust - V²)/10, load = 2 thrust
  m.states = {{"V", "m/s", 1.0}};
  m.inputs = {{"thrust", "N", 1.0}};
  m.outputs = {{"load", "N", 1.0}};
  m.f = [](const VectorXd& x, const VectorXd& u, const VectorXd&) {
    return vec({(u[0] - x[0] * x[0]) / 10});
  };
  m.h = [](const VectorXd&, const VectorXd& u, const VectorXd&) { return vec({2 * u[0]}); };
  const auto at_3 = [&](Range load) {
    const TrimSpec spec{.free = {"thrust"}, .bounds = {{"thrust", {0, 40}}, {"load", load}}};
    return trim(m, spec, {vec({3}), vec({20}), VectorXd()});
  };
  SUBCASE("equations within limits that exclude them") {
    const TrimResult r = at_3({0, 10});
    CHECK(r.status == TrimStatus::not_found);
    CHECK_NEAR(r.point.u[0], 5.0, 1e-7);
    REQUIRE(r.limits_active.size() == 1);
    CHECK(r.limits_active[0].signal == "load");
    CHECK(
        r.message.ends_with("has residual rate V' = -0.4 m/s², with load at its upper limit 10 N"));
  }
  SUBCASE("limits that exclude each other") {
    const TrimResult r = at_3({-5, -1});
    CHECK(r.status == TrimStatus::not_found);
    CHECK_NEAR(r.point.u[0], 0.0, 1e-7);
    REQUIRE(r.limits_active.size() == 1);
    CHECK(r.limits_active[0].signal == "thrust");
    CHECK(r.message.find("starts, and no point within all limits was found; the closest point") !=
          std::string::npos);
    CHECK(r.message.ends_with(
        "with load 1 N above its upper limit -1 N, thrust at its lower limit 0 N"));
  }
  SUBCASE("without a search for the closest point") {
    const TrimSpec spec{.free = {"thrust"}, .bounds = {{"thrust", {0, 40}}, {"load", {-5, -1}}}};
    const TrimResult r = trim(m, spec, {vec({3}), vec({20}), VectorXd()}, {.closest = false});
    CHECK(r.limits_active.empty());
    CHECK(r.message.ends_with("with load 19 N above its upper limit -1 N"));
  }
}

TEST_CASE("the observer sees the Newton iterates from the guess only") {
  for (const TrimOptions& method : both_methods()) {
    std::vector<double> seen;
    TrimOptions options = method;
    options.observe = [&](const OperatingPoint& at) { seen.push_back(at.x[0]); };
    const TrimResult r = trim(fold(), still_fold(), at_fold(3, 1), options);  // no equilibrium
    CHECK(r.status == TrimStatus::not_found);
    CHECK(r.starts > 1);
    CHECK(seen.size() <= std::size_t(options.max_iterations));
    if (method.method == TrimMethod::newton) CHECK(seen.front() == 3.0);
  }
}

TEST_CASE("the same input gives the same bytes; a trimmed point stays where it is" * thorough) {
  TrimSpec bounded = Redundant::spec();
  for (const std::string& name : bounded.free) bounded.bounds[name] = {-0.12, 0.12};
  const TrimSpec angle{.free = {"theta", "omega"}, .steady = {"theta", "omega"}};
  const OperatingPoint leaning{vec({0.2, 0.1}), vec({0.6 * m_g_l}), VectorXd()};
  struct Asked {
    Model model;
    TrimSpec spec;
    OperatingPoint guess;
  };
  const Asked problems[] = {{fold(), bounded_fold(-5, 5), at_fold(3, -2)},
                            {fold(), bounded_fold(-5, 5), at_fold(3, 2)},
                            {pendulum(), angle, leaning},
                            {Redundant().model(), Redundant::spec(), Redundant::guess()},
                            {Redundant().model(), bounded, Redundant::guess()}};
  for (const Asked& asked : problems) {
    CAPTURE(asked.model.name);
    const TrimResult once = trim(asked.model, asked.spec, asked.guess);
    check_same(once, trim(asked.model, asked.spec, asked.guess));
    if (!once) continue;
    const TrimResult again = trim(asked.model, asked.spec, once.point);
    CHECK(again.status == TrimStatus::converged);
    // Rounding of the last Newton step, over unit slopes.
    for (Eigen::Index i = 0; i < once.point.x.size(); ++i)
      CHECK_NEAR(again.point.x[i], once.point.x[i], 1e-13);
    for (Eigen::Index i = 0; i < once.point.u.size(); ++i)
      CHECK_NEAR(again.point.u[i], once.point.u[i], 1e-13);
  }
}

// ---- requested conditions, and which were met ----

TEST_CASE("what neither the equations nor the cost determine is named") {
  const Model m = flow({"x", "v"}, {"a", "b"}, [](const auto& x, const auto& p) {
    return vec({1 - x[0], p[0] + p[1] - x[1]});
  });
  const OperatingPoint guess{vec({0.3, 0.2}), {}, vec({0.1, 0.4})};
  const TrimSpec first{.free = {"x", "v"}, .steady = {"x"}, .moving = {"v"}};
  const TrimResult free_state = trim(m, first, guess);
  CHECK(free_state.status == TrimStatus::singular);
  CHECK(free_state.message == "neither the equations nor the cost determine v");
  TrimSpec shared{.free = {"x", "v", "a", "b"}, .steady = {"x", "v"}, .effort = {{"v", 1.0, 2.0}}};
  const TrimResult two_for_one = trim(m, shared, guess);
  CHECK(two_for_one.status == TrimStatus::singular);
  CHECK(two_for_one.message == "neither the equations nor the cost determine a, b");
  CHECK_NEAR(two_for_one.point.x[1], 2, 1e-9);
  shared.effort.push_back({"a", 1.0, 0.0});
  CHECK(trim(m, shared, guess).status == TrimStatus::converged);
  // The fourth power of a has no curvature at 0, but a least value.
  const Model quartic = flow({"x", "v"}, {"a"}, [](const auto& x, const auto& p) {
    return vec({1 - x[0], p[0] * p[0] - x[1]});
  });
  const TrimSpec least{.free = {"x", "v", "a"}, .steady = {"x", "v"}, .effort = {{"v", 1.0, 0.0}}};
  CHECK(trim(quartic, least, {vec({0.3, 0.2}), {}, vec({0.4})}).status == TrimStatus::converged);
}

TEST_CASE("a state of which nothing is said is steady") {
  const Model m = scalar([](double x, double p) { return p - x; });
  const OperatingPoint guess{vec({0}), {}, vec({1})};
  const TrimResult r = trim(m, {.free = {"x"}}, guess);
  CHECK(r.status == TrimStatus::converged);
  CHECK_NEAR(r.point.x[0], 1.0, 1e-12);
  CHECK(contains(refusal([&] { (void)trim(m, {}, guess); }),
                 "nothing is free to hold 1 condition (x')"));
  CHECK(contains(refusal([&] { (void)trim(m, {.free = {"x"}, .moving = {"x"}}, guess); }),
                 "has no conditions:"));
  CHECK(contains(
      refusal([&] { (void)trim(m, {.free = {"x"}, .steady = {"x"}, .moving = {"x"}}, guess); }),
      "free and held"));
  CHECK(contains(refusal([&] { (void)trim(m, {.free = {"x"}, .moving = {"y"}}, guess); }), "y"));

  // A position is declared moving; trim finds its rate.
  const Model cruise = flow({"position", "speed"}, {"thrust"}, [](const auto& x, const auto& p) {
    return vec({x[1], p[0] - x[1] * x[1]});
  });
  const TrimSpec moving{.free = {"speed"}, .moving = {"position"}};
  CHECK(moving_states(cruise, moving) == std::vector<std::string>{"position"});
  CHECK(moving_states(cruise, {.free = {"speed"}, .steady = {"speed"}}) ==
        std::vector<std::string>{"position"});
  CHECK(moving_states(cruise, {}).empty());
  const TrimResult fast = trim(cruise, moving, {vec({0, 1}), {}, vec({9})});
  CHECK(fast.status == TrimStatus::converged);
  CHECK_NEAR(fast.point.x[1], 3.0, 1e-12);
}

TEST_CASE("of two trims of equal effort the one nearer to the guess, whatever rounding says") {
  // u² = 1: the magnet holds with either sign.
  const Model magnet = plain([](double, double u) { return u * u - 1; });
  for (const double guess : {-3.0, -0.3, -0.01, 0.01, 0.3, 3.0})
    for (const TrimOptions& options : both_methods()) {
      CAPTURE(guess);
      const TrimResult r = trim(magnet, {.free = {"u"}, .steady = {"x"}},
                                {vec({0}), vec({guess}), VectorXd()}, options);
      CHECK(r.status == TrimStatus::converged);
      CHECK_NEAR(r.point.u[0], std::copysign(1.0, guess), 1e-12);
    }
  CHECK(trim(magnet, {.free = {"u"}, .steady = {"x"}}, {vec({0}), vec({0.3}), {}}).others.size() ==
        1);
}

TEST_CASE("rates that vanish with their slopes are no equilibrium" * thorough) {
  const Model decay = scalar([](double x, double) { return std::exp(-x); });
  const TrimResult far = trim(decay, {.free = {"x"}, .steady = {"x"}}, {vec({0}), {}, vec({0})});
  CHECK(far.status == TrimStatus::not_found);
  CHECK(far.residual <= converged_to);
  // Newton's steps are short here, but do not shrink.
  const Model tail = scalar([](double x, double) { return std::exp(-x * x); });
  const TrimResult none = trim(tail, {.free = {"x"}, .steady = {"x"}}, {vec({5}), {}, vec({0})});
  CHECK(none.status == TrimStatus::not_found);
  // A double root is found: Newton's steps to it halve.
  const Model flat = scalar([](double x, double) { return std::pow(x - 1, 4); });
  const TrimResult root = trim(flat, {.free = {"x"}, .steady = {"x"}}, {vec({3}), {}, vec({0})});
  CHECK(root.status == TrimStatus::singular);
  CHECK_NEAR(root.point.x[0], 1.0, 0.01);
}

TEST_CASE("a residual within the tolerance does not do where Newton's next step is long") {
  // x' = 1e-7 (x - 1) rounded to odd multiples of 5e-13: never zero, and 5e-6 of x is left open.
  Model m =
      scalar([](double x, double) { return (std::floor(1e-7 * (x - 1) * 1e12) + 0.5) * 1e-12; });
  m.derivatives = [](const OperatingPoint&, const std::vector<Eigen::Index>& variables) {
    MatrixXd J(1, std::ssize(variables));
    for (Eigen::Index k = 0; k < J.cols(); ++k) J(0, k) = variables[std::size_t(k)] == 0 ? 1e-7 : 0;
    return J;
  };
  const TrimResult r = trim(m, {.free = {"x"}, .steady = {"x"}}, {vec({0}), {}, vec({0})},
                            {.method = TrimMethod::newton, .starts = 0});
  CHECK(r.status == TrimStatus::singular);
  CHECK_NEAR(r.rcond, 1e-7, 1e-20);
  CHECK_NEAR(r.step, 5e-6, 1e-9);
  CHECK(contains(r.message, "Newton's next step"));
}

TEST_CASE("no trim by wrong derivatives: they are named; right ones are not accused") {
  const TrimSpec spec{.free = {"x"}, .steady = {"x"}};
  const OperatingPoint guess{VectorXd::Ones(1), {}, {}};
  Model m;
  m.states = {{"x", "m", 1.0}};
  const auto with = [&](auto rate, auto slope) {
    m.f = [=](const VectorXd& x, const VectorXd&, const VectorXd&) -> VectorXd {
      return VectorXd::Constant(1, rate(x[0]));
    };
    m.derivatives = [=](const OperatingPoint& at, const std::vector<Eigen::Index>&) -> MatrixXd {
      return MatrixXd::Constant(1, 1, slope(at.x[0]));
    };
    return trim(m, spec, guess);
  };
  const auto spring = [](double x) { return 8 - x * x * x; };
  const TrimResult right = with(spring, [](double x) { return -3 * x * x; });
  REQUIRE(right);
  CHECK_NEAR(right.point.x[0], 2.0, 1e-9);
  const TrimResult wrong = with(spring, [](double x) { return 3 * x * x; });
  CAPTURE(wrong.message);
  CHECK(wrong.status == TrimStatus::not_found);
  CHECK(contains(wrong.message, "; the model's derivatives may be wrong: dx'/dx: exact "));
  const TrimResult none = with([](double x) { return 1 + x * x; }, [](double x) { return 2 * x; });
  CHECK(none.status == TrimStatus::not_found);
  CHECK(!contains(none.message, "derivatives"));
}

TEST_CASE("what is left over says what was wanted") {
  Model m = scalar([](double x, double p) { return p - x; });
  m.outputs = {{"gap", "m", 1.0}};
  m.h = [](const VectorXd&, const VectorXd&, const VectorXd&) { return vec({0.25}); };
  const TrimResult r = trim(m, {.free = {"x", "p"}, .steady = {"x"}, .bounds = {{"gap", {1, 1}}}},
                            {vec({0}), {}, vec({1})}, {.starts = 1});
  CHECK(contains(r.message, "gap = 0.25 m instead of 1"));
  const TrimResult one =
      trim(m, {.free = {"x", "p"}, .steady = {"x"}, .bounds = {{"gap", {1, 1}}}},
           {vec({0}), {}, vec({1})}, {.method = TrimMethod::newton, .starts = 0});
  CHECK(contains(one.message, "from 1 start;"));
}

TEST_CASE("a singular trim names every variable that is left, and the rank") {
  const Model m = flow({"a", "b", "c"}, {}, [](const auto& x, const auto&) {
    return vec({x[0] + x[1], 2 * (x[0] + x[1]), x[2]});
  });
  const std::vector<std::string> all{"a", "b", "c"};
  const TrimResult r = trim(m, {.free = all, .steady = all}, {vec({1, 2, 3}), {}, {}});
  CHECK(r.status == TrimStatus::singular);
  CHECK(contains(r.message, "do not determine a, b:"));
  CHECK(contains(r.message, "with rank 2 for 3 equations"));
}

TEST_CASE("a singular trim is singular however large its rates are") {
  const std::vector<std::string> both{"a", "b"};
  for (const double size : {1.0, 1e60, 1e69, 1e71, 1e78, 1e99, 1e101, 1e140}) {
    CAPTURE(size);
    const auto with = [&](double last) {
      const Model m = flow(both, {}, [=](const auto& x, const auto&) {
        return vec({size * (x[0] + x[1]), size * (x[0] + last * x[1])});
      });
      return trim(m, {.free = both, .steady = both}, {vec({0, 0}), {}, {}});
    };
    CHECK(with(1 + 1e-14).status == TrimStatus::singular);
    const TrimResult regular = with(-1.0);
    CHECK(regular.status == TrimStatus::converged);
    CHECK_NEAR(regular.rcond, 1.0, 1e-12);  // [1, 1; 1, -1] is orthogonal but for its size
  }
}

TEST_CASE("a model that knows nothing outside its domain is led back into it") {
  // Two tanks: the flow is the root of the head, undefined for a negative head.
  const Model tanks =
      flow({"upper", "lower"}, {"in"}, [](const auto& x, const auto& p) -> VectorXd {
        if (x[0] < x[1] || x[1] < 0) throw std::domain_error("a negative head");
        return vec({p[0] - std::sqrt(x[0] - x[1]), std::sqrt(x[0] - x[1]) - std::sqrt(x[1])});
      });
  const std::vector<std::string> levels{"upper", "lower"};
  for (const double in : {0.1, 1.0, 2.0})
    for (const OperatingPoint& guess :
         {OperatingPoint{vec({9, 1}), {}, vec({in})}, {vec({1e-9, 0}), {}, vec({in})}}) {
      const TrimResult r = trim(tanks, {.free = levels, .steady = levels}, guess);
      CAPTURE(in);
      CHECK(r.status == TrimStatus::converged);
      CHECK_NEAR(r.point.x[0], 2 * in * in, 1e-9);
      CHECK_NEAR(r.point.x[1], in * in, 1e-9);
    }
}

TEST_CASE("a model too large for full matrices is refused at once") {
  std::vector<std::string> many;
  for (std::size_t i = 0; i <= largest_model; ++i) many.push_back(fmt::format("x{}", i));
  const Model m = flow(many, {}, [](const VectorXd& x, const auto&) { return x; });
  const OperatingPoint guess{VectorXd::Zero(std::ssize(many)), {}, {}};
  CHECK(contains(refusal([&] { (void)trim(m, {.free = many}, guess); }), "2001 signals"));
}

// a' = 1 - a, a >= 1 + δ: the barrier's last point lies √μ from a limit that hardly pushes.
TEST_CASE("a closest point next to its limit lies on it, and says so") {
  const Model m =
      flow({"a"}, {}, [](const VectorXd& x, const VectorXd&) { return vec({1 - x[0]}); });
  for (const double off : {1e-8, 1e-6, 1e-4, 1e-3, 0.1}) {
    CAPTURE(off);
    const TrimSpec spec{.free = {"a"}, .bounds = {{"a", {1 + off, 3}}}};
    const TrimResult r = trim(m, spec, {vec({2.5}), {}, {}});
    CHECK(r.status == TrimStatus::not_found);
    CHECK(r.point.x[0] == 1 + off);
    CHECK_NEAR(r.residual, off, 1e-15);
    REQUIRE(r.limits_active.size() == 1);
    CHECK_FALSE(r.limits_active[0].upper);
    CHECK(contains(r.message, "with a at its lower limit 1"));
  }
}

// x' = 2 - u - v, y' = 2v - u - 1, u + v <= 2 - δ.
TEST_CASE("a closest point next to limits of a variable and of an output lies on both") {
  Model m;
  m.states = {{"x", "", 1.0}, {"y", "", 1.0}};
  m.inputs = {{"u", "", 1.0}, {"v", "", 1.0}};
  m.outputs = {{"sum", "", 1.0}};
  m.f = [](const VectorXd&, const VectorXd& u, const VectorXd&) {
    return vec({2 - u[0] - u[1], 2 * u[1] - u[0] - 1});
  };
  m.h = [](const VectorXd&, const VectorXd& u, const VectorXd&) { return vec({u[0] + u[1]}); };
  for (const double off : {1e-7, 1e-5, 1e-3}) {
    CAPTURE(off);
    // On u + v = 2 - δ the rates are (δ, 2 - 3u - 2δ): the second vanishes at u = 1 - 2δ/3.
    TrimSpec spec{.free = {"u", "v"}, .bounds = {{"u", {-3, 5}}, {"sum", {-9, 2 - off}}}};
    const auto closest = [&] { return trim(m, spec, {vec({0, 0}), vec({0.2, 0.1}), {}}); };
    const TrimResult r = closest();
    CHECK(r.status == TrimStatus::not_found);
    CHECK_NEAR(r.residual, off, 1e-9);
    CHECK_NEAR(r.point.u[0], 1 - 2 * off / 3, 1e-9);
    REQUIRE(r.limits_active.size() == 1);
    CHECK(r.limits_active[0].signal == "sum");
    spec.bounds["u"] = {1 - off / 3, 5};
    const TrimResult both = closest();
    CHECK(both.point.u[0] == 1 - off / 3);
    CHECK_NEAR(both.point.u[1], 1 - 2 * off / 3, 1e-9);
    CHECK(both.limits_active.size() == 2);
  }
}

}  // namespace trim_test
