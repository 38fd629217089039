#include "flight/closed_loop_proof.hpp"

#include <algorithm>
#include <cmath>

#include "model/lookup.hpp"
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

// Starting values of theta and the integrals: a trim at this point.
std::optional<VectorXd> trimmed(const Vehicle& vehicle, const Numbers& numbers, const VectorXd& c) {
  const std::vector<double> p = numbers.on(std::vector<double>(c.begin(), c.end()));
  const auto [there, command] =
      vehicle_from(vehicle, Eigen::Map<const VectorXd>(p.data(), std::ssize(p)));
  const TrimProblem problem = closed_loop_problem(there, command, Axes::wind);
  TrimOptions options;
  options.max_boxes = 0;
  options.closest = false;
  const TrimResult found = trim(problem.model, problem.spec, problem.guess, options);
  if (!is_equilibrium(found.status)) return {};
  return VectorXd{{found.point.x[2], found.point.x[4], found.point.x[5]}};
}

// The bare airframe at the command, with the inputs that the tilt allows.
NecessarySystem bare_airframe(const Vehicle& vehicle, const Numbers& numbers) {
  NecessarySystem system{airframe(vehicle, Axes::wind), {"V", "gamma", "q"}, {}, {}};
  const Limits& limits = vehicle.limits;
  system.unknowns = {{"theta", limits.theta},
                     {"theta0", limits.theta0},
                     {"a1s", limits.a1s},
                     {"delta_e", limits.delta_e}};
  system.at = [numbers](const Jets& c) {
    const Jets p = numbers.on(c);
    const auto aircraft = physics::aircraft_fields<Jet>().size();
    NecessarySystem::Values at;
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
                               const std::vector<ProveParameter>& parameters) {
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
  for (const ProveParameter& parameter : parameters)
    numbers.at.push_back(
        parameter.key == "h" ? -1 : index_of(problem.model.parameters, parameter.key, "parameter"));
  problem.numbers = [numbers](const Jets& c) { return numbers.on(c); };
  const bool bounded = std::ranges::all_of(problem.limits, [](const auto& limit) {
    return std::isfinite(limit.second.lower) && std::isfinite(limit.second.upper);
  });
  if (bounded && vehicle.equations == Equations::consistent)
    problem.necessary = bare_airframe(vehicle, numbers);
  problem.start = [vehicle, numbers](const VectorXd& c) { return trimmed(vehicle, numbers, c); };
  return problem;
}

}  // namespace tiltrim
