/// @file
/// The motion of any model from a point, inputs and parameters changed on the way; how far the
/// linear model reaches.
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
  /// How far each state may be off at its worst sample: the difference of a run at a tenth of the
  /// tolerance. Not a number where there is none.
  Eigen::VectorXd error;
  bool stiff = false;  ///< an implicit method: the explicit one's steps were held by stability

  /// To the end of its time.
  explicit operator bool() const { return status == MotionStatus::completed; }
};

/// From `start` for `duration` seconds, by integrate(), or where its steps are held short by decay
/// that is long over, by an implicit method of order 4. Where the estimated error of a state
/// exceeds a tenth of the state's largest value the motion ends, `inaccurate`. Steps end where a
/// change begins or ends and where a switch of the model is crossed. Throws std::invalid_argument
/// for signals that are no input or parameter of the model, sizes and times that are not finite,
/// and as integrate().
[[nodiscard]] Simulation simulate(const Model& model, const OperatingPoint& start, double duration,
                                  const std::vector<SignalChange>& changes = {},
                                  const IntegrateOptions& options = {});

/// Whether there are responses.
enum class ResponseStatus {
  responded,  ///< both, to their end
  no_trim,    ///< nor a linear model
  cut_short,  ///< the nonlinear motion ends before its time: the message says how
};
std::string to_string(ResponseStatus status);  ///< as JSON spells it

/// Both from the same offset at a trim, inputs and parameters held, as deviations from the trim.
struct Response {
  ResponseStatus status = ResponseStatus::no_trim;  ///< whether there are some
  std::string message{};                            ///< why not
  Signals states{};                                 ///< of the deviations
  Eigen::VectorXd offset{};                         ///< at t = 0
  std::vector<double> t{};                          ///< s
  Eigen::MatrixXd linear{}, nonlinear{};            ///< [state, time]
  /// Largest difference over the largest linear deviation, both in nominal sizes.
  double apart = 0.0;
  /// So many times the offset and the two are `tolerated` apart; at `most` if even that is less.
  double reach = 0.0;
};

/// How response() goes about it.
struct ResponseOptions {
  double duration = 10.0, sample = 0.05;  ///< s
  double tolerated = 0.1;                 ///< of Response::apart
  double most = 1e3;                      ///< times the offset that is tried
  double tolerance = 1e-11;               ///< of the integration
  TrimOptions trimming{};                 ///< of the start
};

/// An offset by state name as a vector. Throws std::invalid_argument for names that are no states
/// and an offset of nothing.
Eigen::VectorXd offset_of(const Signals& states, const std::map<std::string, double>& offset);

/// Linear against nonlinear motion of the model from an offset of states, by name, at a trim.
/// Throws std::invalid_argument for names that are no states and an offset of nothing.
[[nodiscard]] Response response(const Model& model, const OperatingPoint& trim,
                                const std::map<std::string, double>& offset,
                                const ResponseOptions& options = {});

}  // namespace tiltrim
