#include "linearize/linearize.hpp"

#include <algorithm>
#include <complex>
#include <fstream>
#include <functional>
#include <nlohmann/json.hpp>
#include <numbers>
#include <unsupported/Eigen/AutoDiff>

#include "linearize/modes.hpp"
#include "model/differentiate.hpp"
#include "model/formulas.hpp"
#include "model/lookup.hpp"
#include "tests/algebra.hpp"
#include "tests/check.hpp"
#include "tests/random_draws.hpp"
#include "tests/toy_models.hpp"
#include "vehicles/tiltrotor/formulations.hpp"
#include "vehicles/tiltrotor/numbers.hpp"
#include "vehicles/tiltrotor/vehicle.hpp"

using namespace tiltrim;
using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using std::numbers::pi;

namespace linearize_test {

using ::refusal;

namespace {

constexpr double epsilon = std::numeric_limits<double>::epsilon();
constexpr double infinity = std::numeric_limits<double>::infinity();

std::vector<Index> states_of(const Model& model) {
  std::vector<Index> all(model.states.size());
  std::iota(all.begin(), all.end(), Index{0});
  return all;
}

std::vector<Index> states_and_inputs_of(const Model& model) {
  std::vector<Index> all(model.states.size() + model.inputs.size());
  std::iota(all.begin(), all.end(), Index{0});
  return all;
}

// The message that linearize() threw; empty if it did not.
std::string refusal(const Model& model, const OperatingPoint& point,
                    const LinearizeOptions& options) {
  try {
    (void)linearize(model, point, options);
  } catch (const std::invalid_argument& e) {
    return e.what();
  }
  return {};
}

// --- Models whose derivatives are known: the same equations on a complex long double, whose
// imaginary part after a step too small to be rounded away is the derivative to 19 digits.

using Wide = std::complex<long double>;
using algebra::WideMatrix;
constexpr long double imaginary_step = 1e-60L;

struct Known {
  Model model;
  std::function<WideMatrix(const OperatingPoint&)> truth;  // ∂[f; h]/∂(x, u)
  std::function<OperatingPoint(Random&)> sample;
};

// Derivatives of `rates(x, y)` by complex step.
template <class Rates>
WideMatrix complex_step(const Rates& rates, const VectorXd& at, Index rows) {
  WideMatrix J(rows, at.size());
  for (Index j = 0; j < at.size(); ++j) {
    std::vector<Wide> x(at.begin(), at.end());
    std::vector<Wide> y(static_cast<std::size_t>(rows));
    x[std::size_t(j)] += Wide(0, imaginary_step);
    rates(x.data(), y.data());
    for (Index i = 0; i < rows; ++i) J(i, j) = y[std::size_t(i)].imag() / imaginary_step;
  }
  return J;
}

// Three states of the given sizes, three equations on any scalar; points within `reach` sizes of
// `centre` sizes.
template <class Equations>
Known known(const char* name, const Eigen::Vector3d& size, const Equations& equations,
            double centre, double reach, const char* const (&states)[3] = {"a", "b", "c"}) {
  using Dual = Eigen::AutoDiffScalar<Eigen::Vector3d>;
  Known k;
  k.model.name = name;
  for (Index i = 0; i < 3; ++i) k.model.states.push_back({states[i], "", size[i]});
  k.model.f = [equations](const VectorXd& x, const auto&, const auto&) {
    VectorXd y(3);
    equations(x.data(), y.data());
    return y;
  };
  k.model.derivatives = [equations](const OperatingPoint& at, const std::vector<Index>& wanted) {
    std::array<Dual, 3> x, y;
    for (Index i = 0; i < 3; ++i) x[std::size_t(i)] = Dual(at.x[i], 3, int(i));
    equations(x.data(), y.data());
    MatrixXd J(3, std::ssize(wanted));
    for (Index i = 0; i < 3; ++i)
      for (Index j = 0; j < J.cols(); ++j)
        J(i, j) = y[std::size_t(i)].derivatives()[wanted[std::size_t(j)]];
    return J;
  };
  k.truth = [equations](const OperatingPoint& at) { return complex_step(equations, at.x, 3); };
  k.sample = [size, centre, reach](Random& random) {
    const VectorXd x = size.array() * (centre + uniform(random, 3, -reach, reach).array());
    return OperatingPoint{x, VectorXd(), VectorXd()};
  };
  return k;
}

std::vector<Known> small_models() {
  using std::cos, std::exp, std::log, std::pow, std::sin, std::sqrt;
  const Eigen::Vector3d ones = Eigen::Vector3d::Ones();
  const Eigen::Vector3d scales{1e-3, 1.0, 1e5};
  std::vector<Known> all;
  all.push_back(known(
      "polynomial", ones,
      []<class S>(const S* x, S* y) {
        y[0] = x[0] * x[0] * x[1] - S(2.0) * x[2] + S(0.5);
        y[1] = x[0] * x[1] * x[2] + x[1] * x[1] * x[1];
        y[2] = x[2] * x[2] * x[2] * x[2] - S(3.0) * x[0] * x[0] - x[1];
      },
      0, 2));
  all.push_back(known(
      "trigonometric", ones,
      []<class S>(const S* x, S* y) {
        y[0] = sin(S(x[0] + S(2.0) * x[1])) * cos(x[2]);
        y[1] = cos(S(x[0] * x[1])) + sin(x[2]);
        y[2] = sin(x[0]) * sin(x[1]) * sin(x[2]) - S(9.81) * cos(x[1]);
      },
      0, 3));
  all.push_back(known(
      "exponential", ones,
      []<class S>(const S* x, S* y) {
        y[0] = exp(S(x[0] - x[1])) - S(1.0);
        y[1] = exp(S(-(x[2] * x[2]))) * x[0];
        y[2] = log(S(S(1.0) + exp(x[1]))) + x[2];
      },
      0, 2));
  all.push_back(known(
      "rational", ones,
      []<class S>(const S* x, S* y) {
        y[0] = x[0] / (S(1.0) + x[1] * x[1]);
        y[1] = x[0] * x[2] / (S(5.0) + x[1]);
        y[2] = (x[2] - x[0]) / (S(3.0) + x[0] * x[0]) + S(1.0) / (S(4.0) + x[2]);
      },
      0, 2));
  all.push_back(known(
      "badly scaled", scales,
      []<class S>(const S* x, S* y) {
        const S a = x[0] / S(1e-3);
        const S c = x[2] / S(1e5);
        y[0] = S(1e-3) * (sin(S(a * x[1])) - c);
        y[1] = exp(S(S(0.3) * a)) * c - x[1] * x[1];
        y[2] = S(1e5) * (a * x[1] * c + cos(c));
      },
      0, 2));
  all.push_back(known("atmosphere, exponential", {1000.0, 10.0, 0.1},
                      []<class S>(const S* x, S* y) {
                        const S density = S(1.225) * exp(S(-x[0] / S(8500.0)));
                        y[0] = x[1] * sin(x[2]);
                        y[1] = S(-0.01) * density * x[1] * x[1] - S(9.81) * sin(x[2]);
                        y[2] = S(0.02) * density * x[1] - S(9.81) * cos(x[2]) / x[1];
                      },
                      5, 4, {"h", "V", "gamma"}));
  all.push_back(known(
      "atmosphere, power", {1000.0, 10.0, 0.1},
      []<class S>(const S* x, S* y) {
        const S density = S(1.225) * exp(S(S(4.25588) * log(S(S(1.0) - S(2.25577e-5) * x[0]))));
        y[0] = x[1] * sin(x[2]);
        y[1] = S(-0.01) * density * x[1] * x[1] / sqrt(S(S(1.0) + x[1] * x[1] / S(1e5)));
        y[2] = density * x[1] * x[2] - S(9.81) * cos(x[2]) / x[1];
      },
      5, 4, {"h", "V", "gamma"}));
  return all;
}

// --- The tiltrotor's equations again, independently of model/ and in complex long double.

Vehicle tiltrotor() {
  Vehicle v;
  v.polar = std::make_shared<Polar>(load_polar(TILTRIM_SOURCE_DIR "/data/naca8h12_re150k.csv"));
  return v;
}

const Vehicle& craft() {
  static const Vehicle vehicle = tiltrotor();
  return vehicle;
}

// The polar's periodic spline through its one-degree table, solved in long double.
struct WideSpline {
  static constexpr Index n = 360;
  WideMatrix y{n, 3}, M;  // values and second derivatives at the knots
  static double knot(Index i) { return double(i - 180) * (pi / 180); }

  WideSpline() {
    WideMatrix K = WideMatrix::Zero(n, n), right(n, 3);
    const auto width = [](Index i) { return (long double)(knot(i + 1)) - knot(i); };
    for (Index i = 0; i < n; ++i) {
      const Coefficients c = craft().polar->at(knot(i));
      const auto printed = [](double value) { return double(std::llround(value * 1e6)) / 1e6; };
      y.row(i) << printed(c.CL), printed(c.CD), printed(c.CM);
    }
    for (Index i = 0; i < n; ++i) {
      const Index before = (i + n - 1) % n, after = (i + 1) % n;
      const long double hb = width(before), ha = width(i);
      K(i, before) = hb;
      K(i, i) = 2 * (hb + ha);
      K(i, after) = ha;
      right.row(i) = 6 * ((y.row(after) - y.row(i)) / ha - (y.row(i) - y.row(before)) / hb);
    }
    M = algebra::solve(K, right);
  }

  Wide at(Wide alpha, Index k) const {
    alpha -= 2 * std::numbers::pi_v<long double> *
             std::floor((alpha.real() + std::numbers::pi_v<long double>) /
                        (2 * std::numbers::pi_v<long double>));
    const Index i =
        std::clamp(Index(std::floor(double(alpha.real()) * (180 / pi))) + 180, Index{0}, n - 1);
    const Index next = (i + 1) % n;
    const long double h = (long double)(knot(i + 1)) - knot(i);
    const Wide t = (alpha - Wide(knot(i))) / h, s = 1.0L - t;
    return s * y(i, k) + t * y(next, k) +
           h * h / 6 * ((s * s * s - s) * M(i, k) + (t * t * t - t) * M(next, k));
  }
};

const WideSpline& wide_polar() {
  static const WideSpline spline;
  return spline;
}

struct WideRates {
  Wide V, gamma, q;
};

// (2): V', γ', q' in wind axes.
WideRates wide_airframe(Wide V, Wide gamma, Wide theta, Wide q, Wide theta0, Wide a1s, Wide de,
                        Wide eta) {
  const AircraftOf<long double> a = [] {
    const Aircraft d;
    return AircraftOf<long double>{d.mass,          d.inertia_yy,
                                   d.chord,         d.wing_area,
                                   d.air_density,   d.gravity,
                                   d.rotor_x,       d.rotor_z,
                                   d.thrust_excess, d.rotor_speed_rpm,
                                   d.rotor_radius,  d.blade_count,
                                   d.blade_chord,   d.blade_lift_slope,
                                   d.pitch_scale,   d.wake_immersion,
                                   d.CL_q,          d.CL_de,
                                   d.CM_q,          d.CM_de,
                                   d.cyclic_off,    d.cyclic_blend};
  }();
  constexpr long double circle = 2 * std::numbers::pi_v<long double>;
  const Wide alpha = theta - gamma;
  const long double tip = a.rotor_speed_rpm * circle / 60 * a.rotor_radius;
  const long double c1 =
      a.blade_lift_slope * a.blade_count * a.blade_chord / (circle / 2 * a.rotor_radius);
  const Wide pitch = a.pitch_scale * theta0;
  const Wide size = pitch.real() < 0 ? -pitch : pitch;
  const Wide vi = 2.0L * tip * pitch / (std::sqrt(1.0L + 32.0L / c1 * size) + 1.0L);
  const Wide W = V + a.wake_immersion * vi;
  const Wide pressure = 0.5L * a.air_density * a.wing_area * W * W;
  const Wide rate = a.chord * q / (2.0L * W);
  const Wide L =
      pressure * (wide_polar().at(alpha, 0) + a.CL_de * de * std::cos(alpha) + a.CL_q * rate);
  const Wide D = pressure * wide_polar().at(alpha, 1);
  const Wide M = pressure * a.chord *
                 (wide_polar().at(alpha, 2) + a.CM_de * de * std::cos(alpha) + a.CM_q * rate);
  const Wide T = a.thrust_excess * a.mass * a.gravity * theta0;
  const Wide phi = alpha + eta - a1s;
  return {(T * std::cos(phi) - D) / a.mass - a.gravity * std::sin(gamma),
          (T * std::sin(phi) + L - a.mass * a.gravity * std::cos(gamma)) / (a.mass * V),
          (T * (a.rotor_x * std::sin(eta - a1s) - a.rotor_z * std::sin(a1s)) + M) / a.inertia_yy};
}

// The closed loop (14) in wind axes; eta away from the handover.
WideRates wide_loop(Wide V, Wide gamma, Wide theta, Wide q, Wide x1, Wide x2, const Command& d,
                    Wide& He, Wide& Le) {
  const Gains k;
  const Aircraft a;
  const long double g = a.gravity, Ep = a.thrust_excess, K_Ep = k.K_Ep, K_Lp = k.K_Lp;
  const Wide V_err = Wide(d.V) - V, sin_err = std::sin(Wide(d.gamma) - gamma);
  const Wide drag = 0.5L * (long double)(a.air_density) * (long double)(a.wing_area) * V * V *
                    wide_polar().at(theta - gamma, 1);
  const Wide common =
      (long double)(k.k_V) / g * V_err + std::sin(gamma) + drag / ((long double)(a.mass) * g);
  const Wide theta0 = (K_Ep * (common + sin_err) + (long double)(k.K_Ei) * x1) / (1 + Ep * K_Ep);
  const Wide a_hat = (K_Lp * (common - sin_err) + (long double)(k.K_Li) * x2) / (1 + K_Lp);
  const bool cyclic = d.eta >= a.cyclic_off;
  const Wide a1s =
      cyclic ? a_hat + (long double)(k.k_pa) * theta + (long double)(k.k_da) * q : Wide(0);
  const Wide V_rate = wide_airframe(V, gamma, theta, q, theta0, a1s, 0, d.eta).V;
  const Wide energy = ((long double)(k.k_V) * V_err - V_rate) / g;
  He = energy + sin_err;
  Le = energy - sin_err;
  const Wide de = cyclic ? Wide(0)
                         : K_Lp * Le + (long double)(k.K_Li) * x2 + (long double)(k.k_pe) * theta +
                               (long double)(k.k_de) * q;
  return wide_airframe(V, gamma, theta, q, theta0, a1s, de, d.eta);
}

// u', w' from V', γ':  u = V cos α, w = V sin α, α' = q - γ'
std::pair<Wide, Wide> body(const WideRates& wind, Wide V, Wide alpha, Wide q) {
  const Wide turning = V * (q - wind.gamma);
  return {wind.V * std::cos(alpha) - turning * std::sin(alpha),
          wind.V * std::sin(alpha) + turning * std::cos(alpha)};
}

double away_from_hand_over(Random& random) {
  double eta = pi / 3;
  while (std::abs(eta - pi / 3) < 1e-3) eta = uniform(random, 0, pi / 2);
  return eta;
}

// A point of the airframe in wind axes: V, gamma, theta, q; theta0, a1s, delta_e, eta.
OperatingPoint flying(Random& random) {
  const double gamma = uniform(random, -0.5, 1.5);
  const Eigen::Vector4d x{uniform(random, 1, 25), gamma, gamma + uniform(random, -1, 0.6),
                          uniform(random, -0.5, 0.5)};
  const Eigen::Vector4d u{uniform(random, 0.01, 1), uniform(random, -0.35, 0.35),
                          uniform(random, -0.5, 0.5), away_from_hand_over(random)};
  return {x, u, airframe_parameters(craft())};
}

OperatingPoint in_body_axes(OperatingPoint wind) {
  const double V = wind.x[0], alpha = wind.x[2] - wind.x[1];
  wind.x[0] = V * std::cos(alpha);
  wind.x[1] = V * std::sin(alpha);
  return wind;
}

// A point of the closed loop: V_err, gamma_err, theta, q and the integrals.
OperatingPoint steering(Random& random) {
  const Command d{uniform(random, 1, 25), uniform(random, -0.5, 1.5), away_from_hand_over(random)};
  Eigen::Vector<double, 6> x;
  x << uniform(random, -0.3, 0.3) * d.V, uniform(random, -0.2, 0.2),
      d.gamma + uniform(random, -1, 0.6), uniform(random, -0.5, 0.5), uniform(random, 0, 3),
      uniform(random, -40, 10);
  return {x, VectorXd(), closed_loop_parameters(craft(), d)};
}

// The closed loop's point in body axes.
OperatingPoint in_body_axes_of_loop(OperatingPoint wind) {
  const double V = wind.p[0] - wind.x[0], gamma = wind.p[1] - wind.x[1];
  wind.x[0] = V * std::cos(wind.x[2] - gamma);
  wind.x[1] = V * std::sin(wind.x[2] - gamma);
  return wind;
}

std::vector<Known> tiltrotor_models() {
  const auto stacked = [](const VectorXd& x, const VectorXd& u) {
    VectorXd z(x.size() + u.size());
    z << x, u;
    return z;
  };
  std::vector<Known> all(4);
  all[0] = {airframe(craft()),
            [stacked](const OperatingPoint& at) {
              const auto rates = [](const Wide* z, Wide* y) {
                const WideRates r = wide_airframe(z[0], z[1], z[2], z[3], z[4], z[5], z[6], z[7]);
                y[0] = r.V, y[1] = r.gamma, y[2] = z[3], y[3] = r.q;
              };
              return complex_step(rates, stacked(at.x, at.u), 4);
            },
            flying};
  all[1] = {airframe(craft(), Axes::body),
            [stacked](const OperatingPoint& at) {
              const auto rates = [](const Wide* z, Wide* y) {
                const Wide V = std::sqrt(z[0] * z[0] + z[1] * z[1]);
                const Wide alpha = std::atan(z[1] / z[0]);  // u > 0 in all samples
                const WideRates r =
                    wide_airframe(V, z[2] - alpha, z[2], z[3], z[4], z[5], z[6], z[7]);
                std::tie(y[0], y[1]) = body(r, V, alpha, z[3]);
                y[2] = z[3], y[3] = r.q;
              };
              return complex_step(rates, stacked(at.x, at.u), 4);
            },
            [](Random& random) { return in_body_axes(flying(random)); }};
  all[2] = {closed_loop(craft()),
            [](const OperatingPoint& at) {
              const Command d{at.p[0], at.p[1], at.p[2]};
              const auto rates = [d](const Wide* z, Wide* y) {
                const WideRates r = wide_loop(Wide(d.V) - z[0], Wide(d.gamma) - z[1], z[2], z[3],
                                              z[4], z[5], d, y[4], y[5]);
                y[0] = -r.V, y[1] = -r.gamma, y[2] = z[3], y[3] = r.q;
              };
              return complex_step(rates, at.x, 6);
            },
            steering};
  all[3] = {closed_loop(craft(), Axes::body),
            [](const OperatingPoint& at) {
              const Command d{at.p[0], at.p[1], at.p[2]};
              const auto rates = [d](const Wide* z, Wide* y) {
                const Wide V = std::sqrt(z[0] * z[0] + z[1] * z[1]);
                const Wide alpha = std::atan(z[1] / z[0]);  // u > 0 in all samples
                const WideRates r =
                    wide_loop(V, z[2] - alpha, z[2], z[3], z[4], z[5], d, y[4], y[5]);
                std::tie(y[0], y[1]) = body(r, V, alpha, z[3]);
                y[2] = z[3], y[3] = r.q;
              };
              return complex_step(rates, at.x, 6);
            },
            [](Random& random) { return in_body_axes_of_loop(steering(random)); }};
  return all;
}

// Estimated errors compared with the true ones, over the nonzero entries.
struct Score {
  long entries = 0, covered = 0;
  std::vector<double> overstatement;  // estimate over true error, where there is one

  void add(const Estimate& e, const WideMatrix& truth) {
    for (Index i = 0; i < truth.rows(); ++i)
      for (Index j = 0; j < truth.cols(); ++j) {
        if (truth(i, j) == 0 && e.value(i, j) == 0) continue;
        const double miss = double(std::abs((long double)(e.value(i, j)) - truth(i, j)));
        ++entries;
        covered += miss <= e.error(i, j);
        if (miss > 0) overstatement.push_back(e.error(i, j) / miss);
      }
  }
  double coverage() const { return double(covered) / double(entries); }
  double median_overstatement() {
    const auto middle = overstatement.begin() + std::ssize(overstatement) / 2;
    std::ranges::nth_element(overstatement, middle);
    return *middle;
  }
};

// --- The seven reference equilibria.

struct Case {
  std::string name;
  Command command;
  OperatingPoint point;
  MatrixXd A;
  std::vector<std::complex<double>> eigenvalues;
};

const std::vector<Case>& reference_cases() {
  static const std::vector<Case> cases = [] {
    std::ifstream in(TILTRIM_SOURCE_DIR "/data/reference_cases.json");
    const nlohmann::json file = nlohmann::json::parse(in);
    std::vector<Case> all;
    for (const auto& c : file.at("cases")) {
      const auto& asked = c.at("condition");
      const auto degrees = [&](const char* key) {
        return asked.at(key).get<double>() * (pi / 180);
      };
      Case k{
          asked.at("name"), {asked.at("V"), degrees("gamma_deg"), degrees("eta_deg")}, {}, {}, {}};
      k.point = {VectorXd(6), VectorXd(), closed_loop_parameters(craft(), k.command)};
      k.A.resize(6, 6);
      const Signals states = closed_loop(craft()).states;
      for (Index i = 0; i < 6; ++i) {
        k.point.x[i] = c.at("state").at(states[std::size_t(i)].name);
        for (Index j = 0; j < 6; ++j) k.A(i, j) = c.at("A").at(std::size_t(i)).at(std::size_t(j));
        const auto& e = c.at("eigenvalues").at(std::size_t(i));
        k.eigenvalues.emplace_back(e.at(0).get<double>(), e.at(1).get<double>());
      }
      all.push_back(k);
    }
    return all;
  }();
  return cases;
}

const Case& reference_case(std::string_view name) {
  return *std::ranges::find(reference_cases(), name, &Case::name);
}

// --- Small models with a kink, a jump, a domain.

Model scalar_model(std::function<double(double)> f) {
  Model m;
  m.name = "one state";
  m.states = {{"x", "m", 1.0}};
  m.f = [f](const VectorXd& x, const auto&, const auto&) -> VectorXd {
    return VectorXd::Constant(1, f(x[0]));
  };
  return m;
}

OperatingPoint at(double x) { return {VectorXd::Constant(1, x), VectorXd(), VectorXd()}; }

// x' = A x + B u, y = C x + D u
struct Linear {
  MatrixXd A, B, C, D;
  Model model() const {
    Model m;
    const auto name = [](const char* kind, Index count) {
      Signals s;
      for (Index i = 0; i < count; ++i) s.push_back({kind + std::to_string(i), "", 1.0});
      return s;
    };
    m.states = name("x", A.rows()), m.inputs = name("u", B.cols()), m.outputs = name("y", C.rows());
    m.f = [*this](const auto& x, const auto& u, const auto&) -> VectorXd { return A * x + B * u; };
    m.h = [*this](const auto& x, const auto& u, const auto&) -> VectorXd { return C * x + D * u; };
    m.derivatives = [*this](const auto&, const std::vector<Index>& wanted) -> MatrixXd {
      MatrixXd all(A.rows() + C.rows(), A.cols() + B.cols());
      all << A, B, C, D;
      return all(Eigen::all, wanted);
    };
    return m;
  }
};

Linear random_linear(Random& random, Index n, Index m, Index l) {
  const auto entries = [&](Index rows, Index cols) -> MatrixXd {
    return MatrixXd::NullaryExpr(rows, cols, [&] { return uniform(random, -3, 3); });
  };
  return {entries(n, n), entries(n, m), entries(l, n), entries(l, m)};
}

}  // namespace

TEST_CASE("seven closed-loop equilibria agree with an independent code") {
  const Model loop = closed_loop(craft());
  for (const Case& c : reference_cases()) {
    CAPTURE(c.name);
    const double largest = c.A.cwiseAbs().maxCoeff();
    for (const Method method : {Method::exact, Method::differences}) {
      const LinearModel lin = linearize(loop, c.point, {.method = method});
      REQUIRE(lin);
      CHECK(lin.method == method);
      CHECK(lin.remarks.empty());
      // exact: rounding, through states known to 1e-13; differences: (∛ε)² of the largest entry
      CHECK_NEAR((lin.A - c.A).cwiseAbs().maxCoeff() / largest, 0,
                 method == Method::exact ? 1e-11 : 1e-7);
      const Modes found = modes(lin);
      REQUIRE(found.modes.size() == 6);
      for (const std::complex<double> expected : c.eigenvalues) {
        double nearest = infinity;
        for (const Mode& m : found.modes)
          nearest = std::min(nearest, std::abs(m.eigenvalue - expected));
        CHECK_NEAR(nearest, 0, 1e-7);
      }
    }
  }
}

TEST_CASE("trimmed, then linearized") {
  const Model loop = closed_loop(craft());
  for (const Case& c : reference_cases()) {
    CAPTURE(c.name);
    const TrimResult level = trim_closed_loop(craft(), c.command);
    REQUIRE(level);
    const LinearModel lin = linearize(loop, level.point);
    REQUIRE(lin);
    // the trim's step tolerance, 1e-9 of each size, through second derivatives of up to 100
    CHECK_NEAR((lin.A - c.A).cwiseAbs().maxCoeff() / c.A.cwiseAbs().maxCoeff(), 0, 1e-7);
  }
}

TEST_CASE("exact derivatives are those of the equations, and their error estimate holds") {
  Random random(1);
  Score score;
  const auto run = [&](const std::vector<Known>& models, int points) {
    for (const Known& k : models) {
      CAPTURE(k.model.name);
      const std::vector<Index> variables = states_and_inputs_of(k.model);
      double worst = 0;
      for (int i = 0; i < points; ++i) {
        const OperatingPoint point = k.sample(random);
        Estimate e = exact(k.model, point, variables);
        const WideMatrix truth = k.truth(point);
        const Index rows = truth.rows();
        e = {e.value.topRows(rows), e.error.topRows(rows)};
        // Row-relative, each variable in its own size
        const VectorXd sizes = nominals(k.model.states).head(k.model.states.size());
        for (Index r = 0; r < rows; ++r) {
          long double largest = 0, miss = 0;
          for (Index j = 0; j < truth.cols(); ++j) {
            const long double size = signal_of(k.model, variables[std::size_t(j)]).nominal;
            largest = std::max(largest, std::abs(truth(r, j)) * size);
            miss = std::max(miss, std::abs(truth(r, j) - e.value(r, j)) * size);
          }
          worst = std::max(worst, double(miss / largest));
        }
        score.add(e, truth);
      }
      CHECK_NEAR(worst, 0, 1e-13);
    }
  };
  run(small_models(), 300);
  run(tiltrotor_models(), 200);
  CHECK(score.coverage() >= 0.99);
  CHECK(score.median_overstatement() < 1000);  // some 16 roundings where one or two happen
}

TEST_CASE("error estimates of differences bound the true error and do not overstate it" *
          thorough) {
  Random random(2);
  Score score;
  const auto run = [&](const std::vector<Known>& models, int points) {
    for (const Known& k : models) {
      CAPTURE(k.model.name);
      Score own;
      for (int i = 0; i < points; ++i) {
        const OperatingPoint point = k.sample(random);
        const WideMatrix truth = k.truth(point);
        const Differences d = difference(k.model, point, states_and_inputs_of(k.model));
        CHECK(d.remarks.empty());
        const Estimate e{d.jacobian.value.topRows(truth.rows()),
                         d.jacobian.error.topRows(truth.rows())};
        score.add(e, truth);
        own.add(e, truth);
      }
      CHECK(own.coverage() >= 0.99);
      CHECK(own.median_overstatement() < 100);
    }
  };
  run(small_models(), 300);
  run(tiltrotor_models(), 200);
  CHECK(score.coverage() >= 0.99);
  CHECK(score.median_overstatement() < 100);
}

TEST_CASE("noise that no size of a value tells is seen in the differences") {
  // Terms of 1e3 that cancel almost completely: the round-off is that of the terms, visible only in
  // the scatter of neighbouring values. Few samples: a lower bar than for ordinary rows.
  Random random(3);
  const Known k = known(
      "cancelling", Eigen::Vector3d::Ones(),
      []<class S>(const S* x, S* y) {
        using std::exp, std::sin;
        y[0] = S(1e3) * x[0] * x[1] - S(1e3) * x[0] * x[1] * S(0.999) + sin(x[2]);
        y[1] = S(1e3) * (exp(x[0]) - S(1.0) - x[0]);
        y[2] = (x[0] + x[1] + x[2]) * (x[0] - x[1]) - x[0] * x[0] + x[1] * x[1];
      },
      0, 1);
  Score score;
  for (int i = 0; i < 1000; ++i) {
    const OperatingPoint point = k.sample(random);
    score.add(difference(k.model, point, states_of(k.model)).jacobian, k.truth(point));
  }
  CHECK(score.coverage() >= 0.95);
  CHECK(score.median_overstatement() < 100);
}

TEST_CASE("values in steps, of large terms that cancel, of floats or decimals, widen the error") {
  const std::function<double(double)> steps[] = {
      [](double y) { return 1e3 + y - 1e3; },
      [](double y) { return 1e5 + y - 1e5; },
      [](double y) { return double(float(y)); },
      [](double y) { return std::round(y * 1e9) / 1e9; },
      [](double y) { return std::round(y * 1e10) / 1e10 - 0.25; },
  };
  Random random(17);
  for (const auto& in_steps : steps) {
    const Model m = flow({"x"}, {}, [&](const VectorXd& x, const VectorXd&) {
      return vec({in_steps(std::sin(x[0]))});
    });
    int covered = 0, determined = 0;
    for (int trial = 0; trial < 200; ++trial) {
      const double x = uniform(random, 0.2, 2.0);
      const Estimate e = difference(m, {vec({x}), {}, {}}, {0}).jacobian;
      if (!std::isfinite(e.error(0, 0))) continue;
      ++determined;
      covered += std::abs(e.value(0, 0) - std::cos(x)) <= e.error(0, 0);
    }
    CHECK(determined > 100);
    CHECK(covered >= 0.98 * determined);  // where cos x is near 0, a value may not move at all
  }
}

TEST_CASE("the error of a difference falls as the square of its step") {
  // exp at 0.3, the nominal size setting a step large enough for truncation to rule
  const auto miss = [](double nominal, const std::vector<Range>& bounds) {
    Model m = scalar_model([](double x) { return std::exp(x); });
    m.states[0].nominal = nominal;
    const Differences d = difference(m, at(0.3), {0}, bounds);
    CHECK(d.remarks.size() == bounds.size());
    const double error = std::abs(d.jacobian.value(0, 0) - std::exp(0.3));
    CHECK(d.jacobian.error(0, 0) >= error);
    return error;
  };
  const auto order = [&](const std::vector<Range>& bounds) {
    return std::log2(miss(2000, bounds) / miss(1000, bounds));
  };
  const std::vector<Range> none, above{{0.3, infinity}}, below{{-infinity, 0.3}};
  CHECK_NEAR(order(none), 2, 0.02);
  CHECK_NEAR(order(above), 2, 0.05);  // its next term is of order h³, not h⁴
  CHECK_NEAR(order(below), 2, 0.05);
}

TEST_CASE("kinks and jumps: a one-sided difference and a remark that names them") {
  struct Kinked {
    const char* what;
    std::function<double(double)> f;
    double slope;
  };
  const Kinked all[] = {
      {"|x|", [](double x) { return std::abs(x); }, 1},
      {"max(0, x)", [](double x) { return std::max(0.0, x); }, 1},
      {"min(0, x)", [](double x) { return std::min(0.0, x); }, 0},
      {"step", [](double x) { return x >= 0 ? 1 + 3 * x : 2 * x; }, 3},
      {"step, open", [](double x) { return x > 0 ? 1 + 3 * x : 2 * x; }, 2},
      {"saturation", [](double x) { return std::clamp(x, -1.0, 0.0); }, 0},
      {"kink on a slope", [](double x) { return std::sin(x) + 0.01 * std::abs(x); }, 1.01},
  };
  for (const Kinked& k : all) {
    CAPTURE(k.what);
    Model m = scalar_model(k.f);
    const Differences d = difference(m, at(0), {0});
    REQUIRE(d.remarks.size() == 1);
    CHECK(contains(d.remarks[0], "x: one-sided difference"));
    CHECK(contains(d.remarks[0], "kink"));
    CHECK_NEAR(d.jacobian.value(0, 0), k.slope, 1e-9);  // h², and round-off ε/h
    CHECK_NEAR(d.jacobian.value(0, 0), k.slope, d.jacobian.error(0, 0));
    m.switches = {{"the valve opens", [](const OperatingPoint& p) { return p.x[0]; }},
                  {"elsewhere", [](const OperatingPoint& p) { return p.x[0] - 1; }}};
    CHECK(contains(difference(m, at(0), {0}).remarks.at(0), "the valve opens"));
    CHECK(linearize(m, at(0), {.tolerance = 10}).remarks.size() == 1);
  }
}

TEST_CASE("a kink anywhere within a difference's reach is met or within the error estimate") {
  const double h = std::cbrt(epsilon);
  for (int tenths = 0; tenths <= 30; ++tenths) {
    const double place = 0.1 * tenths * h;
    CAPTURE(tenths);
    for (const double side : {1.0, -1.0}) {
      const Model m = scalar_model([=](double x) { return std::abs(x - side * place) + x / 4; });
      const Differences d = difference(m, at(0), {0});
      const double slope = d.jacobian.value(0, 0);
      const double miss = std::min(std::abs(slope + 0.75), std::abs(slope - 1.25));
      // One-sided slopes: within two steps of a kink both belong to the model.
      CHECK(miss <= d.jacobian.error(0, 0));
    }
  }
}

TEST_CASE("at the hand-over the closed loop is linearized from one side, in words") {
  const TrimResult trimmed =
      trim_closed_loop(craft(), {5.0, 60 * pi / 180, craft().aircraft.cyclic_off});
  REQUIRE(trimmed);
  const Model loop = closed_loop(craft());
  const LinearModel lin =
      linearize(loop, trimmed.point, {.method = Method::differences, .inputs = {"eta"}});
  REQUIRE(lin);
  REQUIRE(lin.remarks.size() == 1);
  CHECK(contains(lin.remarks[0], "eta: one-sided difference from above"));
  CHECK(contains(lin.remarks[0], "handover"));
  // From above the cyclic is active: the slope there is the exact one at the same authority.
  const LinearModel same = linearize(loop, trimmed.point, {.inputs = {"eta"}});
  CHECK_NEAR((lin.B - same.B).cwiseAbs().maxCoeff() / same.B.cwiseAbs().maxCoeff(), 0, 1e-7);
  CHECK(linearize(loop, trimmed.point).remarks.empty());  // no state crosses it
}

TEST_CASE("smooth models give no remark") {
  Random random(4);
  const auto run = [&](const std::vector<Known>& models, int points) {
    for (const Known& k : models) {
      CAPTURE(k.model.name);
      for (int i = 0; i < points; ++i) {
        const Differences d = difference(k.model, k.sample(random), states_and_inputs_of(k.model));
        CHECK(d.remarks.empty());
      }
    }
  };
  run(small_models(), 100);
  run(tiltrotor_models(), 100);
  // A minimum is no kink, however flat
  for (const double power : {2.0, 4.0, 6.0}) {
    const Model m = scalar_model([=](double x) { return std::pow(x * x, power / 2) + 1; });
    CHECK(difference(m, at(0), {0}).remarks.empty());
  }
}

TEST_CASE("differences keep within limits") {
  const double h = std::cbrt(epsilon);
  double lowest = 0, highest = 0;
  const Model m = scalar_model([&](double x) {
    lowest = std::min(lowest, x);
    highest = std::max(highest, x);
    return std::sin(x);
  });
  const auto slope = [&](const Range& range) {
    lowest = highest = 0;
    const LinearModel lin = linearize(m, at(0), {.bounds = {{"x", range}}});
    REQUIRE(lin);
    CHECK(lowest >= range.lower);
    CHECK(highest <= range.upper);
    CHECK_NEAR(lin.A(0, 0), 1, lin.A_error(0, 0));
    return lin.remarks;
  };
  CHECK(slope({-1, 1}).empty());
  CHECK(contains(slope({0, 1}).at(0), "x: one-sided difference from above, at a limit"));
  CHECK(contains(slope({-1, 0}).at(0), "x: one-sided difference from below, at a limit"));
  CHECK(contains(slope({-1, h}).at(0), "from below"));
  CHECK(contains(slope({-h, 1}).at(0), "from above"));
  CHECK(slope({-3 * h, 3 * h}).empty());
  CHECK(contains(slope({-h, 5 * h}).at(0), "from above"));
  for (const Range closed : {Range{0, 0}, Range{-h, h}, Range{-h, 3 * h}, Range{1, -1},
                             Range{std::nan(""), std::nan("")}})
    CHECK(
        contains(refusal(m, at(0), {.bounds = {{"x", closed}}}), "'x': the bounds are too close"));
}

TEST_CASE("away from an equilibrium nothing is linearized") {
  const Model loop = closed_loop(craft());
  OperatingPoint point = reference_case("level").point;
  point.x[3] = 0.01;  // rad/s of pitch rate
  const LinearModel lin = linearize(loop, point);
  CHECK(lin.status == LinearizeStatus::not_equilibrium);
  CHECK_FALSE(lin);
  CHECK(lin.A.size() == 0);
  CHECK(contains(lin.message, "not an equilibrium: "));
  CHECK(contains(lin.message, "theta' = 0.01"));
  CHECK_NEAR(lin.rates[2], 0.01, 0);
  CHECK(lin.residual > 0.1);  // 0.01 rad/s over theta's 0.1 rad at least
  CHECK_THROWS_AS((void)modes(lin), std::invalid_argument);
  // The tolerance decides, in nominal sizes
  Model drifting = scalar_model([](double x) { return 1e-3 - x; });
  drifting.states[0].nominal = 1000;
  CHECK(linearize(drifting, at(0), {.tolerance = 1e-6}));
  CHECK_FALSE(linearize(drifting, at(0), {.tolerance = 0.9e-6}));
  CHECK_NEAR(linearize(drifting, at(0)).residual, 1e-6, 1e-20);
}

TEST_CASE("what may move is not asked to rest") {
  Model m = scalar_model([](double) { return 0; });
  m.states = {{"x", "m", 1.0}, {"V", "m/s", 1.0}};
  m.f = [](const VectorXd& x, const auto&, const auto&) -> VectorXd {
    return Eigen::Vector2d{x[1], 9 - x[1] * x[1]};
  };
  const OperatingPoint cruise{Eigen::Vector2d{1e3, 3}, VectorXd(), VectorXd()};
  const LinearModel refused = linearize(m, cruise);
  CHECK(refused.status == LinearizeStatus::not_equilibrium);
  CHECK(contains(refused.message, "x' = 3"));
  const LinearModel lin = linearize(m, cruise, {.moving = {"x"}});
  REQUIRE(lin);
  CHECK(lin.residual == 0);
  CHECK_NEAR(lin.A(0, 1), 1, 1e-9);
  CHECK_NEAR(lin.A(1, 1), -6, 1e-8);
}

TEST_CASE("no derivative, no linear model") {
  const auto check_refused = [](const LinearModel& lin, std::string_view row,
                                std::string_view along) {
    CHECK(lin.status == LinearizeStatus::not_finite);
    CHECK_FALSE(lin);
    CHECK(lin.A.size() == 0);
    CHECK(contains(lin.message, row));
    INFO(lin.message);
    CHECK(contains(lin.message, along));
  };
  const Model root = scalar_model([](double x) { return std::sqrt(x); });
  check_refused(linearize(root, at(0)), "x'", "with respect to x");
  Model exact_root = root;
  exact_root.derivatives = [](const OperatingPoint& p, const auto&) -> MatrixXd {
    return MatrixXd::Constant(1, 1, 0.5 / std::sqrt(p.x[0]));
  };
  check_refused(linearize(exact_root, at(0)), "x'", "with respect to x");

  // Hover in calm air has no angle of attack: the rates have slopes along u, but none along w
  const double theta0 = 1 / craft().aircraft.thrust_excess;
  const OperatingPoint hover{VectorXd::Zero(4), Eigen::Vector4d{theta0, 0, 0, pi / 2},
                             airframe_parameters(craft())};
  check_refused(linearize(airframe(craft(), Axes::body), hover, {.tolerance = infinity}), "'",
                "with respect to w");
  const OperatingPoint loop{VectorXd::Zero(6), VectorXd(),
                            closed_loop_parameters(craft(), {0, 0, pi / 2})};
  check_refused(linearize(closed_loop(craft(), Axes::body), loop, {.tolerance = infinity}), "'",
                "with respect to w");
  CHECK(to_string(LinearizeStatus::linear) == "linear");
  CHECK(to_string(LinearizeStatus::not_equilibrium) == "not_equilibrium");
  CHECK(to_string(LinearizeStatus::not_finite) == "not_finite");
  CHECK(to_string(LinearizeStatus::model_threw) == "model_threw");
  CHECK(to_string(LinearizeStatus::not_repeatable) == "not_repeatable");

  // Rates that are not numbers have no derivatives either
  const Model nowhere = scalar_model([](double) { return std::nan(""); });
  const LinearModel none = linearize(nowhere, at(0));
  CHECK(none.status == LinearizeStatus::not_finite);
  CHECK(contains(none.message, "nan"));
  CHECK(std::isnan(none.residual));
}

TEST_CASE("a model without states is its D, and has no modes") {
  Model gain;
  gain.name = "gain";
  gain.inputs = {{"u", "", 1.0}, {"v", "", 1.0}};
  gain.outputs = {{"y", "", 1.0}};
  gain.h = [](const VectorXd& x, const VectorXd& u, const VectorXd&) {
    CHECK(x.size() == 0);
    return VectorXd::Constant(1, 2 * u[0] - 3 * u[1]);
  };
  const LinearModel linear = linearize(gain, {VectorXd(), VectorXd::Ones(2), VectorXd()});
  REQUIRE(linear);
  CHECK(linear.A.size() == 0);
  CHECK(linear.B.rows() == 0);
  CHECK(linear.B.cols() == 2);
  CHECK(linear.C.rows() == 1);
  CHECK(linear.C.cols() == 0);
  CHECK_NEAR(linear.D(0, 0), 2.0, linear.D_error(0, 0));
  CHECK_NEAR(linear.D(0, 1), -3.0, linear.D_error(0, 1));
  CHECK(linear.D_error.maxCoeff() < 1e-6);
  CHECK(linear.residual == 0);
  const Modes none = modes(linear);
  CHECK(none.modes.empty());
  CHECK(none.verdict == Verdict::stable);  // nothing could be unstable
  CHECK(none.spectral_abscissa == -std::numeric_limits<double>::infinity());
}

TEST_CASE("wrong exact derivatives are noticed, wherever they stand") {
  Random random(5);
  const Linear linear = random_linear(random, 3, 2, 2);
  const OperatingPoint rest{VectorXd::Zero(3), VectorXd::Zero(2), VectorXd()};
  CHECK(linearize(linear.model(), rest).remarks.empty());
  const char* rows[] = {"dx0'", "dx1'", "dx2'", "dy0", "dy1"};
  const char* columns[] = {"/dx0:", "/dx1:", "/dx2:", "/du0:", "/du1:"};
  for (Index i = 0; i < 5; ++i)
    for (Index j = 0; j < 5; ++j) {
      Model m = linear.model();
      const auto right = m.derivatives;
      m.derivatives = [=](const OperatingPoint& p, const std::vector<Index>& v) {
        MatrixXd J = right(p, v);
        J(i, j) += 1e-6;
        return J;
      };
      const LinearModel lin = linearize(m, rest);
      REQUIRE(lin);
      REQUIRE(lin.remarks.size() == 1);
      CHECK(contains(lin.remarks[0], "disagree"));
      CHECK(contains(lin.remarks[0], std::string(rows[i]) + columns[j]));
      MatrixXd error(5, 5);
      error << lin.A_error, lin.B_error, lin.C_error, lin.D_error;
      CHECK(error(i, j) >= 0.99e-6);  // the truth is within it
    }
}

TEST_CASE("a linear model linearizes to itself") {
  Random random(6);
  for (int trial = 0; trial < 50; ++trial) {
    const Linear linear = random_linear(random, 1 + trial % 6, trial % 3, trial % 4);
    const OperatingPoint rest{VectorXd::Zero(linear.A.rows()), VectorXd::Zero(linear.B.cols()),
                              VectorXd()};
    for (const Method method : {Method::exact, Method::differences}) {
      const LinearModel lin = linearize(linear.model(), rest, {.method = method});
      REQUIRE(lin);
      CHECK(lin.remarks.empty());
      const auto same = [](const MatrixXd& found, const MatrixXd& planted, const MatrixXd& error) {
        REQUIRE(found.rows() == planted.rows());
        REQUIRE(found.cols() == planted.cols());
        // Differences of a linear function about zero: each quotient rounds, nothing cancels
        CHECK(((found - planted).cwiseAbs().array() <= 4 * epsilon * planted.array().abs()).all());
        CHECK(((found - planted).cwiseAbs().array() <= error.array()).all());
      };
      same(lin.A, linear.A, lin.A_error);
      same(lin.B, linear.B, lin.B_error);
      same(lin.C, linear.C, lin.C_error);
      same(lin.D, linear.D, lin.D_error);
    }
  }
}

TEST_CASE("entries that are zero for good have no error") {
  const LinearModel lin = linearize(closed_loop(craft()), reference_case("level").point);
  REQUIRE(lin);
  for (Index j : {0, 1, 2, 4, 5}) {
    CHECK(lin.A(2, j) == 0);
    CHECK(lin.A_error(2, j) == 0);
    CHECK(lin.A_differences->value(2, j) == 0);
    CHECK(lin.A_differences->error(2, j) == 0);
  }
}

TEST_CASE("a row that is even about the point has equal samples on both sides, and an error") {
  Model m = scalar_model([](double x) { return std::cos(x) - 1; });
  m.derivatives = [](const OperatingPoint& p, const std::vector<Index>&) {
    return MatrixXd(MatrixXd::Constant(1, 1, -std::sin(p.x[0])));
  };
  const double turn = 2 * pi;  // sin of it is -2.4e-16
  const LinearModel l = linearize(m, at(turn));
  REQUIRE(l.status == LinearizeStatus::linear);
  CHECK(l.A_differences->error(0, 0) > 1e-13);
  CHECK(l.remarks.empty());
}

TEST_CASE("wind and body axes have the same eigenvalues") {
  for (const Case& c : reference_cases()) {
    CAPTURE(c.name);
    const LinearModel body_axes =
        linearize(closed_loop(craft(), Axes::body), in_body_axes_of_loop(c.point));
    REQUIRE(body_axes);
    const Modes wind = modes(linearize(closed_loop(craft()), c.point)), body = modes(body_axes);
    for (std::size_t i = 0; i < 6; ++i)
      CHECK_NEAR(std::abs(wind.modes[i].eigenvalue - body.modes[i].eigenvalue), 0, 1e-9);
    CHECK(wind.verdict == body.verdict);
  }
}

TEST_CASE("what linearization leaves out is of second order") {
  Random random(7);
  const Model loop = closed_loop(craft());
  for (const Case& c : reference_cases()) {
    CAPTURE(c.name);
    const LinearModel lin = linearize(loop, c.point);
    REQUIRE(lin);
    const VectorXd away = nominals(loop.states).cwiseProduct(uniform(random, 6, 0.3, 1));
    const auto left_out = [&](double size) -> VectorXd {
      OperatingPoint p = c.point;
      p.x += size * away;
      const VectorXd change = evaluate(loop, p).rates - lin.rates;
      return (change - lin.A * (size * away)).cwiseQuotient(nominals(loop.states));
    };
    CHECK_NEAR(std::log2(left_out(1e-3).norm() / left_out(5e-4).norm()), 2, 0.02);
  }
}

TEST_CASE("the linear response follows the nonlinear one") {
  const Model loop = closed_loop(craft());
  // Fixed-step Runge-Kutta of order four over two seconds
  const auto fly = [](VectorXd x, const auto& rates) {
    constexpr double dt = 0.005;
    for (int i = 0; i < 400; ++i) {
      const VectorXd k1 = rates(x);
      const VectorXd k2 = rates(VectorXd(x + dt / 2 * k1));
      const VectorXd k3 = rates(VectorXd(x + dt / 2 * k2));
      const VectorXd k4 = rates(VectorXd(x + dt * k3));
      x += dt / 6 * (k1 + 2 * k2 + 2 * k3 + k4);
    }
    return x;
  };
  for (const char* name : {"climb", "transition", "level"}) {
    CAPTURE(name);
    const Case& c = reference_case(name);
    const LinearModel lin = linearize(loop, c.point);
    REQUIRE(lin);
    const VectorXd sizes = nominals(loop.states);
    const auto apart = [&](double size) {
      const VectorXd away = size * sizes;
      const VectorXd nonlinear = fly(VectorXd(c.point.x + away), [&](const VectorXd& x) {
        return loop.f(x, c.point.u, c.point.p);
      });
      const VectorXd linear = fly(away, [&](const VectorXd& x) -> VectorXd { return lin.A * x; });
      return (nonlinear - c.point.x - linear).cwiseQuotient(sizes).norm();
    };
    CHECK(apart(1e-3) < 1e-4);
    CHECK_NEAR(std::log2(apart(1e-3) / apart(5e-4)), 2, 0.02);
  }
}

TEST_CASE("B along commands and parameters is the slope of the rates") {
  const Model loop = closed_loop(craft());
  for (const Case& c : reference_cases()) {
    CAPTURE(c.name);
    const std::vector<std::string> inputs = {"V", "gamma", "eta", "aircraft.mass", "gains.k_V"};
    const LinearModel lin = linearize(loop, c.point, {.inputs = inputs});
    REQUIRE(lin);
    REQUIRE(names(lin.inputs) == inputs);
    CHECK(lin.D.rows() == 6);
    CHECK(lin.D.cols() == 5);
    for (std::size_t k = 0; k < inputs.size(); ++k) {
      const Index j = variable(loop, inputs[k]);
      const double h = 1e-4 * signal_of(loop, j).nominal;  // error: h² f'''/6
      OperatingPoint ahead = c.point, behind = c.point;
      set_value(ahead, j, value_of(c.point, j) + h);
      set_value(behind, j, value_of(c.point, j) - h);
      const VectorXd slope = (evaluate(loop, ahead).rates - evaluate(loop, behind).rates) / (2 * h);
      const double largest = std::max(1.0, lin.B.col(Index(k)).cwiseAbs().maxCoeff());
      CHECK_NEAR((lin.B.col(Index(k)) - slope).cwiseAbs().maxCoeff() / largest, 0, 1e-7);
    }
  }
}

TEST_CASE("the caller's mistakes throw, in words") {
  const Model loop = closed_loop(craft());
  const OperatingPoint point = reference_case("level").point;
  CHECK(contains(refusal(loop, point, {.inputs = {"etta"}}), "no signal 'etta' (nearest: 'eta')"));
  CHECK(contains(refusal(loop, point, {.inputs = {"theta"}}), "'theta' is a state"));
  CHECK(
      contains(refusal(loop, point, {.inputs = {"eta", "eta"}}), "inputs: 'eta' is listed twice"));
  CHECK(contains(refusal(loop, point, {.bounds = {{"thetta", {0, 1}}}}), "no signal 'thetta'"));
  CHECK(contains(refusal(loop, point, {.moving = {"heigth"}}), "'heigth'"));
  CHECK(contains(refusal(loop, point, {.moving = {"eta"}}), "'eta'"));
  OperatingPoint shorter = point, odd = point;
  shorter.x.conservativeResize(5);
  CHECK(contains(refusal(loop, shorter, {}), "state x: expected 6 values, got 5"));
  odd.x[2] = std::nan("");
  CHECK(contains(refusal(loop, odd, {}), "'theta' is nan"));
  Model empty = loop;
  empty.f = nullptr;
  CHECK(contains(refusal(empty, point, {}), "no function f"));
  Model wrong = loop;
  wrong.f = [](const auto&, const auto&, const auto&) -> VectorXd { return VectorXd::Zero(5); };
  CHECK(contains(refusal(wrong, point, {}), "rates f: expected 6 values, got 5"));
  const Model plain = scalar_model([](double x) { return -x; });
  CHECK_THROWS_AS(exact(plain, at(0), {0}), std::invalid_argument);
}

TEST_CASE("solvers get the exact derivatives, or differences of the same accuracy") {
  Model m = scalar_model([](double x) { return std::sin(x); });
  const double slope = jacobian(m, at(1), {0})(0, 0);
  CHECK_NEAR(slope, std::cos(1), 1e-10);
  m.derivatives = [](const OperatingPoint& p, const auto&) -> MatrixXd {
    return MatrixXd::Constant(1, 1, std::cos(p.x[0]));
  };
  CHECK(jacobian(m, at(1), {0})(0, 0) == std::cos(1.0));
}

TEST_CASE("a point so large that a step is lost still moves") {
  const Model m = scalar_model([](double x) { return 2 * x; });
  const Differences d = difference(m, at(1e15), {0});
  CHECK_NEAR(d.jacobian.value(0, 0), 2, d.jacobian.error(0, 0));
  CHECK_NEAR(d.jacobian.value(0, 0), 2, 1e-12);
}

TEST_CASE("one-sided differences beside a singularity: the truth within the error, or no error") {
  struct Edge {
    std::function<double(double)> f, slope;
  };
  const Edge edges[] = {
      {[](double x) { return std::log(x); }, [](double x) { return 1 / x; }},
      {[](double x) { return std::sqrt(x); }, [](double x) { return 0.5 / std::sqrt(x); }},
      {[](double x) { return std::pow(x, 0.75); },
       [](double x) { return 0.75 * std::pow(x, -0.25); }},
      {[](double x) { return 1 / x; }, [](double x) { return -1 / (x * x); }},
      {[](double x) { return x * std::log(x); }, [](double x) { return 1 + std::log(x); }},
      {[](double x) { return std::pow(x, 1.5); }, [](double x) { return 1.5 * std::sqrt(x); }}};
  int determined = 0, not_determined = 0;
  for (const Edge& edge : edges)
    for (double power = -12; power <= 1; power += 0.05) {
      const double x = std::pow(10, power);
      const Model m = scalar_model([&](double y) { return edge.f(x + y); });
      const Estimate e = difference(m, at(0), {0}, {{0, infinity}}).jacobian;
      CAPTURE(x);
      if (!std::isfinite(e.error(0, 0))) {
        ++not_determined;
        continue;
      }
      ++determined;
      CHECK_NEAR(e.value(0, 0), edge.slope(x), e.error(0, 0));
    }
  CHECK(determined > 300);
  CHECK(not_determined > 300);
  // The edge itself: the slope of a root there is infinite.
  const Model root = scalar_model([](double x) { return std::sqrt(x); });
  const LinearModel lin = linearize(root, at(0), {.bounds = {{"x", {0, 1}}}});
  CHECK(lin.status == LinearizeStatus::not_finite);
  CHECK(contains(lin.message, "the derivative of x' with respect to x is not determined:"));
}

TEST_CASE("central differences across a singularity: the truth within the error, or no error") {
  struct Odd {
    std::function<double(double)> half, slope;  // f(x) = -f(-x)
  };
  std::vector<Odd> all{{[](double x) { return x * std::log(x); },
                        [](double x) { return x > 0 ? 1 + std::log(x) : -infinity; }}};
  for (const double p : {1.0 / 3, 0.5, 0.75, 1.2, 1.5, 1.9})
    all.push_back({[=](double x) { return std::pow(x, p); },
                   [=](double x) { return p * std::pow(x, p - 1); }});
  int determined = 0, not_determined = 0;
  for (const Odd& odd : all)
    for (const double share : {0.0, 0.03, 0.4, 0.6, 1.3, 1.7, 2.2, 3.0, 10.0, 1e3, 1e5}) {
      const double x = 6.0554544523933429e-06 * share;  // steps from the singularity
      const Model m = scalar_model([&](double y) {
        const double z = x + y;
        return z > 0 ? odd.half(z) : z < 0 ? -odd.half(-z) : 0.0;
      });
      const Estimate e = difference(m, at(0), {0}).jacobian;
      CAPTURE(x);
      const bool known = std::isfinite(e.error(0, 0));
      ++(known ? determined : not_determined);
      if (known) CHECK_NEAR(e.value(0, 0), odd.slope(x), e.error(0, 0));
      if (share == 0) CHECK_FALSE(known);
    }
  CHECK(determined >= 20);
  CHECK(not_determined >= 20);
}

TEST_CASE("the edge of a model's domain is seen without bounds, thrown or not a number") {
  for (const bool throws : {false, true}) {
    const Model m = scalar_model([=](double x) {
      if (x < 0 && throws) throw std::domain_error("x is negative");
      return x < 0 ? std::nan("") : std::exp(x) - 1;
    });
    const LinearModel lin = linearize(m, at(0));
    REQUIRE(lin);
    CHECK_NEAR(lin.A(0, 0), 1, lin.A_error(0, 0));
    CHECK(contains(lin.remarks.at(0), "from above, at the edge of the model's domain"));
  }
  // If no side gives a finite value, the model's own message.
  const Model nowhere =
      scalar_model([](double x) { return x == 0 ? 0 : throw std::domain_error("only zero"); });
  CHECK(contains(linearize(nowhere, at(0)).message, "only zero"));
}

TEST_CASE("a derivative that is missing is named by its own variable, and withholds no other") {
  Model m = scalar_model([](double) { return 0; });
  m.states = {{"x", "", 1.0}, {"y", "", 1.0}};
  m.outputs = {{"root", "", 1.0}, {"sum", "", 1.0}};
  m.f = [](const VectorXd& x, const auto&, const auto&) -> VectorXd { return -x; };
  m.h = [](const VectorXd& x, const auto&, const auto&) -> VectorXd {
    return Eigen::Vector2d{x[0] + std::sqrt(std::abs(x[1])), x[0] + x[1]};
  };
  const OperatingPoint origin{VectorXd::Zero(2), VectorXd(), VectorXd()};
  const LinearModel lin = linearize(m, origin, {.bounds = {{"y", {0, 1}}}});
  REQUIRE(lin);
  CHECK_NEAR(lin.C(0, 0), 1, 1e-8);
  CHECK(std::isnan(lin.C(0, 1)));
  CHECK_NEAR(lin.C(1, 1), 1, 1e-8);
  CHECK(std::ranges::any_of(lin.remarks, [](const std::string& r) {
    return contains(r, "root with respect to y") && !contains(r, "with respect to x");
  }));
}

TEST_CASE("an output without a slope takes nothing from the exact slopes of the others") {
  const Model m = model_of({.name = "root",
                            .states = {{"x", "", 1.0}, {"y", "", 1.0}},
                            .inputs = {{"u", "", 1.0}},
                            .outputs = {{"root", "", 1.0}, {"exponential", "", 1.0}},
                            .parameters = {},
                            .rates = {"-3*x + sin(y)/7 + u", "x - exp(y) + 1"},
                            .values = {"sqrt(u)", "exp(x/3)"}});
  const OperatingPoint origin{VectorXd::Zero(2), VectorXd::Zero(1), VectorXd()};
  const LinearModel lin = linearize(m, origin);
  REQUIRE(lin);
  constexpr double rounding = 1e-13;
  const MatrixXd A{{-3.0, 1.0 / 7}, {1.0, -1.0}}, B{{1.0}, {0.0}};
  CHECK((lin.A - A).cwiseAbs().maxCoeff() <= lin.A_error.minCoeff());
  CHECK(lin.A_error.maxCoeff() < rounding);
  CHECK(lin.B == B);
  CHECK(lin.B_error.maxCoeff() < rounding);
  CHECK_NEAR(lin.C(1, 0), 1.0 / 3, lin.C_error(1, 0));
  CHECK(lin.C_error(1, 0) < rounding);
  CHECK(lin.C.row(0).isZero(0.0));
  CHECK(std::isnan(lin.D(0, 0)));
  CHECK(std::ranges::any_of(lin.remarks, [](const std::string& r) {
    return contains(r, "derivative of root with respect to u is not determined");
  }));
}

TEST_CASE("noise and state in a model are no kink, and have no linear model") {
  Random random(3);
  std::normal_distribution<double> noise(0, 1e-9);
  const Model noisy = scalar_model([&](double x) { return -x + noise(random); });
  const LinearModel lin = linearize(noisy, at(0));
  CHECK(lin.status == LinearizeStatus::not_repeatable);
  CHECK(contains(lin.message, "two different values at one point:"));
  int calls = 0;
  const Model counting = scalar_model([&](double x) { return ++calls > 3 ? -x + 1e-9 : -x; });
  CHECK(linearize(counting, at(0)).status == LinearizeStatus::not_repeatable);
}

TEST_CASE("a verdict needs an equilibrium, not a rate that is small with its slope") {
  const LinearModel tiny =
      linearize(scalar_model([](double x) { return 1e-300 * (x - 1); }), at(0));
  CHECK(tiny.status == LinearizeStatus::not_equilibrium);
  CHECK(contains(tiny.message, "1 nominal sizes away"));
  const LinearModel far = linearize(scalar_model([](double x) { return std::exp(-x); }), at(119));
  CHECK(far.status == LinearizeStatus::not_equilibrium);
  CHECK(linearize(scalar_model([](double x) { return 1e-300 * x; }), at(0)));
  // No zero either, though each of Newton's steps is short: 1/(2x).
  const LinearModel tail =
      linearize(scalar_model([](double x) { return std::exp(-x * x); }), at(10));
  CHECK(tail.status == LinearizeStatus::not_equilibrium);
  // A root of high order is one.
  CHECK(linearize(scalar_model([](double x) { return std::pow(x, 9); }), at(0.02)));
}

TEST_CASE("at a fold the errors allow for where within its tolerance a trim may have stopped") {
  // x' = -x², y' = -y in the coordinates a = x + y, b = y - x; in each a zero eigenvalue.
  const auto at = [](double x, const auto& rate) {
    Model m;
    m.states = {{"a", "", 1.0}, {"b", "", 1.0}};
    m.f = [rate](const VectorXd& s, const VectorXd&, const VectorXd&) {
      const double from_x = rate((s[0] - s[1]) / 2, (s[0] + s[1]) / 2), from_y = -(s[0] + s[1]) / 2;
      return VectorXd(Eigen::Vector2d{from_x + from_y, from_y - from_x});
    };
    const double y = 0;
    return linearize(m, {Eigen::Vector2d{x + y, y - x}, VectorXd(), VectorXd()});
  };
  for (const double x : {-1e-12, 1e-14, 1e-9}) {
    CAPTURE(x);
    const LinearModel fold = at(x, [](double p, double) { return -p * p; });
    REQUIRE(fold.status == LinearizeStatus::linear);
    CHECK(fold.A_error.maxCoeff() > 1e-7);
    CHECK(modes(fold).verdict == Verdict::undecided);
  }
  // Families of equilibria: y = 0 for any x, and along the curve 3 y = sin x.
  CHECK(at(0.3, [](double, double) { return 0.0; }).A_error.maxCoeff() < 1e-9);
  Model curve;
  curve.states = {{"x", "", 1.0}, {"y", "", 1.0}};
  curve.f = [](const VectorXd& s, const VectorXd&, const VectorXd&) {
    return VectorXd(Eigen::Vector2d{std::sin(s[0]) - 3 * s[1], 6 * s[1] - 2 * std::sin(s[0])});
  };
  const OperatingPoint origin{Eigen::Vector2d{0, 0}, VectorXd(), VectorXd()};
  CHECK(linearize(curve, origin).A_error.maxCoeff() < 1e-9);
  // A model that ends not far from the fold.
  curve.f = [](const VectorXd& s, const VectorXd&, const VectorXd&) {
    if (std::abs(s[0]) > 1e-3) throw std::domain_error("no table");
    return VectorXd(Eigen::Vector2d{-s[0] * s[0], -s[1]});
  };
  CHECK(linearize(curve, origin).A_error.maxCoeff() > 1e-7);
}

TEST_CASE("a moving state that others depend on makes a linear model of an instant") {
  Model m = scalar_model([](double) { return 0; });
  m.states = {{"height", "m", 1.0}, {"V", "m/s", 1.0}};
  m.f = [](const VectorXd& x, const auto&, const auto&) -> VectorXd {
    return Eigen::Vector2d{0.5, (1 - 1e-3 * x[0]) * (9 - x[1] * x[1])};
  };
  const OperatingPoint climb{Eigen::Vector2d{0, 3}, VectorXd(), VectorXd()};
  CHECK(linearize(m, climb, {.moving = {"height"}}).remarks.empty());
  m.f = [](const VectorXd& x, const auto&, const auto&) -> VectorXd {
    return Eigen::Vector2d{0.5, 9 - 1e-3 * x[0] - x[1] * x[1]};
  };
  const LinearModel lin = linearize(m, climb, {.moving = {"height"}});
  REQUIRE(lin.remarks.size() == 1);
  CHECK(contains(lin.remarks[0], "height' = 0.5, and V' depends on height"));
}

TEST_CASE("at a double root rounding of the rates leaves the sign of the slope open") {
  // x² - 2ax + a² and 1 - cosh(x - a) are zero at a alone, with slope zero; a trim misses it by the
  // root of their rounding.
  const char* const square = "s*(x^2 - 2*x*0.7 + 0.7^2)";
  struct Row {
    const char* rate;
    double size;
  };
  for (const Row& row :
       {Row{square, 1}, Row{square, -1e3}, Row{square, 1e6}, Row{"1 - cosh(s*(x - 0.7))", 30}}) {
    CAPTURE(row.rate);
    CAPTURE(row.size);
    const Model m = model_of({.name = "double root",
                              .states = {{"x", ""}},
                              .inputs = {},
                              .outputs = {},
                              .parameters = {{"s", ""}},
                              .rates = {row.rate}});
    for (const double guess : {0.1, 0.9}) {
      const TrimResult r =
          trim(m, {.free = {"x"}, .steady = {"x"}},
               {VectorXd::Constant(1, guess), {}, VectorXd::Constant(1, row.size)});
      REQUIRE(std::abs(r.point.x[0] - 0.7) < 1e-5);
      const LinearModel linear = linearize(m, r.point);
      CHECK(std::abs(linear.A(0, 0)) <= linear.A_error(0, 0));
      CHECK(modes(linear).verdict == Verdict::undecided);
    }
  }
  // A simple root with the same terms is decided.
  const Model simple = model_of({.name = "simple root",
                                 .states = {{"x", ""}},
                                 .inputs = {},
                                 .outputs = {},
                                 .parameters = {},
                                 .rates = {"x^2 - 2*x*0.7 + 0.7^2 - 1e-10"}});
  const TrimResult r =
      trim(simple, {.free = {"x"}, .steady = {"x"}}, {VectorXd::Constant(1, 0.6), {}, {}});
  CHECK_NEAR(r.point.x[0], 0.7 - 1e-5, 1e-9);
  CHECK(modes(linearize(simple, r.point)).verdict == Verdict::stable);
}

TEST_CASE("a slow mode at the very end of the model's domain") {
  Model m = scalar_model([](double x) {
    if (x > 1) throw std::domain_error("no table");
    return 1e-3 * (1 - x);
  });
  m.derivatives = [](const OperatingPoint&, const std::vector<Eigen::Index>& variables) {
    return Eigen::MatrixXd::Constant(1, std::ssize(variables), -1e-3);
  };
  const LinearModel linear = linearize(m, {VectorXd::Constant(1, 1.0), VectorXd(), VectorXd()});
  CHECK(linear.status == LinearizeStatus::linear);
  CHECK(linear.A(0, 0) == -1e-3);
  CHECK(linear.A_error(0, 0) < 1e-12);
}

}  // namespace linearize_test
