/// Integration of ẋ = f(t, x) with error control, dense output and located events. Internal to
/// tiltrim.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "simulate/simulate.hpp"

namespace tiltrim {

/// A function whose sign change is an event. Zero counts as negative: a function that rises from
/// zero at the start has an event, one that falls from zero does not.
struct EventFunction {
  std::string name;  ///< in messages
  /// The sign changes that count.
  enum class Direction {
    both,                         ///< either
    rising,                       ///< from negative to positive
    falling,                      ///< from positive to negative
  } direction = Direction::both;  ///< direction of the change
  bool ends = false;              ///< the event ends the motion
};

/// An event that happened.
struct MotionEvent {
  std::size_t which = 0;  ///< index of the event function
  bool rising = false;    ///< otherwise falling
  double t = 0.0;         ///< s
};

/// Rates [states] or event functions [event_functions] at a time and state, on one side of all
/// jumps, identified by the caller's number `mode`.
using Evaluate = std::function<void(double t, const double* x, int mode, double* values)>;

/// A motion, smooth except at its breaks and events.
struct Motion {
  Signals states;                                ///< of x
  Evaluate f;                                    ///< their rates
  std::vector<EventFunction> event_functions{};  ///< the event functions
  Evaluate g{};  ///< their values; required if `event_functions` is not empty
  /// Ascending times at which f or g has a kink or a jump; there both have right-hand values.
  std::vector<double> breaks{};
  /// Called just after each event; may change the state, returns the mode from there on.
  /// Empty: events change nothing.
  std::function<int(const MotionEvent&, double* x, int mode)> at{};
};

/// The result of integrate().
struct Trajectory {
  MotionStatus status = MotionStatus::completed;  ///< how it ended
  std::string message;                            ///< where and why it ended early; otherwise empty
  std::vector<double> t;            ///< s, of the samples; at an event one before and one after it
  std::vector<double> x;            ///< [sample][state]
  std::vector<int> modes;           ///< [sample]
  std::vector<MotionEvent> events;  ///< in order of time
  long steps = 0, rejected = 0, evaluations = 0;  ///< accepted, rejected, calls of f

  /// Number of samples.
  std::size_t samples() const { return t.size(); }
  /// The states of one sample.
  const double* state(std::size_t sample) const {
    return x.data() + sample * (t.empty() ? 0 : x.size() / t.size());
  }
  /// Time of the last sample, s.
  double end() const { return t.back(); }
  /// True if the end time was reached.
  explicit operator bool() const { return status == MotionStatus::completed; }
};

/// Time of sample k on the grid from a start; infinite at the end of the motion, which has a sample
/// of its own, and within rounding of it.
double sample_time(double from, double to, double sample, long k);

/// Integrates from x0 at `from` to `to` > from by the Dormand-Prince pair of orders 5 and 4 with
/// its dense output [52]. An event is located to rounding on steps of their own, not on the dense
/// output, and no step crosses an event; crossings within 1e-13 of the time or the step are
/// simultaneous. f and g must be smooth for one step beyond an event. Every limit has its status.
/// Throws std::invalid_argument if sizes do not match, a start is not finite, an option is NaN or
/// out of range, or `to` is not after `from`.
[[nodiscard]] Trajectory integrate(const Motion& motion, const std::vector<double>& x0, int mode,
                                   double from, double to, const IntegrateOptions& options = {});

}  // namespace tiltrim
