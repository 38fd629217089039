// A study's [tune] as a problem.
#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <utility>

#include "model/lookup.hpp"
#include "runtime/rounding.hpp"
#include "study/flown.hpp"
#include "study/problems.hpp"
#include "study/qualities_study.hpp"
#include "tune/measures.hpp"
#include "vehicles/tiltrotor/along.hpp"
#include "vehicles/tiltrotor/corridor.hpp"
#include "vehicles/tiltrotor/numbers.hpp"

namespace tiltrim {

namespace {

const TuneTable& table_of(const Study& study) {
  if (!study.tune)
    throw std::invalid_argument(
        "no [tune] table; expected one, with a [[tune.gain]] for each free number");
  return *study.tune;
}

// The study's conditions, then points along corridor (16).
std::vector<Condition> conditions_of(const Study& study) {
  const TuneTable& table = table_of(study);
  std::vector<Condition> all;
  for (const Condition& c : study.conditions)
    if (std::ranges::find(table.conditions, c.name) != table.conditions.end()) all.push_back(c);
  for (const double h : table.heights) {
    Condition c;
    c.name = fmt::format("h = {:g} m", h);
    c.asked = corridor(h);
    all.push_back(c);
  }
  return all;
}

// The closed loop's states are errors, commanded minus actual.
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

// The study's values of the free variables, at each tilt of the schedule.
Eigen::VectorXd own_numbers(const Study& study) {
  const TuneTable& table = table_of(study);
  const std::vector<double> tilts =
      table.schedule.empty() ? std::vector<double>{0.0} : table.schedule;
  std::vector<double> numbers;
  if (study.user_model) {
    for (const FreeGain& g : table.gains)
      numbers.push_back(study.user_model->parameters[index_of(study.user_model->model.parameters,
                                                              g.name, "parameter")]);
    return Eigen::Map<const Eigen::VectorXd>(numbers.data(), std::ssize(numbers));
  }
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

// The user-defined model with its loops' inputs only; the others are held at the condition's
// values. Named as margins expect them.
Model broken(const UserModel& own, const SweepRequest& request) {
  Model loops = own.model;
  loops.inputs.clear();
  loops.outputs.clear();
  std::vector<Eigen::Index> rows, columns;
  for (const UserModel::Loop& loop : own.loops) {
    loops.inputs.push_back({loop.name + "_added", ""});
    loops.outputs.push_back({loop.name, ""});
    columns.push_back(index_of(own.model.inputs, loop.input, "input"));
    rows.push_back(index_of(own.model.outputs, loop.output, "output"));
  }
  for (const Signal& s : own.model.inputs)
    if (std::ranges::find(request.spec.free, s.name) != request.spec.free.end())
      throw std::invalid_argument(
          fmt::format("the input {} is an unknown of the trim of '{}'; expected a number for it "
                      "when margins are tuned",
                      s.name, request.name));
  const auto with = [columns, u = request.guess.u](const Eigen::VectorXd& added) {
    Eigen::VectorXd all = u;
    for (std::size_t j = 0; j < columns.size(); ++j) all[columns[j]] += added[Eigen::Index(j)];
    return all;
  };
  loops.f = [f = own.model.f, with](const auto& x, const auto& u, const auto& p) {
    return f(x, with(u), p);
  };
  loops.h = [h = own.model.h, with, rows](const auto& x, const auto& u,
                                          const auto& p) -> Eigen::VectorXd {
    return h(x, with(u), p)(rows);
  };
  if (own.model.derivatives) {
    const Eigen::Index nx = std::ssize(loops.states), nu = std::ssize(own.model.inputs);
    for (Eigen::Index& row : rows) row += nx;
    for (Eigen::Index i = 0; i < nx; ++i) rows.insert(rows.begin() + i, i);
    loops.derivatives = [slopes = own.model.derivatives, with, rows, columns, nx, nu](
                            const OperatingPoint& at, std::vector<Eigen::Index> variables) {
      const Eigen::Index added = std::ssize(columns);
      for (Eigen::Index& j : variables)
        if (j >= nx) j = j < nx + added ? nx + columns[std::size_t(j - nx)] : j - added + nu;
      return Eigen::MatrixXd(slopes({at.x, with(at.u), at.p}, variables)(rows, Eigen::all));
    };
  }
  loops.enclosure = nullptr;  // of all inputs and outputs
  loops.jets = nullptr;
  loops.switches.clear();
  return loops;
}

bool is_margin(const Requirement& r) {
  return r.measure == Measure::peak_sensitivity ||
         (r.measure >= Measure::gain_margin_db && r.measure <= Measure::disk_margin);
}

bool is_transfer(const Requirement& r) { return !r.from.empty(); }

bool asks(const TuneTable& table, bool (*which)(const Requirement&)) {
  return which(table.goal) || std::ranges::any_of(table.goals, which) ||
         std::ranges::any_of(table.limits, which) || (table.front && which(table.front->limit));
}

// Adds the operating points of a user-defined model.
void add_own(const Study& study, TuneProblem& problem) {
  const TuneTable& table = table_of(study);
  problem.disturbance = table.disturbance;
  if (study.qualities)
    problem.figures = quality_figures(study, problem.points.front(), conditions_of(study).front());
  if (!asks(table, is_margin) && table.regulator_starts.empty() && table.placed_starts.empty())
    return;
  if (study.user_model->loops.empty())
    throw std::invalid_argument(
        "margins or regulators of a model without [[model.loop]], so no loop can be broken; "
        "expected "
        "[[model.loop]] tables");
  for (const SweepRequest& r : problem.points)
    problem.loops.push_back(broken(*study.user_model, r));
}

// Adds those of the tiltrotor.
void add_tiltrotor(const Study& study, TuneProblem& problem) {
  const TuneTable& table = table_of(study);
  problem.disturbance = state_of(table.disturbance);
  if (asks(table, [](const Requirement& r) { return r.measure == Measure::figure; }))
    problem.figures = flight_figures(study);
  const bool transfers = asks(table, is_transfer);
  for (const SweepRequest& r : problem.points) {
    const bool wind = find(r.model.states, "V_err") >= 0;
    if (!wind && !problem.disturbance.empty())
      throw std::invalid_argument(
          fmt::format("condition '{}' is too slow for a disturbance in wind axes; expected V of at "
                      "least {} m/s",
                      r.name, body_axes_below));
    const Axes axes = wind ? Axes::wind : Axes::body;
    problem.loops.push_back(closed_loop_with_inputs(study.vehicle, axes));
    if (transfers) problem.responses.push_back(closed_loop_with_commands(study.vehicle, axes));
  }
}

}  // namespace

TuneProblem tune_problem(const Study& study) {
  const RoundToNearest environment;
  const TuneTable& table = table_of(study);
  const std::vector<Condition> conditions = conditions_of(study);
  TuneProblem problem;
  problem.points = sweep_requests(study, conditions, {});
  problem.gains = table.gains;
  problem.schedule = table.schedule;
  problem.schedule_over = "eta";
  problem.uncertain = table.uncertain;
  problem.corners = table.corners;
  problem.samples = table.samples;
  problem.sample_seed = table.seed;
  problem.goal = table.goal;
  problem.goals = table.goals;
  problem.limits = table.limits;
  if (study.user_model)
    add_own(study, problem);
  else
    add_tiltrotor(study, problem);
  return problem;
}

TuneOptions tune_options(const Study& study) {
  const TuneTable& table = table_of(study);
  TuneOptions options;
  options.trimming.time_limit = study.time_limit;
  options.global = global_search(table.global);
  options.local = local_search(table.local);
  options.seed = table.seed;
  options.evaluations = table.evaluations;
  options.seconds = table.seconds;
  options.start = own_numbers(study);
  return options;
}

}  // namespace tiltrim
