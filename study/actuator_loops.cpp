#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>

#include "model/lookup.hpp"
#include "runtime/rounding.hpp"
#include "study/analyses.hpp"
#include "vehicles/tiltrotor/along.hpp"

namespace tiltrim {

using Eigen::Index;
using Eigen::VectorXd;

namespace {

// The actuators at which the condition's loops can be broken.
std::vector<std::string> places_of(const Condition& condition) {
  if (!condition.user()) return actuators();
  std::vector<std::string> names;
  for (const UserModel::Loop& loop : condition.user()->model->loops) names.push_back(loop.name);
  return names;
}

void check(const Condition& condition, const LoopsOptions& options) {
  if (condition.user() && condition.user()->model->loops.empty())
    throw std::invalid_argument(
        condition.user()->model->xv15
            ? "the vehicle has no control law, so no loop can be broken; expected control = "
              "\"energy\""
            : "the model has no [[model.loop]], so no loop can be broken; expected [[model.loop]] "
              "tables with input and output");
  if (!condition.user() && !condition.command())
    throw std::invalid_argument("margins need a closed loop; expected formulation closed_loop");
  const std::vector<std::string> all = places_of(condition);
  for (const std::string& name : options.actuators)
    if (std::ranges::find(all, name) == all.end())
      throw std::invalid_argument(
          fmt::format("no actuator '{}'; there are: {}", name, fmt::join(all, ", ")));
}

// Column j of B and row j of C and D belong to loop j.
LinearModel user_loops(const Answer& trimmed) {
  const UserModel& own = *trimmed.condition.user()->model;
  LinearizeOptions options;
  options.moving = moving_states(trimmed.condition);
  for (const UserModel::Loop& loop : own.loops) options.inputs.push_back(loop.input);
  LinearModel linear = linearize(own.model, trimmed.trim.point, options);
  if (!linear) return linear;
  const Index n = std::ssize(own.loops);
  Eigen::MatrixXd C(n, linear.C.cols()), D(n, linear.D.cols());
  for (Index j = 0; j < n; ++j) {
    const Index row = index_of(own.model.outputs, own.loops[std::size_t(j)].output, "output");
    C.row(j) = linear.C.row(row);
    D.row(j) = linear.D.row(row);
  }
  linear.C = C;
  linear.D = D;
  return linear;
}

// The closed loop linearized at the trim, with inputs added to the law's commands.
LinearModel with_inputs(const Vehicle& vehicle, const Answer& trimmed) {
  if (trimmed.condition.user()) return user_loops(trimmed);
  const Axes axes = trimmed.condition.command()->V < body_axes_below ? Axes::body : Axes::wind;
  const Model model = closed_loop_with_inputs(vehicle, axes);
  const OperatingPoint& at = trimmed.trim.point;
  return linearize(model, {at.x, VectorXd::Zero(std::ssize(model.inputs)), at.p});
}

struct Frequencies {
  double from, to;
};

// An eigenvalue at zero within its error bound is taken at that bound.
Frequencies frequencies(const Modes& modes, const LoopsOptions& options) {
  constexpr double decade = 10.0;
  double slowest = std::numeric_limits<double>::infinity(), fastest = 0.0;
  for (const Mode& m : modes.modes) {
    const double frequency = std::max(m.frequency(), m.error);
    slowest = std::min(slowest, frequency);
    fastest = std::max(fastest, frequency);
  }
  const Frequencies f{options.from.value_or(slowest / decade),
                      options.to.value_or(fastest * decade)};
  if (!(f.from > 0 && f.from < f.to && std::isfinite(f.to)))
    throw std::invalid_argument(fmt::format(
        "no Bode data from {:.6g} to {:.6g} rad/s; expected 0 < from < to", f.from, f.to));
  return f;
}

// An input at actuator j appears after it as 1 + c (sI - A)⁻¹ b + d.
ActuatorLoop broken(const LinearModel& closed, Index j, const std::string& actuator) {
  const VectorXd b = closed.B.col(j);
  const Eigen::RowVectorXd c = closed.C.row(j);
  const bool in_use = !b.isZero(0) && !c.isZero(0);
  return {actuator, in_use, opened(closed.A, b, c, closed.D(j, j)), {}, {}};
}

}  // namespace

std::vector<std::string> actuators() { return {"theta0", "a1s", "delta_e"}; }

bool LoopsAnswer::answered() const {
  return trimmed.trim && linear && modes.verdict != Verdict::undecided &&
         std::ranges::all_of(loops, [this](const ActuatorLoop& l) {
           return !l.in_use || (l.margins.closed_loop == modes.verdict && l.margins.complete);
         });
}

LoopsAnswer actuator_loops(const Vehicle& vehicle, const Condition& condition,
                           const LoopsOptions& options, const TrimOptions& trimming) {
  const RoundToNearest environment;
  check(condition, options);
  LoopsAnswer answer{tiltrim::answer(vehicle, condition, trimming), {}, {}, {}};
  if (!answer.trimmed.has_equilibrium()) return answer;
  answer.linear = with_inputs(vehicle, answer.trimmed);
  if (!answer.linear) return answer;
  answer.modes = modes(answer.linear);
  if (!answer.modes.converged) return answer;
  const auto [from, to] = frequencies(answer.modes, options);
  const std::vector<std::string> all = places_of(condition), &wanted = options.actuators;
  for (std::size_t j = 0; j < all.size(); ++j) {
    if (!wanted.empty() && std::ranges::find(wanted, all[j]) == wanted.end()) continue;
    ActuatorLoop& one = answer.loops.emplace_back(broken(answer.linear, Index(j), all[j]));
    if (!one.in_use) continue;
    one.margins.closed_loop = answer.modes.verdict;
    if (answer.modes.verdict == Verdict::stable) one.margins = margins(one.loop);
    one.bode = bode(one.loop, from, to, options.points);
  }
  return answer;
}

}  // namespace tiltrim
