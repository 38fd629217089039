/// A limit on the computing time of a model.
#pragma once

#include <limits>
#include <memory>
#include <stdexcept>
#include <string>

#include "model/model.hpp"

namespace tiltrim {

/// No limit, in seconds.
inline constexpr double unlimited = std::numeric_limits<double>::infinity();

/// The time limit of a model is exceeded. A call in progress is not interrupted.
struct OutOfTime : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// A model whose functions throw OutOfTime after the time limit.
struct TimedModel {
  Model model;                       ///< with a clock around its functions
  std::shared_ptr<const bool> over;  ///< true once a function has thrown OutOfTime
};

/// The model limited to this many seconds of wall-clock time from now. Throws std::invalid_argument
/// unless `seconds` is positive.
[[nodiscard]] TimedModel timed(const Model& model, double seconds);

/// "the model exceeded the time limit of 2 s".
std::string out_of_time_in_words(double seconds);

}  // namespace tiltrim
