#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <numbers>
#include <stdexcept>

#include "flight/flight.hpp"
#include "runtime/rounding.hpp"
#include "study/problems.hpp"
#include "vehicles/tiltrotor/corridor.hpp"

namespace tiltrim {

namespace {

const Command& named(const Study& study, const std::string& name) {
  const auto at = std::ranges::find(study.conditions, name, &Condition::name);
  if (at == study.conditions.end())
    throw std::invalid_argument(fmt::format("simulate: no condition '{}'", name));
  if (!at->command())
    throw std::invalid_argument(
        fmt::format("simulate: the condition '{}' is not a closed loop", name));
  return *at->command();
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
      return held(at_condition(table) ? named(study, table.start)
                                      : named(study, study.conditions.front().name));
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
  // Omitted columns are (16) itself with its kinks, not interpolated between the table's values.
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
  // Adding zero avoids printing -0.
  const auto degrees = [](double angle) {
    constexpr double finest = 1e-9;
    return std::round(angle * 180 / std::numbers::pi / finest) * finest + 0.0;
  };
  return fmt::format("from the trim at V = {:.4g} m/s, γ = {:.4g}°, η = {:.4g}°", c.V,
                     degrees(c.gamma), degrees(c.eta));
}

}  // namespace

Flight flight_of(const Study& study, const SimulateTable& table) {
  const RoundToNearest environment;
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
  const RoundToNearest environment;
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
    const Command command = at_condition(table) ? named(study, table.start) : first;
    TrimOptions limited = options;
    limited.time_limit = std::min(options.time_limit, study.time_limit);
    const TrimmedStart from = trimmed_start(plan.flight, command, table.height, limited);
    plan.start_status = from.status;
    plan.message = from.message;
    plan.start = from.start;
    plan.start_words = words(command);
  }
  put(table.states, table.axes, plan.start.state);
  return plan;
}

namespace {

ScatteredFlights scattered_flights(const Study& study) {
  if (!study.montecarlo)
    throw std::invalid_argument(
        "no [montecarlo] table; expected one, with a [[montecarlo.scatter]] for each scattered "
        "number");
  const std::vector<GustTable> gusts = study.simulate.value_or(SimulateTable{}).gusts;
  const auto random = [](const GustTable& gust) { return gust.kind == GustTable::Kind::dryden; };
  if (study.montecarlo->scatter.empty() && std::ranges::none_of(gusts, random))
    throw std::invalid_argument(
        "montecarlo.scatter: is missing, so that every flight would be the same; expected a "
        "[[montecarlo.scatter]] for each scattered number, or a [[simulate.gust]] of kind "
        "\"dryden\"");
  return {flight_plan(study), gusts, *study.montecarlo};
}

}  // namespace

MonteCarlo monte_carlo(const Study& study, const MonteCarloOptions& options) {
  return monte_carlo(scattered_flights(study), options);
}

FlightPlan flight_plan_of(const Study& study, long number) {
  return flight_plan_of(scattered_flights(study), number);
}

}  // namespace tiltrim
