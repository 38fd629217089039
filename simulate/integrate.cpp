#include "simulate/integrate.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <boost/math/tools/toms748_solve.hpp>
#include <boost/numeric/odeint/stepper/runge_kutta_dopri5.hpp>
#include <cmath>
#include <cstdint>
#include <limits>
#include <optional>
#include <stdexcept>

#include "runtime/rounding.hpp"
#include "simulate/sliding.hpp"

namespace tiltrim {

namespace {

using State = std::vector<double>;
using Stepper = boost::numeric::odeint::runge_kutta_dopri5<State>;

void check(const Motion& motion, const State& x0, double from, double to,
           const IntegrateOptions& o) {
  const auto require = [](bool holds, const std::string& why) {
    if (!holds) throw std::invalid_argument("integrate: " + why);
  };
  require(bool(motion.f), "the motion has no rates f");
  require(!motion.states.empty(), "the motion has no states");
  require(x0.size() == motion.states.size(),
          fmt::format("{} values for {} states", x0.size(), motion.states.size()));
  require(motion.event_functions.empty() || bool(motion.g),
          "events are named but there is no event function g");
  require(std::isfinite(from) && std::isfinite(to) && to > from,
          fmt::format("from t = {} to t = {}; the end must come after the start", from, to));
  require(std::ranges::none_of(motion.breaks, [](double t) { return std::isnan(t); }) &&
              std::ranges::is_sorted(motion.breaks),
          "the breaks must be numbers in ascending order");
  require(o.tolerance > 0 && o.tolerance < 1, "the tolerance must be between 0 and 1");
  require(o.sample >= 0 && o.longest_step > 0 && o.fixed_step >= 0 && std::isfinite(o.fixed_step),
          "sample and steps must not be negative");
  require(o.diverged_beyond > 0, "diverged_beyond must be greater than zero");
  for (std::size_t i = 0; i < x0.size(); ++i)
    require(std::isfinite(x0[i]) && motion.states[i].nominal > 0,
            fmt::format("{} starts at {}, nominal {}", motion.states[i].name, x0[i],
                        motion.states[i].nominal));
}

// The state of an integration, kept from step to step.
class Integration {
 public:
  Integration(const Motion& motion, const State& x0, int mode, double from, double to,
              const IntegrateOptions& options)
      : motion_(motion),
        options_(options),
        n_(x0.size()),
        mode_(mode),
        start_(from),
        to_(to),
        t_(from),
        x_(x0),
        rates_(n_),
        next_(n_),
        next_rates_(n_),
        error_(n_),
        trial_(n_),
        trial_rates_(n_),
        g_(motion.event_functions.size()),
        above_(motion.event_functions.size()) {}

  Trajectory run() {
    begin();
    while (!finished_ && t_ < to_) {
      if (options_.stop.stop_requested())
        stop(MotionStatus::interrupted, "stopped");
      else if (result_.steps + result_.rejected >= options_.max_steps)
        stop(MotionStatus::step_limit,
             step_limit_in_words(motion_, t_, x_, mode_, options_.max_steps));
      else
        step();
    }
    sample_here();
    return std::move(result_);
  }

 private:
  const Motion& motion_;
  const IntegrateOptions& options_;
  std::size_t n_;
  int mode_;
  double start_, to_, t_;
  State x_, rates_, next_, next_rates_, error_, trial_, trial_rates_;
  std::vector<double> g_;
  std::vector<char> above_;  // side of zero of each event function; zero counts as below
  Stepper stepper_;
  Trajectory result_;
  double h_ = 0.0;
  double target_ = 0.0;  // the next break, or the end
  double inside_ = 0.0;  // the last time before a break
  long sampled_ = 1;     // samples on the grid so far
  long at_once_ = 0;     // crossings at this time
  double instant_ = -std::numeric_limits<double>::infinity();
  bool finished_ = false;

  // A step that ends at a break is evaluated on its left side.
  auto system() {
    return [this](const State& x, State& dxdt, double t) {
      ++result_.evaluations;
      motion_.f(std::min(t, inside_), x.data(), mode_, dxdt.data());
    };
  }

  void watch(double t, const State& x) {
    if (!g_.empty()) motion_.g(std::min(t, inside_), x.data(), mode_, g_.data());
  }

  void stop(MotionStatus status, std::string why) {
    finished_ = true;
    result_.status = status;
    result_.message = std::move(why);
  }

  void sample(double t, const State& x) {
    result_.t.push_back(t);
    result_.x.insert(result_.x.end(), x.begin(), x.end());
    result_.modes.push_back(mode_);
  }

  void sample_here() {
    if (result_.t.back() != t_) sample(t_, x_);
  }

  // Events are located to the spacing of floating-point times and are distinct if at least sixteen
  // spacings apart; functions that cross within `instant` cross simultaneously.
  double spacing() const {
    return 2 * std::numeric_limits<double>::epsilon() * std::max(std::abs(t_), h_);
  }
  double nearest() const { return 16 * spacing(); }
  double instant() const { return 256 * spacing(); }

  void begin() {
    sample(t_, x_);
    onward();
    h_ = options_.fixed_step > 0 ? options_.fixed_step : first_step();
    watch(t_, x_);
    for (std::size_t k = 0; k < g_.size(); ++k) above_[k] = g_[k] > 0;
    require_numbers();
    settle();
  }

  // Computes rates and the next break at a point where they may have changed.
  void onward() {
    const auto next = std::ranges::upper_bound(motion_.breaks, t_);
    const bool breaks = next != motion_.breaks.end() && *next <= to_;
    target_ = breaks ? *next : to_;
    inside_ = breaks ? std::nextafter(target_, t_) : to_;
    system()(x_, rates_, t_);
    require_finite(rates_);
  }

  void require_finite(const State& rates) {
    for (std::size_t i = 0; i < n_ && !finished_; ++i)
      if (!std::isfinite(rates[i]))
        stop(MotionStatus::not_finite,
             fmt::format("the rate of {} is {}", motion_.states[i].name, rates[i]));
  }

  void require_numbers() {
    for (std::size_t k = 0; k < g_.size() && !finished_; ++k)
      if (std::isnan(g_[k]))
        stop(MotionStatus::not_finite,
             fmt::format("the event function '{}' is nan", motion_.event_functions[k].name));
  }

  // A hundredth of the time in which the fastest state changes by its size.
  double first_step() const {
    double fastest = 1.0 / options_.longest_step;
    for (std::size_t i = 0; i < n_; ++i)
      fastest = std::max(
          fastest, std::abs(rates_[i]) / std::max(std::abs(x_[i]), motion_.states[i].nominal));
    return std::min({options_.longest_step, 0.01 / fastest, to_ - t_});
  }

  // The step from t_ to t_ + h; returns its error over the tolerance, infinite if not finite.
  double tried(double h, State& x, State& rates) {
    stepper_.do_step(system(), x_, rates_, t_, x, rates, h, error_);
    double worst = 0.0;
    for (std::size_t i = 0; i < n_; ++i) {
      if (!std::isfinite(x[i]) || !std::isfinite(rates[i]) || !std::isfinite(error_[i]))
        return std::numeric_limits<double>::infinity();
      const double size = std::max({std::abs(x_[i]), std::abs(x[i]), motion_.states[i].nominal});
      worst = std::max(worst, std::abs(error_[i]) / (options_.tolerance * size));
    }
    return worst;
  }

  void step() {
    const double rest = target_ - t_;
    const double longest = options_.fixed_step > 0 ? options_.fixed_step : options_.longest_step;
    double h = std::min(h_, longest);
    h = (t_ + h) - t_;                       // as representable in time
    if (!(h < (1 - 1e-9) * rest)) h = rest;  // no tiny last step
    if (!(h > 0)) return too_small();
    const double error = tried(h, next_, next_rates_);
    // The usual step-size controller for a fifth-order pair: [52, sec. II.4].
    const double factor = std::isfinite(error)
                              ? std::clamp(0.9 * std::pow(std::max(error, 1e-10), -0.2), 0.2, 5.0)
                              : 0.1;
    const bool controlled = options_.fixed_step == 0;
    if (!controlled && !std::isfinite(error)) return too_small();
    if (controlled && error > 1) {
      ++result_.rejected;
      h_ = h * std::min(factor, 0.9);
      if (!((t_ + h_) - t_ < h)) too_small();
      return;
    }
    ++result_.steps;
    if (controlled) h_ = factor > 1 ? std::max(h_, h * factor) : h * factor;
    accept(h, h == rest);
  }

  void too_small() {
    require_finite(next_rates_);
    if (finished_) return;
    const std::string along = slides_along(motion_, t_, x_, mode_);
    stop(MotionStatus::step_too_small,
         "even the shortest step exceeds the tolerance" + (along.empty() ? "" : ": " + along));
  }

  // Accepts the step of length h up to the first event in it.
  void accept(double h, bool to_target) {
    const std::optional<std::size_t> crossed = first_crossing(h);
    const double t = to_target && !crossed ? target_ : std::min(t_ + h, target_);
    samples_between(t_, t);
    t_ = t;
    x_.swap(next_);
    rates_.swap(next_rates_);
    for (std::size_t i = 0; i < n_; ++i)
      if (!(std::abs(x_[i]) <= options_.diverged_beyond * motion_.states[i].nominal))
        return stop(MotionStatus::diverged, fmt::format("{} is {:.3g} {}", motion_.states[i].name,
                                                        x_[i], motion_.states[i].unit));
    require_numbers();
    if (finished_) return;
    if (crossed)
      happened(*crossed);
    else if (t_ == target_ && t_ < to_)
      onward();
    else
      return;
    settle();
  }

  // The event function that changes sign first within the step of length h, if any; the step is cut
  // to end just after it. Two sign changes of one function within a step are not detected.
  std::optional<std::size_t> first_crossing(double& h) {
    std::optional<std::size_t> first;
    watch(t_ + h, next_);
    for (std::size_t k = 0; k < g_.size(); ++k) {
      if ((g_[k] > 0) == bool(above_[k]) || std::isnan(g_[k])) continue;
      first = k;
      h = located(k, h);
      tried(h, next_, next_rates_);
      watch(t_ + h, next_);
    }
    return first;
  }

  // The length of a step that ends just after the sign change of an event function.
  double located(std::size_t which, double h) {
    if (h <= nearest()) return h;
    constexpr double least = std::numeric_limits<double>::min(), most = 1e300;
    const auto side = [&] {
      const double g = g_[which];
      return g > 0 ? std::min(g, most) : std::max(-most, std::min(-least, g));
    };
    const auto value = [&](double length) {
      tried(length, trial_, trial_rates_);
      watch(t_ + length, trial_);
      return side();
    };
    const double at_end = side();
    watch(t_, x_);
    double from = 0.0, at_start = side();
    if ((at_start > 0) != bool(above_[which])) at_start = value(from = nearest());
    if ((at_start > 0) == (at_end > 0)) return from;  // changes back at once
    std::uintmax_t steps = 100;
    return boost::math::tools::toms748_solve(
               value, from, h, at_start, at_end,
               [&](double a, double b) { return std::abs(b - a) <= spacing(); }, steps)
        .second;
  }

  // Samples on the grid in (from, to], by the dense output of the step from x_ to next_.
  void samples_between(double from, double to) {
    if (options_.sample == 0) return sample(to, next_);
    for (double t; (t = sample_time(start_, to_, options_.sample, sampled_)) <= to; ++sampled_) {
      stepper_.calc_state(t, trial_, x_, rates_, from, next_, next_rates_, to);
      sample(t, trial_);
    }
  }

  // An event function has changed sign: calls the user's function.
  void happened(std::size_t which) {
    if (t_ - instant_ > instant()) at_once_ = 0;
    instant_ = t_;
    above_[which] = !above_[which];
    const EventFunction& function = motion_.event_functions[which];
    const MotionEvent event{which, bool(above_[which]), t_};
    using enum EventFunction::Direction;
    if (function.direction == both || (function.direction == rising) == event.rising) {
      sample_here();
      result_.events.push_back(event);
      if (motion_.at) mode_ = motion_.at(event, x_.data(), mode_);
      sample(t_, x_);
      if (function.ends) return stop(MotionStatus::ended_by_event, function.name);
    }
    const long at_most = 20 * long(above_.size());  // simultaneous, 20 of each: chattering
    if (long(result_.events.size()) < options_.max_events && ++at_once_ <= at_most) return onward();
    const std::string along = slides_along(motion_, t_, x_, mode_);
    stop(MotionStatus::event_limit,
         fmt::format("'{}' chatters, {} events{}", function.name, result_.events.size(),
                     along.empty() ? "" : ": " + along));
  }

  // After a start, an event or a break: each function about to change sign crosses at this time,
  // one after the other, so that even the shortest bounce is detected.
  void settle() {
    while (!finished_) {
      for (std::size_t i = 0; i < n_; ++i) trial_[i] = x_[i] + instant() * rates_[i];
      watch(t_ + instant(), trial_);
      require_numbers();
      if (finished_) return;
      std::size_t k = 0;
      while (k < g_.size() && (g_[k] > 0) == bool(above_[k])) ++k;
      if (k == g_.size()) return;
      happened(k);
    }
  }
};

}  // namespace

std::string to_string(MotionStatus status) {
  switch (status) {
    case MotionStatus::completed:
      return "completed";
    case MotionStatus::ended_by_event:
      return "ended_by_event";
    case MotionStatus::diverged:
      return "diverged";
    case MotionStatus::not_finite:
      return "not_finite";
    case MotionStatus::step_too_small:
      return "step_too_small";
    case MotionStatus::step_limit:
      return "step_limit";
    case MotionStatus::event_limit:
      return "event_limit";
    case MotionStatus::interrupted:
      return "interrupted";
    case MotionStatus::inaccurate:
      return "inaccurate";
  }
  return "?";
}

double sample_time(double from, double to, double sample, long k) {
  constexpr double rounding = 1e-9;  // of the sample
  const double t = from + double(k) * sample;
  return t < to - rounding * sample ? t : std::numeric_limits<double>::infinity();
}

Trajectory integrate(const Motion& motion, const std::vector<double>& x0, int mode, double from,
                     double to, const IntegrateOptions& options) {
  const RoundToNearest environment;
  check(motion, x0, from, to, options);
  return Integration(motion, x0, mode, from, to, options).run();
}

}  // namespace tiltrim
