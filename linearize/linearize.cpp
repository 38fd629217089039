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

// Fills the residual; whether the point is an equilibrium but for what may move.
bool at_rest(const Model& model, const LinearizeOptions& options, LinearModel& linear) {
  for (const std::string& name : options.moving) (void)index_of(model.states, name, "state");
  std::vector<std::string> moving;
  for (Index i = 0; i < linear.rates.size(); ++i) {
    const Signal& s = model.states[std::size_t(i)];
    if (std::ranges::find(options.moving, s.name) != options.moving.end()) continue;
    const double scaled = std::abs(linear.rates[i]) / s.nominal;
    linear.residual = std::isfinite(scaled) ? std::max(linear.residual, scaled) : scaled;
    if (!(scaled <= options.tolerance))
      moving.push_back(fmt::format("{}' = {:.3g}", s.name, linear.rates[i]));
  }
  if (moving.empty()) return true;
  linear.message = fmt::format("not an equilibrium: {}", fmt::join(moving, ", "));
  return false;
}

// ∂row/∂variable in words: "V'" along a state's rate, the name of an output.
std::string row_name(const Model& model, Index row) {
  const Index nx = std::ssize(model.states);
  return row < nx ? model.states[std::size_t(row)].name + "'"
                  : model.outputs[std::size_t(row - nx)].name;
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

}  // namespace

LinearModel linearize(const Model& model, const OperatingPoint& point,
                      const LinearizeOptions& options) {
  check(model);
  check(model, point);
  const Selection selection = select(model, options);
  LinearModel linear;
  linear.states = model.states;
  linear.inputs = selection.inputs;
  linear.outputs = model.outputs;
  linear.point = point;
  linear.rates = evaluate(model, point).rates;
  if (!at_rest(model, options, linear)) return linear;

  const Differences d =
      difference(model, point, selection.variables, ranges(model, selection, options));
  const bool use_exact = options.method == Method::exact && model.derivatives;
  const Estimate all = use_exact ? exact(model, point, selection.variables) : d.jacobian;
  linear.method = use_exact ? Method::exact : Method::differences;
  linear.remarks = d.remarks;
  linear.message = not_finite(all, model, selection);
  if (!linear.message.empty()) {
    linear.status = LinearizeStatus::not_finite;
    return linear;
  }
  split(all, linear);
  linear.status = LinearizeStatus::linear;
  if (use_exact) {
    const Index n = std::ssize(linear.states);
    linear.A_differences = {d.jacobian.value.topLeftCorner(n, n),
                            d.jacobian.error.topLeftCorner(n, n)};
    compare(all, d.jacobian, model, selection, linear.remarks);
  }
  return linear;
}

}  // namespace tiltrim
