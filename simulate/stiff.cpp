#include "simulate/stiff.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "simulate/integrate.hpp"
#include "simulate/rosenbrock.hpp"
#include "simulate/sliding.hpp"

namespace tiltrim {

namespace {

struct NotFinite {};  // the rates are not finite within a step

// The motion in its states' nominal sizes, so that one tolerance applies to all.
class StiffIntegration {
 public:
  StiffIntegration(const Motion& motion, const RateSlopes& slopes, const std::vector<double>& x0,
                   double from, double to, const IntegrateOptions& options)
      : motion_(motion),
        slopes_(slopes),
        options_(options),
        n_(x0.size()),
        from_(from),
        to_(to),
        z_(n_),
        x_(n_),
        g_(motion.event_functions.size()),
        above_(motion.event_functions.size()) {
    for (std::size_t i = 0; i < n_; ++i) z_[i] = x0[i] / nominal(i);
  }

  Trajectory run() {
    watch(from_, z_.data());
    for (std::size_t k = 0; k < g_.size(); ++k) above_[k] = g_[k] > 0;
    sample(from_, z_.data());
    std::vector<double> stops = motion_.breaks;
    stops.push_back(to_);
    double t = from_;
    for (const double next : stops) {
      if (!(next > t) || next > to_) continue;
      if (!stretch(t, next)) return std::move(result_);
      t = next;
    }
    return std::move(result_);
  }

 private:
  const Motion& motion_;
  const RateSlopes& slopes_;
  const IntegrateOptions& options_;
  std::size_t n_;
  double from_, to_;
  double before_ = std::numeric_limits<double>::infinity();  // steps end after the next break, but
                                                             // see only values before it
  std::vector<double> z_, x_, g_;
  std::vector<char> above_;
  std::size_t sampled_ = 1;  // on the grid
  Trajectory result_{};

  double nominal(std::size_t i) const { return motion_.states[i].nominal; }
  const double* unscaled(const double* z) {
    for (std::size_t i = 0; i < n_; ++i) x_[i] = z[i] * nominal(i);
    return x_.data();
  }
  void rates(double t, const double* z, double* rates) {
    ++result_.evaluations;
    motion_.f(std::min(t, before_), unscaled(z), 0, rates);
    for (std::size_t i = 0; i < n_; ++i) {
      if (!std::isfinite(rates[i])) throw NotFinite();
      rates[i] /= nominal(i);
    }
  }
  void slopes(double t, const double* z, double* J) {
    const Eigen::MatrixXd A = slopes_(std::min(t, before_), unscaled(z));
    if (!A.allFinite()) throw NotFinite();
    for (std::size_t i = 0; i < n_; ++i)
      for (std::size_t j = 0; j < n_; ++j)
        J[i * n_ + j] = A(Eigen::Index(i), Eigen::Index(j)) * nominal(j) / nominal(i);
  }
  void watch(double t, const double* z) {
    if (!g_.empty()) motion_.g(std::min(t, before_), unscaled(z), 0, g_.data());
  }
  void sample(double t, const double* z) {
    result_.t.push_back(t);
    const double* x = unscaled(z);
    result_.x.insert(result_.x.end(), x, x + n_);
    result_.modes.push_back(0);
  }
  bool end(MotionStatus status, double t, const std::string& why) {
    if (result_.t.back() != t) sample(t, z_.data());
    result_.status = status;
    result_.message = fmt::format("at t = {:.6g} s: {}", t, why);
    return false;
  }

  const std::vector<double>& scaled_back() {
    (void)unscaled(z_.data());
    return x_;
  }
  std::string or_sliding(double t, std::string why) {
    const std::string along = slides_along(motion_, t, scaled_back(), 0);
    return along.empty() ? why : why + ": " + along;
  }
  bool too_small(double t) {
    return end(MotionStatus::step_too_small, t,
               or_sliding(t, "even the shortest step exceeds the tolerance"));
  }
  bool too_many_events(double t) {
    return end(MotionStatus::event_limit, t,
               or_sliding(t, fmt::format("{} events", result_.events.size())));
  }

  // From one break to the next; returns whether the motion continues.
  bool stretch(double t, double until) {
    constexpr double shortest = 1e-15;  // relative to the time
    before_ = std::nextafter(until, from_);
    const RosenbrockSystem system{
        [this](double at, const double* z, double* f) { rates(at, z, f); },
        [this](double at, const double* z, double* J) { slopes(at, z, J); }};
    Rosenbrock stepper(system, z_, t, std::min(1e-6 * (until - t), options_.longest_step),
                       options_.tolerance);
    while (t < until) {
      if (options_.stop.stop_requested())
        return end(MotionStatus::interrupted, t, "stopped by the caller");
      if (result_.steps >= options_.max_steps)
        return end(MotionStatus::step_limit, t,
                   step_limit_in_words(motion_, t, scaled_back(), 0, options_.max_steps));
      if (stepper.next_step() < shortest * std::max(std::abs(t), until - from_))
        return too_small(t);
      try {
        if (!stepper.do_step()) return too_small(t);
      } catch (const NotFinite&) {
        return end(MotionStatus::not_finite, t, "the rates are not finite ahead");
      }
      ++result_.steps;
      const double reached = std::min(stepper.to(), until);
      const auto at = [&](double when) {
        stepper.state(when, z_);
        return z_.data();
      };
      samples(reached, at);
      if (!events(stepper.from(), reached, at)) return false;
      t = reached;
      (void)at(t);
      for (std::size_t i = 0; i < n_; ++i)
        if (!(std::abs(z_[i]) <= options_.diverged_beyond))
          return end(MotionStatus::diverged, t,
                     fmt::format("{} is {:.3g}", motion_.states[i].name, z_[i] * nominal(i)));
    }
    if (t >= to_) sample(to_, z_.data());
    return true;
  }

  // Those on the grid up to the end of a step, or, without a grid, its end.
  template <class At>
  void samples(double reached, const At& at) {
    if (options_.sample == 0) {
      if (reached < to_) sample(reached, at(reached));
      return;
    }
    for (double s; (s = sample_time(from_, to_, options_.sample, sampled_)) <= reached; ++sampled_)
      sample(s, at(s));
  }

  // Locates sign changes of event functions between two times by bisection; returns whether the
  // motion continues.
  template <class At>
  bool events(double low, double high, const At& at) {
    constexpr int halvings = 60;
    watch(high, at(high));
    for (std::size_t k = 0; k < above_.size(); ++k) {
      if (std::isnan(g_[k]))
        return end(MotionStatus::not_finite, high,
                   fmt::format("the event function '{}' is nan", motion_.event_functions[k].name));
      if ((g_[k] > 0) == bool(above_[k])) continue;
      double a = low, b = high;
      for (int i = 0; i < halvings; ++i) {
        const double middle = 0.5 * (a + b);
        watch(middle, at(middle));
        ((g_[k] > 0) == bool(above_[k]) ? a : b) = middle;
      }
      above_[k] = !above_[k];
      result_.events.push_back({k, bool(above_[k]), b});
      watch(high, at(high));
    }
    std::ranges::stable_sort(result_.events, {}, &MotionEvent::t);
    if (long(result_.events.size()) >= options_.max_events) return too_many_events(high);
    return true;
  }
};

}  // namespace

Trajectory integrate_stiff(const Motion& motion, const RateSlopes& slopes,
                           const std::vector<double>& x0, double from, double to,
                           const IntegrateOptions& options) {
  return StiffIntegration(motion, slopes, x0, from, to, options).run();
}

}  // namespace tiltrim
