#include "simulate/simulate.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <stdexcept>

#include "linearize/eigenvalues.hpp"
#include "linearize/modes.hpp"
#include "model/differentiate.hpp"
#include "model/lookup.hpp"
#include "runtime/rounding.hpp"
#include "simulate/global_error.hpp"
#include "simulate/integrate.hpp"
#include "simulate/stiff.hpp"

namespace tiltrim {

using Eigen::Index;
using Eigen::VectorXd;

namespace {

constexpr double nan = std::numeric_limits<double>::quiet_NaN();

struct Change {
  Index variable;
  SignalChange what;
};

// The variable that each change applies to; states are not allowed.
std::vector<Change> checked(const Model& model, const std::vector<SignalChange>& changes) {
  std::vector<Change> all;
  for (const SignalChange& c : changes) {
    const Index j = variable(model, c.signal);
    if (j < std::ssize(model.states))
      throw std::invalid_argument(fmt::format(
          "'{}' is a state; expected an input or a parameter, which can be changed", c.signal));
    if (!std::isfinite(c.size) || !std::isfinite(c.from) || !(c.to > c.from))
      throw std::invalid_argument(
          fmt::format("a change of '{}' by {} from {} to {} s; expected finite numbers and an end "
                      "after the beginning",
                      c.signal, c.size, c.from, c.to));
    all.push_back({j, c});
  }
  return all;
}

// The model as a function of time; the text of its exceptions is kept.
class Moving {
 public:
  Moving(const Model& model, const OperatingPoint& start, std::vector<Change> changes)
      : model_(model), start_(start), changes_(std::move(changes)) {}

  // At a break the changes after it apply, unless the interval ends there.
  OperatingPoint at(double t, const double* x) const {
    OperatingPoint point = start_;
    point.x = Eigen::Map<const VectorXd>(x, point.x.size());
    for (const Change& c : changes_)
      if (t >= c.what.from && t < c.what.to)
        set_value(point, c.variable, value_of(point, c.variable) + c.what.size);
    return point;
  }

  void rates(double t, const double* x, double* rates) {
    const Index n = start_.x.size();
    Eigen::Map<VectorXd> out(rates, n);
    out.setConstant(nan);
    const OperatingPoint point = at(t, x);
    guarded([&] {
      const VectorXd f = model_.f(point.x, point.u, point.p);
      check_rates(model_, f);
      out = f;
    });
  }

  void switches(double t, const double* x, double* values) {
    const OperatingPoint point = at(t, x);
    for (std::size_t i = 0; i < model_.switches.size(); ++i) {
      values[i] = nan;
      guarded([&] { values[i] = model_.switches[i].distance(point); });
    }
  }

  VectorXd outputs(const OperatingPoint& point) {
    VectorXd y = VectorXd::Constant(std::ssize(model_.outputs), nan);
    guarded([&] {
      if (!model_.h) return;
      const VectorXd given = model_.h(point.x, point.u, point.p);
      check_outputs(model_, given);
      y = given;
    });
    return y;
  }

  // The text of the model's last exception; empty if it did not throw.
  const std::string& thrown() const { return thrown_; }
  void forget() { thrown_.clear(); }

 private:
  const Model& model_;
  const OperatingPoint& start_;
  std::vector<Change> changes_;
  std::string thrown_;

  // The caller's errors propagate; exceptions of the model are reported in the result.
  template <class Call>
  void guarded(const Call& call) {
    try {
      call();
    } catch (const CallerMistake&) {
      throw;
    } catch (const std::exception& e) {
      thrown_ = e.what();
    } catch (...) {
      thrown_ = "an exception that is not a std::exception";
    }
  }
};

std::vector<double> breaks_of(const std::vector<SignalChange>& changes, double duration) {
  std::vector<double> breaks;
  for (const SignalChange& c : changes)
    for (const double t : {c.from, c.to})
      if (t > 0 && t < duration) breaks.push_back(t);
  std::ranges::sort(breaks);
  breaks.erase(std::unique(breaks.begin(), breaks.end()), breaks.end());
  return breaks;
}

void say(Simulation& s, const std::string& words) {
  s.message += (s.message.empty() ? "" : ": ") + words;
}

// ∂rates/∂states; not finite if the model throws.
Eigen::MatrixXd rate_slopes(const Model& model, const OperatingPoint& at) {
  const Index n = std::ssize(model.states);
  std::vector<Index> states(model.states.size());
  std::iota(states.begin(), states.end(), Index{0});
  try {
    return jacobian(model, at, states).topRows(n);
  } catch (const CallerMistake&) {
    throw;
  } catch (...) {
    return Eigen::MatrixXd::Constant(n, n, nan);
  }
}

// True if explicit steps of this average length are limited by stability and not by accuracy:
// Dormand-Prince is stable to -3.3 along the negative real axis.              [70, sec. IV.2]
bool held_by_stability(const Model& model, const OperatingPoint& at, double step) {
  constexpr double near = 2.0;
  const Eigen::MatrixXd A = rate_slopes(model, at);
  if (!A.allFinite()) return false;
  const Eigen::VectorXcd lambda = eigenvalues(A);
  return lambda.size() > 0 && -lambda.real().minCoeff() * step > near;
}

// One run: explicit, or implicit if the explicit method is too slow.
struct Run {
  Trajectory trajectory;
  bool stiff = false;
};

Run run(const Model& model, const Motion& motion, const Moving& moving,
        const std::vector<double>& x0, double duration, const IntegrateOptions& options,
        bool known_stiff) {
  constexpr long patience = 10'000;  // steps, before stiffness is tested
  if (options.fixed_step > 0) return {integrate(motion, x0, 0, 0.0, duration, options), false};
  const RateSlopes slopes = [&](double t, const double* x) {
    return rate_slopes(model, moving.at(t, x));
  };
  if (known_stiff) return {integrate_stiff(motion, slopes, x0, 0.0, duration, options), true};
  IntegrateOptions first = options;
  first.max_steps = std::min(options.max_steps, patience);
  Trajectory found = integrate(motion, x0, 0, 0.0, duration, first);
  if (found.status != MotionStatus::step_limit) return {std::move(found), false};
  const double end = found.end(), step = end / double(found.steps);
  const OperatingPoint at = moving.at(end, found.state(found.samples() - 1));
  if (held_by_stability(model, at, step))
    return {integrate_stiff(motion, slopes, x0, 0.0, duration, options), true};
  if (options.max_steps > patience) found = integrate(motion, x0, 0, 0.0, duration, options);
  return {std::move(found), false};
}

}  // namespace

Simulation simulate(const Model& model, const OperatingPoint& start, double duration,
                    const std::vector<SignalChange>& changes, const IntegrateOptions& options) {
  const RoundToNearest environment;
  check(model);
  check(model, start);
  Moving moving(model, start, checked(model, changes));
  Motion motion{model.states,
                [&](double t, const double* x, int, double* f) { moving.rates(t, x, f); }};
  for (const Model::Switch& s : model.switches) motion.event_functions.push_back({s.name});
  if (!model.switches.empty())
    motion.g = [&](double t, const double* x, int, double* g) { moving.switches(t, x, g); };
  motion.breaks = breaks_of(changes, duration);
  const std::vector<double> x0(start.x.data(), start.x.data() + start.x.size());
  Run first = run(model, motion, moving, x0, duration, options, false);
  Trajectory& found = first.trajectory;
  Simulation s;
  s.stiff = first.stiff;
  s.error = with_error(
      model.states, options,
      [&](double to, const IntegrateOptions& other) {
        Motion same = motion;
        same.breaks = breaks_again(found, other, motion.breaks);
        return run(model, same, moving, x0, to, other, first.stiff).trajectory;
      },
      found);
  if (found) moving.forget();  // thrown in a rejected step

  s.status = found.status;
  s.message = found.message;
  s.t = found.t;
  s.steps = found.steps;
  s.evaluations = found.evaluations;
  const auto samples = Index(found.samples());
  s.x.resize(std::ssize(model.states), samples);
  s.u.resize(std::ssize(model.inputs), samples);
  s.p.resize(std::ssize(model.parameters), samples);
  s.y.resize(std::ssize(model.outputs), samples);
  for (Index k = 0; k < samples; ++k) {
    const OperatingPoint point = moving.at(found.t[std::size_t(k)], found.state(std::size_t(k)));
    s.x.col(k) = point.x;
    s.u.col(k) = point.u;
    s.p.col(k) = point.p;
    s.y.col(k) = moving.outputs(point);
  }
  for (const MotionEvent& e : found.events)
    s.events.push_back({model.switches[e.which].name, e.t, e.rising});
  if (!moving.thrown().empty()) say(s, "the model threw: " + moving.thrown());
  return s;
}

}  // namespace tiltrim
