/// @file
/// A study's motion of a model of the user's own, from the trim of one of its conditions.
#pragma once

#include <optional>

#include "flight/flight_table.hpp"
#include "simulate/response.hpp"
#include "simulate/simulate.hpp"
#include "study/answer.hpp"

namespace tiltrim {

/// A condition's motion.
struct MotionAnswer {
  UserMotion asked;                  ///< as asked, or the default
  Answer start;                      ///< the condition, trimmed
  std::optional<Simulation> motion;  ///< none without a trim to start from
  FlightTable table;                 ///< of it: time, states, inputs, parameters changed, outputs

  /// To the end of its time.
  bool answered() const { return motion && *motion; }
};

/// [simulate] of a study with [model], or its defaults. Throws std::invalid_argument where the
/// study has no [model].
[[nodiscard]] MotionAnswer user_motion(const Study& study, const TrimOptions& trimming = {});

/// Linear against nonlinear motion from an offset of states, by name, at a condition's trim. Throws
/// std::invalid_argument for names that are no states and an offset of nothing.
[[nodiscard]] Response user_response(const Condition& condition,
                                     const std::map<std::string, double>& offset,
                                     const ResponseOptions& options = {});

}  // namespace tiltrim
