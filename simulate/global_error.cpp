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

// The samples common to two runs, the largest differences on them, and the first sample that is
// unreliable: a state's difference exceeds a tenth of its largest value.
struct Agreement {
  VectorXd error;
  std::size_t good = 0;
};

Agreement agreement(const Signals& states, const Trajectory& run, const Trajectory& other) {
  constexpr double eaten = 0.1, least = 1e-6;  // of the largest value, of the nominal size
  const auto n = Index(states.size());
  VectorXd largest = least * nominals(states);
  const auto state = [n](const Trajectory& t, std::size_t k) {
    return Eigen::Map<const VectorXd>(t.state(k), n);
  };
  for (std::size_t k = 0; k < run.samples(); ++k)
    largest = largest.cwiseMax(state(run, k).cwiseAbs());
  Agreement a{VectorXd::Zero(n)};
  // Each run locates an event by itself. Samples of one run only, at its steps, are skipped.
  const double same_event = 1e-6 * run.end();
  const auto happens = [](const Trajectory& t, std::size_t k) {
    return std::ranges::binary_search(t.events, t.t[k], {}, &MotionEvent::t);
  };
  for (std::size_t i = 0, k = 0; i < run.samples() && k < other.samples();) {
    const double later = run.t[i] - other.t[k];
    const bool same =
        later == 0 || (std::abs(later) <= same_event && happens(run, i) && happens(other, k));
    if (!same) {
      ++(later > 0 ? k : i);
      continue;
    }
    const VectorXd apart = (state(run, i) - state(other, k)).cwiseAbs();
    if (!(apart.array() <= eaten * largest.array()).all()) break;
    a.error = a.error.cwiseMax(apart);
    a.good = ++i;
    ++k;
  }
  return a;
}

}  // namespace

bool has_estimate(const IntegrateOptions& options, const Trajectory& found) {
  return options.global_error && options.fixed_step == 0 && found.samples() > 1 &&
         found.status != MotionStatus::interrupted;
}

IntegrateOptions finer(IntegrateOptions options) {
  constexpr double tenth = 0.1, finest = 1e-14;
  options.tolerance = std::max(tenth * options.tolerance, finest);
  return options;
}

VectorXd with_error(const Signals& states, const Trajectory& second, Trajectory& found) {
  const Agreement a = agreement(states, found, second);
  const bool unfinished = second.status == MotionStatus::interrupted ||
                          second.status == MotionStatus::step_limit ||
                          second.status == MotionStatus::event_limit;
  if (found.status == MotionStatus::completed && unfinished)
    return VectorXd::Constant(std::ssize(states), std::numeric_limits<double>::quiet_NaN());
  if (found.status != MotionStatus::completed || a.good == found.samples() || a.good == 0)
    return a.error;
  const double t = found.t[a.good];
  const std::size_t n = states.size();
  found.t.resize(a.good);
  found.x.resize(a.good * n);
  found.modes.resize(a.good);
  std::erase_if(found.events, [&](const MotionEvent& e) { return e.t > found.t.back(); });
  found.status = MotionStatus::inaccurate;
  found.message = fmt::format(
      "after t = {:.4g} s the estimated error exceeds a tenth of the motion; a smaller tolerance "
      "extends the valid range",
      t);
  return a.error;
}

}  // namespace tiltrim
