// simulate: the motion of any model.
#include <fmt/core.h>

#include <algorithm>
#include <limits>
#include <stdexcept>

#include "model/lookup.hpp"
#include "python/src/calls.hpp"
#include "python/src/models.hpp"
#include "python/src/verbs.hpp"
#include "simulate/global_error.hpp"
#include "simulate/integrate.hpp"
#include "simulate/simulate.hpp"

namespace tiltrim::python {

using Eigen::Index;
using Eigen::VectorXd;

namespace {

using ChangeTuple = std::tuple<std::string, double, double, double>;  ///< signal, size, from, to

IntegrateOptions options_of(const py::dict& fields) {
  IntegrateOptions options;
  for_each_option(fields, [&](const std::string& name, py::handle value) {
    if (name == "tolerance")
      options.tolerance = value.cast<double>();
    else if (name == "sample")
      options.sample = value.cast<double>();
    else if (name == "longest_step")
      options.longest_step = value.cast<double>();
    else if (name == "max_steps")
      options.max_steps = value.cast<long>();
    else
      throw std::invalid_argument(fmt::format("simulate has no option '{}'", name));
  });
  return options;
}

// A model whose inputs come from a callable of time, in the form simulate() takes for constant
// inputs.
class Driven {
 public:
  Driven(const Model& model, const OperatingPoint& start, const Held& input)
      : model_(model), start_(start), input_(input) {}

  OperatingPoint at(double t, const double* x) const {
    const VectorXd u = call_for_vector(input_, "the input", start_.u.size(), py::make_tuple(t));
    return {Eigen::Map<const VectorXd>(x, start_.x.size()), u, start_.p};
  }

  void rates(double t, const double* x, double* rates) {
    Eigen::Map<VectorXd> out(rates, start_.x.size());
    out.setConstant(nan);
    guarded([&] {
      const OperatingPoint point = at(t, x);
      const VectorXd f = model_.f(point.x, point.u, point.p);
      check_rates(model_, f);
      out = f;
    });
  }

  void switches(double t, const double* x, double* values) {
    std::fill_n(values, model_.switches.size(), nan);
    guarded([&] {
      const OperatingPoint point = at(t, x);
      for (const Model::Switch& s : model_.switches) *values++ = s.distance(point);
    });
  }

  // Samples u and y.
  void fill(Simulation& s) {
    for (Index k = 0; k < std::ssize(s.t); ++k) {
      s.u.col(k).setConstant(nan);
      s.y.col(k).setConstant(nan);
      guarded([&] {
        const OperatingPoint point = at(s.t[std::size_t(k)], s.x.col(k).data());
        s.u.col(k) = point.u;
        if (model_.h) s.y.col(k) = evaluate(model_, point).outputs;
      });
    }
  }

  // The last exception text of the model; empty if there was none.
  const std::string& thrown() const { return thrown_; }
  void forget() { thrown_.clear(); }

 private:
  static constexpr double nan = std::numeric_limits<double>::quiet_NaN();
  const Model& model_;
  const OperatingPoint& start_;
  const Held& input_;
  std::string thrown_;

  void guarded(const std::function<void()>& work) {
    try {
      work();
    } catch (const CallerMistake&) {
      throw;
    } catch (const std::exception& e) {
      thrown_ = e.what();
    }
  }
};

Simulation simulated(const Model& model, const OperatingPoint& start, double duration,
                     const Held& input, const std::vector<double>& breaks,
                     const IntegrateOptions& options) {
  check(model, start);
  Driven driven(model, start, input);
  Motion motion{model.states,
                [&](double t, const double* x, int, double* f) { driven.rates(t, x, f); }};
  motion.breaks = breaks;
  for (const Model::Switch& s : model.switches) motion.event_functions.push_back({s.name});
  if (!model.switches.empty())
    motion.g = [&](double t, const double* x, int, double* g) { driven.switches(t, x, g); };
  const std::vector<double> x0(start.x.begin(), start.x.end());
  Trajectory found = integrate(motion, x0, 0, 0.0, duration, options);
  Simulation s;
  s.error = with_error(
      model.states, options,
      [&](double to, const IntegrateOptions& other) {
        Motion same = motion;
        same.breaks = breaks_again(found, other, motion.breaks);
        return integrate(same, x0, 0, 0.0, to, other);
      },
      found);
  const auto samples = Index(found.samples());
  s.status = found.status;
  s.message = found.message;
  s.t = found.t;
  s.steps = found.steps;
  s.evaluations = found.evaluations;
  s.x = Eigen::Map<const Eigen::MatrixXd>(found.x.data(), start.x.size(), samples);
  s.u.resize(start.u.size(), samples);
  s.p = start.p.replicate(1, samples);
  s.y.resize(std::ssize(model.outputs), samples);
  if (found) driven.forget();  // thrown at a trial point of a rejected step
  driven.fill(s);
  for (const MotionEvent& e : found.events)
    s.events.push_back({model.switches[e.which].name, e.t, e.rising});
  if (!driven.thrown().empty())
    s.message += (s.message.empty() ? "" : ": ") + ("the model threw: " + driven.thrown());
  return s;
}

py::dict moved(const HeldModel& held, const PointTuple& start, double duration,
               const std::vector<ChangeTuple>& changes, const py::object& input,
               const std::vector<double>& breaks, const py::dict& fields) {
  IntegrateOptions options = options_of(fields);
  const OperatingPoint from = point_of(start);
  std::vector<SignalChange> all;
  for (const auto& [signal, size, begins, ends] : changes)
    all.push_back({signal, size, begins, ends});
  const Held function{input};
  const bool driven = !input.is_none();
  const auto [s, raised] = run(held.callables || driven, [&](const std::stop_token& stop) {
    options.stop = stop;
    return driven ? simulated(held.model, from, duration, function, breaks, options)
                  : simulate(held.model, from, duration, all, options);
  });
  py::list events;
  for (const Simulation::SwitchEvent& e : s.events)
    events.append(py::make_tuple(e.name, e.t, e.rising));
  py::dict d;
  d["status"] = to_string(s.status);
  d["message"] = s.message;
  d["t"] = array_of(s.t);
  d["x"] = s.x.transpose().eval();
  d["u"] = s.u.transpose().eval();
  d["p"] = s.p.transpose().eval();
  d["y"] = s.y.transpose().eval();
  d["events"] = events;
  d["steps"] = s.steps;
  d["evaluations"] = s.evaluations;
  d["error"] = s.error;
  d["stiff"] = s.stiff;
  d["exception"] = raised;
  return d;
}

}  // namespace

void add_motion(py::module_& module) {
  using py::arg;
  module.def("simulate", &moved, arg("model"), arg("start"), arg("duration"), arg("changes"),
             arg("input"), arg("breaks"), arg("options"));
}

}  // namespace tiltrim::python
