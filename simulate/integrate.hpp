/// @file
/// Integration of ẋ = f(t, x) with error control, dense output and located events.
#pragma once

#include <functional>
#include <stop_token>
#include <string>
#include <vector>

#include "model/model.hpp"

namespace tiltrim {

/// A function whose change of sign is an event. Zero counts as below it: at the start what rises
/// from zero has an event, what falls from it has none.
struct EventFunction {
  std::string name;  ///< in messages
  /// Which changes of sign count.
  enum class Direction {
    both,                         ///< either
    rising,                       ///< from below zero
    falling,                      ///< from above zero
  } direction = Direction::both;  ///< which
  bool ends = false;              ///< the motion, where it happens
};

/// An event that happened.
struct MotionEvent {
  std::size_t which = 0;  ///< of the watched
  bool rising = false;    ///< else falling
  double t = 0.0;         ///< s
};

/// Rates [states] or watched functions [watched] at a time and state, on one side of all jumps:
/// `mode` is the caller's own number for it.
using Evaluate = std::function<void(double t, const double* x, int mode, double* values)>;

/// A motion, smooth but at its breaks and events.
struct Motion {
  Signals states;                        ///< of x
  Evaluate f;                            ///< their rates
  std::vector<EventFunction> watched{};  ///< what has events
  Evaluate g{};                          ///< its values; needed if anything is watched
  /// Times at which f or g has a kink or a jump, rising; at them both have their value behind.
  std::vector<double> breaks{};
  /// Called at each event, just behind it; may move the state, returns the mode from there on.
  /// Empty: events change nothing.
  std::function<int(const MotionEvent&, double* x, int mode)> at{};
};

/// How integrate() goes about it.
struct IntegrateOptions {
  /// Of each step's error in each state: times the larger of the state and its nominal size.
  double tolerance = 1e-9;
  double sample = 0.1;         ///< between samples; 0: at the steps; infinite: at the ends, events
  double fixed_step = 0.0;     ///< no error control, to measure the order; 0: controlled
  double longest_step = 0.5;   ///< what changes its sign twice within a step is missed
  long max_steps = 2'000'000;  ///< tried
  long max_events = 10'000;    ///< in all
  double diverged_beyond = 1e9;  ///< nominal sizes
  std::stop_token stop{};        ///< asked between steps
  /// simulate(): whether a second, finer run says how far the motion may be off. Twice the work.
  bool global_error = true;
};

/// How a motion ended.
enum class MotionStatus {
  completed,       ///< the end time is reached
  ended_by_event,  ///< by one that ends the motion
  diverged,        ///< a state is beyond all sizes
  not_finite,      ///< f at or just behind the last state; a watched function that is NaN
  step_too_small,  ///< no step that times can tell is short enough for the tolerance: a pole
  step_limit,      ///< max_steps used up: stiff, or a tolerance out of reach
  event_limit,     ///< max_events, or 20 per watched one at once: to and fro
  interrupted,     ///< the caller asked to stop
  inaccurate,      ///< simulate(): beyond there the estimated error has eaten the answer
};
std::string to_string(MotionStatus status);  ///< as JSON spells it

/// What integrate() answers.
struct Trajectory {
  MotionStatus status = MotionStatus::completed;  ///< how it ended
  std::string message;              ///< where and why it ended early, in words; else empty
  std::vector<double> t;            ///< samples; at an event one before and one behind it
  std::vector<double> x;            ///< [sample][state]
  std::vector<int> modes;           ///< [sample]
  std::vector<MotionEvent> events;  ///< in their order
  long steps = 0, rejected = 0, evaluations = 0;  ///< taken, tried in vain, calls of f

  /// How many.
  std::size_t samples() const { return t.size(); }
  /// The states of one sample.
  const double* state(std::size_t sample) const {
    return x.data() + sample * (t.empty() ? 0 : x.size() / t.size());
  }
  /// The last time, s.
  double end() const { return t.back(); }
  /// The end time is reached.
  explicit operator bool() const { return status == MotionStatus::completed; }
};

/// From x0 at `from` to `to` > from: Dormand and Prince's pair of orders 5 and 4 with its dense
/// output [52]. An event is located to rounding on steps of its own, not on the dense output, and
/// no step goes across one; what crosses within 1e-13 of the time or the step happens at once. f
/// and g must go on smoothly a step beyond an event. Every cap has its status. Throws
/// std::invalid_argument where sizes do not fit, a start is not finite, an option is NaN or out of
/// range, or `to` is not behind `from`.
[[nodiscard]] Trajectory integrate(const Motion& motion, const std::vector<double>& x0, int mode,
                                   double from, double to, const IntegrateOptions& options = {});

}  // namespace tiltrim
