/// @file
/// Before the flight: does the loop behind the hand-over take over what the loop in front leaves?
#pragma once

#include <complex>
#include <optional>
#include <string>
#include <vector>

#include "flight/fly.hpp"
#include "trim/trim.hpp"

namespace tiltrim {

/// The trim of the loop on one side of the hand-over.
struct HandOverSide {
  bool airplane = false;                      ///< the side of the elevator
  TrimStatus status = TrimStatus::not_found;  ///< of the trim
  std::string message{};                      ///< why there is none
  FlightState state{};                        ///< of the trim
  Actuators inputs{};                         ///< of the trim
  double abscissa = 0.0;                      ///< largest Re λ of the frozen loop, 1/s
};

/// What becomes of a hand-over.
enum class HandOverVerdict {
  settles,      ///< the loop behind brings the trim in front to its own
  lost,         ///< it does not: the message says why
  not_reached,  ///< it does not, but the loop in front is too slow to come to its own trim in the
                ///< time the schedule gives it: where the flight will be is for flying to show
  no_trim,      ///< there is none on one of the sides
  blended,      ///< the hand-over is no switch: nothing jumps
  never,        ///< the schedule does not come to it
};
std::string to_string(HandOverVerdict verdict);  ///< as JSON spells it

/// One place at which the pitch changes hands.
struct HandOverCheck {
  HandOverVerdict verdict = HandOverVerdict::never;  ///< what becomes of it
  std::string message{};           ///< the cause in words: which state, which jump, where
  double t = 0.0, height = 0.0;    ///< where the schedule has it, s, m
  Command command{};               ///< there
  HandOverSide front{}, behind{};  ///< the trims of the loops
  Actuators asked{};               ///< behind, of the state in front (bumpless: with x2 set anew)
  double integral_jump = 0.0;  ///< K_Li x2 behind less in front, what the switch asks to be made up
  FlightStatus ends = FlightStatus::flown;  ///< of the flight on from the trim in front
  double ends_at = 0.0;                     ///< s after the hand-over
  double seconds_there =
      0.0;  ///< that the schedule takes to come here, were it flown to the letter
};

/// How check_hand_over() goes about it.
struct HandOverOptions {
  double seconds = 60.0;   ///< that it is flown on
  double height = 120.0;   ///< of the schedule's end, m: where crossings are looked for, from 0
  double duration = 90.0;  ///< s, the same over time
  TrimOptions trimming{.starts = 8, .max_boxes = 2000, .closest = false};  ///< of both sides
};

/// Every place along the schedule where it crosses the hand-over, in order; one with verdict never
/// or blended if there is none. At each the loop is trimmed on both sides, and the schedule
/// is flown on from the trim in front, in calm air.
[[nodiscard]] std::vector<HandOverCheck> check_hand_over(const Flight& flight,
                                                         const HandOverOptions& options = {});

}  // namespace tiltrim
