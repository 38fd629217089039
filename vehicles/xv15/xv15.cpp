#include "vehicles/xv15/xv15.hpp"

#include <fmt/core.h>

#include <array>
#include <cmath>
#include <functional>
#include <span>

#include "model/exact.hpp"
#include "vehicles/mode_names.hpp"
#include "vehicles/xv15/airframe.hpp"
#include "vehicles/xv15/data.hpp"

namespace tiltrim::xv15 {

namespace {

constexpr std::array component_names{"wing",     "fuselage", "horizontal_tail", "pylons",
                                     "spinners", "rotors",   "vertical_tails"};

struct Rates {
  std::shared_ptr<const Data> data;
  template <class S>
  void operator()(std::span<const S> x, std::span<const S> u, std::span<const S> p,
                  std::span<S> rates) const {
    rates_on<S>(*data, x, u, p, rates);
  }
};

struct Outputs {
  std::shared_ptr<const Data> data;
  template <class S>
  void operator()(std::span<const S> x, std::span<const S> u, std::span<const S> p,
                  std::span<S> y) const {
    const Whole<S> at = whole(*data, x, u, p);
    const Stream<S> f = stream(at.s);
    y[0] = f.V;
    y[1] = f.alpha;
    // From the components of the velocity: without the jump of theta - alpha.
    y[2] = x[0] * sin(x[2]) - x[1] * cos(x[2]);
    y[3] = f.knots;
    y[4] = data->elevator_per_stick * (u[1] - data->stick_neutral);
    y[5] = at.input.B1;
    y[6] = at.rotor.motion.v;
    y[7] = at.rotor.forces.thrust;
    y[8] = 2.0 * at.rotor.power;
    y[9] = at.rotor.motion.a1;
  }
};

Load plain(const LoadOf<double>& load) { return {load.X, load.Z, load.M}; }

// A root of g between two collectives, by bisection and secants (Illinois).
double root(const std::function<double(double)>& g, double low, double high,
            std::string_view what) {
  constexpr int most_steps = 100;
  double at_low = g(low), at_high = g(high);
  if (!(at_low * at_high <= 0))
    throw std::domain_error(fmt::format("no collective between {:.3g} and {:.3g} degrees gives {}",
                                        low / degree, high / degree, what));
  for (int step = 0; step < most_steps && std::abs(high - low) > 1e-13; ++step) {
    const double middle = high - at_high * (high - low) / (at_high - at_low);
    const double at = g(middle);
    if (at == 0) return middle;
    if (at * at_high < 0) {
      low = high;
      at_low = at_high;
    } else {
      at_low /= 2;
    }
    high = middle;
    at_high = at;
  }
  return high;
}

}  // namespace

const std::vector<std::string>& variant_names() {
  static const std::vector<std::string> names{"report_1988", "printed_1983"};
  return names;
}

std::shared_ptr<const Data> load(const std::filesystem::path& folder, Variant variant) {
  return std::make_shared<const Data>(read_data(folder, variant));
}

Model model(const std::shared_ptr<const Data>& data) {
  Model m;
  m.name = "XV-15, " + variant_names()[std::size_t(data->variant)];
  m.mode_names = longitudinal_modes();
  m.states = {{"u", "m/s", 1.0}, {"w", "m/s", 1.0}, {"theta", "rad", 0.1}, {"q", "rad/s", 0.1}};
  m.inputs = {{"collective", "rad", 0.1},
              {"stick", "in", 1.0},
              {"flap", "rad", 0.1},
              {"mast_angle", "rad", 0.1}};
  m.parameters = {{"mass", "kg", 500.0},        {"air_density", "kg/m3", 0.1},
                  {"sound_speed", "m/s", 10.0}, {"rotor_speed", "rad/s", 5.0},
                  {"gravity", "m/s2", 1.0},     {"inflow_gradient", "", 0.1}};
  m.outputs = {{"V", "m/s", 1.0},
               {"alpha", "rad", 0.1},
               {"climb", "m/s", 1.0},
               {"speed_kt", "kt", 1.0},
               {"elevator", "rad", 0.1},
               {"cyclic", "rad", 0.1},
               {"induced_velocity", "m/s", 1.0},
               {"thrust", "N", 1000.0},
               {"power", "W", 1e5},
               {"disc_tilt", "rad", 0.1}};
  return exact_model(m, Rates{data}, Outputs{data});
}

Eigen::VectorXd parameters(const Data& d) {
  Eigen::VectorXd p(6);
  p << d.mass, d.si.at("air_density_trims"), 340.294, d.si.at("rotor_speed_helicopter"),
      d.si.at("gravity_thesis"), 1.0;
  return p;
}

double stick_for(const Data& d, double elevator) {
  return d.stick_neutral + elevator / d.elevator_per_stick;
}

Loads loads(const Data& d, const OperatingPoint& point, const RotorState& asked) {
  const std::span<const double> x(point.x.data(), 4), u(point.u.data(), 4),
      p(point.p.data(), std::size_t(point.p.size()));
  const State<double> s = state_of(x, u, p);
  const Geometry<double> g = geometry(d, s.mast);
  const auto turning = [&](double collective) {
    return rotor(rotor_input(d, s, g, collective), d, asked.induced_velocity);
  };
  const auto summed = [&](const RotorAnswer<double>& at) {
    return sums(d, s, g, at.forces.thrust, at.forces.in_plane, at.motion.v);
  };
  const auto imbalance = [&](double collective) {
    const double along = std::atan2(s.w, s.u), weight = p[mass] * p[gravity];
    const Sums<double> all = summed(turning(collective));
    return (all.total.X - weight * std::sin(along)) * g.sin -
           (all.total.Z + weight * std::cos(along)) * g.cos;
  };
  const double inflow = (hub_motion(s, g).V_n) / (s.omega * d.radius * 0.75);
  const double centre = std::atan(inflow);
  const double collective = asked.collective ? *asked.collective
                                             : root(imbalance, centre - 10 * degree,
                                                    centre + 20 * degree, "level flight");
  const RotorAnswer<double> at = turning(collective);
  const Sums<double> all = summed(at);
  Loads answer;
  for (std::size_t k = 0; k < component_names.size(); ++k)
    answer.components.emplace_back(component_names[k], plain(all.parts[k]));
  answer.total = plain(all.total);
  answer.induced_velocity = at.motion.v;
  answer.thrust = at.forces.thrust;
  answer.collective = collective;
  answer.wing_alpha = all.alpha_wing;
  return answer;
}

Hover hover(const Data& d, double collective, double tip_speed) {
  const double omega = tip_speed / d.radius, rho = d.si.at("air_density_trims");
  const RotorAnswer<double> at =
      rotor(RotorInput<double>{0, 0, 0, collective, 0, omega, rho, 340.294, 0}, d);
  const double area = std::numbers::pi * d.radius * d.radius;
  const double CT = at.forces.thrust / (rho * area * tip_speed * tip_speed);
  const double CP = at.power / (rho * area * tip_speed * tip_speed * tip_speed);
  return {CT, CP, std::pow(CT, 1.5) / (std::sqrt(2.0) * CP)};
}

}  // namespace tiltrim::xv15
