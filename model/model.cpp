#include "model/model.hpp"

#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "model/in_place.hpp"
#include "model/lookup.hpp"
#include "model/name_table.hpp"

namespace tiltrim {

using Eigen::Index;
using Eigen::VectorXd;

static void check_size(const std::string& what, Index expected, const VectorXd& got) {
  if (got.size() != expected)
    throw CallerMistake(fmt::format("{}: expected {} values, got {}", what, expected, got.size()));
}

static std::string answer_of(const Model& model, const char* function) {
  return model.name.empty() ? fmt::format("the model's {}", function)
                            : fmt::format("model '{}': its {}", model.name, function);
}

void check_rates(const Model& model, const VectorXd& rates) {
  if (rates.size() != std::ssize(model.states))
    check_size(answer_of(model, "rates f"), std::ssize(model.states), rates);
}

void check_outputs(const Model& model, const VectorXd& outputs) {
  if (outputs.size() != std::ssize(model.outputs))
    check_size(answer_of(model, "outputs h"), std::ssize(model.outputs), outputs);
}

void check_derivatives(const Model& model, const Eigen::MatrixXd& J, std::size_t variables) {
  const std::size_t rows = model.states.size() + model.outputs.size();
  if (J.rows() != Index(rows) || J.cols() != Index(variables))
    throw CallerMistake(fmt::format("{}: expected {} x {} values, got {} x {}",
                                    answer_of(model, "derivatives"), rows, variables, J.rows(),
                                    J.cols()));
}

static void check_sizes(const Model& model, const OperatingPoint& point) {
  check_size("state x", std::ssize(model.states), point.x);
  check_size("input u", std::ssize(model.inputs), point.u);
  check_size("parameters p", std::ssize(model.parameters), point.p);
}

Evaluation evaluate(const Model& model, const OperatingPoint& point) {
  check_sizes(model, point);
  if (const InPlace* const both = in_place(model)) {
    Evaluation e{VectorXd(both->states), VectorXd(both->outputs)};
    both->write(point.x.data(), point.u.data(), point.p.data(), e.rates.data(), e.outputs.data());
    return e;
  }
  Evaluation e{model.f(point.x, point.u, point.p), {}};
  check_rates(model, e.rates);
  if (model.h) e.outputs = model.h(point.x, point.u, point.p);
  check_outputs(model, e.outputs);
  return e;
}

Index variable(const Model& model, std::string_view name) {
  const Index nx = std::ssize(model.states);
  const Index nu = std::ssize(model.inputs);
  if (const Index i = find(model.states, name); i >= 0) return i;
  if (const Index i = find(model.inputs, name); i >= 0) return nx + i;
  if (const Index i = find(model.parameters, name); i >= 0) return nx + nu + i;
  std::vector<std::string> all = names(model.states);
  std::ranges::copy(names(model.inputs), std::back_inserter(all));
  std::ranges::copy(names(model.parameters), std::back_inserter(all));
  const std::string near = nearest_name(name, all);
  throw std::invalid_argument(fmt::format("no signal '{}'{}; the model has: {}", name,
                                          near.empty() ? "" : fmt::format(" (nearest: '{}')", near),
                                          fmt::join(all, ", ")));
}

const Signal& signal_of(const Model& model, Index variable) {
  const Index nx = std::ssize(model.states);
  const Index nu = std::ssize(model.inputs);
  if (variable < nx) return model.states[std::size_t(variable)];
  if (variable < nx + nu) return model.inputs[std::size_t(variable - nx)];
  return model.parameters.at(std::size_t(variable - nx - nu));
}

std::string row_name(const Model& model, Index row) {
  const Index nx = std::ssize(model.states);
  return row < nx ? model.states[std::size_t(row)].name + "'"
                  : model.outputs[std::size_t(row - nx)].name;
}

double value_of(const OperatingPoint& point, Index variable) {
  const Index nx = point.x.size();
  const Index nu = point.u.size();
  if (variable < nx) return point.x[variable];
  if (variable < nx + nu) return point.u[variable - nx];
  return point.p[variable - nx - nu];
}

void set_value(OperatingPoint& point, Index variable, double value) {
  const Index nx = point.x.size();
  const Index nu = point.u.size();
  if (variable < nx)
    point.x[variable] = value;
  else if (variable < nx + nu)
    point.u[variable - nx] = value;
  else
    point.p[variable - nx - nu] = value;
}

OperatingPoint changed(const Model& model, OperatingPoint point,
                       const std::map<std::string, double>& values) {
  check_sizes(model, point);
  for (const auto& [name, value] : values) set_value(point, variable(model, name), value);
  return point;
}

OperatingPoint point_of(const Model& model, const std::map<std::string, double>& values) {
  return changed(
      model,
      {VectorXd::Zero(std::ssize(model.states)), VectorXd::Zero(std::ssize(model.inputs)),
       VectorXd::Zero(std::ssize(model.parameters))},
      values);
}

double value_of(const Model& model, const OperatingPoint& point, std::string_view name) {
  check_sizes(model, point);
  return value_of(point, variable(model, name));
}

void check(const Model& model) { (void)checked_names(model); }

ModelNames checked_names(const Model& model) {
  if (!model.f) throw std::invalid_argument("the model has no function f");
  if (!model.outputs.empty() && !model.h)
    throw std::invalid_argument("the model names outputs but has no function h");
  for (const Signals* signals : {&model.states, &model.inputs, &model.outputs})
    if (signals->size() > largest_model)
      throw std::invalid_argument(
          fmt::format("{} signals in one vector of the model; these methods use dense matrices and "
                      "support at most {}",
                      signals->size(), largest_model));
  ModelNames names{NameTable({&model.states, &model.inputs, &model.parameters}),
                   NameTable({&model.outputs})};
  const auto check_all = [](const Signals& signals, NameTable& seen) {
    for (const Signal& s : signals) {
      if (!seen.insert(s.name))
        throw std::invalid_argument(fmt::format("the signal name '{}' is used twice", s.name));
      if (!(s.nominal > 0 && std::isfinite(s.nominal)))
        throw std::invalid_argument(
            fmt::format("signal '{}': nominal size {} is not positive", s.name, s.nominal));
    }
  };
  check_all(model.states, names.variables);
  check_all(model.inputs, names.variables);
  check_all(model.parameters, names.variables);
  check_all(model.outputs, names.outputs);
  return names;
}

void check(const Model& model, const OperatingPoint& point) {
  check_sizes(model, point);
  // Any NaN or infinity makes the sum NaN.
  const auto finite = [](const VectorXd& v) { return std::isfinite((0.0 * v).sum()); };
  if (finite(point.x) && finite(point.u) && finite(point.p)) return;
  const Index n = point.x.size() + point.u.size() + point.p.size();
  for (Index j = 0; j < n; ++j)
    if (!std::isfinite(value_of(point, j)))
      throw std::invalid_argument(
          fmt::format("'{}' is {}", signal_of(model, j).name, value_of(point, j)));
}

}  // namespace tiltrim
