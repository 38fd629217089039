/// @file
/// How far the linear model reaches: its response beside the nonlinear one.
#pragma once

#include <Eigen/Core>
#include <map>
#include <string>
#include <vector>

#include "model/model.hpp"
#include "trim/trim.hpp"

namespace tiltrim {

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
