// Analyses of a study's conditions.
#include "study/analyses.hpp"

#include <algorithm>
#include <optional>

#include "python/src/calls.hpp"
#include "python/src/studies.hpp"
#include "python/src/verbs.hpp"

namespace tiltrim::python {

namespace {

TrimOptions trimming_of(const HeldCondition& held, const py::dict& fields) {
  return trim_options_of(fields, {.time_limit = held.study->time_limit});
}

// A study's key, or the key of a model's signal.
Key key_of(const Study& study, const std::string& name) {
  const std::vector<Key> keys = keys_of(study);
  const auto found = std::ranges::find(keys, name, &Key::signal);
  return found != keys.end() ? *found : key_among(keys, name);
}

py::dict sensitive_condition(const HeldCondition& held, const std::vector<std::string>& parameters,
                             const py::dict& fields) {
  refuse_within_callable("sensitivities", no_ipopt);
  std::vector<Key> keys;
  for (const std::string& name : parameters) keys.push_back(key_of(*held.study, name));
  TrimOptions trimming = trimming_of(held, fields);
  const SensitivityAnswer answer =
      run(false, [&](const std::stop_token& stop) {
        trimming.stop = stop;
        return sensitivities(held.vehicle(), held.condition, keys, trimming);
      }).first;
  py::dict d = dict_of(answer.sensitivities);
  d["model"] = HeldModel::built_in(answer.trimmed.model);
  return d;
}

py::list listed(const std::vector<Margins::Crossing>& crossings) {
  py::list all;
  for (const Margins::Crossing& c : crossings) all.append(py::make_tuple(c.frequency, c.change));
  return all;
}

py::dict in_dict(const Margins& m) {
  py::dict d;
  d["verdict"] = to_string(m.closed_loop);
  d["gain_up"] = m.gain_up;
  d["gain_up_at"] = m.gain_up_at;
  d["gain_down"] = m.gain_down;
  d["gain_down_at"] = m.gain_down_at;
  d["phase"] = m.phase;
  d["phase_at"] = m.phase_at;
  d["delay"] = m.delay;
  d["delay_at"] = m.delay_at;
  d["disk"] = m.disk;
  d["disk_at"] = m.disk_at;
  d["disk_gain_up"] = m.disk_gain_up();
  d["disk_gain_down"] = m.disk_gain_down();
  d["disk_phase"] = m.disk_phase();
  d["sensitivity_peak"] = m.sensitivity_peak;
  d["sensitivity_peak_at"] = m.sensitivity_peak_at;
  d["phase_crossings"] = listed(m.phase_crossings);
  d["gain_crossovers"] = listed(m.gain_crossovers);
  d["residual"] = m.residual;
  d["complete"] = m.complete;
  return d;
}

py::dict in_dict(const ActuatorLoop& l) {
  py::dict d = in_dict(l.margins);
  d["name"] = l.actuator;
  d["in_use"] = l.in_use;
  d["A"] = l.loop.A;
  d["b"] = l.loop.b;
  d["c"] = l.loop.c;
  d["d"] = l.loop.d;
  d["frequency"] = array_of(l.bode.frequency);
  d["magnitude"] = array_of(l.bode.magnitude);
  d["phase_of"] = array_of(l.bode.phase);
  return d;
}

py::dict margins_of(const HeldCondition& held, const std::vector<std::string>& loops,
                    std::optional<double> from, std::optional<double> to, int points,
                    const py::dict& fields) {
  refuse_within_callable("margins", "margins of a LinearModel");
  LoopsOptions options{loops, from, to, points};
  TrimOptions trimming = trimming_of(held, fields);
  const LoopsAnswer answer =
      run(false, [&](const std::stop_token& stop) {
        trimming.stop = stop;
        return actuator_loops(held.vehicle(), held.condition, options, trimming);
      }).first;
  py::list all;
  for (const ActuatorLoop& l : answer.loops) all.append(in_dict(l));
  const bool linear = bool(answer.linear);
  std::vector<std::string> states;
  for (const Signal& s : answer.linear.states) states.push_back(s.name);
  py::dict d;
  d["status"] = to_string(answer.trimmed.trim.status);
  d["message"] = answer.trimmed.has_equilibrium() && !linear ? answer.linear.message
                                                             : answer.trimmed.trim.message;
  d["answered"] = answer.answered();
  d["modes"] = linear ? py::object(dict_of(answer.modes)) : py::none();
  d["states"] = states;
  d["loops"] = all;
  return d;
}

// A loop of any linear model: broken in the closed loop, or given open.
py::dict margins_of_loop(const std::string& name, const Eigen::MatrixXd& A,
                         const Eigen::VectorXd& b, const Eigen::VectorXd& c, double d, bool closed,
                         double from, double to, int points) {
  ActuatorLoop l{name, !b.isZero(0) && !c.isZero(0), {A, b, c.transpose(), d}, {}, {}};
  l.in_use = l.in_use || d != 0;
  if (closed) l.loop = opened(A, b, c.transpose(), d);
  if (l.in_use) {
    l.margins = margins(l.loop);
    l.bode = bode(l.loop, from, to, points);
  }
  return in_dict(l);
}

}  // namespace

void add_analyses(py::module_& module) {
  using py::arg;
  module.def("sensitivities_condition", &sensitive_condition, arg("condition"), arg("parameters"),
             arg("trimming"));
  module.def("margins_condition", &margins_of, arg("condition"), arg("loops"), arg("lowest"),
             arg("highest"), arg("points"), arg("trimming"));
  module.def("margins", &margins_of_loop, arg("name"), arg("A"), arg("b"), arg("c"), arg("d"),
             arg("closed"), arg("lowest"), arg("highest"), arg("points"));
}

}  // namespace tiltrim::python
