// A study's [tune] as a problem.
#include <fmt/core.h>

#include <algorithm>
#include <stdexcept>

#include "tune/flown.hpp"
#include "tune/tune.hpp"

namespace tiltrim {

namespace {

const TuneTable& table_of(const Study& study) {
  if (!study.tune)
    throw std::invalid_argument(
        "no [tune] table; expected one, with [[tune.gain]] for each number that is free");
  return *study.tune;
}

// Conditions of the study, then points along corridor (16).
std::vector<Condition> conditions_of(const Study& study) {
  const TuneTable& table = table_of(study);
  std::vector<Condition> all;
  for (const Condition& c : study.conditions)
    if (std::ranges::find(table.conditions, c.name) != table.conditions.end()) all.push_back(c);
  for (const double h : table.heights) {
    Condition c;
    c.name = fmt::format("h = {:g} m", h);
    c.command = corridor(h);
    all.push_back(c);
  }
  return all;
}

// The closed loop's states are errors, commanded less actual.
std::map<std::string, double> state_of(const std::map<std::string, double>& disturbance) {
  std::map<std::string, double> state;
  for (const auto& [name, value] : disturbance) {
    if (value == 0) continue;
    if (name == "V" || name == "gamma")
      state[name + "_err"] = -value;
    else
      state[name] = value;
  }
  return state;
}

// What the study has for the numbers that are free, at each tilt of the schedule.
Eigen::VectorXd own_numbers(const Study& study) {
  const TuneTable& table = table_of(study);
  const std::vector<double> tilts =
      table.schedule.empty() ? std::vector<double>{0.0} : table.schedule;
  std::vector<double> numbers;
  const Model model = closed_loop(study.vehicle);
  for (const FreeGain& g : table.gains)
    for (const double eta : tilts) {
      Vehicle vehicle = study.vehicle;
      if (!study.schedule.eta.empty()) vehicle.gains = gains_at(study.schedule, eta);
      const Eigen::VectorXd p = closed_loop_parameters(vehicle, {15.0, 0.0, eta});
      numbers.push_back(p[index_of(model.parameters, g.name, "parameter")]);
    }
  return Eigen::Map<const Eigen::VectorXd>(numbers.data(), std::ssize(numbers));
}

}  // namespace

TuneProblem tune_problem(const Study& study) {
  const TuneTable& table = table_of(study);
  const std::vector<Condition> conditions = conditions_of(study);
  TuneProblem problem;
  problem.points = sweep_requests(study, conditions, {});
  problem.gains = table.gains;
  problem.schedule = table.schedule;
  problem.uncertain = table.uncertain;
  problem.corners = table.corners;
  problem.samples = table.samples;
  problem.sample_seed = table.seed;
  problem.disturbance = state_of(table.disturbance);
  const auto flies = [](const Requirement& r) {
    return r.measure == Measure::flight || r.measure == Measure::tracking;
  };
  if (flies(table.goal) || std::ranges::any_of(table.limits, flies) ||
      (table.front && flies(table.front->limit)))
    problem.flight = flight_figure(study);
  problem.goal = table.goal;
  problem.limits = table.limits;
  for (const SweepRequest& r : problem.points) {
    const bool wind = find(r.model.states, "V_err") >= 0;
    if (!wind && !problem.disturbance.empty())
      throw std::invalid_argument(
          fmt::format("condition '{}' is too slow for a disturbance in wind axes; expected V of {} "
                      "m/s at least",
                      r.name, body_axes_below));
    problem.loops.push_back(closed_loop_with_inputs(study.vehicle, wind ? Axes::wind : Axes::body));
  }
  return problem;
}

TuneOptions tune_options(const Study& study) {
  const TuneTable& table = table_of(study);
  TuneOptions options;
  options.global = global_search(table.global);
  options.local = local_search(table.local);
  options.seed = table.seed;
  options.evaluations = table.evaluations;
  options.seconds = table.seconds;
  options.start = own_numbers(study);
  return options;
}

}  // namespace tiltrim
