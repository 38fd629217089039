#include "python/src/convert.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <functional>
#include <stdexcept>
#include <type_traits>

namespace tiltrim::python {

Signals signals_of(const std::vector<SignalTuple>& tuples) {
  Signals signals;
  for (const auto& [name, unit, nominal] : tuples) signals.push_back({name, unit, nominal});
  return signals;
}

std::vector<SignalTuple> tuples_of(const Signals& signals) {
  std::vector<SignalTuple> tuples;
  for (const Signal& s : signals) tuples.emplace_back(s.name, s.unit, s.nominal);
  return tuples;
}

TrimSpec spec_of(const py::dict& fields) {
  TrimSpec spec;
  spec.free = fields["free"].cast<std::vector<std::string>>();
  spec.steady = fields["steady"].cast<std::vector<std::string>>();
  spec.rates = fields["rates"].cast<std::map<std::string, double>>();
  spec.implied = fields["implied"].cast<std::vector<std::string>>();
  spec.moving = fields["moving"].cast<std::vector<std::string>>();
  for (const auto& [name, range] : fields["bounds"].cast<std::map<std::string, RangeTuple>>())
    spec.bounds[name] = {std::get<0>(range), std::get<1>(range)};
  for (const auto& [signal, scale, reference] : fields["effort"].cast<std::vector<EffortTuple>>())
    spec.effort.push_back({signal, scale, reference});
  return spec;
}

py::dict dict_of(const TrimSpec& spec) {
  std::map<std::string, RangeTuple> bounds;
  for (const auto& [name, range] : spec.bounds) bounds[name] = {range.lower, range.upper};
  std::vector<EffortTuple> effort;
  for (const CostTerm& e : spec.effort) effort.emplace_back(e.signal, e.scale, e.reference);
  py::dict d;
  d["free"] = spec.free;
  d["steady"] = spec.steady;
  d["rates"] = spec.rates;
  d["bounds"] = bounds;
  d["implied"] = spec.implied;
  d["moving"] = spec.moving;
  d["effort"] = effort;
  return d;
}

static TrimMethod method_of(const std::string& name) {
  if (name == "ipopt") return TrimMethod::ipopt;
  if (name == "newton") return TrimMethod::newton;
  throw std::invalid_argument(fmt::format("no method '{}'; expected 'ipopt' or 'newton'", name));
}

static void set_option(TrimOptions& options, const std::string& name, const py::handle& value) {
  if (name == "method")
    options.method = method_of(value.cast<std::string>());
  else if (name == "tolerance")
    options.tolerance = value.cast<double>();
  else if (name == "step_tolerance")
    options.step_tolerance = value.cast<double>();
  else if (name == "others")
    options.others = value.cast<bool>();
  else if (name == "starts")
    options.starts = value.cast<int>();
  else if (name == "max_iterations")
    options.max_iterations = value.cast<int>();
  else if (name == "max_boxes")
    options.max_boxes = value.cast<int>();
  else if (name == "time_limit")
    options.time_limit = value.cast<double>();
  else if (name == "closest")
    options.closest = value.cast<bool>();
  else
    throw std::invalid_argument(fmt::format("trim has no option '{}'", name));
}

void for_each_option(const py::dict& options,
                     const std::function<void(const std::string& name, py::handle value)>& set) {
  for (const auto& [key, value] : options) {
    const std::string name = py::str(key);
    try {
      set(name, value);
    } catch (const py::cast_error&) {
      throw py::type_error(fmt::format("{} cannot be {}", name, std::string(py::repr(value))));
    }
  }
}

TrimOptions trim_options_of(const py::dict& fields, TrimOptions options) {
  for_each_option(
      fields, [&](const std::string& name, py::handle value) { set_option(options, name, value); });
  return options;
}

py::dict dict_of(const TrimResult& r) {
  py::list limits, others;
  for (const ActiveLimit& l : r.limits_active)
    limits.append(py::make_tuple(l.signal, l.upper ? "upper" : "lower", l.value));
  for (const OperatingPoint& other : r.others) others.append(tuple_of(other));
  py::dict d;
  d["status"] = to_string(r.status);
  d["equilibrium"] = is_equilibrium(r.status);
  d["point"] = tuple_of(r.point);
  d["rates"] = r.rates;
  d["outputs"] = r.outputs;
  d["residual"] = r.residual;
  d["step"] = r.step;
  d["rcond"] = r.rcond;
  d["effort"] = r.effort;
  d["limits_active"] = limits;
  d["others"] = others;
  d["starts"] = r.starts;
  d["evaluations"] = r.evaluations;
  d["message"] = r.message;
  d["thrown"] = r.thrown;
  return d;
}

py::dict dict_of(const LinearModel& l) {
  py::dict d;
  d["status"] = to_string(l.status);
  d["states"] = tuples_of(l.states);
  d["inputs"] = tuples_of(l.inputs);
  d["outputs"] = tuples_of(l.outputs);
  d["point"] = tuple_of(l.point);
  d["rates"] = l.rates;
  d["residual"] = l.residual;
  d["A"] = l.A;
  d["B"] = l.B;
  d["C"] = l.C;
  d["D"] = l.D;
  d["A_error"] = l.A_error;
  d["B_error"] = l.B_error;
  d["C_error"] = l.C_error;
  d["D_error"] = l.D_error;
  d["method"] = l.method == Method::exact ? "exact" : "differences";
  d["A_differences"] = l.A_differences ? py::cast(l.A_differences->value) : py::none();
  d["A_differences_error"] = l.A_differences ? py::cast(l.A_differences->error) : py::none();
  d["remarks"] = l.remarks;
  d["message"] = l.message;
  return d;
}

// One property of all modes: a number, or a vector, which becomes a row.
template <class Of>
static auto column(const std::vector<Mode>& modes, Of of) {
  std::vector<std::decay_t<std::invoke_result_t<Of, const Mode&>>> all;
  all.reserve(modes.size());
  for (const Mode& m : modes) all.push_back(std::invoke(of, m));
  return all;
}

template <class Vector>
static py::array_t<typename Vector::Scalar> rows(const std::vector<Mode>& modes, Vector Mode::*of) {
  const auto n = py::ssize_t(modes.size());
  py::array_t<typename Vector::Scalar> all({n, n});
  auto* at = all.mutable_data();
  for (const Mode& m : modes) at = std::ranges::copy(m.*of, at).out;
  return all;
}

py::dict dict_of(const Modes& found) {
  const std::vector<Mode>& modes = found.modes;
  const auto numbers = [&](auto of) { return array_of(column(modes, of)); };
  py::dict columns;
  columns["eigenvalue"] = numbers(&Mode::eigenvalue);
  columns["frequency"] = numbers(&Mode::frequency);
  columns["damping"] = numbers(&Mode::damping);
  columns["time_to_half"] = numbers(&Mode::time_to_half);
  columns["error"] = numbers(&Mode::error);
  columns["condition"] = numbers(&Mode::condition);
  columns["backward_error"] = numbers(&Mode::backward_error);
  columns["right"] = rows(modes, &Mode::right);
  columns["left"] = rows(modes, &Mode::left);
  columns["participation"] = rows(modes, &Mode::participation);
  columns["name"] = column(modes, &Mode::name);
  columns["determined"] = column(modes, &Mode::determined);
  py::dict d;
  d["columns"] = columns;
  d["verdict"] = to_string(found.verdict);
  d["spectral_abscissa"] = found.spectral_abscissa;
  d["converged"] = found.converged;
  return d;
}

}  // namespace tiltrim::python
