// Cost of exact derivatives of a user-defined model compared with differences: an aircraft with
// four longitudinal states and two inputs, its functions written for double and for any scalar.
#include <benchmark/benchmark.h>

#include <chrono>
#include <cmath>

#include "model/differentiate.hpp"
#include "model/exact.hpp"

using namespace tiltrim;

namespace {

using Eigen::VectorXd;

// m V' = T cos α - D - m g sin γ,   m V γ' = T sin α + L - m g cos γ,   θ' = q,   Iyy q' = M
struct Longitudinal {
  template <class X, class U, class P, class R>
  void operator()(const X& x, const U& u, const P& p, R&& rates) const {
    using std::sin, std::cos;
    const auto& V = x[0];
    const auto& q = x[3];
    const auto alpha = x[2] - x[1];
    const auto Q = 0.5 * p[0] * V * V * p[1];
    const auto CL = 0.3 + 5.5 * alpha + 0.4 * u[1];
    const auto lift = Q * CL;
    const auto drag = Q * (0.02 + 0.05 * CL * CL);
    const auto thrust = p[2] * p[3] * u[0];
    rates[0] = (thrust * cos(alpha) - drag) / p[2] - p[3] * sin(x[1]);
    rates[1] = (thrust * sin(alpha) + lift) / (p[2] * V) - p[3] / V * cos(x[1]);
    rates[2] = q;
    rates[3] = Q * (0.05 - 1.2 * alpha - 1.5 * u[1] - 8.0 * q / V) / p[4];
  }
};

Model named() {
  Model m;
  m.states = {{"V", "m/s", 1}, {"gamma", "rad", 0.1}, {"theta", "rad", 0.1}, {"q", "rad/s", 0.1}};
  m.inputs = {{"thrust", "", 0.1}, {"elevator", "rad", 0.1}};
  m.parameters = {{"density", "kg/m³", 0.1},
                  {"area", "m²", 0.1},
                  {"mass", "kg", 1},
                  {"gravity", "m/s²", 1},
                  {"inertia", "kg m²", 1}};
  return m;
}

Model on_double() {
  Model m = named();
  m.f = [](const VectorXd& x, const VectorXd& u, const VectorXd& p) {
    VectorXd rates(4);
    Longitudinal{}(x, u, p, rates);
    return rates;
  };
  return m;
}

OperatingPoint cruise() {
  VectorXd p(5);
  p << 1.2, 0.85, 4.0, 9.81, 0.6;
  return {Eigen::Vector4d{15.0, 0.01, 0.06, 0.02}, Eigen::Vector2d{0.1, -0.03}, p};
}

const std::vector<Eigen::Index> states_and_inputs{0, 1, 2, 3, 4, 5};

void user_model_on_double(benchmark::State& state) {
  const Model m = on_double();
  const OperatingPoint at = cruise();
  for (auto _ : state) benchmark::DoNotOptimize(m.f(at.x, at.u, at.p));
}

void user_model_on_any_scalar(benchmark::State& state) {
  const Model m = exact_model(named(), Longitudinal{});
  const OperatingPoint at = cruise();
  for (auto _ : state) benchmark::DoNotOptimize(m.f(at.x, at.u, at.p));
}

// Time of differences over that of exact derivatives, in alternation: four rates by six variables.
template <class Differences>
void differences_over_exact(benchmark::State& state, const Differences& differences) {
  using clock = std::chrono::steady_clock;
  const Model plain = on_double();
  const Model exact = exact_model(named(), Longitudinal{});
  const OperatingPoint at = cruise();
  double by_differences = 0, exactly = 0;
  for (auto _ : state) {
    const auto begun = clock::now();
    for (int k = 0; k < 100; ++k) benchmark::DoNotOptimize(differences(plain, at));
    const auto between = clock::now();
    for (int k = 0; k < 100; ++k)
      benchmark::DoNotOptimize(exact.derivatives(at, states_and_inputs));
    by_differences += std::chrono::duration<double>(between - begun).count();
    exactly += std::chrono::duration<double>(clock::now() - between).count();
  }
  const auto one = [&](double all) { return 1e9 * all / (100.0 * double(state.iterations())); };
  state.counters["exact_ns"] = one(exactly);
  state.counters["differences_ns"] = one(by_differences);
  state.counters["ratio"] = by_differences / exactly;
}

void user_model_central_over_exact(benchmark::State& state) {
  differences_over_exact(state, [](const Model& m, const OperatingPoint& at) {
    return jacobian(m, at, states_and_inputs);
  });
}

void user_model_differences_with_errors_over_exact(benchmark::State& state) {
  differences_over_exact(state, [](const Model& m, const OperatingPoint& at) {
    return difference(m, at, states_and_inputs);
  });
}

BENCHMARK(user_model_on_double);
BENCHMARK(user_model_on_any_scalar);
BENCHMARK(user_model_central_over_exact);
BENCHMARK(user_model_differences_with_errors_over_exact);

}  // namespace
