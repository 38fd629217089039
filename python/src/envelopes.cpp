// envelope and all_equilibria, for any model and for a study's conditions.
#include <functional>
#include <optional>

#include "follow/envelope.hpp"
#include "model/degrees.hpp"
#include "python/src/calls.hpp"
#include "python/src/studies.hpp"
#include "python/src/verbs.hpp"
#include "study/analyses.hpp"

namespace tiltrim::python {

namespace {

/// signal, lower, upper, grid points
using AxisTuple = std::tuple<std::string, double, double, int>;
/// From SI to the unit of the result.
using Unit = std::function<double(double)>;

struct Units {
  Unit x, y;
};

py::dict in_dict(const BorderPiece& piece, const Units& in) {
  std::vector<double> along, over, residual;
  std::vector<bool> outer;
  py::list points, outputs;
  for (const BorderPiece::Point& p : piece.points) {
    along.push_back(in.x(p.x));
    over.push_back(in.y(p.y));
    outer.push_back(p.outer);
    residual.push_back(p.residual);
    points.append(tuple_of(p.point));
    outputs.append(p.outputs);
  }
  py::dict d;
  d["name"] = piece.name;
  d["begins"] = piece.from;
  d["ends"] = piece.to;
  d["along"] = array_of(along);
  d["over"] = array_of(over);
  d["outer"] = outer;
  d["residual"] = array_of(residual);
  d["points"] = points;
  d["outputs"] = outputs;
  return d;
}

py::dict in_dict(const Envelope& part, const Units& in) {
  py::list pieces, rows;
  for (const BorderPiece& piece : part.pieces) pieces.append(in_dict(piece, in));
  for (const EnvelopeRow& row : part.rows) {
    py::list intervals;
    for (const EnvelopeInterval& i : row.intervals)
      intervals.append(py::make_tuple(in.x(i.from.x), i.from.name, in.x(i.to.x), i.to.name));
    rows.append(py::make_tuple(in.y(row.y), intervals));
  }
  py::dict d;
  d["status"] = to_string(part.status);
  d["along"] = RangeTuple(in.x(part.x.range.lower), in.x(part.x.range.upper));
  d["over"] = RangeTuple(in.y(part.y.range.lower), in.y(part.y.range.upper));
  d["count"] = part.count;
  d["pieces"] = pieces;
  d["rows"] = rows;
  d["evaluations"] = part.evaluations;
  return d;
}

void observe(EnvelopeOptions& options, Progress& progress) {
  constexpr double percent = 100.0;
  options.observe = [&](double share) {
    if (progress)
      progress.tell(std::size_t(percent * share), std::size_t(percent), "% of the grid");
  };
}

py::dict enveloped(const HeldModel& held, const py::dict& spec, const PointTuple& guess,
                   const AxisTuple& along, const AxisTuple& over, const std::vector<double>& rows,
                   const py::object& listener) {
  refuse_within_callable("envelope", no_ipopt);
  const auto axis = [](const AxisTuple& a) {
    return EnvelopeAxis{std::get<0>(a), {std::get<1>(a), std::get<2>(a)}, std::get<3>(a)};
  };
  EnvelopeOptions options;
  options.rows = rows;
  options.threads = held.callables ? 1 : 0;
  Progress progress(listener);
  observe(options, progress);
  const TrimSpec asked = spec_of(spec);
  const auto work = [&](const std::stop_token& stop) {
    options.stop = stop;
    Envelope found = envelope(held.model, asked, point_of(guess), axis(along), axis(over), options);
    if (found.status != EnvelopeStatus::interrupted) options.observe(1.0);
    return found;
  };
  const auto [found, raised] = run(held.callables, work, Lasts::any_time, &progress);
  const Unit same = [](double value) { return value; };
  py::dict d;
  d["parts"] = py::make_tuple(in_dict(found, {same, same}));
  d["exception"] = raised;
  return d;
}

py::dict enveloped_condition(const HeldCondition& held, const std::string& over,
                             std::optional<int> count,
                             const std::optional<std::vector<double>>& rows,
                             const py::object& listener) {
  refuse_within_callable("envelope", no_ipopt);
  const bool user = held.condition.user();
  const EnvelopeTable table = envelope_table(*held.study, over, count);
  EnvelopeOptions options;
  options.rows = envelope_rows(table, user);
  if (rows) {
    options.rows.clear();
    for (const double row : *rows) options.rows.push_back(table.over.in_si(row));
  }
  Progress progress(listener);
  observe(options, progress);
  const auto work = [&](const std::stop_token& stop) {
    options.stop = stop;
    EnvelopeAnswer found = envelope(held.study->vehicle, held.condition, table, options);
    if (found.answered()) options.observe(1.0);
    return found;
  };
  const EnvelopeAnswer answer = run(false, work, Lasts::any_time, &progress).first;
  const Unit angle = [](double si) { return si * degrees; };
  const Unit own = [&](double si) { return table.over.in_study(si); };
  const Units in{[&](double si) { return table.along.in_study(si); }, user ? own : angle};
  py::list parts;
  for (const Envelope& part : answer.parts) parts.append(in_dict(part, in));
  py::dict d;
  d["model"] = HeldModel::built_in(answer.model);
  d["along"] = SignalTuple(table.along.name, table.along.unit, 1.0);
  d["over"] = SignalTuple(table.over.name, table.over.unit, 1.0);
  d["parts"] = parts;
  d["exception"] = py::none();
  return d;
}

// The model of a condition's envelope, which EnvelopeAnswer has.
HeldModel envelope_model(const HeldCondition& held) {
  const Command* command = held.condition.command();
  return HeldModel::built_in(
      command ? closed_loop_problem(held.study->vehicle, *command, Axes::wind).model
              : problem_of(held.vehicle(), held.condition).model);
}

py::dict in_dict(const AllEquilibria& all) {
  py::list equilibria;
  for (const Equilibrium& e : all.equilibria)
    equilibria.append(py::make_tuple(dict_of(e.trim), e.found,
                                     e.modes ? py::object(dict_of(*e.modes)) : py::none()));
  py::dict d;
  d["equilibria"] = equilibria;
  d["none"] = all.equilibria.empty() ? py::object(dict_of(all.none)) : py::none();
  d["starts"] = all.starts;
  d["branches"] = all.branches;
  return d;
}

py::dict all_of(const HeldModel& held, const py::dict& spec, const PointTuple& guess,
                const std::vector<std::string>& parameters, double reach, const py::dict& fields) {
  refuse_within_callable("all_equilibria", no_ipopt);
  TrimOptions options = trim_options_of(fields);
  const TrimSpec asked = spec_of(spec);
  const auto [all, raised] = run(held.callables, [&](const std::stop_token& stop) {
    options.stop = stop;
    return all_equilibria(held.model, asked, point_of(guess), parameters, reach, options);
  });
  py::dict d = in_dict(all);
  d["exception"] = raised;
  return d;
}

py::dict all_of_condition(const HeldCondition& held, const py::dict& fields) {
  refuse_within_callable("all_equilibria", no_ipopt);
  TrimOptions options = trim_options_of(fields, {.time_limit = held.study->time_limit});
  const Vehicle vehicle = held.vehicle();
  const AllEquilibria all = run(false, [&](const std::stop_token& stop) {
                              options.stop = stop;
                              return all_equilibria(vehicle, held.condition, options);
                            }).first;
  const TrimProblem problem = problem_of(vehicle, held.condition);
  py::dict d = in_dict(all);
  d["model"] = HeldModel::built_in(problem.model);
  d["spec"] = dict_of(problem.spec);
  d["exception"] = py::none();
  return d;
}

}  // namespace

void add_envelopes(py::module_& module) {
  using py::arg;
  module.def("envelope", &enveloped, arg("model"), arg("spec"), arg("guess"), arg("along"),
             arg("over"), arg("rows"), arg("progress"));
  module.def("envelope_condition", &enveloped_condition, arg("condition"), arg("over"),
             arg("count"), arg("rows"), arg("progress"));
  module.def("envelope_model", &envelope_model, arg("condition"));
  module.def("all_equilibria", &all_of, arg("model"), arg("spec"), arg("guess"), arg("parameters"),
             arg("reach"), arg("options"));
  module.def("all_equilibria_condition", &all_of_condition, arg("condition"), arg("options"));
}

}  // namespace tiltrim::python
