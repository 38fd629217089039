/// @file
/// Simulate: the motion of any model from a point, inputs and parameters changed on the way.
#pragma once

#include <Eigen/Core>
#include <limits>
#include <string>
#include <vector>

#include "model/model.hpp"
#include "simulate/integrate.hpp"

namespace tiltrim {

/// `size` is added to an input or parameter from `from` until `to`.
struct SignalChange {
  std::string signal;                                               ///< which
  double size = 0.0;                                                ///< in its unit
  double from = 0.0, to = std::numeric_limits<double>::infinity();  ///< s
};

/// One of the model's switches, met on the way.
struct SwitchEvent {
  std::string name;     ///< of the switch
  double t = 0.0;       ///< s
  bool rising = false;  ///< its distance becomes positive
};

/// Samples along t. Where the rates throw or are no finite numbers the motion ends before; outputs
/// that throw or are none are NaN. What the model threw is in the message.
struct Simulation {
  MotionStatus status = MotionStatus::completed;  ///< how it ended
  std::string message;                            ///< why it ended early; what the outputs threw
  std::vector<double> t;                          ///< s
  Eigen::MatrixXd x, u, p, y;                     ///< [signal, sample]
  std::vector<SwitchEvent> events;                ///< in their order
  long steps = 0, evaluations = 0;                ///< taken; calls of the model

  /// To the end of its time.
  explicit operator bool() const { return status == MotionStatus::completed; }
};

/// From `start` for `duration` seconds. Steps end where a change begins or ends and where a switch
/// of the model is crossed. Throws std::invalid_argument for signals that are no input or parameter
/// of the model, sizes and times that are not finite, and as integrate().
[[nodiscard]] Simulation simulate(const Model& model, const OperatingPoint& start, double duration,
                                  const std::vector<SignalChange>& changes = {},
                                  const IntegrateOptions& options = {});

}  // namespace tiltrim
