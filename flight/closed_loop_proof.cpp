#include "flight/closed_loop_proof.hpp"

#include <algorithm>
#include <cmath>

#include "model/lookup.hpp"
#include "vehicles/tiltrotor/closed_loop.hpp"
#include "vehicles/tiltrotor/command.hpp"
#include "vehicles/tiltrotor/corridor.hpp"
#include "vehicles/tiltrotor/formulations.hpp"
#include "vehicles/tiltrotor/numbers.hpp"
#include "vehicles/tiltrotor/physics.hpp"

namespace tiltrim {

using Eigen::Index;
using Eigen::VectorXd;

namespace {

// The loop's parameters at values of the varied ones, on any scalar.
struct Numbers {
  VectorXd base;
  GainSchedule schedule;
  std::vector<Index> at;  // of each varied parameter; -1: height

  template <class S>
  std::vector<S> on(const std::vector<S>& c) const {
    std::vector<S> p(base.begin(), base.end());
    for (std::size_t k = 0; k < at.size(); ++k) {
      if (at[k] >= 0) continue;
      const CommandOf<S> command = physics::corridor_at(c[k]);
      p[0] = command.V;
      p[1] = command.gamma;
      p[2] = command.eta;
    }
    for (std::size_t k = 0; k < at.size(); ++k)
      if (at[k] >= 0 && at[k] < 3) p[std::size_t(at[k])] = c[k];
    if (!schedule.eta.empty()) {
      const GainsOf<S> gains = physics::scheduled(schedule, p[2]);
      constexpr auto fields = physics::gain_fields<S>();
      for (std::size_t j = 0; j < fields.size(); ++j)
        p[p.size() - fields.size() + j] = gains.*(fields[j].member);
    }
    for (std::size_t k = 0; k < at.size(); ++k)
      if (at[k] >= 3) p[std::size_t(at[k])] = c[k];
    return p;
  }
};

// A trim at values c of the varied parameters.
std::optional<TrimResult> trimmed(const Vehicle& vehicle, const Numbers& numbers,
                                  const VectorXd& c) {
  const std::vector<double> p = numbers.on(std::vector<double>(c.begin(), c.end()));
  const auto [there, command] =
      vehicle_from(vehicle, Eigen::Map<const VectorXd>(p.data(), std::ssize(p)));
  const TrimProblem problem = closed_loop_problem(there, command, Axes::wind);
  TrimOptions options;
  options.method = TrimMethod::newton;
  options.max_boxes = 0;
  options.closest = false;
  TrimResult found = trim(problem.model, problem.spec, problem.guess, options);
  if (!is_equilibrium(found.status)) return {};
  return found;
}

// [f; h] of the loop whose inputs are theta0 and the deflection of the actuator that controls
// pitch.
template <physics::LoopInputs inputs>
std::vector<Jet> about_trim(const std::shared_ptr<const Polar>& polar, const std::vector<Jet>& x,
                            const std::vector<Jet>& u, const std::vector<Jet>& p) {
  const physics::WindLoop<inputs> loop{polar, Equations::consistent};
  constexpr std::size_t states = loop.sizes.states;
  std::vector<Jet> all(states + loop.sizes.outputs);
  loop(x.data(), u.data(), p.data(), all.data(), all.data() + states);
  return all;
}

// Whether theta0 and one deflection determine both integrals everywhere in the box: then theta and
// they are the unknowns, since the airframe's trim does not depend on the gains.
bool integrals_follow(const Vehicle& vehicle, const Numbers& numbers,
                      const std::vector<Uncertain>& parameters) {
  if (vehicle.equations != Equations::consistent || vehicle.aircraft.cyclic_blend > 0) return false;
  const auto one_sign = [&](const std::string& key, double Gains::*gain, double constant) {
    std::vector<double> values{constant};
    if (!numbers.schedule.eta.empty()) values.clear();
    for (const Gains& gains : numbers.schedule.gains) values.push_back(gains.*gain);
    for (const Uncertain& p : parameters)
      if (p.name == key) values.insert(values.end(), {p.lower, p.upper});
    return std::ranges::all_of(values, [](double k) { return k > 0; }) ||
           std::ranges::all_of(values, [](double k) { return k < 0; });
  };
  return std::ranges::none_of(parameters,
                              [](const auto& p) { return p.name == "aircraft.cyclic_blend"; }) &&
         one_sign("gains.K_Ei", &Gains::K_Ei, vehicle.gains.K_Ei) &&
         one_sign("gains.K_Li", &Gains::K_Li, vehicle.gains.K_Li);
}

// theta, theta0 and the deflection at a trim.
void solve_for_actuators(ProveProblem& problem, const Vehicle& vehicle, const Numbers& numbers) {
  problem.model.inputs = {{"theta0", "", 0.1}, {"deflection", "rad", 0.1}};
  problem.model.jets = [polar = vehicle.polar](const std::vector<Jet>& x, const std::vector<Jet>& u,
                                               const std::vector<Jet>& p) {
    return about_trim<physics::LoopInputs::feedback>(polar, x, u, p);
  };
  problem.trim = [polar = vehicle.polar](const std::vector<Jet>& x, const std::vector<Jet>& u,
                                         const std::vector<Jet>& p) {
    return about_trim<physics::LoopInputs::trim>(polar, x, u, p);
  };
  problem.unknowns = {"theta", "theta0", "deflection"};
  problem.guess.u = VectorXd::Zero(2);
  problem.start = [vehicle, numbers](const VectorXd& c) -> std::optional<VectorXd> {
    const auto found = trimmed(vehicle, numbers, c);
    if (!found) return {};
    return VectorXd{{found->point.x[2], found->outputs[0], found->outputs[1] + found->outputs[2]}};
  };
}

// The bare airframe at the command, with the inputs that the tilt allows.
ProveProblem::NecessarySystem bare_airframe(const Vehicle& vehicle, const Numbers& numbers) {
  ProveProblem::NecessarySystem system{airframe(vehicle, Axes::wind), {"V", "gamma", "q"}, {}, {}};
  const Limits& limits = vehicle.limits;
  system.unknowns = {{"theta", limits.theta},
                     {"theta0", limits.theta0},
                     {"a1s", limits.a1s},
                     {"delta_e", limits.delta_e}};
  system.at = [numbers](const std::vector<Jet>& c) {
    const std::vector<Jet> p = numbers.on(c);
    const auto aircraft = physics::aircraft_fields<Jet>().size();
    ProveProblem::NecessarySystem::Values at;
    at.p.assign(p.begin() + 3, p.begin() + 3 + std::ptrdiff_t(aircraft));
    at.x = {p[0], p[1], Jet(), Jet()};
    at.u = {Jet(), Jet(), Jet(), p[2]};
    const Jet s = physics::authority_at(
        p[2], physics::unpack<AircraftOf<Jet>, physics::aircraft_fields<Jet>>(at.p.data()));
    at.fixed = {0, 0, char(s.constant() && magnitude(s.range()) == 0),
                char(s.constant() && magnitude(s.range() - 1.0) == 0)};
    return at;
  };
  return system;
}

}  // namespace

ProveProblem closed_loop_proof(const Vehicle& vehicle, const GainSchedule& schedule,
                               const std::string& name, const Command& command,
                               const std::vector<Uncertain>& parameters) {
  const TrimProblem closed = closed_loop_problem(vehicle, command, Axes::wind);
  ProveProblem problem;
  problem.name = name;
  problem.model = closed.model;
  problem.unknowns = {"theta", "energy_integral", "distribution_integral"};
  problem.equations = {"V_err", "gamma_err", "q"};
  problem.guess = closed.guess;
  problem.limits = {{"theta0", vehicle.limits.theta0},
                    {"a1s", vehicle.limits.a1s},
                    {"delta_e", vehicle.limits.delta_e},
                    {"theta", vehicle.limits.theta}};
  problem.parameters = parameters;
  Numbers numbers{closed.guess.p, schedule, {}};
  for (const Uncertain& parameter : parameters)
    numbers.at.push_back(parameter.name == "h"
                             ? -1
                             : index_of(problem.model.parameters, parameter.name, "parameter"));
  problem.numbers = [numbers](const std::vector<Jet>& c) { return numbers.on(c); };
  const bool bounded = std::ranges::all_of(problem.limits, [](const auto& limit) {
    return std::isfinite(limit.second.lower) && std::isfinite(limit.second.upper);
  });
  if (bounded && vehicle.equations == Equations::consistent)
    problem.necessary = bare_airframe(vehicle, numbers);
  problem.start = [vehicle, numbers](const VectorXd& c) -> std::optional<VectorXd> {
    const auto found = trimmed(vehicle, numbers, c);
    if (!found) return {};
    return VectorXd{{found->point.x[2], found->point.x[4], found->point.x[5]}};
  };
  if (integrals_follow(vehicle, numbers, parameters))
    solve_for_actuators(problem, vehicle, numbers);
  return problem;
}

}  // namespace tiltrim
