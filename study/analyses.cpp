#include "study/analyses.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>

#include "model/lookup.hpp"
#include "runtime/rounding.hpp"
#include "vehicles/tiltrotor/along.hpp"

namespace tiltrim {

namespace {

// Trimmed with the bounds that spread the condition's starting points, in the equations that are
// followed.
TrimResult started(const Vehicle& vehicle, const Condition& condition, const TrimProblem& problem,
                   const TrimOptions& trimming) {
  TrimSpec spec = problem.spec;
  if (condition.command())
    for (const auto& [name, range] : problem_of(vehicle, condition).spec.bounds)
      if (name.ends_with("_integral")) spec.bounds[name] = range;
  return trim(problem.model, spec, problem.guess, trimming);
}

// The lowest speed of a command; meaningless for the other formulations.
double speed_of(const Condition& condition) {
  const Command* command = condition.command();
  return command ? command->V : 0.0;
}

bool has_variable(const Model& model, const std::string& name) {
  return find(model.states, name) >= 0 || find(model.inputs, name) >= 0 ||
         find(model.parameters, name) >= 0;
}

// The commands of a published vehicle that flies by another speed.
bool is_idle_command(const Condition& condition, const Model& model, const std::string& signal) {
  const UserCondition* user = condition.user();
  if (!user || !user->model->xv15 || find(model.inputs, "stick") < 0) return false;
  return (signal == "airspeed_kt" || signal == "climb_angle") &&
         !user->values.contains("forward_error") && !user->values.contains("climb_error");
}

}  // namespace

void check_moves(const Condition& condition, const Model& model, const std::string& signal,
                 const std::string& key) {
  if (!has_variable(model, signal))
    throw std::invalid_argument(fmt::format("the {} has no variable {}", model.name, key));
  if (is_idle_command(condition, model, signal))
    throw std::invalid_argument(fmt::format(
        "{} moves nothing; expected a condition that gives airspeed_kt instead of another speed",
        key));
  if (condition.command() && signal == "q")
    throw std::invalid_argument(key + " is zero in every trim of the closed loop");
}

TrimProblem problem_along(const Vehicle& vehicle, const Condition& condition, double slowest) {
  const RoundToNearest environment;
  if (const Command* command = condition.command())
    return closed_loop_along(vehicle, *command, slowest);
  if (const UserCondition* user = condition.user()) return user_problem(*user);
  return without_integral_bounds(problem_of(vehicle, condition));
}

bool BranchAnswer::answered() const {
  return branch.end == BranchEnd::reached || branch.end == BranchEnd::limit ||
         branch.end == BranchEnd::closed || branch.end == BranchEnd::switched;
}

double BranchAnswer::from() const {
  return parameter.in_study(value_of(start.trim.point, variable(start.model, parameter.signal)));
}

BranchAnswer follow(const Vehicle& vehicle, const Condition& condition, const Key& parameter,
                    double to, const FollowOptions& options, const TrimOptions& trimming) {
  const RoundToNearest environment;
  const double V = speed_of(condition);
  const TrimProblem problem =
      problem_along(vehicle, condition, parameter.signal == "V" ? std::min(V, to) : V);
  BranchAnswer answer{{condition, problem.model, {}, {}}, parameter, to, {}};
  check_moves(condition, problem.model, parameter.signal, parameter.name);
  if (value_of(problem.guess, variable(problem.model, parameter.signal)) == to)
    throw std::invalid_argument(
        fmt::format("{} is at {:.6g} already", parameter.name, parameter.in_study(to)));
  TrimResult& start = answer.start.trim;
  start = started(vehicle, condition, problem, trimming);
  const bool found = answer.start.has_equilibrium();
  answer.branch = follow(problem.model, problem.spec, found ? start.point : problem.guess,
                         parameter.signal, to, options);
  if (!found) {  // as trim() explains it, which also tests the airframe alone
    const TrimResult said = tiltrim::answer(vehicle, condition, trimming).trim;
    start.status = said.status;
    start.message = said.message;
    answer.branch.message =
        fmt::format("no trim to start from: {}: {}", to_string(start.status), start.message);
  }
  return answer;
}

SensitivityAnswer sensitivities(const Vehicle& vehicle, const Condition& condition,
                                const std::vector<Key>& keys, const TrimOptions& trimming) {
  const RoundToNearest environment;
  const TrimProblem problem = problem_along(vehicle, condition, speed_of(condition));
  SensitivityAnswer answer{{condition, problem.model, {}, {}}, {}};
  TrimResult& trimmed = answer.trimmed.trim;
  trimmed = started(vehicle, condition, problem, trimming);
  if (!answer.trimmed.has_equilibrium()) {
    answer.sensitivities.message = trimmed.message;
    return answer;
  }
  std::vector<std::string> names;
  for (const Key& key : keys) names.push_back(key.signal);
  answer.sensitivities = tiltrim::sensitivities(problem.model, problem.spec, trimmed.point, names);
  return answer;
}

AllEquilibria all_equilibria(const Vehicle& vehicle, const Condition& condition,
                             const TrimOptions& options) {
  const RoundToNearest environment;
  constexpr double reach = 10.0;  // m/s, and a radian of path angle or tilt
  const TrimProblem p = problem_of(vehicle, condition);
  std::vector<std::string> held;
  for (const char* name : {"V", "gamma", "eta"}) {
    const bool there = has_variable(p.model, name);
    const bool free = std::ranges::find(p.spec.free, name) != p.spec.free.end();
    // In body axes the speed is a bounded output, tied to the command, which alone would vary.
    const bool tied = p.spec.bounds.contains("airspeed") && std::string(name) != "eta";
    if (there && !free && !tied) held.push_back(name);
  }
  return all_equilibria(p.model, p.spec, without_integral_bounds(p).spec, p.guess, held, reach,
                        options);
}

bool EnvelopeAnswer::has(EnvelopeStatus status) const {
  return std::ranges::any_of(parts, [&](const Envelope& e) { return e.status == status; });
}

bool EnvelopeAnswer::answered() const {
  return !has(EnvelopeStatus::interrupted) && !has(EnvelopeStatus::incomplete);
}

EnvelopeTable envelope_table(const Study& study, const std::string& over,
                             std::optional<int> count) {
  if (study.user_model && !study.envelope)
    throw StudyError(
        fmt::format("{}: no [envelope] table; expected one with along and over, two "
                    "numbers of the model, and the range of each",
                    study.file.string()));
  if (study.user_model && !over.empty())
    throw std::invalid_argument(
        "--over applies to the built-in tiltrotor; a study with [model] sets `over` in [envelope]");
  EnvelopeTable table = study.envelope.value_or(EnvelopeTable{});
  if (!over.empty() && over != table.over.name) {
    if (over != "eta_deg" && over != "gamma_deg")
      throw std::invalid_argument(
          fmt::format("no envelope over '{}'; there are: eta_deg, gamma_deg", over));
    const EnvelopeTable other = envelope_over(over);
    table.over = other.over;
    table.range = other.range;
  }
  if (count) table.count = *count;
  return table;
}

std::vector<double> envelope_rows(const EnvelopeTable& table, bool user_model) {
  constexpr double step = 10.0;  // degrees
  constexpr int tenths = 10;
  const auto [from, to] = table.range;
  std::vector<double> rows{from};
  if (user_model) {
    for (int i = 1; i < tenths; ++i) rows.push_back(from + double(i) / tenths * (to - from));
  } else {
    const double last = table.over.in_study(to);
    for (double at = step * (std::floor(table.over.in_study(from) / step) + 1); at < last;
         at += step)
      rows.push_back(table.over.in_si(at));
  }
  rows.push_back(to);
  return rows;
}

// Of a study with [model]: as it is, over the two variables.
static EnvelopeAnswer user_envelope(const Condition& condition, const EnvelopeTable& table,
                                    const EnvelopeOptions& options) {
  const TrimProblem problem = user_problem(*condition.user());
  for (const Key& key : {table.along, table.over})
    check_moves(condition, problem.model, key.signal, key.name);
  return {condition,
          table,
          problem.model,
          {envelope(problem.model, problem.spec, problem.guess,
                    {table.along.signal, table.along_range, table.count},
                    {table.over.signal, table.range, table.count}, options)}};
}

EnvelopeAnswer envelope(const Vehicle& vehicle, const Condition& condition,
                        const EnvelopeTable& table, const EnvelopeOptions& options) {
  const RoundToNearest environment;
  if (condition.user()) return user_envelope(condition, table, options);
  if (!condition.command())
    throw std::invalid_argument(
        "an envelope needs the closed loop; expected formulation closed_loop");
  // Far enough from the switch that finite differences do not cross it.
  constexpr double clear = 1e-6;
  const Aircraft& a = vehicle.aircraft;
  const bool over_tilt = table.over.signal == "eta";
  std::vector<Range> stretches{table.range};
  if (over_tilt && a.cyclic_blend == 0 && a.cyclic_off > table.range.lower &&
      a.cyclic_off <= table.range.upper)
    stretches = {{table.range.lower, a.cyclic_off - clear}, {a.cyclic_off, table.range.upper}};
  EnvelopeAnswer answer{condition, table, {}, {}};
  for (const Range& stretch : stretches) {
    if (!(stretch.lower < stretch.upper)) continue;
    Command middle = *condition.command();
    middle.V = 0.5 * (table.along_range.lower + table.along_range.upper);
    (over_tilt ? middle.eta : middle.gamma) = 0.5 * (stretch.lower + stretch.upper);
    const TrimProblem problem =
        without_integral_bounds(closed_loop_problem(vehicle, middle, Axes::wind));
    answer.model = problem.model;
    EnvelopeOptions own = options;
    std::erase_if(own.rows, [&](double y) { return y < stretch.lower || y > stretch.upper; });
    const double span = table.range.upper - table.range.lower;
    const double share = (stretch.upper - stretch.lower) / span;
    const double before = (stretch.lower - table.range.lower) / span;
    if (options.observe) own.observe = [&](double done) { options.observe(before + done * share); };
    const int count = std::max(5, int(std::lround(table.count * share)));
    answer.parts.push_back(envelope(problem.model, problem.spec, problem.guess,
                                    {"V", table.along_range, table.count},
                                    {table.over.signal, stretch, count}, own));
  }
  return answer;
}

}  // namespace tiltrim
