#include "linearize/linearize.hpp"

#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>

namespace tiltrim {

using Eigen::Index;
using Eigen::MatrixXd;

std::string to_string(LinearizeStatus status) {
  switch (status) {
    case LinearizeStatus::linear:
      return "linear";
    case LinearizeStatus::not_equilibrium:
      return "not_equilibrium";
    case LinearizeStatus::not_finite:
      return "not_finite";
    case LinearizeStatus::model_threw:
      return "model_threw";
  }
  return "unknown";
}

namespace {

// The variables of the model that the linear model's states and inputs are.
struct Selection {
  std::vector<Index> variables;  // states first
  Signals inputs;
};

Selection select(const Model& model, const LinearizeOptions& options) {
  Selection s;
  for (Index i = 0; i < std::ssize(model.states); ++i) s.variables.push_back(i);
  const std::vector<std::string> wanted =
      options.inputs.empty() ? names(model.inputs) : options.inputs;
  for (const std::string& name : wanted) {
    const Index j = variable(model, name);
    if (j < std::ssize(model.states))
      throw std::invalid_argument(fmt::format("'{}' is a state, it cannot be an input", name));
    s.variables.push_back(j);
    s.inputs.push_back(signal_of(model, j));
  }
  return s;
}

std::vector<Range> ranges(const Model& model, const Selection& selection,
                          const LinearizeOptions& options) {
  for (const auto& [name, range] : options.bounds) (void)variable(model, name);
  std::vector<Range> bounds;
  for (const Index j : selection.variables) {
    const auto at = options.bounds.find(signal_of(model, j).name);
    bounds.push_back(at == options.bounds.end() ? Range{} : at->second);
  }
  return bounds;
}

// Fills the residual; what is not at rest but for what may move, in words.
std::string left_over(const Model& model, const LinearizeOptions& options, LinearModel& linear) {
  std::vector<std::string> moving;
  linear.residual = 0.0;
  for (Index i = 0; i < linear.rates.size(); ++i) {
    const Signal& s = model.states[std::size_t(i)];
    if (std::ranges::find(options.moving, s.name) != options.moving.end()) continue;
    const double scaled = std::abs(linear.rates[i]) / s.nominal;
    linear.residual = std::isfinite(scaled) ? std::max(linear.residual, scaled) : scaled;
    if (!(scaled <= options.tolerance))
      moving.push_back(fmt::format("{}' = {:.3g}", s.name, linear.rates[i]));
  }
  return moving.empty() ? "" : fmt::format("not an equilibrium: {}", fmt::join(moving, ", "));
}

// ∂row/∂variable in words: "V'" along a state's rate, the name of an output.
std::string row_name(const Model& model, Index row) {
  const Index nx = std::ssize(model.states);
  return row < nx ? model.states[std::size_t(row)].name + "'"
                  : model.outputs[std::size_t(row - nx)].name;
}

// The rates and outputs that are no finite numbers, in words; empty if all are.
std::string not_finite(const Model& model, const Evaluation& e) {
  Eigen::VectorXd y(e.rates.size() + e.outputs.size());
  y << e.rates, e.outputs;
  std::vector<std::string> words;
  for (Index row = 0; row < y.size(); ++row)
    if (!std::isfinite(y[row]))
      words.push_back(fmt::format("{} = {}", row_name(model, row), y[row]));
  return words.empty() ? "" : fmt::format("no finite numbers: {}", fmt::join(words, ", "));
}

// Exact and difference Jacobians that differ by more than their errors: one of them is wrong.
void compare(const Estimate& exact, const Estimate& differences, const Model& model,
             const Selection& selection, std::vector<std::string>& remarks) {
  constexpr double doubt = 10.0;  // error estimates are estimates
  for (Index i = 0; i < exact.value.rows(); ++i)
    for (Index j = 0; j < exact.value.cols(); ++j) {
      const double apart = std::abs(exact.value(i, j) - differences.value(i, j));
      if (apart <= doubt * (exact.error(i, j) + differences.error(i, j))) continue;
      remarks.push_back(fmt::format("d{}/d{}: exact {:.6g} and difference {:.6g} disagree",
                                    row_name(model, i),
                                    signal_of(model, selection.variables[std::size_t(j)]).name,
                                    exact.value(i, j), differences.value(i, j)));
    }
}

std::string not_finite(const Estimate& e, const Model& model, const Selection& s) {
  for (Index j = 0; j < e.value.cols(); ++j)
    for (Index i = 0; i < e.value.rows(); ++i)
      if (!std::isfinite(e.value(i, j)) || !std::isfinite(e.error(i, j)))
        return fmt::format("the model has no derivative of {} along {} at this point",
                           row_name(model, i), signal_of(model, s.variables[std::size_t(j)]).name);
  return {};
}

void split(const Estimate& all, LinearModel& linear) {
  const Index n = std::ssize(linear.states), m = std::ssize(linear.inputs);
  const Index l = std::ssize(linear.outputs);
  linear.A = all.value.topLeftCorner(n, n);
  linear.B = all.value.topRightCorner(n, m);
  linear.C = all.value.bottomLeftCorner(l, n);
  linear.D = all.value.bottomRightCorner(l, m);
  linear.A_error = all.error.topLeftCorner(n, n);
  linear.B_error = all.error.topRightCorner(n, m);
  linear.C_error = all.error.bottomLeftCorner(l, n);
  linear.D_error = all.error.bottomRightCorner(l, m);
}

// A, B, C, D where the point is at rest; calls the model, and so throws what the model throws.
void fill(const Model& model, const Selection& selection, const std::vector<Range>& bounds,
          const LinearizeOptions& options, LinearModel& linear) {
  const auto refused = [&linear](LinearizeStatus status, const std::string& why) {
    linear.status = status;
    linear.message = why;
    return !why.empty();
  };
  const Evaluation e = evaluate(model, linear.point);
  linear.rates = e.rates;
  const std::string moving = left_over(model, options, linear);
  if (refused(LinearizeStatus::not_finite, not_finite(model, e))) return;
  if (refused(LinearizeStatus::not_equilibrium, moving)) return;

  const Differences d = difference(model, linear.point, selection.variables, bounds);
  const bool use_exact = options.method == Method::exact && model.derivatives;
  const Estimate all = use_exact ? exact(model, linear.point, selection.variables) : d.jacobian;
  linear.method = use_exact ? Method::exact : Method::differences;
  linear.remarks = d.remarks;
  if (refused(LinearizeStatus::not_finite, not_finite(all, model, selection))) return;
  split(all, linear);
  linear.status = LinearizeStatus::linear;
  if (!use_exact) return;
  const Index n = std::ssize(linear.states);
  linear.A_differences = {d.jacobian.value.topLeftCorner(n, n),
                          d.jacobian.error.topLeftCorner(n, n)};
  compare(all, d.jacobian, model, selection, linear.remarks);
}

}  // namespace

LinearModel linearize(const Model& model, const OperatingPoint& point,
                      const LinearizeOptions& options) {
  check(model);
  check(model, point);
  for (const std::string& name : options.moving) (void)index_of(model.states, name, "state");
  const Selection selection = select(model, options);
  const std::vector<Range> bounds = ranges(model, selection, options);
  LinearModel linear;
  linear.mode_names = model.mode_names;
  linear.states = model.states;
  linear.inputs = selection.inputs;
  linear.outputs = model.outputs;
  linear.point = point;
  const auto threw = [&linear](const char* words) {
    linear.status = LinearizeStatus::model_threw;
    linear.message = fmt::format("the model threw: {}", words);
  };
  try {
    fill(model, selection, bounds, options, linear);
  } catch (const CallerMistake&) {
    throw;
  } catch (const std::exception& e) {
    threw(e.what());
  } catch (...) {
    threw("something that is not a std::exception");
  }
  return linear;
}

}  // namespace tiltrim
