#include "simulate/plan.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>

#include "simulate/schedule.hpp"
#include "simulate/weather.hpp"
#include "trim/conditions.hpp"

namespace tiltrim {

namespace {

const Condition& named(const Study& study, const std::string& name) {
  const auto at = std::ranges::find(study.conditions, name, &Condition::name);
  if (at == study.conditions.end())
    throw std::invalid_argument(fmt::format("simulate: no condition '{}'", name));
  if (at->formulation != Formulation::closed_loop)
    throw std::invalid_argument(
        fmt::format("simulate: the condition '{}' is no closed loop", name));
  return *at;
}

bool at_condition(const SimulateTable& table) {
  return !table.start.empty() && table.start != "ground" && table.start != "trim";
}

Schedule schedule_of(const Study& study, const SimulateTable& table) {
  const ScheduleTable& own = table.schedule;
  switch (own.kind) {
    case ScheduleTable::Kind::corridor:
      return {};
    case ScheduleTable::Kind::reconversion:
      return reconversion();
    case ScheduleTable::Kind::hold:
      return held(at_condition(table) ? named(study, table.start).command
                                      : study.conditions.front().command);
    case ScheduleTable::Kind::table:
      break;
  }
  Commands commands{own.at, {}};
  for (std::size_t k = 0; k < own.at.size(); ++k) {
    Command command = own.over_time ? Command{} : corridor(own.at[k]);
    if (!own.V.empty()) command.V = own.V[k];
    if (!own.gamma.empty()) command.gamma = own.gamma[k];
    if (!own.eta.empty()) command.eta = own.eta[k];
    commands.values.push_back(command);
  }
  if (own.over_time) return over_time(commands);
  Schedule schedule = over_height(commands);
  if (!own.V.empty() && !own.gamma.empty() && !own.eta.empty()) return schedule;
  // What the table leaves out is (16) itself with its kinks, not what lies between its values.
  schedule.kink_heights.clear();
  std::ranges::set_union(commands.at, Schedule{}.kink_heights,
                         std::back_inserter(schedule.kink_heights));
  schedule.command = [table_of = schedule.command, own](double t, double h) {
    Command command = table_of(t, h);
    const Command other = corridor(h);
    if (own.V.empty()) command.V = other.V;
    if (own.gamma.empty()) command.gamma = other.gamma;
    if (own.eta.empty()) command.eta = other.eta;
    return command;
  };
  return schedule;
}

std::string words(const Command& c) {
  // Zero is added because what rounds to -0 would be printed so.
  const auto degrees = [](double angle) {
    constexpr double finest = 1e-9;
    return std::round(angle * 180 / std::numbers::pi / finest) * finest + 0.0;
  };
  return fmt::format("from the trim at V = {:.4g} m/s, γ = {:.4g}°, η = {:.4g}°", c.V,
                     degrees(c.gamma), degrees(c.eta));
}

}  // namespace

void put(const std::map<std::string, double>& states, Axes axes, FlightState& x) {
  const auto given = [&](const char* name, double otherwise) {
    const auto at = states.find(name);
    return at == states.end() ? otherwise : at->second;
  };
  const bool body = axes == Axes::body;
  double V = body ? std::hypot(x.along, x.across) : x.along;
  double gamma = body ? x.theta - std::atan2(x.across, x.along) : x.across;
  V = given("V", V);
  gamma = given("gamma", gamma);
  x.theta = given("theta", x.theta);
  x.q = given("q", x.q);
  x.x1 = given("energy_integral", x.x1);
  x.x2 = given("distribution_integral", x.x2);
  x.along = body ? V * std::cos(x.theta - gamma) : V;
  x.across = body ? V * std::sin(x.theta - gamma) : gamma;
}

TrimmedStart trimmed_start(const Flight& flight, const Command& command, double height,
                           const TrimOptions& options) {
  Vehicle vehicle = flight.vehicle;
  vehicle.gains = gains_at(flight, command.eta);
  const TrimResult trim = trim_closed_loop(vehicle, command, options);
  TrimmedStart answer{trim.status, trim.message, {}};
  if (!answer) return answer;
  const TrimProblem problem = closed_loop_problem(vehicle, command);
  const Eigen::VectorXd& x = trim.point.x;
  const Evaluation at = evaluate(problem.model, trim.point);
  FlightState& state = answer.start.state;
  state.theta = x[2];
  state.q = x[3];
  state.x1 = x[4];
  state.x2 = x[5];
  state.height = height;
  put({{"V", command.V}, {"gamma", command.gamma}}, flight.axes, state);
  state.eta = command.eta;
  state.theta0 = at.outputs[0];
  state.a1s = at.outputs[1];
  state.delta_e = at.outputs[2];
  return answer;
}

Flight flight_of(const Study& study, const SimulateTable& table) {
  Flight flight{study.vehicle};
  flight.gains = study.schedule;
  flight.schedule = schedule_of(study, table);
  const Weather air = weather(table.gusts);
  const Disturbances added = disturbances(table.disturbances);
  flight.wind = air.wind;
  flight.disturbance = added.at;
  std::ranges::set_union(air.kink_times, added.kink_times, std::back_inserter(flight.kink_times));
  flight.axes = table.axes;
  flight.hand_over = table.hand_over;
  flight.rates = table.rates;
  flight.lag = table.lag;
  flight.anti_windup = table.anti_windup;
  return flight;
}

FlightPlan flight_plan(const Study& study, const TrimOptions& options) {
  const SimulateTable table = study.simulate.value_or(SimulateTable{});
  FlightPlan plan{flight_of(study, table), {}, {}, {}, {}, {}, {}};
  plan.options.duration = table.duration;
  plan.options.integrate.tolerance = table.tolerance;
  plan.options.integrate.sample = table.sample;
  plan.lands = table.schedule.kind == ScheduleTable::Kind::reconversion;
  const Command first = plan.flight.schedule.command(0.0, table.height);
  if (from_ground(table)) {
    plan.start = at_rest();
    plan.start.state.height = table.height;
    plan.start.state.eta = first.eta;
    plan.start_words = "at rest on the ground";
  } else {
    const Command command = at_condition(table) ? named(study, table.start).command : first;
    const TrimmedStart from = trimmed_start(plan.flight, command, table.height, options);
    plan.start_status = from.status;
    plan.message = from.message;
    plan.start = from.start;
    plan.start_words = words(command);
  }
  put(table.states, table.axes, plan.start.state);
  return plan;
}

}  // namespace tiltrim
