#include "vehicles/tiltrotor/formulations.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>

#include "model/lookup.hpp"
#include "runtime/rounding.hpp"
#include "trim/proof.hpp"
#include "vehicles/tiltrotor/along.hpp"
#include "vehicles/tiltrotor/corridor.hpp"
#include "vehicles/tiltrotor/numbers.hpp"
#include "vehicles/tiltrotor/table_trim.hpp"

namespace tiltrim {

using Eigen::Index;
using Eigen::VectorXd;

namespace {

// The range of y = slope x + offset for ranges of x and offset.
Range affine(const Range& x, double slope, const Range& offset) {
  const double a = slope * x.lower, b = slope * x.upper;
  return {std::min(a, b) + offset.lower, std::max(a, b) + offset.upper};
}

Range cut(const Range& a, const Range& b) {
  const Range both{std::max(a.lower, b.lower), std::min(a.upper, b.upper)};
  return both.lower <= both.upper ? both : a;
}

// The steady integrals that (13), (12) and (9) allow while theta and the actuators are within their
// limits. An integral whose gain is zero has no effect and is unbounded.
struct Integrals {
  Range x1, x2;
};

Integrals integral_bounds(const Vehicle& v, const Command& d) {
  const Aircraft& a = v.aircraft;
  const Gains& k = v.gains;
  const double pressure = 0.5 * a.air_density * d.V * d.V * a.wing_area / (a.mass * a.gravity);
  const Range CD = v.polar->range(-std::numbers::pi, std::numbers::pi)[1];
  const Range common = affine(CD, pressure, {std::sin(d.gamma), std::sin(d.gamma)});
  const double s = authority(a, d.eta);
  Integrals bounds;
  if (k.K_Ei != 0) {
    // x₁ = ((1 + Ep K_Ep) θ₀ - K_Ep common) / K_Ei
    const Range offset = affine(common, -k.K_Ep / k.K_Ei, {0, 0});
    bounds.x1 = affine(v.limits.theta0, (1 + a.thrust_excess * k.K_Ep) / k.K_Ei, offset);
  }
  if (k.K_Li != 0 && s > 0) {
    // x₂ = ((1 + K_Lp) (a1s/s - k_pa θ) - K_Lp common) / K_Li
    const Range law = affine(common, -k.K_Lp / k.K_Li, {0, 0});
    const Range pitch = affine(v.limits.theta, -(1 + k.K_Lp) * k.k_pa / k.K_Li, law);
    bounds.x2 = affine(v.limits.a1s, (1 + k.K_Lp) / (s * k.K_Li), pitch);
  }
  if (k.K_Li != 0 && s < 1) {
    // x₂ = (δe/(1 - s) - k_pe θ) / K_Li, since Le = 0
    const Range pitch = affine(v.limits.theta, -k.k_pe / k.K_Li, {0, 0});
    bounds.x2 = cut(bounds.x2, affine(v.limits.delta_e, 1 / ((1 - s) * k.K_Li), pitch));
  }
  return bounds;
}

double middle(const Range& r) {
  return std::isfinite(r.lower) && std::isfinite(r.upper) ? 0.5 * (r.lower + r.upper) : 0.0;
}

// The starting point: an attitude, and the thrust that balances drag and weight along the path.
struct FirstGuess {
  double theta, theta0, drag_over_weight;
};

FirstGuess first_guess(const Vehicle& v, double V, double gamma, double eta) {
  // In airplane mode the nose follows the path, in helicopter mode it stays nearly level.
  constexpr double incidence = 0.1;  // rad
  const Aircraft& a = v.aircraft;
  const double on_rotors = std::clamp(eta / (std::numbers::pi / 2), 0.0, 1.0);
  const double theta = std::clamp(gamma * (1 - on_rotors * on_rotors) + incidence,
                                  v.limits.theta.lower, v.limits.theta.upper);
  const double alpha = theta - gamma;
  const double drag = 0.5 * a.air_density * V * V * a.wing_area * v.polar->at(alpha).CD;
  const double along = std::max(std::cos(alpha + eta), 0.2);  // T cos φ = D + m g sin γ
  const double theta0 = (std::sin(gamma) + drag / (a.mass * a.gravity)) / (a.thrust_excess * along);
  return {theta, std::clamp(theta0, v.limits.theta0.lower, v.limits.theta0.upper),
          drag / (a.mass * a.gravity)};
}

// The integrals for which (13), (12) and (9) give this thrust, and zero cyclic and elevator.
Eigen::Vector2d first_integrals(const Vehicle& v, const Command& d, const FirstGuess& first) {
  const Gains& k = v.gains;
  const double common = std::sin(d.gamma) + first.drag_over_weight;
  const double x1 =
      ((1 + v.aircraft.thrust_excess * k.K_Ep) * first.theta0 - k.K_Ep * common) / k.K_Ei;
  const bool cyclic = authority(v.aircraft, d.eta) > 0;
  const double x2 = cyclic ? (-(1 + k.K_Lp) * k.k_pa * first.theta - k.K_Lp * common) / k.K_Li
                           : -k.k_pe * first.theta / k.K_Li;
  return {std::isfinite(x1) ? x1 : 0.0, std::isfinite(x2) ? x2 : 0.0};
}

void bound_actuators(TrimSpec& spec, const Limits& limits) {
  spec.bounds["theta0"] = limits.theta0;
  spec.bounds["a1s"] = limits.a1s;
  spec.bounds["delta_e"] = limits.delta_e;
  spec.bounds["theta"] = limits.theta;
}

// theta0² + (a1s/0.35)² + (delta_e/0.53)², each over its limit.
std::vector<CostTerm> control_effort(const Limits& limits) {
  const auto most = [](const Range& r) {
    const double size = std::max(std::abs(r.lower), std::abs(r.upper));
    return std::isfinite(size) && size > 0 ? size : 1.0;
  };
  return {{"theta0", most(limits.theta0)},
          {"a1s", most(limits.a1s)},
          {"delta_e", most(limits.delta_e)}};
}

}  // namespace

TrimProblem closed_loop_problem(const Vehicle& vehicle, const Command& command) {
  const RoundToNearest environment;
  const bool slow = command.V < body_axes_below;
  return closed_loop_problem(vehicle, command, slow ? Axes::body : Axes::wind);
}

TrimProblem closed_loop_problem(const Vehicle& vehicle, const Command& command, Axes axes) {
  const RoundToNearest environment;
  TrimProblem problem{closed_loop(vehicle, axes), {}, {}};
  const auto [x1, x2] = integral_bounds(vehicle, command);
  const FirstGuess first = first_guess(vehicle, command.V, command.gamma, command.eta);
  const double alpha = first.theta - command.gamma;
  TrimSpec& spec = problem.spec;
  spec.free = {"theta", "energy_integral", "distribution_integral"};
  spec.steady = {"q"};
  spec.implied = {"theta", "energy_integral", "distribution_integral"};
  if (axes == Axes::wind) {
    spec.steady.insert(spec.steady.end(), {"V_err", "gamma_err"});
  } else {
    spec.steady.insert(spec.steady.end(), {"u", "w"});
    if (command.V > 0) {
      spec.free.insert(spec.free.end(), {"u", "w"});
      spec.bounds["airspeed"] = {command.V, command.V};
      spec.bounds["flight_path"] = {command.gamma, command.gamma};
    }
  }
  bound_actuators(spec, vehicle.limits);
  spec.bounds["energy_integral"] = x1;
  spec.bounds["distribution_integral"] = x2;
  spec.effort = control_effort(vehicle.limits);
  problem.guess.x = VectorXd::Zero(6);
  if (axes == Axes::body) {
    problem.guess.x[0] = command.V * std::cos(alpha);
    problem.guess.x[1] = command.V * std::sin(alpha);
  }
  problem.guess.x[2] = first.theta;
  problem.guess.x.tail<2>() = first_integrals(vehicle, command, first);
  problem.guess.u.resize(0);
  problem.guess.p = closed_loop_parameters(vehicle, command);
  return problem;
}

namespace {

// The closed loop at any nonzero speed. The command alone sets the speed: zero energy errors
// already imply speed and path, so neither is constrained a second time.
TrimProblem body_axes_problem(const Vehicle& vehicle, const Command& command) {
  TrimProblem problem = closed_loop_problem(vehicle, command, Axes::body);
  problem.spec.bounds.erase("airspeed");
  problem.spec.bounds.erase("flight_path");
  problem.spec.free = {"u", "w", "theta", "energy_integral", "distribution_integral"};
  problem.spec.steady = {"u", "w", "q", "energy_integral", "distribution_integral"};
  problem.spec.implied = {"theta"};
  return problem;
}

}  // namespace

// The integrals' bounds follow from those of the actuators at the condition's speed and path, and
// serve its starts; along a branch they do not hold and must not limit it.
TrimProblem without_integral_bounds(TrimProblem problem) {
  const RoundToNearest environment;
  problem.spec.bounds.erase("energy_integral");
  problem.spec.bounds.erase("distribution_integral");
  return problem;
}

TrimProblem closed_loop_along(const Vehicle& vehicle, const Command& command, double slowest) {
  const RoundToNearest environment;
  const bool slow = slowest < body_axes_below;
  if (slow && command.V == 0)
    throw std::invalid_argument(
        "at rest there is no path angle to continue from; expected V above 0");
  return without_integral_bounds(slow ? body_axes_problem(vehicle, command)
                                      : closed_loop_problem(vehicle, command));
}

TrimResult trim_closed_loop(const Vehicle& vehicle, const Command& command,
                            const TrimOptions& options) {
  return trim_closed_loop(closed_loop_problem(vehicle, command), vehicle, command, options);
}

namespace {

// No control law can hold what the airframe cannot: the bare airframe, with the inputs available at
// this tilt.
TrimProblem airframe_alone(const Vehicle& vehicle, const Command& command) {
  const double s = authority(vehicle.aircraft, command.eta);
  AirframeCondition alone;
  alone.values = {{"V", {command.V, command.V}},
                  {"gamma", {command.gamma, command.gamma}},
                  {"eta", {command.eta, command.eta}}};
  if (s == 0) alone.values["a1s"] = {0, 0};
  if (s == 1) alone.values["delta_e"] = {0, 0};
  // Wind axes unless at rest: only they have an enclosure.
  return airframe_problem(vehicle, alone, command.V > 0 ? Axes::wind : Axes::body);
}

bool found_at_once(const TrimProblem& problem, TrimOptions options) {
  options.method = TrimMethod::newton;
  options.starts = options.max_boxes = 0;
  options.observe = {};
  return bool(trim(problem.model, problem.spec, problem.guess, options));
}

}  // namespace

TrimResult trim_closed_loop(const TrimProblem& problem, const Vehicle& vehicle,
                            const Command& command, const TrimOptions& options) {
  const auto whatever_the_law = [](TrimResult result, const std::string& none) {
    result.status = TrimStatus::infeasible;
    result.message = "whatever the control law does, " + none;
    return result;
  };
  if (!found_at_once(problem, options)) {
    const TrimProblem airframe = airframe_alone(vehicle, command);
    TrimOptions briefly = options;
    if (options.closest) briefly.max_boxes = std::min(options.max_boxes, boxes_before_search);
    if (proved_infeasible(airframe.model, airframe.spec, airframe.guess, briefly)) {
      TrimResult nowhere, open;
      nowhere.point = problem.guess;
      if (options.closest) {
        nowhere = closest_point(problem.model, problem.spec, problem.guess, options);
        open = trim(airframe.model, airframe.spec, airframe.guess, options);
      }
      return whatever_the_law(nowhere, open.status == TrimStatus::infeasible
                                           ? open.message
                                           : "no point within the limits is an equilibrium");
    }
  }
  TrimResult result = trim(problem.model, problem.spec, problem.guess, options);
  if (result.status != TrimStatus::not_found) return result;
  const TrimProblem airframe = airframe_alone(vehicle, command);
  const TrimResult open = trim(airframe.model, airframe.spec, airframe.guess, options);
  return open.status == TrimStatus::infeasible ? whatever_the_law(result, open.message) : result;
}

TrimProblem airframe_problem(const Vehicle& vehicle, const AirframeCondition& condition) {
  const RoundToNearest environment;
  const auto V = condition.values.find("V");
  const bool slow = V != condition.values.end() && V->second.upper < body_axes_below;
  return airframe_problem(vehicle, condition, slow ? Axes::body : Axes::wind);
}

namespace {

// The condition's ranges with defaults: level path, no pitch rate, the limits.
std::map<std::string, Range> all_values(const Vehicle& vehicle,
                                        const AirframeCondition& condition) {
  static const std::vector<std::string> known = {"V",   "gamma",  "alpha", "theta",  "q",
                                                 "eta", "theta0", "a1s",   "delta_e"};
  for (const auto& [name, range] : condition.values)
    if (std::ranges::find(known, name) == known.end())
      throw std::invalid_argument(
          fmt::format("no airframe variable '{}'{}", name,
                      "; there are: V, gamma, alpha, theta, q, eta, theta0, "
                      "a1s, delta_e"));
  std::map<std::string, Range> values = condition.values;
  for (const char* needed : {"V", "eta"})
    if (!values.contains(needed))
      throw std::invalid_argument(fmt::format("the airframe condition needs '{}'", needed));
  values.emplace("gamma", Range{0, 0});
  values.emplace("q", Range{0, 0});
  const auto limit = [&](const char* name, const Range& range) {
    Range& r = values.emplace(name, Range{}).first->second;
    if (!std::isfinite(r.lower)) r.lower = range.lower;
    if (!std::isfinite(r.upper)) r.upper = range.upper;
  };
  limit("theta", vehicle.limits.theta);
  limit("theta0", vehicle.limits.theta0);
  limit("a1s", vehicle.limits.a1s);
  limit("delta_e", vehicle.limits.delta_e);
  return values;
}

// The signal for V or gamma: a state in wind axes, an output in body axes.
std::string signal_behind(const Model& model, const std::string& name) {
  if (find(model.states, name) >= 0) return name;
  return name == "V" ? "airspeed" : name == "gamma" ? "flight_path" : name;
}

void check_pitch_rate(const Range& q, double theta_dot) {
  if (q.lower < q.upper || theta_dot == 0 || theta_dot == q.lower) return;
  throw std::invalid_argument(
      fmt::format("theta_dot = {:.6g} rad/s is q, which is fixed at {:.6g} rad/s; expected q = "
                  "\"free\" or the same value",
                  theta_dot, q.lower));
}

}  // namespace

TrimProblem airframe_problem(const Vehicle& vehicle, const AirframeCondition& condition,
                             Axes axes) {
  const RoundToNearest environment;
  const std::map<std::string, Range> values = all_values(vehicle, condition);
  TrimProblem problem{airframe(vehicle, axes), {}, {}};
  const Model& model = problem.model;
  problem.guess = {VectorXd::Zero(4), VectorXd::Zero(4), airframe_parameters(vehicle)};
  TrimSpec& spec = problem.spec;
  const bool at_rest = axes == Axes::body && values.at("V").upper == 0;
  for (const auto& [name, range] : values) {
    if (at_rest && (name == "V" || name == "gamma" || name == "alpha")) continue;
    const bool is_variable = find(model.states, name) >= 0 || find(model.inputs, name) >= 0;
    spec.bounds[signal_behind(model, name)] = range;
    if (!is_variable) continue;
    const double value =
        range.lower == range.upper ? range.lower : std::clamp(0.0, range.lower, range.upper);
    set_value(problem.guess, variable(model, name), value);
    if (range.lower < range.upper) spec.free.push_back(name);
  }
  const double gamma = middle(values.at("gamma"));
  const double V = std::isfinite(values.at("V").upper) ? middle(values.at("V")) : 10.0;
  const FirstGuess first = first_guess(vehicle, V, gamma, middle(values.at("eta")));
  const double theta = std::clamp(first.theta, values.at("theta").lower, values.at("theta").upper);
  set_value(problem.guess, variable(model, "theta"), theta);
  set_value(problem.guess, variable(model, "theta0"),
            std::clamp(first.theta0, values.at("theta0").lower, values.at("theta0").upper));
  if (axes == Axes::wind) {
    set_value(problem.guess, variable(model, "V"), V);
  } else if (!at_rest) {
    problem.guess.x[0] = V * std::cos(theta - gamma);
    problem.guess.x[1] = V * std::sin(theta - gamma);
    spec.free.insert(spec.free.end(), {"u", "w"});
  }
  const char* const along = axes == Axes::wind ? "V" : "u";
  const char* const across = axes == Axes::wind ? "gamma" : "w";
  for (const auto& [name, rate] : condition.rates) {
    if (name != "V" && name != "gamma" && name != "theta" && name != "q")
      throw std::invalid_argument(
          fmt::format("no rate of '{}' to hold; there are: V, gamma, theta, q", name));
    if (axes == Axes::body && (name == "V" || name == "gamma") && rate != 0)
      throw std::invalid_argument(
          fmt::format("the rate of '{}' can be held in wind axes only", name));
  }
  const auto rate = [&](const char* name) {
    const auto at = condition.rates.find(name);
    return at == condition.rates.end() ? 0.0 : at->second;
  };
  spec.rates = {{along, rate("V")}, {across, rate("gamma")}, {"q", rate("q")}};
  // theta' = q by kinematics: an equation only if q is free
  const Range& q = values.at("q");
  check_pitch_rate(q, rate("theta"));
  if (q.lower < q.upper)
    spec.rates["theta"] = rate("theta");
  else
    (q.lower == 0 ? spec.implied : spec.moving).push_back("theta");
  spec.effort = condition.effort.empty() ? control_effort(vehicle.limits) : condition.effort;
  for (CostTerm& e : spec.effort) e.signal = signal_behind(model, e.signal);
  return problem;
}

// As printed, lift and thrust accelerate the path downwards.
Model table_model(const TableCondition& c, double Ep) {
  const RoundToNearest environment;
  Model model;
  model.name = "rows 1 and 2 of (15), coefficients given";
  model.states = {{"V", "", 1.0}, {"gamma", "", 1.0}};
  model.inputs = {{"theta0", "", 0.1}, {"a1s", "rad", 0.1}};
  model.f = [c, Ep](const VectorXd&, const VectorXd& u, const VectorXd&) -> VectorXd {
    const double phi = c.alpha + c.eta - u[1];
    return Eigen::Vector2d{Ep * u[0] * std::cos(phi) - c.k * c.CD - std::sin(c.gamma),
                           -Ep * u[0] * std::sin(phi) - c.k * c.CL - std::cos(c.gamma)};
  };
  return model;
}

TableTrim trim_table(const Vehicle& vehicle, const TableCondition& c, const TrimOptions& options) {
  const RoundToNearest environment;
  const Aircraft& a = vehicle.aircraft;
  const double Ep = a.thrust_excess;
  TrimSpec spec;
  spec.free = {"theta0", "a1s"};
  spec.steady = {"V", "gamma"};
  spec.bounds = {{"theta0", {-1.0, 1.0}}, {"a1s", vehicle.limits.a1s}};
  const OperatingPoint guess{VectorXd::Zero(2), Eigen::Vector2d{-0.5, 0.0}, VectorXd()};
  TableTrim table{trim(table_model(c, Ep), spec, guess, options), 0, 0, 0, 0};
  table.theta0 = table.trim.point.u[0];
  table.a1s = table.trim.point.u[1];
  // Third row of (15), over Q S c̄ = k m g c̄:  (xR sin(η - a1s) - zH sin a1s) Ep θ₀ + k c̄ CM = 0
  const double hub = a.rotor_x * std::sin(c.eta - table.a1s) - a.rotor_z * std::sin(table.a1s);
  table.CM_required = -hub * Ep * table.theta0 / (c.k * a.chord);
  table.CM_elevator = table.CM_required - c.CM;
  return table;
}

}  // namespace tiltrim
