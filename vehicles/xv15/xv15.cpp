#include "vehicles/xv15/xv15.hpp"

#include <fmt/core.h>

#include <array>
#include <cmath>
#include <functional>
#include <limits>
#include <span>

#include "model/exact.hpp"
#include "vehicles/mode_names.hpp"
#include "vehicles/xv15/airframe.hpp"
#include "vehicles/xv15/data.hpp"
#include "vehicles/xv15/loads.hpp"

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

// The rotors' outputs are NaN where inflow and flapping have no balance: a control law needs what
// is measured before it has chosen the controls.
struct Outputs {
  std::shared_ptr<const Data> data;
  template <class S>
  void operator()(std::span<const S> x, std::span<const S> u, std::span<const S> p,
                  std::span<S> y) const {
    const State<S> s = state_of(x, u, p);
    const RotorInput<S> in = rotor_input(*data, s, geometry(*data, s.mast), u[0]);
    motion_outputs(*data, s, in.B1, x, p, y);
    const S none(std::numeric_limits<double>::quiet_NaN());
    RotorAnswer<S> at{{none, none, none}, {none, none, none, none, none}, none};
    try {
      at = rotor(in, *data);
    } catch (const std::domain_error&) {
    }
    rotor_outputs(at, y);
  }
};

// Both, for derivatives at the cost of one.
struct RatesAndOutputs {
  std::shared_ptr<const Data> data;
  template <class S>
  void operator()(std::span<const S> x, std::span<const S> u, std::span<const S> p,
                  std::span<S> all) const {
    const Turning<S> at = turning(*data, x, u, p);
    rates_of(*data, at, x, p, all.first(4));
    motion_outputs(*data, at.s, at.input.B1, x, p, all.subspan(4));
    rotor_outputs(at.rotor, all.subspan(4));
  }
};

Load plain(const LoadOf<double>& load) { return {load.X, load.Z, load.M}; }

using Imbalance = std::function<double(double collective)>;

// A root of g between two collectives, by bisection and secants (Illinois).
double root(const Imbalance& g, double low, double high) {
  constexpr int most_steps = 100;
  double at_low = g(low), at_high = g(high);
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

// Where g, which grows with the collective, first passes zero. Some collectives have no balance of
// inflow and flapping, or leave the blades' tables.
double first_root(const Imbalance& g, double low, double high) {
  constexpr int parts = 60;
  std::optional<std::pair<double, double>> before;  // the last collective and its imbalance
  std::string silent;
  for (int k = 0; k <= parts; ++k) {
    const double at = low + k * (high - low) / parts;
    try {
      const double value = g(at);
      if (before && before->second <= 0 && value >= 0) return root(g, before->first, at);
      before = {at, value};
    } catch (const std::domain_error& e) {
      silent = e.what();
    }
  }
  if (!before) throw std::domain_error(silent);
  throw std::domain_error(
      fmt::format("no collective between {:.3g} and {:.3g} degrees balances the forces along the "
                  "masts",
                  low / degree, high / degree));
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
  m.mode_names = aircraft_modes();
  m.states = {{"u", "m/s", 1.0}, {"w", "m/s", 1.0}, {"theta", "rad", 0.1}, {"q", "rad/s", 0.1}};
  m.inputs = {{"collective", "rad", 0.1},
              {"stick", "in", 1.0},
              {"flap", "rad", 0.1},
              {"mast_angle", "rad", 0.1}};
  m.parameters = {{"mass", "kg", 500.0},        {"air_density", "kg/m3", 0.1},
                  {"sound_speed", "m/s", 10.0}, {"rotor_speed", "rad/s", 5.0},
                  {"gravity", "m/s2", 1.0},     {"inflow_gradient", "", 0.1},
                  {"airspeed_kt", "kt", 10.0},  {"climb_angle", "rad", 0.1}};
  m.outputs = {{"V", "m/s", 1.0},
               {"alpha", "rad", 0.1},
               {"climb", "m/s", 1.0},
               {"speed_kt", "kt", 1.0},
               {"elevator", "rad", 0.1},
               {"cyclic", "rad", 0.1},
               {"induced_velocity", "m/s", 1.0},
               {"thrust", "N", 1000.0},
               {"power", "W", 1e5},
               {"disc_tilt", "rad", 0.1},
               {"forward_error", "m/s", 1.0},
               {"climb_error", "m/s", 1.0},
               {"in_plane", "N", 1000.0},
               {"nacelle_angle", "rad", 0.1},
               {"commanded_inflow_angle", "rad", 0.1}};
  m = exact_model(m, Rates{data}, Outputs{data});
  const auto rows = Eigen::Index(m.states.size() + m.outputs.size());
  m.derivatives = [rows, both = ExactFunction(RatesAndOutputs{data})](
                      const OperatingPoint& at, const std::vector<Eigen::Index>& variables) {
    Eigen::MatrixXd all(rows, std::ssize(variables));
    both.slopes(at, variables, all);
    return all;
  };
  return m;
}

Eigen::VectorXd parameters(const Data& d) {
  Eigen::VectorXd p(8);
  p << d.mass, d.si.at("air_density_trims"), 340.294, d.si.at("rotor_speed_helicopter"),
      d.si.at("gravity_thesis"), 1.0, 0.0, 0.0;
  return p;
}

double stick_for(const Data& d, double elevator) {
  return d.stick_neutral + elevator / d.elevator_per_stick;
}

// ---- Start of a trim ----

namespace {

// A steady point by the airframe's tables and the rotor's closed form.
struct Rough {
  double collective;
  Eigen::Vector3d left;  // forces over the weight, moment over weight times mast length
};

// `z`: alpha, thrust over weight, stick over its travel.
Rough rough(const Data& d, State<double> s, double V, double climb, double weight,
            const Eigen::Vector3d& z) {
  const Geometry<double> g = geometry(d, s.mast);
  s.u = V * std::cos(z[0]);
  s.w = V * std::sin(z[0]);
  s.stick = 9.6 * z[2];
  const double thrust = 0.5 * weight * z[1], tip = s.omega * d.radius;
  const double scale = s.density * std::numbers::pi * d.radius * d.radius * tip * tip;
  const RotorInput<double> in = rotor_input(d, s, g, 0.0);
  double v = std::sqrt(std::max(thrust, 0.0) / scale / 2) * tip;
  for (int step = 0; step < 8; ++step)  // T = 2 rho A v sqrt(V_e² + (V_n + v)²)
    v = 0.5 * (v + thrust / (2 * scale / (tip * tip)) / std::hypot(in.V_e, in.V_n + v, 1.0));
  const double mu = in.V_e / tip, lambda = (in.V_n + v) / tip;
  // The closed form's pitch for this thrust; about the inflow angle where that is large.
  const SimpleBlade none = simple_blade(d, 0);
  const double root = (2 * thrust / scale / (d.solidity * none.lift_slope) + lambda / 2 -
                       none.twist * (1 + mu * mu) / 4 + mu * in.B1 / 2) /
                      (1.0 / 3 + mu * mu / 2);
  const bool slow = in.V_n < closed_form_inflow * tip;
  const double loaded = 6 * thrust / scale / (d.solidity * none.lift_slope);
  const double collective =
      slow ? root + 0.75 * none.twist : std::atan(lambda / 0.75) + 0.75 * loaded;
  const ClosedForm form =
      closed_form(simple_blade(d, collective), mu, lambda, 0, in.B1, std::tan(d.delta3));
  const double in_plane = slow ? form.CH * scale : 0.0;
  const LoadOf<double> F = sums(d, s, g, thrust, in_plane, v).total;
  const double theta = z[0] + climb;
  return {collective,
          {F.X / weight - std::sin(theta), F.Z / weight + std::cos(theta),
           F.M / weight / d.mast_length}};
}

struct RoughTrim {
  Start start;
  double left;  // as Rough::left, the largest
};

// By Newton's method from z; none where the tables are silent at z.
std::optional<RoughTrim> rough_trim(const Data& d, const State<double>& s, double V, double climb,
                                    double weight, Eigen::Vector3d z) {
  constexpr int most_steps = 4, with_slopes = 2;  // the later steps keep the slopes
  constexpr double difference = 1e-5, largest = 0.3;
  Eigen::Matrix3d J;
  std::optional<RoughTrim> found;
  try {
    for (int step = 0; step <= most_steps; ++step) {
      const Rough here = rough(d, s, V, climb, weight, z);
      found = {{z[0] + climb, here.collective, std::clamp(9.6 * z[2], 0.0, 9.6)},
               here.left.cwiseAbs().maxCoeff()};
      if (step == most_steps) break;
      for (Eigen::Index k = 0; step < with_slopes && k < 3; ++k) {
        Eigen::Vector3d moved = z;
        moved[k] += difference;
        J.col(k) = (rough(d, s, V, climb, weight, moved).left - here.left) / difference;
      }
      const Eigen::Vector3d move = inverse_of(J) * here.left;
      if (!move.allFinite()) break;
      z -= move / std::max(1.0, move.cwiseAbs().maxCoeff() / largest);
    }
  } catch (const std::domain_error&) {
    // The tables end on the way: what was found before is only a start.
  }
  return found;
}

}  // namespace

// A wing carries a fuselage that points along the path, rotors one whose masts are upright.
Start start_of(const Data& d, const OperatingPoint& at, double V, double climb) {
  constexpr double steepest = 85 * degree;  // the fuselage's tables end at 90
  const State<double> s = state_of<double>({at.x.data(), 4}, {at.u.data(), 4}, {at.p.data(), 8});
  const double weight = at.p[mass] * at.p[gravity];
  const auto from = [&](double alpha) {
    const double thrust = std::cos(s.mast) + 0.15 * std::sin(s.mast);
    return rough_trim(d, s, V, climb, weight, {alpha, thrust, 0.5});
  };
  const auto along = from(0.0);
  const auto upright =
      climb == 0 ? std::nullopt : from(std::clamp(s.mast - climb, -steepest, steepest));
  if (upright && (!along || upright->left < along->left)) return upright->start;
  if (along) return along->start;
  return {climb, 8 * degree + std::atan(V * std::sin(s.mast) / 176), d.stick_neutral};
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
    const double theta = x[2], weight = p[mass] * p[gravity];
    const Sums<double> all = summed(turning(collective));
    return (all.total.X - weight * std::sin(theta)) * g.sin -
           (all.total.Z + weight * std::cos(theta)) * g.cos;
  };
  const double inflow = (hub_motion(s, g).V_n) / (s.omega * d.radius * 0.75);
  const double centre = std::atan(inflow);
  const double collective = asked.collective
                                ? *asked.collective
                                : first_root(imbalance, centre - 10 * degree, centre + 20 * degree);
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
