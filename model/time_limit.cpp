#include "model/time_limit.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <chrono>

namespace tiltrim {

using Clock = std::chrono::steady_clock;

std::string out_of_time_in_words(double seconds) {
  return fmt::format("the model exceeded the time limit of {:.6g} s", seconds);
}

TimedModel timed(const Model& model, double seconds) {
  if (!(seconds > 0))
    throw std::invalid_argument(
        fmt::format("a time limit of {} s; expected more than 0 s", seconds));
  constexpr double longest = 1e9;  // s, within the clock's range
  const Clock::duration allowed = std::chrono::duration_cast<Clock::duration>(
      std::chrono::duration<double>(std::min(seconds, longest)));
  const auto over = std::make_shared<bool>(false);
  const auto in_time = [seconds, over, end = Clock::now() + allowed](const auto& function) {
    return [seconds, over, end, function](const auto&... arguments) {
      if (Clock::now() > end) {
        *over = true;
        throw OutOfTime(out_of_time_in_words(seconds));
      }
      return function(arguments...);
    };
  };
  Model limited = model;
  limited.f = in_time(model.f);
  if (model.h) limited.h = in_time(model.h);
  if (model.derivatives) limited.derivatives = in_time(model.derivatives);
  if (model.enclosure) limited.enclosure = in_time(model.enclosure);
  if (model.lanes) limited.lanes = in_time(model.lanes);
  return {limited, over};
}

}  // namespace tiltrim
