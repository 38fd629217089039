#include "sweep/prepared.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <set>
#include <stdexcept>

#include "linearize/batch.hpp"
#include "model/lookup.hpp"

namespace tiltrim {

using Eigen::Index;

TrimSpec free_of(TrimSpec spec, const Model& model, const std::vector<SweepAxis>& axes) {
  std::set<std::string> set;
  for (const SweepAxis& axis : axes)
    for (const SweepAxis::Column& column : axis.columns) {
      if (column.signal.empty()) continue;
      if (!set.insert(column.signal).second)
        throw std::invalid_argument(
            fmt::format("{} is set twice by the axes; expected each number once", column.name));
      if (std::ranges::find(spec.free, column.signal) != spec.free.end())
        throw std::invalid_argument(
            fmt::format("{} is a free variable of this trim; expected a number with a given value",
                        column.name));
      const auto at = spec.bounds.find(column.signal);
      if (at != spec.bounds.end() && at->second.lower == at->second.upper) spec.bounds.erase(at);
      check_within_limits(spec, column.signal, column.si);
      (void)variable(model, column.signal);
    }
  return spec;
}

namespace {

const Model::Affine* structure_of(const Model& model, const SweepAxis& axis) {
  const Model::Affine* found = nullptr;
  for (const SweepAxis::Column& column : axis.columns) {
    if (column.signal.empty()) continue;
    const auto at = std::ranges::find(model.affine, column.signal, &Model::Affine::parameter);
    if (found || at == model.affine.end()) return nullptr;  // exactly one parameter, an affine one
    found = &*at;
  }
  return found;
}

}  // namespace

Prepared::Prepared(const SweepRequest& r, const std::vector<SweepAxis>& a, const TrimOptions& t)
    : request(r),
      axes(a),
      trimming(t),
      problem(make_problem(r.model, free_of(r.spec, r.model, a), r.guess)) {
  const Model& m = r.model;
  if (states() > largest_batch_matrix)
    throw std::invalid_argument(fmt::format("sweep and tune support up to {} states, the {} has {}",
                                            largest_batch_matrix, m.name, states()));
  for (Index i = 0; i < states(); ++i) along.push_back(i);
  for (const Index j : problem.unknowns) {
    const auto known = std::ranges::find(along, j);
    unknowns.push_back(known - along.begin());
    if (known == along.end()) along.push_back(j);
  }
  const auto is_output = [&](Index row) { return row >= states(); };
  output_equations = std::ranges::any_of(problem.equations, is_output);
  for (const SweepAxis& axis : a) {
    moved.emplace_back();
    for (const SweepAxis::Column& column : axis.columns)
      moved.back().push_back(column.signal.empty() ? -1 : variable(m, column.signal));
    const bool plain =
        problem.square() && std::ssize(along) == states() &&
        std::ranges::all_of(problem.equations, [&](Index row) { return row < states(); });
    affine.push_back(plain ? structure_of(m, axis) : nullptr);
  }
  const Index nu = std::ssize(m.inputs);
  for (const std::string& name : r.inputs) {
    const Index input = find(m.inputs, name);
    inputs.push_back(input >= 0 ? input : nu + index_of(m.outputs, name, "output"));
    if (std::ranges::count(r.inputs, name) > 1)
      throw std::invalid_argument(
          fmt::format("inputs: '{}' is listed twice; expected each once", name));
  }
}

double coordinate(const SweepAxis& axis, double position) {
  const std::vector<double>& values = axis.columns.front().values;
  const auto k = std::min(std::size_t(position), values.size() - 1);
  const double share = position - double(k);
  return share == 0 ? values[k] : values[k] + share * (values[k + 1] - values[k]);
}

std::vector<double> values_at(const SweepAxis& axis, double position) {
  const auto k = std::min(std::size_t(position), axis.size() - 1);
  const double share = position - double(k);
  std::vector<double> values;
  for (const SweepAxis::Column& column : axis.columns) {
    const std::vector<double>& si = column.si;
    values.push_back(share == 0 ? si[k] : si[k] + share * (si[k + 1] - si[k]));
  }
  if (share != 0 && axis.between) axis.between(values);
  return values;
}

void move_to(const Prepared& sweep, std::size_t axis, double position, OperatingPoint& at) {
  const std::vector<double> values = values_at(sweep.axes[axis], position);
  for (std::size_t c = 0; c < values.size(); ++c)
    if (const Index j = sweep.moved[axis][c]; j >= 0) set_value(at, j, values[c]);
}

OperatingPoint numbers_at(const Prepared& sweep, const GridPlace& place) {
  OperatingPoint at = sweep.request.guess;
  for (std::size_t axis = 0; axis < place.size(); ++axis) move_to(sweep, axis, place[axis], at);
  return at;
}

}  // namespace tiltrim
