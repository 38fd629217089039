/// @file
/// A study's condition: its closed loop broken behind the control law at each actuator.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "linearize/margins.hpp"
#include "study/answer.hpp"
#include "study/study.hpp"

namespace tiltrim {

/// What the tiltrotor's law commands, and where its loops are broken: theta0, a1s, delta_e. A model
/// of the user's own says its own places.
std::vector<std::string> actuators();

/// The loop broken at one actuator, behind the law, all others closed.
struct ActuatorLoop {
  std::string actuator;  ///< theta0, a1s or delta_e
  bool in_use = false;   ///< false: the law does not command it here, or it moves nothing; L = 0
  LoopTransfer loop;  ///< from what arrives at the actuator to what the law commands, sign turned
  Margins margins;    ///< of a loop in use, as is what follows
  Bode bode;          ///< of the same
};

/// How actuator_loops() goes about it.
struct LoopsOptions {
  std::vector<std::string> actuators{};  ///< empty: all
  /// Of the Bode data, rad/s; not given: ten times slower than every eigenvalue of the closed loop.
  std::optional<double> from{};
  std::optional<double> to{};  ///< the same; not given: ten times faster
  int points = 200;            ///< of the Bode data
};

/// `linear`, `modes` and `loops` where there is an equilibrium; `loops` in the actuators' order.
struct LoopsAnswer {
  Answer trimmed;                   ///< the condition's trim
  LinearModel linear;               ///< of closed_loop_with_inputs()
  Modes modes;                      ///< of the closed loop
  std::vector<ActuatorLoop> loops;  ///< empty without an equilibrium

  /// A trim without remark, a closed loop that is stable or not, and every margin found.
  bool answered() const;
};

/// Trims the condition, linearizes it and breaks its loops. Throws std::invalid_argument for a
/// condition without a loop to break, for an actuator that is none, and unless 0 < from < to and
/// points >= 2.
[[nodiscard]] LoopsAnswer actuator_loops(const Vehicle& vehicle, const Condition& condition,
                                         const LoopsOptions& options = {},
                                         const TrimOptions& trimming = {});

}  // namespace tiltrim
