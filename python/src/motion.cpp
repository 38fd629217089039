// simulate: the motion of any model.
#include <fmt/core.h>

#include <algorithm>
#include <stdexcept>

#include "python/src/calls.hpp"
#include "python/src/model.hpp"
#include "python/src/verbs.hpp"
#include "simulate/integrate.hpp"

namespace tiltrim::python {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

// The inputs over time: held, or what a callable says.
using Inputs = std::function<VectorXd(double t)>;

IntegrateOptions options_of(const py::dict& fields) {
  IntegrateOptions options;
  for (const auto& [key, value] : fields) {
    const std::string name = py::str(key);
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
  }
  return options;
}

Motion motion_of(const Model& model, const VectorXd& p, const Inputs& inputs,
                 const std::vector<double>& breaks) {
  Motion motion;
  motion.states = model.states;
  motion.breaks = breaks;
  const Index n = std::ssize(model.states);
  motion.f = [&model, &p, &inputs, n](double t, const double* x, int, double* rates) {
    const VectorXd at = Eigen::Map<const VectorXd>(x, n);
    const VectorXd answer = model.f(at, inputs(t), p);
    if (answer.size() != n)
      throw std::invalid_argument(
          fmt::format("the model's rates f: expected {} values, got {}", n, answer.size()));
    std::ranges::copy(answer, rates);
  };
  return motion;
}

struct Simulated {
  Trajectory trajectory;
  MatrixXd x, u, y;  // [sample, signal]
};

Simulated simulated(const Model& model, const OperatingPoint& start, const Inputs& inputs,
                    const std::vector<double>& breaks, double duration,
                    const IntegrateOptions& options) {
  (void)evaluate(model, start);  // sizes, before any step
  const Motion motion = motion_of(model, start.p, inputs, breaks);
  Simulated s;
  s.trajectory = integrate(motion, {start.x.begin(), start.x.end()}, 0, 0.0, duration, options);
  const Index samples = std::ssize(s.trajectory.t);
  s.x.resize(samples, start.x.size());
  s.u.resize(samples, start.u.size());
  s.y.resize(samples, std::ssize(model.outputs));
  for (Index i = 0; i < samples; ++i) {
    const VectorXd x =
        Eigen::Map<const VectorXd>(s.trajectory.state(std::size_t(i)), start.x.size());
    const VectorXd u = inputs(s.trajectory.t[std::size_t(i)]);
    s.x.row(i) = x;
    s.u.row(i) = u;
    if (s.y.cols() > 0) s.y.row(i) = evaluate(model, {x, u, start.p}).outputs;
  }
  return s;
}

py::dict simulate(const HeldModel& held, const PointTuple& start, double duration,
                  const py::object& input, const std::vector<double>& breaks,
                  const py::dict& fields) {
  IntegrateOptions options = options_of(fields);
  const OperatingPoint from = point_of(start);
  Inputs inputs = [&from](double) { return from.u; };
  Held function{input};
  if (!input.is_none())
    inputs = [&](double t) {
      return call_for_vector(function, "input", from.u.size(), py::make_tuple(t));
    };
  const auto [s, raised] =
      run(held.callables || !input.is_none(), [&](const std::stop_token& stop) {
        options.stop = stop;
        return simulated(held.model, from, inputs, breaks, duration, options);
      });
  py::dict d;
  d["status"] = to_string(s.trajectory.status);
  d["message"] = s.trajectory.message;
  d["t"] = array_of(s.trajectory.t);
  d["x"] = s.x;
  d["u"] = s.u;
  d["y"] = s.y;
  d["steps"] = s.trajectory.steps;
  d["evaluations"] = s.trajectory.evaluations;
  return d;
}

}  // namespace

void add_motion(py::module_& module) {
  using py::arg;
  module.def("simulate", &simulate, arg("model"), arg("start"), arg("duration"), arg("input"),
             arg("breaks"), arg("options"));
}

}  // namespace tiltrim::python
