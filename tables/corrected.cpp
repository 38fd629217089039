// True equilibria of Table 1's conditions on the reference aircraft.
#include <fmt/core.h>
#include <fmt/ranges.h>

#include <cmath>
#include <numbers>

#include "model/lookup.hpp"
#include "tables/tables.hpp"
#include "trim/proof.hpp"
#include "vehicles/tiltrotor/formulations.hpp"

namespace tiltrim {

namespace {

using std::numbers::pi;
constexpr double degree = pi / 180.0;

// Table 1 with its slips corrected: the climb climbs, and the transition moves at 6 m/s.
const Columns<Command>& conditions() {
  static const Columns<Command> all{Command{2.0, pi / 2, pi / 2}, Command{6.0, pi / 4, pi / 4},
                                    Command{15.0, 0.0, 0.0}};
  return all;
}
constexpr Columns<const char*> column_names{"climb", "transition", "level"};

double signal(const Signals& signals, const Eigen::VectorXd& values, const char* name) {
  return values[index_of(signals, name, "signal")];
}

std::string condition_in_words(const Command& c) {
  return fmt::format("V = {:g} m/s, gamma = {:g}°, eta = {:g}°", c.V, c.gamma / degree,
                     c.eta / degree);
}

std::string no_equilibrium(const CorrectedColumn& column) {
  return fmt::format("{}: no equilibrium at {} ({}): {}", column.name,
                     condition_in_words(column.condition), to_string(column.trim.status),
                     column.trim.message);
}

// ---- theta = 0 ----

TrimProblem level_body_problem(const Vehicle& vehicle, const Command& c) {
  AirframeCondition condition;
  condition.values = {
      {"V", {c.V, c.V}}, {"gamma", {c.gamma, c.gamma}}, {"theta", {0, 0}}, {"eta", {c.eta, c.eta}}};
  return airframe_problem(vehicle, condition);
}

TrimResult solved(const TrimProblem& problem, const TrimSpec& spec) {
  TrimOptions options;
  options.closest = false;
  options.max_boxes = boxes_before_short_search;
  return trim(problem.model, spec, problem.guess, options);
}

std::string equation_in_words(const std::string& state) {
  if (state == "V") return "the speed equation V' = 0";
  if (state == "gamma") return "the path equation gamma' = 0";
  return "the pitch equation q' = 0";
}

// Equations or limits, each of which alone prevents an equilibrium.
std::vector<std::string> what_stops(const Vehicle& vehicle, const TrimProblem& problem) {
  struct Wide {
    const char* input;
    Range range, limit;
    const char* unit;
  };
  const Wide wide[] = {{"theta0", {-5.0, 5.0}, vehicle.limits.theta0, ""},
                       {"a1s", {-pi / 2, pi / 2}, vehicle.limits.a1s, " rad"},
                       {"delta_e", {-pi / 2, pi / 2}, vehicle.limits.delta_e, " rad"}};
  std::vector<std::string> stops;
  for (const auto& [state, rate] : problem.spec.rates) {
    TrimSpec spec = problem.spec;
    spec.rates.erase(state);
    spec.moving.push_back(state);
    if (solved(problem, spec)) stops.push_back(equation_in_words(state));
  }
  for (const Wide& w : wide) {
    TrimSpec spec = problem.spec;
    spec.bounds[w.input] = w.range;
    const TrimResult freed = solved(problem, spec);
    if (freed)
      stops.push_back(fmt::format("the limits of {}, [{:g}, {:g}]{}: it would need {:.4f}{}",
                                  w.input, w.limit.lower, w.limit.upper, w.unit,
                                  signal(problem.model.inputs, freed.point.u, w.input), w.unit));
  }
  return stops;
}

// Without the pitch equation: the residual moment, and what the elevator can contribute.
std::string moment_left(const Vehicle& vehicle, const TrimProblem& problem, const Command& c) {
  TrimSpec spec = problem.spec;
  spec.rates.erase("q");
  spec.moving.push_back("q");
  const TrimResult forces = solved(problem, spec);
  if (!forces) return {};
  const double acceleration = signal(problem.model.states, forces.rates, "q");
  const double arm = std::abs(std::cos(c.gamma));  // alpha = -gamma
  return fmt::format(
      "; with both forces balanced a pitching moment of {:+.3f} N m remains, and at this angle of "
      "attack the elevator keeps {:.0f} % of its effectiveness",
      acceleration * vehicle.aircraft.inertia_yy, 100.0 * arm);
}

CorrectedColumn level_body_column(const Vehicle& vehicle, std::size_t i) {
  CorrectedColumn column;
  column.name = column_names[i];
  column.condition = conditions()[i];
  const TrimProblem problem = level_body_problem(vehicle, column.condition);
  column.trim = trim(problem.model, problem.spec, problem.guess);
  const auto input = [&](const char* name) {
    return signal(problem.model.inputs, column.trim.point.u, name);
  };
  if (column.trim) {
    column.theta = 0.0;
    column.theta0 = input("theta0");
    column.a1s = input("a1s");
    column.delta_e = input("delta_e");
    column.finding = fmt::format(
        "{}: held at {} with theta = 0 by theta0 = {:.5f}, a1s = {:.5f}, delta_e "
        "= {:.5f}",
        column.name, condition_in_words(column.condition), *column.theta0, *column.a1s,
        *column.delta_e);
    return column;
  }
  column.stopped_by = what_stops(vehicle, problem);
  column.finding = no_equilibrium(column);
  if (column.stopped_by.empty())
    column.finding +=
        "; no single equation or limit prevents it: more than one would have to be released";
  else
    column.finding += fmt::format("; releasing any one of these gives an equilibrium: {}",
                                  fmt::join(column.stopped_by, "; "));
  column.finding += moment_left(vehicle, problem, column.condition);
  return column;
}

// ---- theta free ----

CorrectedColumn free_pitch_column(const Vehicle& vehicle, const char* name,
                                  const Command& condition) {
  CorrectedColumn column;
  column.name = name;
  column.condition = condition;
  const TrimProblem problem = closed_loop_problem(vehicle, condition);
  column.trim = trim_closed_loop(problem, vehicle, condition);
  if (!column.trim) {
    column.finding = no_equilibrium(column);
    return column;
  }
  const Model& model = problem.model;
  const auto output = [&](const char* signal_name) {
    return signal(model.outputs, column.trim.outputs, signal_name);
  };
  column.theta = signal(model.states, column.trim.point.x, "theta");
  column.theta0 = output("theta0");
  column.a1s = output("a1s");
  column.delta_e = output("delta_e");
  const LinearModel linear = linearize(model, column.trim.point);
  if (!linear) {
    column.finding = column.name + ": not linearized: " + linear.message;
    return column;
  }
  const Modes found = modes(linear);
  column.verdict = found.verdict;
  column.spectral_abscissa = found.spectral_abscissa;
  column.finding =
      fmt::format("{}: {} is held at theta = {:.4f} rad, {} (largest real part {:.4f} 1/s)",
                  column.name, condition_in_words(condition), *column.theta,
                  to_string(found.verdict), found.spectral_abscissa);
  return column;
}

}  // namespace

CorrectedTable trim_level_body(const Vehicle& vehicle) {
  CorrectedTable table{"Table 3 corrected: the airframe at theta = 0, as Table 1 has it", {}};
  for (std::size_t i = 0; i < 3; ++i) table.columns[i] = level_body_column(vehicle, i);
  return table;
}

CorrectedTable trim_free_pitch(const Vehicle& vehicle) {
  CorrectedTable table{"Table 3 corrected: the closed loop at its own theta", {}};
  for (std::size_t i = 0; i < 3; ++i)
    table.columns[i] = free_pitch_column(vehicle, column_names[i], conditions()[i]);
  return table;
}

CorrectedColumn climb_with_printed_wake(const Vehicle& vehicle) {
  Vehicle printed = vehicle;
  printed.aircraft.pitch_scale = 1.0;
  printed.aircraft.wake_immersion = 1.0;
  return free_pitch_column(printed, "climb with (3) as printed", conditions()[0]);
}

}  // namespace tiltrim
