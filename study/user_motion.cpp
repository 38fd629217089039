#include <fmt/core.h>

#include <algorithm>
#include <limits>
#include <stdexcept>

#include "model/degrees.hpp"
#include "model/lookup.hpp"
#include "runtime/rounding.hpp"
#include "simulate/comparison.hpp"
#include "study/problems.hpp"

namespace tiltrim {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

const Condition& start_of(const Study& study, const UserMotion& asked) {
  const auto at = std::ranges::find(study.conditions, asked.start, &Condition::name);
  return at == study.conditions.end() ? study.conditions.front() : *at;
}

// A doublet is a step, then the opposite step for as long.
std::vector<SignalChange> changes_of(const UserMotion& asked) {
  constexpr double forever = std::numeric_limits<double>::infinity();
  std::vector<SignalChange> changes;
  for (const UserMotion::Change& c : asked.changes) {
    const double end = c.duration > 0 ? c.at + c.duration : forever;
    changes.push_back({c.signal, c.size, c.at, end});
    if (c.doublet) changes.push_back({c.signal, -c.size, end, end + c.duration});
  }
  return changes;
}

// A signal may have the name of another column, "time" or that of an angle in degrees.
std::string free_name(const FlightTable& table, const std::string& wanted) {
  std::string name = wanted;
  for (int k = 2;
       std::ranges::find(table.columns, name, &FlightColumn::name) != table.columns.end(); ++k)
    name = fmt::format("{}_{}", wanted, k);
  return name;
}

void add(const Signals& signals, const MatrixXd& samples, const char* kind, FlightTable& table,
         const auto& shown) {
  for (std::size_t i = 0; i < signals.size(); ++i) {
    const Signal& s = signals[i];
    if (!shown(s)) continue;
    const bool angle = s.unit == "rad";
    const VectorXd values = samples.row(Index(i)) * (angle ? degrees : 1.0);
    table.columns.push_back({free_name(table, s.name + (angle ? "_deg" : "")),
                             angle ? "degrees" : s.unit,
                             kind,
                             {values.data(), values.data() + values.size()}});
  }
}

FlightTable table_of(const Model& model, const UserMotion& asked, const Simulation& s) {
  FlightTable table;
  table.columns.push_back({"time", "s", "time", s.t});
  const auto always = [](const Signal&) { return true; };
  add(model.states, s.x, "state", table, always);
  add(model.inputs, s.u, "input", table, always);
  add(model.parameters, s.p, "parameter", table, [&](const Signal& signal) {
    return std::ranges::find(asked.changes, signal.name, &UserMotion::Change::signal) !=
           asked.changes.end();
  });
  add(model.outputs, s.y, "output", table, always);
  return table;
}

}  // namespace

MotionAnswer user_motion(const Study& study, const TrimOptions& trimming) {
  const RoundToNearest environment;
  if (!study.user_model)
    throw std::invalid_argument("the study has no [model]; expected one, or flight_plan()");
  MotionAnswer answer;
  answer.asked = study.user_motion.value_or(UserMotion{});
  const Condition& condition = start_of(study, answer.asked);
  answer.asked.start = condition.name;
  TrimOptions limited = trimming;
  limited.time_limit = std::min(trimming.time_limit, study.time_limit);
  answer.start = tiltrim::answer(study.vehicle, condition, limited);
  if (!answer.start.has_equilibrium()) return answer;
  const Model& model = answer.start.model;
  OperatingPoint from = answer.start.trim.point;
  for (const auto& [name, by] : answer.asked.offset)
    from.x[index_of(model.states, name, "state")] += by;
  IntegrateOptions options;
  options.tolerance = answer.asked.tolerance;
  options.sample = answer.asked.sample;
  options.stop = trimming.stop;
  answer.motion = simulate(model, from, answer.asked.duration, changes_of(answer.asked), options);
  answer.table = table_of(model, answer.asked, *answer.motion);
  return answer;
}

Response user_response(const Condition& condition, const std::map<std::string, double>& offset,
                       const ResponseOptions& options) {
  const RoundToNearest environment;
  const Answer trimmed = tiltrim::answer({}, condition, options.trimming);
  if (trimmed.has_equilibrium())
    return response(trimmed.model, trimmed.trim.point, offset, options);
  Response none;
  none.states = trimmed.model.states;
  none.offset = offset_of(none.states, offset);
  none.message = trimmed.trim.message;
  return none;
}

}  // namespace tiltrim
