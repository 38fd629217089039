#include "simulate/global_error.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "model/lookup.hpp"
#include "simulate/integrate.hpp"

namespace tiltrim {

using Eigen::Index;
using Eigen::VectorXd;

namespace {

constexpr double finest = 1e-14;  // tolerance of a second run

// The second run, and the first run's error over the difference between the two: the error is
// proportional to the tolerance.
struct Finer {
  IntegrateOptions options;
  double over_difference = 1.0;
};

// The longest step shrinks with the tolerance; otherwise the runs would agree where it alone limits
// the step.
Finer finer(IntegrateOptions options) {
  constexpr double tenth = 0.1, order = 5.0;
  const double tolerance = std::max(tenth * options.tolerance, finest);
  const double share = tolerance / options.tolerance;
  options.tolerance = tolerance;
  options.longest_step *= std::pow(share, 1 / order);
  options.diverged_beyond = std::numeric_limits<double>::infinity();  // to the end of the first
  return {options, 1 / (1 - share)};
}

// A run that reached its limit of steps is not repeated with smaller ones.
bool can_be_repeated(const IntegrateOptions& options, const Trajectory& found) {
  return options.global_error && options.fixed_step == 0 && options.tolerance > finest &&
         found.samples() > 1 && found.end() > found.t.front() &&
         found.status != MotionStatus::interrupted && found.status != MotionStatus::step_limit;
}

// The errors on the samples common to two runs.
struct Agreement {
  VectorXd error, reliable_error;  // of all of them; of those before the first unreliable one
  std::size_t reliable = 0;        // samples before that: a state's error exceeds a tenth of its
                                   // largest value
  bool differs = false;            // there is an unreliable one
  bool to_end = false;             // the last sample is among them
};

constexpr double located_alike = 1e-6;  // of the duration

// Each run locates an event by itself. Samples of one run only, at its steps, have no partner.
bool are_partners(const Trajectory& run, std::size_t i, const Trajectory& other, std::size_t k) {
  const double later = run.t[i] - other.t[k];
  if (later == 0) return true;
  const auto happens = [](const Trajectory& t, double when) {
    return std::ranges::binary_search(t.events, when, {}, &MotionEvent::t);
  };
  return std::abs(later) <= located_alike * run.end() && happens(run, run.t[i]) &&
         happens(other, other.t[k]);
}

Agreement agreement(const Signals& states, const Trajectory& run, const Trajectory& other,
                    double over_difference) {
  constexpr double eaten = 0.1, least = 1e-6;  // of the largest value, of the nominal size
  const auto n = Index(states.size());
  VectorXd largest = least * nominals(states);
  const auto state = [n](const Trajectory& t, std::size_t k) {
    return Eigen::Map<const VectorXd>(t.state(k), n);
  };
  for (std::size_t k = 0; k < run.samples(); ++k)
    largest = largest.cwiseMax(state(run, k).cwiseAbs());
  Agreement a{VectorXd::Zero(n), VectorXd::Zero(n)};
  for (std::size_t i = 0, k = 0; i < run.samples() && k < other.samples();) {
    if (!are_partners(run, i, other, k)) {
      ++(run.t[i] > other.t[k] ? k : i);
      continue;
    }
    const VectorXd error = over_difference * (state(run, i) - state(other, k)).cwiseAbs();
    a.error = a.error.cwiseMax(error);
    a.differs = a.differs || !(error.array() <= eaten * largest.array()).all();
    a.to_end = ++i == run.samples();
    ++k;
    if (a.differs) continue;
    a.reliable = i;
    a.reliable_error = a.error;
  }
  return a;
}

void cut_short(Trajectory& found, std::size_t samples, std::size_t states) {
  const double t = found.t[samples];
  found.t.resize(samples);
  found.x.resize(samples * states);
  found.modes.resize(samples);
  std::erase_if(found.events, [&](const MotionEvent& e) { return e.t > found.t.back(); });
  found.status = MotionStatus::inaccurate;
  found.message = fmt::format(
      "after t = {:.4g} s the estimated error exceeds a tenth of the motion; a smaller tolerance "
      "extends the valid range",
      t);
}

}  // namespace

VectorXd with_error(const Signals& states, const IntegrateOptions& options, const RunAgain& again,
                    Trajectory& found) {
  const VectorXd none =
      VectorXd::Constant(std::ssize(states), std::numeric_limits<double>::quiet_NaN());
  if (!can_be_repeated(options, found)) return none;
  const Finer second = finer(options);
  const Trajectory other = again(found.end(), second.options);
  // If it comes to the edge at which the first ended a little earlier, they are compared there.
  const double earlier = found.end() - other.end();
  const bool at_edge = found.status != MotionStatus::completed && earlier > 0 &&
                       earlier <= located_alike * found.end();
  const auto compared = [&](const Trajectory& first) {
    return agreement(states, first, other, second.over_difference);
  };
  const Agreement a = at_edge ? compared(again(other.end(), options)) : compared(found);
  const bool unfinished = other.status == MotionStatus::interrupted ||
                          other.status == MotionStatus::step_limit ||
                          other.status == MotionStatus::event_limit;
  if (found.status != MotionStatus::completed || unfinished) return a.to_end ? a.error : none;
  if (a.to_end && !a.differs) return a.error;
  cut_short(found, a.reliable, states.size());
  return a.reliable > 1 ? a.reliable_error : none;
}

std::vector<double> breaks_again(const Trajectory& run, const IntegrateOptions& options,
                                 std::vector<double> breaks) {
  if (options.sample > 0) return breaks;
  for (const double t : run.t)
    if (t > 0 && t < run.end() && !std::ranges::binary_search(run.events, t, {}, &MotionEvent::t))
      breaks.push_back(t);
  std::ranges::sort(breaks);
  breaks.erase(std::unique(breaks.begin(), breaks.end()), breaks.end());
  return breaks;
}

}  // namespace tiltrim
