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
  require(motion.watched.empty() || bool(motion.g), "events are watched but there is no g");
  require(std::isfinite(from) && std::isfinite(to) && to > from,
          fmt::format("from t = {} to t = {}; the end must come after the start", from, to));
  require(o.tolerance > 0 && o.tolerance < 1, "the tolerance must be between 0 and 1");
  require(o.sample >= 0 && o.longest_step > 0 && o.fixed_step >= 0,
          "sample and steps must not be negative");
  for (std::size_t i = 0; i < x0.size(); ++i)
    require(std::isfinite(x0[i]), fmt::format("{} starts at {}", motion.states[i].name, x0[i]));
}

// A step under way: everything that goes on from one to the next.
class Integration {
 public:
  Integration(const Motion& motion, const State& x0, int mode, double from, double to,
              const IntegrateOptions& options)
      : motion_(motion),
        options_(options),
        n_(x0.size()),
        mode_(mode),
        t_(from),
        to_(to),
        x_(x0),
        rates_(n_),
        next_(n_),
        next_rates_(n_),
        error_(n_),
        trial_(n_),
        trial_rates_(n_),
        g_(motion.watched.size()),
        above_(motion.watched.size()) {}

  Trajectory run() {
    begin();
    while (!finished_) {
      if (t_ >= to_) break;
      if (options_.stop.stop_requested()) return end(MotionStatus::interrupted, "stopped");
      if (result_.steps + result_.rejected >= options_.max_steps)
        return end(MotionStatus::step_limit,
                   fmt::format("{} steps are used up: stiff, or too fine a tolerance",
                               options_.max_steps));
      step();
    }
    if (!finished_) sample(t_, x_);
    return std::move(result_);
  }

 private:
  const Motion& motion_;
  const IntegrateOptions& options_;
  std::size_t n_;
  int mode_;
  double t_, to_;
  State x_, rates_, next_, next_rates_, error_, trial_, trial_rates_;
  std::vector<double> g_;
  std::vector<char> above_;  // side of zero that each watched function is on
  Stepper stepper_;
  Trajectory result_;
  double h_ = 0.0;
  long sampled_ = 0;  // samples on the grid so far
  double start_ = 0.0;
  bool finished_ = false;

  auto system() {
    return [this](const State& x, State& dxdt, double t) {
      ++result_.evaluations;
      motion_.f(t, x.data(), mode_, dxdt.data());
    };
  }

  Trajectory end(MotionStatus status, std::string why) {
    stop(status, std::move(why));
    return std::move(result_);
  }

  void stop(MotionStatus status, std::string why) {
    finished_ = true;
    result_.status = status;
    result_.message = std::move(why);
    if (result_.t.empty() || result_.t.back() != t_) sample(t_, x_);
  }

  void sample(double t, const State& x) {
    result_.t.push_back(t);
    result_.x.insert(result_.x.end(), x.begin(), x.end());
    result_.modes.push_back(mode_);
  }

  void begin() {
    start_ = t_;
    sample(t_, x_);
    sampled_ = 1;
    if (!motion_.watched.empty()) {
      motion_.g(t_, x_.data(), mode_, g_.data());
      for (std::size_t k = 0; k < g_.size(); ++k) above_[k] = g_[k] > 0;
    }
    evaluate_rates();
    h_ = options_.fixed_step > 0 ? options_.fixed_step : first_step();
  }

  void evaluate_rates() {
    system()(x_, rates_, t_);
    for (std::size_t i = 0; i < n_ && !finished_; ++i)
      if (!std::isfinite(rates_[i]))
        stop(MotionStatus::not_finite,
             fmt::format("the rate of {} is {}", motion_.states[i].name, rates_[i]));
  }

  // A hundredth of the time in which the fastest state moves by its size.
  double first_step() const {
    double fastest = 1.0 / options_.longest_step;
    for (std::size_t i = 0; i < n_; ++i)
      fastest = std::max(
          fastest, std::abs(rates_[i]) / std::max(std::abs(x_[i]), motion_.states[i].nominal));
    return std::min(options_.longest_step, 0.01 / fastest);
  }

  double next_break() const {
    const auto next = std::ranges::upper_bound(motion_.breaks, t_);
    return next == motion_.breaks.end() ? to_ : std::min(to_, *next);
  }

  // The step from here to t_ + h; its error over the tolerance, infinite where it is not finite.
  double tried(double h, State& x, State& rates) {
    stepper_.do_step(system(), x_, rates_, t_, x, rates, h, error_);
    double worst = 0.0;
    for (std::size_t i = 0; i < n_; ++i) {
      if (!std::isfinite(x[i]) || !std::isfinite(rates[i]))
        return std::numeric_limits<double>::infinity();
      const double size = std::max({std::abs(x_[i]), std::abs(x[i]), motion_.states[i].nominal});
      worst = std::max(worst, std::abs(error_[i]) / (options_.tolerance * size));
    }
    return worst;
  }

  void step() {
    const double target = next_break();
    const double rest = target - t_;
    const double longest = options_.fixed_step > 0 ? options_.fixed_step : options_.longest_step;
    double h = std::min({h_, longest, rest});
    if (rest - h < 1e-9 * longest) h = rest;  // no crumbs
    const double error = tried(h, next_, next_rates_);
    const bool controlled = options_.fixed_step == 0;
    // The usual controller of a fifth-order pair: [52, sec. II.4].
    const double factor = std::isfinite(error)
                              ? std::clamp(0.9 * std::pow(std::max(error, 1e-10), -0.2), 0.2, 5.0)
                              : 0.1;
    if (!(error <= 1) && (controlled || !std::isfinite(error))) {
      ++result_.rejected;
      h_ = h * std::min(factor, 0.9);
      if (!(t_ + h_ > t_))
        stop(MotionStatus::step_too_small, "no step is short enough for the tolerance");
      return;
    }
    ++result_.steps;
    const std::optional<std::size_t> crossed = first_crossing(h);
    const double t = h == rest && !crossed ? target : t_ + h;
    samples_between(t_, t);
    const double taken = h;
    t_ = t;
    x_.swap(next_);
    rates_.swap(next_rates_);
    for (std::size_t i = 0; i < n_; ++i)
      if (!(std::abs(x_[i]) <= options_.diverged_beyond * motion_.states[i].nominal))
        return stop(MotionStatus::diverged, fmt::format("{} is {:.3g} {}", motion_.states[i].name,
                                                        x_[i], motion_.states[i].unit));
    if (controlled && !crossed) h_ = std::max(taken, std::min(h_, taken)) * factor;
    if (crossed)
      happened(*crossed);
    else if (h == rest)
      evaluate_rates();  // behind a break
  }

  // The watched function that changes its side first within the step of length h, if one does: then
  // the step is cut to end just behind it.
  std::optional<std::size_t> first_crossing(double& h) {
    if (motion_.watched.empty()) return {};
    motion_.g(t_ + h, next_.data(), mode_, g_.data());
    std::optional<std::size_t> first;
    const std::vector<double> at_end = g_;
    double shortest = h;
    for (std::size_t k = 0; k < at_end.size(); ++k) {
      if ((at_end[k] > 0) == bool(above_[k])) continue;
      const double behind = located(k, h, at_end[k]);
      if (first && behind >= shortest) continue;
      first = k;
      shortest = behind;
    }
    if (!first) return {};
    h = shortest;
    tried(h, trial_, trial_rates_);
    next_ = trial_;
    next_rates_ = trial_rates_;
    return first;
  }

  // The length of a step that ends just behind the zero of a watched function.
  double located(std::size_t which, double h, double at_end) {
    const auto value = [&](double length) {
      tried(length, trial_, trial_rates_);
      motion_.g(t_ + length, trial_.data(), mode_, g_.data());
      return g_[which];
    };
    const double side = above_[which] ? 1.0 : -1.0;
    motion_.g(t_, x_.data(), mode_, g_.data());
    const double at_start = g_[which];
    // Behind a zero already, but for rounding: it is here.
    if (!(at_start * side > 0)) return std::min(h, 16 * spacing());
    if (at_end == 0) return h;
    std::uintmax_t steps = 100;
    const auto [from, to] = boost::math::tools::toms748_solve(
        value, 0.0, h, at_start, at_end,
        [&](double a, double b) { return std::abs(b - a) <= spacing(); }, steps);
    return to;
  }

  double spacing() const {
    return 2 * std::numeric_limits<double>::epsilon() * std::max(std::abs(t_), 0.01);
  }

  // Samples on the grid in (from, to], by the dense output of the step from x_ to next_.
  void samples_between(double from, double to) {
    if (options_.sample == 0) {
      sample(to, next_);
      return;
    }
    for (double t; (t = start_ + double(sampled_) * options_.sample) <= to; ++sampled_) {
      if (t >= to_) return;  // the end has a sample of its own
      stepper_.calc_state(t, trial_, x_, rates_, from, next_, next_rates_, to);
      sample(t, trial_);
    }
  }

  // At an event: the samples before and behind it, the caller's change, and what that makes happen.
  void happened(std::size_t which) {
    sample(t_, x_);
    for (int chain = 0; which < above_.size(); ++chain) {
      above_[which] = !above_[which];
      const Watched& watched = motion_.watched[which];
      const MotionEvent event{which, bool(above_[which]), t_};
      using enum Watched::Direction;
      const bool counts =
          watched.direction == both || (watched.direction == rising) == event.rising;
      if (counts) {
        result_.events.push_back(event);
        if (motion_.at) mode_ = motion_.at(event, x_.data(), mode_);
        if (watched.ends) {
          sample(t_, x_);
          return stop(MotionStatus::ended_by_event, watched.name);
        }
      }
      if (long(result_.events.size()) >= options_.max_events || chain > 100)
        return stop(MotionStatus::event_limit,
                    fmt::format("'{}' to and fro, {} events", watched.name, result_.events.size()));
      motion_.g(t_, x_.data(), mode_, g_.data());
      which = above_.size();
      for (std::size_t k = 0; k < g_.size(); ++k)
        if ((g_[k] > 0) != bool(above_[k]) && k != event.which) which = std::min(which, k);
    }
    sample(t_, x_);
    evaluate_rates();
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
  }
  return "?";
}

Trajectory integrate(const Motion& motion, const std::vector<double>& x0, int mode, double from,
                     double to, const IntegrateOptions& options) {
  check(motion, x0, from, to, options);
  return Integration(motion, x0, mode, from, to, options).run();
}

}  // namespace tiltrim
