/// @file
/// A limit on the time that a model may take.
#pragma once

#include <limits>
#include <memory>
#include <stdexcept>
#include <string>

#include "model/model.hpp"

namespace tiltrim {

/// No limit, in seconds.
inline constexpr double unlimited = std::numeric_limits<double>::infinity();

/// The time allowed for a model is over. A call that has begun is not cut short.
struct OutOfTime : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// A model whose functions throw OutOfTime once its time is over.
struct TimedModel {
  Model model;
  std::shared_ptr<const bool> over;  ///< a function threw OutOfTime
};

/// The model for so many seconds of wall clock, from now on. Throws std::invalid_argument unless
/// they are more than zero.
[[nodiscard]] TimedModel timed(const Model& model, double seconds);

/// "the model took longer than the 2 s allowed".
std::string out_of_time_in_words(double seconds);

}  // namespace tiltrim
