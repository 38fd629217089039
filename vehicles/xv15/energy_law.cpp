// The total-energy control law around the XV-15.
#include <array>
#include <cmath>
#include <numbers>

#include "model/exact.hpp"
#include "model/feedback.hpp"
#include "vehicles/mode_names.hpp"
#include "vehicles/xv15/scalar_functions.hpp"
#include "vehicles/xv15/xv15.hpp"

namespace tiltrim::xv15 {

namespace {

// Inputs in order: what the plant measures.
enum Measured { forward_error, climb_error, pitch, pitch_rate, nacelle, inflow };
// Then what is added to its commands.
enum Added { to_collective = inflow + 1, to_stick };

// Gains in helicopter mode, then in airplane mode: linear over the nacelle angle.
constexpr std::array gain_names{"k_V", "k_h", "K_Ep", "K_Ei", "K_Lp", "K_Li", "k_p", "k_d"};
constexpr std::array gain_units{"1/s", "s/m", "rad", "rad/s", "in", "in/s", "in/rad", "in s/rad"};
constexpr std::array<std::array<double, 2>, gain_names.size()> default_gains{
    {{0.25, 0.25}, {0.04, 0.0125}, {0.3, 0.4}, {0.1, 0.1}, {12, 8}, {1.5, 1.5}, {14, 8}, {16, 5}}};

// With V_err and climb_err the commanded less the flown (the errors' negatives):
//   He = k_V V_err/g + k_h climb_err,  Le = k_V V_err/g - k_h climb_err
//   collective = inflow angle commanded + x1 + K_Ep He,  x1' = K_Ei He
//   stick = neutral + x2 + K_Lp Le + k_p theta + k_d q,  x2' = K_Li Le
// The integrals carry their gains, so that a schedule moves no control.
template <class S>
struct Law {
  S k_V, k_h, K_Ep, K_Ei, K_Lp, K_Li, k_p, k_d, He, Le;

  Law(std::span<const S> u, std::span<const S> p) {
    const std::array all{&k_V, &k_h, &K_Ep, &K_Ei, &K_Lp, &K_Li, &k_p, &k_d};
    const S share = u[nacelle] * (2 / std::numbers::pi);  // 1 in helicopter mode
    for (std::size_t k = 0; k < all.size(); ++k)
      *all[k] = p[2 * k + 1] + share * (p[2 * k] - p[2 * k + 1]);
    constexpr double g = 9.80665;
    const S speed = -(k_V * u[forward_error]) * (1 / g), climb = -(k_h * u[climb_error]);
    He = speed + climb;
    Le = speed - climb;
  }
};

struct LawRates {
  template <class S>
  void operator()(std::span<const S>, std::span<const S> u, std::span<const S> p,
                  std::span<S> rates) const {
    const Law<S> law(u, p);
    rates[0] = law.K_Ei * law.He;
    rates[1] = law.K_Li * law.Le;
  }
};

struct LawOutputs {
  template <class S>
  void operator()(std::span<const S> x, std::span<const S> u, std::span<const S> p,
                  std::span<S> y) const {
    constexpr double neutral = 4.8;  // in
    const Law<S> law(u, p);
    const S collective = u[inflow] + x[0] + law.K_Ep * law.He;
    const S stick =
        neutral + x[1] + law.K_Lp * law.Le + law.k_p * u[pitch] + law.k_d * u[pitch_rate];
    y[0] = collective + u[to_collective];
    y[1] = stick + u[to_stick];
    y[2] = collective;
    y[3] = stick;
  }
};

Model energy_law() {
  Model m;
  m.name = "total-energy control law";
  m.states = {{"energy_integral", "rad", 0.1}, {"distribution_integral", "in", 1.0}};
  m.inputs = {{"forward_error", "m/s", 1.0},
              {"climb_error", "m/s", 1.0},
              {"theta", "rad", 0.1},
              {"q", "rad/s", 0.1},
              {"nacelle_angle", "rad", 0.1},
              {"commanded_inflow_angle", "rad", 0.1},
              {"collective_added", "rad", 0.1},
              {"stick_added", "in", 1.0}};
  m.outputs = {{"collective", "rad", 0.1},
               {"stick", "in", 1.0},
               {"collective_command", "rad", 0.1},
               {"stick_command", "in", 1.0}};
  for (std::size_t k = 0; k < gain_names.size(); ++k)
    for (const char* mode : {"_helicopter", "_airplane"})
      m.parameters.push_back({std::string(gain_names[k]) + mode, gain_units[k],
                              default_gains[k][mode == std::string("_airplane")] / 10});
  return exact_model(m, LawRates{}, LawOutputs{});
}

}  // namespace

Model closed_loop(const std::shared_ptr<const Data>& data) {
  Model loop = feedback(model(data), energy_law());
  loop.name = "XV-15 under total-energy control";
  loop.mode_names = aircraft_modes();
  return loop;
}

Eigen::VectorXd closed_loop_parameters(const Data& data) {
  const Eigen::VectorXd own = parameters(data);
  Eigen::VectorXd p(own.size() + Eigen::Index(2 * gain_names.size()));
  p.head(own.size()) = own;
  for (std::size_t k = 0; k < gain_names.size(); ++k)
    for (std::size_t mode = 0; mode < 2; ++mode)
      p[own.size() + Eigen::Index(2 * k + mode)] = default_gains[k][mode];
  return p;
}

}  // namespace tiltrim::xv15
