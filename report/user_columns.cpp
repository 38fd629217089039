#include "report/user_columns.hpp"

#include <algorithm>

#include "model/degrees.hpp"

namespace tiltrim {

using Eigen::Index;

namespace {

bool in_degrees(const Signal& signal) { return signal.unit == "rad"; }

SheetColumn column_of(const Signal& s) {
  constexpr double rounding = 1e-12;  // of the nominal size; below it a computed value is noise
  const double unit = in_degrees(s) ? degrees : 1.0;
  return {column_key(s.name + (in_degrees(s) ? "_deg" : "")), s.name, in_degrees(s) ? "°" : s.unit,
          "{:.7g}", rounding * s.nominal * unit};
}

// Every signal that has a column, and its value.
template <class Show>
void for_each(const Model& model, const std::vector<std::string>& parameters, const Show& show) {
  const auto all = [&](const Signals& signals, const auto& vector) {
    for (std::size_t i = 0; i < signals.size(); ++i) show(signals[i], vector, Index(i));
  };
  all(model.states, &OperatingPoint::x);
  all(model.inputs, &OperatingPoint::u);
  for (std::size_t i = 0; i < model.parameters.size(); ++i)
    if (std::ranges::find(parameters, model.parameters[i].name) != parameters.end())
      show(model.parameters[i], &OperatingPoint::p, Index(i));
}

}  // namespace

std::vector<std::string> shown_parameters(const std::vector<Condition>& conditions) {
  const std::map<std::string, Range> none;
  std::vector<std::string> all;
  for (const Condition& c : conditions)
    for (const auto& [name, range] : c.user() ? c.user()->values : none)
      if (find(c.user()->model->model.parameters, name) >= 0 &&
          std::ranges::find(all, name) == all.end())
        all.push_back(name);
  return all;
}

std::vector<SheetColumn> user_columns(const Model& model,
                                      const std::vector<std::string>& parameters) {
  std::vector<SheetColumn> columns;
  for_each(model, parameters, [&](const Signal& s, auto vector, Index) {
    columns.push_back(column_of(s));
    if (vector == &OperatingPoint::p) columns.back().rounding = 0.0;  // given, not computed
  });
  for (const Signal& s : model.outputs) columns.push_back(column_of(s));
  return columns;
}

std::vector<SheetCell> user_cells(const Model& model, const std::vector<std::string>& parameters,
                                  const OperatingPoint& at, const Eigen::VectorXd& outputs) {
  std::vector<SheetCell> cells;
  for_each(model, parameters, [&](const Signal& s, auto vector, Index i) {
    cells.emplace_back((at.*vector)[i] * (in_degrees(s) ? degrees : 1.0));
  });
  for (std::size_t i = 0; i < model.outputs.size(); ++i)
    cells.push_back(
        Index(i) < outputs.size()
            ? SheetCell(outputs[Index(i)] * (in_degrees(model.outputs[i]) ? degrees : 1.0))
            : SheetCell());
  return cells;
}

}  // namespace tiltrim
