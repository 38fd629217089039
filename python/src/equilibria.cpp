// trim, follow, linearize, modes, sensitivities for any model.
#include <fmt/core.h>

#include <algorithm>
#include <stdexcept>

#include "follow/sensitivity.hpp"
#include "python/src/calls.hpp"
#include "python/src/models.hpp"
#include "python/src/verbs.hpp"
#include "vehicles/mode_names.hpp"

namespace tiltrim::python {

using Eigen::MatrixXd;

FollowOptions follow_options_of(const py::dict& fields) {
  FollowOptions options;
  for_each_option(fields, [&](const std::string& name, py::handle value) {
    if (name == "max_step")
      options.max_step = value.cast<double>();
    else if (name == "max_points")
      options.max_points = value.cast<int>();
    else if (name == "stability")
      options.stability = value.cast<bool>();
    else if (name == "tolerance")
      options.tolerance = value.cast<double>();
    else if (name == "step_tolerance")
      options.step_tolerance = value.cast<double>();
    else
      throw std::invalid_argument(fmt::format("follow has no option '{}'", name));
  });
  return options;
}

namespace {

py::dict trimmed(const HeldModel& held, const py::dict& spec, const PointTuple& guess,
                 const py::dict& fields) {
  TrimOptions options = trim_options_of(fields);
  if (options.method != TrimMethod::newton || options.closest)
    refuse_within_callable("trim", "method='newton' and closest=False");
  const auto [result, raised] = run(held.callables, [&](const std::stop_token& stop) {
    options.stop = stop;
    return trim(held.model, spec_of(spec), point_of(guess), options);
  });
  py::dict d = dict_of(result);
  d["exception"] = raised;
  return d;
}

py::dict followed(const HeldModel& held, const py::dict& spec, const PointTuple& start,
                  const std::string& parameter, double to, const py::dict& fields) {
  FollowOptions options = follow_options_of(fields);
  refuse_within_callable("follow", "trim with method='newton' and closest=False");
  const TrimSpec asked = spec_of(spec);
  const auto [branch, raised] = run(held.callables, [&](const std::stop_token& stop) {
    options.stop = stop;
    return follow(held.model, asked, point_of(start), parameter, to, options);
  });
  py::dict d = dict_of(branch);
  d["exception"] = raised;
  return d;
}

Method method_of(const std::string& name) {
  if (name == "exact") return Method::exact;
  if (name == "differences") return Method::differences;
  throw std::invalid_argument(
      fmt::format("no method '{}'; expected 'exact' or 'differences'", name));
}

py::dict linearized(const HeldModel& held, const PointTuple& point, const std::string& method,
                    const std::vector<std::string>& inputs,
                    const std::map<std::string, RangeTuple>& bounds, double tolerance,
                    const std::vector<std::string>& moving, double time_limit) {
  LinearizeOptions options{method_of(method), inputs, {}, tolerance, moving, time_limit};
  for (const auto& [name, range] : bounds)
    options.bounds[name] = {std::get<0>(range), std::get<1>(range)};
  const auto work = [&](const std::stop_token&) {
    return linearize(held.model, point_of(point), options);
  };
  const auto [linear, raised] = run(held.callables, work, Lasts::a_moment);
  py::dict d = dict_of(linear);
  d["exception"] = raised;
  return d;
}

py::dict modes_of(const MatrixXd& A, const MatrixXd& A_error,
                  const std::vector<std::string>& states) {
  return dict_of(modes(A, A_error, states, aircraft_modes()));
}

py::dict sensitive(const HeldModel& held, const py::dict& spec, const PointTuple& trimmed,
                   const std::vector<std::string>& parameters) {
  const TrimSpec asked = spec_of(spec);
  const auto work = [&](const std::stop_token&) {
    return sensitivities(held.model, asked, point_of(trimmed), parameters);
  };
  return dict_of(run(held.callables, work, Lasts::a_moment).first);
}

// Points of a branch as arrays.
py::dict arrays_of(const std::vector<const BranchPoint*>& points) {
  const auto rows = [&](const auto& vector_of) {
    const auto columns = points.empty() ? 0 : vector_of(*points.front()).size();
    MatrixXd all(std::ssize(points), columns);
    for (std::size_t i = 0; i < points.size(); ++i)
      all.row(Eigen::Index(i)) = vector_of(*points[i]);
    return all;
  };
  std::vector<double> parameter, residual;
  std::vector<int> unstable;
  std::vector<bool> least;
  for (const BranchPoint* p : points) {
    parameter.push_back(p->parameter);
    residual.push_back(p->residual);
    unstable.push_back(p->unstable.value_or(-1));
    least.push_back(p->least);
  }
  py::dict d;
  d["parameter"] = array_of(parameter);
  d["x"] = rows([](const BranchPoint& p) { return p.point.x; });
  d["u"] = rows([](const BranchPoint& p) { return p.point.u; });
  d["p"] = rows([](const BranchPoint& p) { return p.point.p; });
  d["outputs"] = rows([](const BranchPoint& p) { return p.outputs; });
  d["residual"] = array_of(residual);
  d["unstable"] = array_of(unstable);
  d["least"] = least;
  return d;
}

}  // namespace

py::dict dict_of(const Sensitivities& s) {
  py::list parameters, most;
  for (const ParameterSensitivity& p : s.parameters) {
    py::dict d;
    d["parameter"] = SignalTuple(p.parameter.name, p.parameter.unit, p.parameter.nominal);
    d["value"] = p.value;
    d["x"] = p.x;
    d["u"] = p.u;
    d["outputs"] = p.outputs;
    std::vector<std::complex<double>> eigenvalue;
    std::vector<double> damping, frequency, error;
    for (const ParameterSensitivity::ModeSensitivity& m : p.modes) {
      eigenvalue.push_back(m.eigenvalue);
      damping.push_back(m.damping);
      frequency.push_back(m.frequency);
      error.push_back(m.error);
    }
    d["eigenvalue"] = array_of(eigenvalue);
    d["damping"] = array_of(damping);
    d["frequency"] = array_of(frequency);
    d["error"] = array_of(error);
    parameters.append(d);
  }
  for (std::size_t i = 0; i < s.modes.modes.size() && s; ++i) most.append(s.ranked(i));
  py::dict d;
  d["status"] = to_string(s.status);
  d["message"] = s.message;
  d["point"] = tuple_of(s.point);
  d["rcond"] = s.rcond;
  d["modes"] = dict_of(s.modes);
  d["simple"] = s.simple;
  d["parameters"] = parameters;
  d["ranked"] = most;
  return d;
}

py::dict dict_of(const Branch& branch) {
  std::vector<const BranchPoint*> points;
  for (const BranchPoint& p : branch.points) points.push_back(&p);
  const BranchPoint& last = branch.events.back().at;
  if (!points.empty() && last.point.x.size() > 0 && last.parameter != points.back()->parameter)
    points.push_back(&last);  // the end is a trim as well
  py::list events;
  for (const BranchEvent& e : branch.events) {
    py::dict d;
    d["kind"] = to_string(e.kind);
    d["parameter"] = e.at.parameter;
    d["error"] = e.error;
    d["point"] = tuple_of(e.at.point);
    d["outputs"] = e.at.outputs;
    d["unstable"] = e.at.unstable ? py::cast(*e.at.unstable) : py::none();
    d["after"] = e.after;
    d["which"] = e.which;
    d["eigenvalue"] = e.eigenvalue ? py::cast(*e.eigenvalue) : py::none();
    d["modes"] = e.modes ? py::object(dict_of(*e.modes)) : py::none();
    events.append(d);
  }
  py::dict d;
  d["points"] = arrays_of(points);
  d["events"] = events;
  d["end"] = to_string(branch.end);
  d["message"] = branch.message;
  d["no_stability"] = branch.no_stability;
  d["evaluations"] = branch.evaluations;
  return d;
}

void add_equilibria(py::module_& module) {
  using py::arg;
  module.def("trim", &trimmed, arg("model"), arg("spec"), arg("guess"), arg("options"));
  module.def("follow", &followed, arg("model"), arg("spec"), arg("start"), arg("parameter"),
             arg("to"), arg("options"));
  module.def("linearize", &linearized, arg("model"), arg("point"), arg("method"), arg("inputs"),
             arg("bounds"), arg("tolerance"), arg("moving"), arg("time_limit"));
  module.def("modes", &modes_of, arg("A"), arg("A_error"), arg("states"));
  module.def("sensitivities", &sensitive, arg("model"), arg("spec"), arg("point"),
             arg("parameters"));
}

}  // namespace tiltrim::python
