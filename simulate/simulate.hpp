/// @file
/// Simulation of any model from a point, with changes of inputs and parameters, and the range of
/// validity of the linear model.
#pragma once

#include <Eigen/Core>
#include <limits>
#include <map>
#include <string>
#include <vector>

#include "model/model.hpp"
#include "simulate/integrate.hpp"
#include "trim/trim.hpp"

namespace tiltrim {

/// `size` is added to an input or parameter from `from` to `to`.
struct SignalChange {
  std::string signal;                                               ///< input or parameter
  double size = 0.0;                                                ///< in its unit
  double from = 0.0, to = std::numeric_limits<double>::infinity();  ///< s
};

/// A crossing of one of the model's switches.
struct SwitchEvent {
  std::string name;     ///< of the switch
  double t = 0.0;       ///< s
  bool rising = false;  ///< its distance becomes positive
};

/// Samples of a motion. If the rates throw or are not finite, the motion ends there; outputs that
/// throw or are not finite are NaN. The message contains the model's exception.
struct Simulation {
  MotionStatus status = MotionStatus::completed;  ///< how it ended
  std::string message;                            ///< why it ended early; exceptions of the outputs
  std::vector<double> t;                          ///< s
  Eigen::MatrixXd x, u, p, y;                     ///< [signal, sample]
  std::vector<SwitchEvent> events;                ///< in order of time
  long steps = 0, evaluations = 0;                ///< accepted; calls of the model
  /// Error estimate of each state at its worst sample: the difference from a run at a tenth of
  /// the tolerance. NaN if not available.
  Eigen::VectorXd error;
  bool stiff = false;  ///< implicit method used: explicit steps were limited by stability

  /// True if the motion reached its end time.
  explicit operator bool() const { return status == MotionStatus::completed; }
};

/// Simulates from `start` for `duration` seconds, by integrate(), or by an implicit method of order
/// 4 if its steps are limited by modes that have decayed. If the estimated error of a state exceeds
/// a tenth of the state's largest value the motion ends with `inaccurate`. Steps end where a change
/// begins or ends and where a switch of the model is crossed. Throws std::invalid_argument for
/// signals that are not an input or parameter of the model, for sizes and times that are not
/// finite, and as integrate().
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
  TrimOptions trimming{};                 ///< for the start
};

/// Linear and nonlinear motion of the model from an offset of states, by name, at a trim.
/// Throws std::invalid_argument for names that are not states and for a zero offset.
[[nodiscard]] Response response(const Model& model, const OperatingPoint& trim,
                                const std::map<std::string, double>& offset,
                                const ResponseOptions& options = {});

}  // namespace tiltrim
