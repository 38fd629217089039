// sweep and tune for any problem.
#include "python/src/sweeps.hpp"

#include <fmt/core.h>

#include <cmath>
#include <limits>
#include <stdexcept>

#include "model/lookup.hpp"
#include "python/src/calls.hpp"
#include "python/src/verbs.hpp"
#include "tune/measures.hpp"

namespace tiltrim::python {

using Eigen::VectorXd;

namespace {

// ---- Arguments ----------------------------------------------------------------------------------

/// name, model, spec, guess, inputs to keep
using ProblemTuple =
    std::tuple<std::string, py::object, py::dict, PointTuple, std::vector<std::string>>;
/// name, columns of (signal, unit, values)
using AxisTuple =
    std::tuple<std::string, std::vector<std::tuple<std::string, std::string, std::vector<double>>>>;

std::vector<SweepRequest> requests_of(const std::vector<ProblemTuple>& problems, bool& callables) {
  std::vector<SweepRequest> requests;
  for (const auto& [name, model, spec, guess, inputs] : problems) {
    const auto& held = model.cast<const HeldModel&>();
    callables = callables || held.callables;
    requests.push_back({name, held.model, spec_of(spec), point_of(guess), inputs, {}});
  }
  return requests;
}

std::vector<SweepAxis> axes_of(const std::vector<AxisTuple>& tuples) {
  std::vector<SweepAxis> axes;
  for (const auto& [name, columns] : tuples) {
    SweepAxis axis;
    axis.name = name;
    for (const auto& [signal, unit, values] : columns)
      axis.columns.push_back({signal, unit, signal, values, values});
    axes.push_back(std::move(axis));
  }
  return axes;
}

// Models with callables use one thread: this one.
int threads_of(int threads, bool callables) {
  if (!callables) return threads;
  if (threads > 1)
    throw std::invalid_argument(
        fmt::format("{} threads for a model with Python callables; expected 1", threads));
  return 1;
}

Measure measure_of(const std::string& name) {
  std::vector<std::string> all;
  for (const Measure m : measures()) {
    if (m == Measure::figure) continue;
    if (to_string(m) == name) return m;
    all.push_back(to_string(m));
  }
  const std::string near = nearest_name(name, all);
  std::string list;
  for (const std::string& one : all) list += (list.empty() ? "" : ", ") + one;
  throw std::invalid_argument(fmt::format("no measure '{}'{}; there are: {}", name,
                                          near.empty() ? "" : fmt::format(" (nearest: '{}')", near),
                                          list));
}

// The number of `limit`, `at_least` or `at_most`, of which the measure has one sense.
double limit_of(const Requirement& r, const std::string& side, const py::handle& value) {
  const bool more = more_is_better(r.measure);
  if (side == (more ? "at_most" : "at_least"))
    throw std::invalid_argument(fmt::format("for {}, {} is better; expected {}", name_of(r),
                                            more ? "more" : "less", more ? "at_least" : "at_most"));
  if (!std::isnan(r.limit)) throw std::invalid_argument(name_of(r) + " has two limits");
  return value.cast<double>();
}

// Of {measure, limit, of, input, output, ...}; the limit is NaN if there is none.
Requirement requirement_of(const py::dict& given) {
  if (!given.contains("measure")) throw std::invalid_argument("a requirement has no 'measure'");
  Requirement r{measure_of(given["measure"].cast<std::string>())};
  r.limit = std::numeric_limits<double>::quiet_NaN();
  for (const auto& [key, value] : given) {
    const std::string name = py::str(key);
    if (name == "limit" || name == "at_least" || name == "at_most")
      r.limit = limit_of(r, name, value);
    else if (name == "of")
      r.of = value.cast<std::string>();
    else if (name == "input")
      r.from = value.cast<std::vector<std::string>>();
    else if (name == "output")
      r.to = value.cast<std::vector<std::string>>();
    else if (name == "numerator")
      r.numerator = value.cast<std::vector<double>>();
    else if (name == "denominator")
      r.denominator = value.cast<std::vector<double>>();
    else if (name == "weights")
      r.weights = value.cast<std::map<std::string, double>>();
    else if (name == "band")
      r.band = value.cast<double>();
    else if (name == "decay")
      r.decay = value.cast<double>();
    else if (name == "damping")
      r.damping = value.cast<double>();
    else if (name == "frequency")
      r.frequency = value.cast<double>();
    else if (name != "measure")
      throw std::invalid_argument(fmt::format("a requirement has no '{}'", name));
  }
  return r;
}

py::dict swept(const std::vector<ProblemTuple>& problems, const std::vector<AxisTuple>& axes,
               const py::dict& fields, const py::object& listener) {
  refuse_within_callable("sweep", "trim with method='newton' and closest=False");
  bool callables = false;
  const std::vector<SweepRequest> requests = requests_of(problems, callables);
  SweepOptions options = sweep_options_of(fields, callables);
  Progress progress(listener);
  observe(options, progress);
  const auto work = [&](const std::stop_token& stop) {
    options.stop = options.trimming.stop = stop;
    return sweep_so_far(requests, axes_of(axes), options);
  };
  const auto [swept, raised] = run(callables, work, Lasts::any_time, &progress);
  py::dict d = dict_of(swept.map);
  d["interrupted"] = swept.interrupted;
  d["exception"] = raised;
  return d;
}

// ---- Tuning -------------------------------------------------------------------------------------

py::dict in_dict(const TuneProblem& problem, const Achieved& a) {
  py::dict d;
  d["point"] = problem.points.at(a.place.point).name;
  d["scatter"] = a.place.scatter;
  d["measure"] = name_of(a.requirement);
  d["unit"] = std::string(unit(a.requirement.measure));
  d["of"] = a.requirement.of;
  d["limit"] = a.requirement.limit;
  d["goal"] = a.asked < goals_of(problem);
  d["value"] = a.value;
  d["eigenvalue"] = a.eigenvalue;
  d["active"] = a.active;
  d["reserve"] = a.reserve();
  return d;
}

py::dict tuned(const std::vector<ProblemTuple>& problems, const py::dict& asked,
               const py::dict& fields, const py::object& listener) {
  refuse_within_callable("tune", "trim with method='newton' and closest=False");
  bool callables = false;
  const TuneProblem problem = tune_problem_of(requests_of(problems, callables), asked);
  TuneOptions options = tune_options_of(fields, {}, callables);
  add_starts(options, problem, fields);
  Progress progress(listener);
  options.trimming.stop = progress.abandoned();  // a stopped search still verifies its best
  observe(options, problem, progress);
  const auto work = [&](const std::stop_token& stop) {
    options.stop = stop;
    return tune(problem, options);
  };
  const auto [result, raised] = run(callables, work, Lasts::any_time, &progress);
  py::dict d = dict_of(problem, result);
  d["exception"] = raised;
  return d;
}

}  // namespace

Swept sweep_so_far(const std::vector<SweepRequest>& requests, const std::vector<SweepAxis>& axes,
                   const SweepOptions& options) {
  Swept swept;
  try {
    swept.map = sweep(requests, axes, options);
  } catch (const SweepInterrupted& e) {
    if (!e.finished) throw;
    swept = {*e.finished, true};
  }
  swept.map.program = "tiltrim " TILTRIM_VERSION;
  return swept;
}

SweepOptions sweep_options_of(const py::dict& fields, bool callables, double time_limit) {
  SweepOptions options;
  options.trimming.time_limit = time_limit;
  options.threads = threads_of(fields["threads"].cast<int>(), callables);
  options.crossings = fields["crossings"].cast<bool>();
  options.trimming = trim_options_of(fields["trimming"].cast<py::dict>(), options.trimming);
  return options;
}

void observe(SweepOptions& options, Progress& progress) {
  if (!progress) return;
  options.observe = [&](const SweepProgress& p) {
    progress.tell(p.done, p.total,
                  fmt::format("{}: {} stable, {} unstable, {} undecided, {} without trim", p.what,
                              p.stable, p.unstable, p.undecided, p.no_trim));
  };
}

void tell(Progress& progress, const TuneProblem& problem, const std::string& what,
          const TuneProgress& at) {
  const std::string_view in = goal_unit(problem);
  progress.tell(
      std::size_t(at.evaluations), std::size_t(at.of),
      fmt::format("{}: {} {:.4g}{}{}, {} {}", what, goal_name(problem), at.best,
                  in.empty() ? "" : " ", in, at.feasible ? "held by" : "missing", at.decides));
}

void observe(TuneOptions& options, const TuneProblem& problem, Progress& progress) {
  if (!progress) return;
  options.observe = [&, algorithm = to_string(options.global)](const TuneProgress& at) {
    tell(progress, problem, algorithm, at);
  };
}

TuneOptions tune_options_of(const py::dict& fields, TuneOptions options, bool callables) {
  options.threads = callables ? 1 : 0;
  for_each_option(fields, [&](const std::string& name, py::handle value) {
    if (name == "evaluations")
      options.evaluations = value.cast<long>();
    else if (name == "seconds")
      options.seconds = value.cast<double>();
    else if (name == "time_limit")
      options.trimming.time_limit = value.cast<double>();
    else if (name == "seed")
      options.seed = value.cast<std::uint64_t>();
    else if (name == "threads")
      options.threads = threads_of(value.cast<int>(), callables);
    else if (name == "start")
      options.start = value.cast<VectorXd>();
    else if (name == "global_search")
      options.global = global_search(value.cast<std::string>());
    else if (name == "local_search")
      options.local = local_search(value.cast<std::string>());
    else if (name == "starts")
      options.starts = value.cast<std::vector<VectorXd>>();
    else if (name != "regulator_starts" && name != "placed_starts")
      throw std::invalid_argument(fmt::format("tune has no option '{}'", name));
  });
  return options;
}

void add_starts(TuneOptions& options, const TuneProblem& problem, const py::dict& fields) {
  if (problem.gains.empty()) return;  // tune() refuses it
  const SweepRequest& first = problem.points.front();
  const std::size_t each = problem.variables() / problem.gains.size();
  const auto add = [&](const char* name, auto starts) {
    if (!fields.contains(name)) return;
    VectorXd at = options.start;
    if (at.size() == 0) {
      at.resize(Eigen::Index(problem.variables()));
      for (Eigen::Index i = 0; i < at.size(); ++i)
        at[i] = value_of(first.model, first.guess, problem.gains[std::size_t(i) / each].name);
    }
    const auto values = fields[name].cast<std::vector<double>>();
    for (VectorXd& start : starts(problem, at, values, options.trimming))
      options.starts.push_back(std::move(start));
  };
  add("regulator_starts", &regulator_starts);
  add("placed_starts", &placed_starts);
}

TuneProblem tune_problem_of(const std::vector<SweepRequest>& points, const py::dict& asked) {
  TuneProblem problem;
  problem.points = points;
  for (const auto& [name, lower, upper, logarithmic] :
       asked["gains"].cast<std::vector<std::tuple<std::string, double, double, bool>>>())
    problem.gains.push_back({name, lower, upper, logarithmic});
  for (const auto& [name, lower, upper] :
       asked["uncertain"].cast<std::vector<std::tuple<std::string, double, double>>>())
    problem.uncertain.push_back({name, lower, upper});
  problem.corners = asked["corners"].cast<bool>();
  problem.samples = asked["samples"].cast<int>();
  problem.schedule = asked["schedule"].cast<std::vector<double>>();
  problem.schedule_over = asked["schedule_over"].cast<std::string>();
  problem.disturbance = asked["disturbance"].cast<std::map<std::string, double>>();
  const auto goals = asked["goals"].cast<std::vector<py::dict>>();
  for (const py::dict& goal : goals) problem.goals.push_back(requirement_of(goal));
  if (problem.goals.size() == 1 && std::isnan(problem.goals.front().limit)) {
    problem.goal = problem.goals.front();
    problem.goals.clear();
  }
  for (const auto& limit : asked["limits"].cast<std::vector<py::dict>>())
    problem.limits.push_back(requirement_of(limit));
  return problem;
}

py::dict dict_of(const TuneProblem& problem, const TuneResult& r) {
  py::list achieved, effects;
  for (const Achieved& a : r.achieved) achieved.append(in_dict(problem, a));
  for (const TuneResult::GainEffect& e : r.effects) {
    py::dict d;
    d["name"] = e.name;
    d["value"] = e.value;
    d["slopes"] = array_of(e.slopes);
    d["goal_less"] = e.goal_less;
    d["goal_more"] = e.goal_more;
    d["limits_less"] = e.limits_less;
    d["limits_more"] = e.limits_more;
    effects.append(d);
  }
  std::vector<std::string> gains;
  for (const FreeGain& g : problem.gains) gains.push_back(g.name);
  py::dict d;
  d["status"] = to_string(r.status);
  d["message"] = r.message;
  d["names"] = gains;
  d["schedule"] = problem.schedule;
  d["gains"] = r.gains;
  d["goal"] = r.status == TuneStatus::no_trim ? std::numeric_limits<double>::quiet_NaN() : r.goal;
  d["goal_measure"] = goal_name(problem);
  d["goal_unit"] = std::string(goal_unit(problem));
  d["achieved"] = achieved;
  d["effects"] = effects;
  d["coalescing"] = r.coalescing;
  d["end"] = to_string(r.end);
  d["stationarity"] = r.stationarity;
  d["starts"] = r.starts;
  d["agreeing"] = r.agreeing;
  d["evaluations"] = r.evaluations;
  d["interrupted"] = r.interrupted;
  d["out_of_time"] = r.out_of_time;
  d["out_of_evaluations"] = r.out_of_evaluations;
  return d;
}

void add_maps(py::module_& module) {
  using py::arg;
  module.def("sweep", &swept, arg("problems"), arg("axes"), arg("options"), arg("progress"));
  module.def("tune", &tuned, arg("problems"), arg("asked"), arg("options"), arg("progress"));
}

}  // namespace tiltrim::python
