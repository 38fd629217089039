// Studies and their conditions.
#include "python/src/studies.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <memory>
#include <optional>
#include <stdexcept>

#include "cli/commands.hpp"
#include "flight/fly.hpp"
#include "python/src/calls.hpp"
#include "python/src/sweeps.hpp"
#include "python/src/verbs.hpp"
#include "report/tuning_report.hpp"
#include "study/analyses.hpp"
#include "study/angle_remarks.hpp"
#include "study/problems.hpp"

namespace tiltrim::python {

namespace {

HeldStudy parsed(const std::string& text, const std::string& name) {
  return {std::make_shared<const Study>(parse_study(text, name))};
}

HeldStudy loaded(const std::string& file) {
  return {std::make_shared<const Study>(load_study(file))};
}

std::vector<HeldCondition> conditions_of(const HeldStudy& held) {
  std::vector<HeldCondition> all;
  for (const Condition& c : held.study->conditions) all.push_back({held.study, c});
  return all;
}

void refuse_stop_within(const char* verb) {
  refuse_within_callable(verb, "trim with method='newton' and closest=False");
}

py::tuple problem_of(const HeldCondition& held) {
  const TrimProblem p = tiltrim::problem_of(held.vehicle(), held.condition);
  return py::make_tuple(HeldModel::built_in(p.model), dict_of(p.spec), tuple_of(p.guess));
}

py::dict in_dict(const Answer& answer) {
  py::dict d = dict_of(answer.trim);
  d["model"] = HeldModel::built_in(answer.model);
  d["moment"] =
      answer.table
          ? py::object(py::make_tuple(answer.table->CM_required, answer.table->CM_elevator))
          : py::none();
  d["exception"] = py::none();
  return d;
}

py::dict trimmed_condition(const HeldCondition& held, const py::dict& fields) {
  refuse_stop_within("trim");
  TrimOptions options = trim_options_of(fields, {.time_limit = held.study->time_limit});
  const Answer answer = run(false, [&](const std::stop_token& stop) {
                          options.stop = stop;
                          return tiltrim::answer(held.vehicle(), held.condition, options);
                        }).first;
  return in_dict(answer);
}

py::dict followed_condition(const HeldCondition& held, const std::string& parameter, double to,
                            const py::dict& fields, const py::dict& trimming) {
  refuse_stop_within("follow");
  const Key key = key_among(keys_of(*held.study), parameter);
  if (key.signal == "eta" && !held.study->schedule.eta.empty())
    throw std::invalid_argument(
        "the gains move with the tilt (schedule_eta_deg); expected another parameter than eta_deg, "
        "or a sweep over it");
  if (!(to >= key.accepted.lower && to <= key.accepted.upper))
    throw std::invalid_argument(fmt::format("to: {} is out of range; expected {} from {} to {} {}",
                                            to, key.name, key.accepted.lower, key.accepted.upper,
                                            key.unit));
  FollowOptions options = follow_options_of(fields);
  TrimOptions trim_options = trim_options_of(trimming, {.time_limit = held.study->time_limit});
  BranchAnswer answer =
      run(false, [&](const std::stop_token& stop) {
        options.stop = trim_options.stop = stop;
        return follow(held.vehicle(), held.condition, key, key.in_si(to), options, trim_options);
      }).first;
  for (BranchPoint& p : answer.branch.points) p.parameter = key.in_study(p.parameter);
  for (BranchEvent& e : answer.branch.events) e.at.parameter = key.in_study(e.at.parameter);
  py::dict d = dict_of(answer.branch);
  d["model"] = HeldModel::built_in(answer.start.model);
  d["parameter"] = SignalTuple(key.name, key.unit, 1.0);
  d["exception"] = py::none();
  return d;
}

py::object follow_table(const HeldStudy& held) {
  if (!held.study->follow) return py::none();
  const FollowTable& table = *held.study->follow;
  return py::make_tuple(table.parameter.name, table.parameter.in_study(table.to));
}

std::vector<Condition> chosen(const Study& study, const std::vector<std::string>& only) {
  std::vector<Condition> conditions;
  for (const Condition& c : study.conditions)
    if (only.empty() || std::ranges::find(only, c.name) != only.end()) conditions.push_back(c);
  return conditions;
}

py::dict swept_study(const HeldStudy& held, const std::vector<std::string>& only,
                     const py::dict& fields, const py::object& listener) {
  refuse_stop_within("sweep");
  const Study& study = *held.study;
  if (!study.sweep)
    throw StudyError(
        fmt::format("{}: no [[sweep.axis]] table; expected one or more, with key, from, "
                    "to and count, or values",
                    study.file.string()));
  if (study.sweep->verdicts)
    throw StudyError(
        fmt::format("{}: detail = \"verdict\" is for `tiltrim sweep`, whose map xarray "
                    "opens; expected a study without it",
                    study.file.string()));
  SweepOptions options = sweep_options_of(fields, false, study.time_limit);
  options.crossings = options.crossings && study.sweep->crossings;
  const std::vector<SweepAxis>& axes = study.sweep->axes;
  Progress progress(listener);
  observe(options, progress);
  const auto work = [&](const std::stop_token& stop) {
    options.stop = options.trimming.stop = stop;
    Swept found = sweep_so_far(sweep_requests(study, chosen(study, only), axes), axes, options);
    cli::sign(study, found.map);
    return found;
  };
  const Swept swept = run(false, work, Lasts::any_time, &progress).first;
  py::dict d = dict_of(swept.map);
  d["interrupted"] = swept.interrupted;
  d["exception"] = py::none();
  return d;
}

py::dict in_dict(const Robustness& r) {
  py::dict d;
  d["samples"] = r.samples;
  d["met"] = r.met;
  d["no_trim"] = r.no_trim;
  d["unstable"] = r.unstable;
  d["fraction"] = r.fraction;
  d["lower"] = r.lower;
  d["upper"] = r.upper;
  d["worst_goal"] = r.worst_goal;
  d["worst"] = r.worst;
  d["interrupted"] = r.interrupted;
  return d;
}

py::dict tuned_study(const HeldStudy& held, const py::dict& fields, const py::object& listener) {
  refuse_stop_within("tune");
  Study study = *held.study;
  TuneOptions options = tune_options_of(fields, tune_options(study), false);
  if (fields.contains("regulator_starts"))
    study.tune->regulator_starts = fields["regulator_starts"].cast<std::vector<double>>();
  if (fields.contains("placed_starts"))
    study.tune->placed_starts = fields["placed_starts"].cast<std::vector<double>>();
  Progress progress(listener);
  options.trimming.stop = progress.abandoned();
  TuneProblem asked;
  if (study.tune) asked.goal = study.tune->goal, asked.goals = study.tune->goals;
  const auto work = [&](const std::stop_token& stop) {
    options.stop = stop;
    return tune_study(study, options, [&](const std::string& what, const TuneProgress& at) {
      if (progress) tell(progress, asked, what, at);
    });
  };
  const TuningReport report = run(false, work, Lasts::any_time, &progress).first;
  py::dict d = dict_of(report.problem, report.result);
  d["interrupted"] = report.interrupted || report.result.interrupted;
  d["toml"] = tuning_toml(report);
  d["algorithm"] = to_string(report.options.global);
  d["second_algorithm"] = report.second_algorithm;
  if (report.second) d["second"] = dict_of(report.problem, *report.second);
  if (report.robustness) d["robustness"] = in_dict(*report.robustness);
  py::list front;
  for (const TuningReport::FrontPoint& p : report.front)
    front.append(py::make_tuple(p.limit, dict_of(report.problem, p.result)));
  d["front"] = front;
  if (!report.front.empty())
    d["front_limit"] = py::make_tuple(name_of(report.front_limit), report.front_limit.of);
  d["exception"] = py::none();
  return d;
}

// The conditions as a tuning problem, as [tune] would define it.
TuneProblem tuning_of(const std::vector<HeldCondition>& conditions, const py::dict& asked) {
  std::vector<SweepRequest> points;
  for (const HeldCondition& held : conditions)
    for (SweepRequest& request : sweep_requests(*held.study, {held.condition}, {}))
      points.push_back(std::move(request));
  TuneProblem problem = tune_problem_of(points, asked);
  for (std::size_t i = 0; i < conditions.size(); ++i) {
    if (!conditions[i].condition.command()) {
      problem.loops.clear();  // an airframe has no loop to break
      problem.responses.clear();
      break;
    }
    const bool wind = find(points[i].model.states, "V_err") >= 0;
    const Axes axes = wind ? Axes::wind : Axes::body;
    problem.loops.push_back(closed_loop_with_inputs(conditions[i].vehicle(), axes));
    problem.responses.push_back(closed_loop_with_commands(conditions[i].vehicle(), axes));
  }
  return problem;
}

py::dict tuned_conditions(const std::vector<HeldCondition>& conditions, const py::dict& asked,
                          const py::dict& fields, const py::object& listener) {
  refuse_stop_within("tune");
  const TuneProblem problem = tuning_of(conditions, asked);
  TuneOptions defaults;
  defaults.trimming.time_limit = conditions.front().study->time_limit;
  TuneOptions options = tune_options_of(fields, defaults, false);
  add_starts(options, problem, fields);
  Progress progress(listener);
  options.trimming.stop = progress.abandoned();
  observe(options, problem, progress);
  const auto work = [&](const std::stop_token& stop) {
    options.stop = stop;
    return tune(problem, options);
  };
  const TuneResult result = run(false, work, Lasts::any_time, &progress).first;
  py::dict d = dict_of(problem, result);
  d["exception"] = py::none();
  return d;
}

py::list events_of(const FlightResult& flown) {
  py::list events;
  for (const FlightEvent& e : flown.events)
    events.append(py::make_tuple(to_string(e.kind), e.what, e.t));
  return events;
}

py::list columns_of(const FlightTable& table) {
  py::list columns;
  for (const FlightColumn& c : table.columns)
    columns.append(py::make_tuple(c.name, c.unit, c.what, array_of(c.values)));
  return columns;
}

// The flight of a study of the tiltrotor.
py::dict flown(const Study& study, std::optional<long> number) {
  FlightPlan plan = run(false, [&](const std::stop_token& stop) {
                      TrimOptions options;
                      options.stop = stop;
                      return number ? flight_plan_of(study, *number) : flight_plan(study, options);
                    }).first;
  py::dict d;
  d["start"] = plan.start_words;
  d["status"] = "no_trim";
  d["message"] = plan.message;
  d["events"] = py::list();
  d["columns"] = py::list();
  d["error"] = py::dict();
  if (!is_equilibrium(plan.start_status)) return d;
  const auto [result, table] = run(false, [&](const std::stop_token& stop) {
                                 plan.options.integrate.stop = stop;
                                 plan.options.global_error = true;
                                 FlightResult r = fly(plan.flight, plan.start, plan.options);
                                 FlightTable t = flight_table(plan.flight, r);
                                 return std::pair(std::move(r), std::move(t));
                               }).first;
  d["status"] = to_string(result.status);
  d["message"] = result.message;
  d["events"] = events_of(result);
  d["columns"] = columns_of(table);
  for (const FlightColumn& c : table.columns) d["error"][py::str(c.name)] = c.error;
  return d;
}

// The motion of a study with [model].
py::dict moved(const Study& study) {
  const MotionAnswer answer = run(false, [&](const std::stop_token& stop) {
                                TrimOptions options;
                                options.stop = stop;
                                return user_motion(study, options);
                              }).first;
  py::list events;
  py::dict d;
  d["start"] = "from the trim of " + answer.asked.start;
  d["status"] = answer.motion ? to_string(answer.motion->status) : "no_trim";
  d["message"] = answer.motion ? answer.motion->message : answer.start.trim.message;
  if (answer.motion)
    for (const Simulation::SwitchEvent& e : answer.motion->events)
      events.append(py::make_tuple("switch", e.name, e.t));
  d["events"] = events;
  d["columns"] = columns_of(answer.table);
  d["error"] = py::dict();
  const Signals& states = answer.start.model.states;
  if (answer.motion)
    for (Eigen::Index i = 0; i < answer.motion->error.size(); ++i)
      d["error"][py::str(states[std::size_t(i)].name)] = answer.motion->error[i];
  return d;
}

py::dict flown_or_moved(const HeldStudy& held, std::optional<long> number) {
  refuse_stop_within("simulate");
  if (!held.study->user_model) return flown(*held.study, number);
  if (number) throw std::invalid_argument("Monte Carlo flights are of the tiltrotor");
  return moved(*held.study);
}

py::dict in_dict(const MonteCarlo& r) {
  py::dict ends, d;
  for (std::size_t k = 0; k < r.ends.size(); ++k)
    ends[to_string(FlightStatus(k)).c_str()] = r.ends[k];
  py::list worst;
  for (const auto& [outcome, numbers] : r.worst)
    worst.append(py::make_tuple(outcome.number, to_string(outcome.status), outcome.good, outcome.t,
                                outcome.height, outcome.V_off, outcome.gamma_off,
                                outcome.theta_most, outcome.miss, numbers));
  d["asked"] = r.asked;
  d["flown"] = r.flown;
  d["good"] = r.good;
  d["share"] = r.share.share;
  d["lower"] = r.share.lower;
  d["upper"] = r.share.upper;
  d["ends"] = ends;
  d["names"] = r.names;
  d["worst"] = worst;
  d["message"] = r.message;
  d["interrupted"] = r.interrupted;
  return d;
}

py::dict scattered(const HeldStudy& held, int threads, const py::object& listener) {
  refuse_stop_within("monte_carlo");
  Progress progress(listener);
  MonteCarloOptions options;
  options.threads = threads;
  if (progress)
    options.observe = [&](const MonteCarlo& m) {
      progress.tell(std::size_t(m.flown), std::size_t(m.asked),
                    fmt::format("flights: {} good", m.good));
    };
  const auto work = [&](const std::stop_token& stop) {
    options.stop = stop;
    return monte_carlo(*held.study, options);
  };
  return in_dict(run(false, work, Lasts::any_time, &progress).first);
}

}  // namespace

void add_studies(py::module_& module) {
  using py::arg;
  py::class_<HeldStudy>(module, "Study")
      .def_property_readonly("conditions", &conditions_of)
      .def_property_readonly("file", [](const HeldStudy& s) { return s.study->file.string(); })
      .def_property_readonly("text", [](const HeldStudy& s) { return s.study->text; })
      .def_property_readonly("has_axes", [](const HeldStudy& s) { return bool(s.study->sweep); })
      .def_property_readonly("follow", &follow_table);
  py::class_<HeldCondition>(module, "Condition")
      .def_property_readonly("name", [](const HeldCondition& c) { return c.condition.name; })
      .def_property_readonly("place", [](const HeldCondition& c) { return c.condition.place; })
      .def_property_readonly("formulation",
                             [](const HeldCondition& c) { return formulation_of(c.condition); })
      .def_property_readonly("study", [](const HeldCondition& c) { return HeldStudy{c.study}; })
      .def("problem", &problem_of);
  module.def("read_study", &loaded, arg("file"));
  module.def("parse_study", &parsed, arg("text"), arg("name"));
  module.def(
      "angle_remarks", [](const HeldStudy& s) { return angle_remarks(*s.study); }, arg("study"));
  module.def("trim_condition", &trimmed_condition, arg("condition"), arg("options"));
  module.def("follow_condition", &followed_condition, arg("condition"), arg("parameter"), arg("to"),
             arg("options"), arg("trimming"));
  module.def("sweep_study", &swept_study, arg("study"), arg("only"), arg("options"),
             arg("progress"));
  module.def("tune_study", &tuned_study, arg("study"), arg("options"), arg("progress"));
  module.def("tune_conditions", &tuned_conditions, arg("conditions"), arg("asked"), arg("options"),
             arg("progress"));
  module.def("fly_study", &flown_or_moved, arg("study"), arg("number"));
  module.def("monte_carlo", &scattered, arg("study"), arg("threads"), arg("progress"));
}

}  // namespace tiltrim::python
