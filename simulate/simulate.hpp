/// @file
/// Simulation of any model from a point, with changes of inputs and parameters, and the range of
/// validity of the linear model.
#pragma once

#include <Eigen/Core>
#include <limits>
#include <map>
#include <stop_token>
#include <string>
#include <vector>

#include "model/model.hpp"
#include "trim/trim.hpp"

namespace tiltrim {

/// Options of the integration of a motion.
struct IntegrateOptions {
  /// On the error per step of each state, relative to the larger of the state and its nominal size.
  double tolerance = 1e-9;
  double sample = 0.1;           ///< s; 0: at steps; infinite: only at ends and events
  double fixed_step = 0.0;       ///< s; disables error control, to measure the order; 0: controlled
  double longest_step = 0.5;     ///< s; two sign changes within a step are missed
  long max_steps = 2'000'000;    ///< attempted
  long max_events = 10'000;      ///< in all
  double diverged_beyond = 1e9;  ///< nominal sizes
  std::stop_token stop{};        ///< checked between steps
  /// Estimate the global error by a second, finer run. Doubles the cost.
  bool global_error = true;
};

/// Status of a motion.
enum class MotionStatus {
  completed,       ///< reached the end time
  ended_by_event,  ///< by an event that ends the motion
  diverged,        ///< a state exceeds diverged_beyond
  not_finite,      ///< f at or just after the last state; an event function that is NaN
  step_too_small,  ///< the tolerance needs a step below the resolution of time: a pole
  step_limit,      ///< max_steps reached: stiff, a tolerance too small, or sliding along a jump
  event_limit,     ///< max_events, or 20 simultaneous per event function: chattering
  interrupted,     ///< stopped by the caller
  inaccurate,      ///< simulate(): from there on the estimated error is too large
};
std::string to_string(MotionStatus status);  ///< as in JSON

/// `size` is added to an input or parameter from `from` to `to`.
struct SignalChange {
  std::string signal;                                               ///< input or parameter
  double size = 0.0;                                                ///< in its unit
  double from = 0.0, to = std::numeric_limits<double>::infinity();  ///< s
};

/// Samples of a motion. If the rates throw or are not finite, the motion ends there; outputs that
/// throw or are not finite are NaN. The message contains the model's exception.
struct Simulation {
  /// A crossing of one of the model's switches.
  struct SwitchEvent {
    std::string name;     ///< of the switch
    double t = 0.0;       ///< s
    bool rising = false;  ///< its distance becomes positive
  };

  MotionStatus status = MotionStatus::completed;  ///< how it ended
  std::string message;                            ///< why it ended early; exceptions of the outputs
  std::vector<double> t;                          ///< s
  Eigen::MatrixXd x, u, p, y;                     ///< [signal, sample]
  std::vector<SwitchEvent> events;                ///< in order of time
  long steps = 0, evaluations = 0;                ///< accepted; calls of the model
  /// Error estimate of each state at its worst sample, the last included: 10/9 of the difference
  /// from a run at a tenth of the tolerance. NaN if not available.
  Eigen::VectorXd error;
  bool stiff = false;  ///< implicit method used: explicit steps were limited by stability

  /// True if the motion reached its end time.
  explicit operator bool() const { return status == MotionStatus::completed; }
};

/// Simulates from `start` for `duration` seconds, by the Dormand-Prince pair of orders 5 and 4 with
/// its dense output [52], or by an implicit method of order 4 if its steps are limited by modes
/// that have decayed. If the estimated error of a state exceeds a tenth of the state's largest
/// value the motion ends with `inaccurate`. Steps end where a change begins or ends and where a
/// switch of the model is crossed. Throws std::invalid_argument for signals that are not an input
/// or parameter of the model, for sizes and times that are not finite, and for options that are NaN
/// or out of range.
[[nodiscard]] Simulation simulate(const Model& model, const OperatingPoint& start, double duration,
                                  const std::vector<SignalChange>& changes = {},
                                  const IntegrateOptions& options = {});

/// Status of response().
enum class ResponseStatus {
  responded,  ///< both responses, to the end
  no_trim,    ///< no trim or no linear model
  cut_short,  ///< the nonlinear motion ends early; `message` gives the reason
};
std::string to_string(ResponseStatus status);  ///< as in JSON

/// Linear and nonlinear responses to the same offset from a trim with constant inputs and
/// parameters, as deviations from the trim.
struct Response {
  ResponseStatus status = ResponseStatus::no_trim;  ///< whether they exist
  std::string message{};                            ///< if they do not, the reason
  Signals states{};                                 ///< of the deviations
  Eigen::VectorXd offset{};                         ///< in each state's unit, at t = 0
  std::vector<double> t{};                          ///< s
  Eigen::MatrixXd linear{}, nonlinear{};            ///< [state, time]
  /// Largest difference relative to the largest linear deviation, both in nominal sizes.
  double apart = 0.0;
  /// Multiple of the offset at which `apart` reaches `tolerated`; `most` if it does not.
  double reach = 0.0;
};

/// Options of response().
struct ResponseOptions {
  double duration = 10.0, sample = 0.05;  ///< s
  double tolerated = 0.1;                 ///< limit of Response::apart
  double most = 1e3;                      ///< largest multiple of the offset that is tried
  double tolerance = 1e-11;               ///< of the integration
  TrimOptions trimming{};                 ///< of a flight's start; a motion has its trim
};

/// Linear and nonlinear motion of the model from an offset of states, by name, at a trim.
/// Throws std::invalid_argument for names that are not states, a zero offset, and options other
/// than 0 < sample <= duration, tolerated > 0 and most >= 1.
[[nodiscard]] Response response(const Model& model, const OperatingPoint& trim,
                                const std::map<std::string, double>& offset,
                                const ResponseOptions& options = {});

}  // namespace tiltrim
