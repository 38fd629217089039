/// Predicts, before simulating, whether the loop after the handover captures the state before it.
#pragma once

#include <complex>
#include <optional>
#include <string>
#include <vector>

#include "flight/fly.hpp"
#include "trim/trim.hpp"

namespace tiltrim {

/// The trim of the loop on one side of the handover.
struct HandOverSide {
  bool airplane = false;                      ///< the elevator controls pitch
  TrimStatus status = TrimStatus::not_found;  ///< of the trim
  std::string message{};                      ///< why no trim was found
  FlightState state{};                        ///< of the trim
  Actuators inputs{};                         ///< of the trim
  double abscissa = 0.0;                      ///< largest Re λ of the frozen loop, 1/s
};

/// Outcome of a handover.
enum class HandOverVerdict {
  settles,      ///< from the trim before it, the loop settles at the trim after it
  lost,         ///< it does not settle: the message gives the reason
  not_reached,  ///< it does not settle, but the loop before it is too slow to reach its own trim in
                ///< the time the schedule allows: only simulation can tell
  no_trim,      ///< one of the sides has no trim
  blended,      ///< the controls are blended: nothing jumps
  never,        ///< the schedule does not reach the handover
};
std::string to_string(HandOverVerdict verdict);  ///< as JSON spells it

/// One handover along the schedule.
struct HandOverCheck {
  HandOverVerdict verdict = HandOverVerdict::never;  ///< its outcome
  std::string message{};                             ///< the cause: which state, which jump, where
  double t = 0.0, height = 0.0;                      ///< of the handover along the schedule, s, m
  Command command{};                                 ///< the command there
  HandOverSide front{}, behind{};                    ///< trims before and after the handover
  Actuators asked{};           ///< by the law after it, in the state before it (bumpless: x2 reset)
  double integral_jump = 0.0;  ///< K_Li x2 after minus before: left to the integral
  FlightStatus ends = FlightStatus::flown;  ///< of the flight that continues from before
  double ends_at = 0.0;                     ///< s after the handover
  double seconds_there = 0.0;               ///< if the schedule is followed exactly, s
};

/// Options of check_hand_over().
struct HandOverOptions {
  double seconds = 60.0;         ///< s of flight after the handover
  double height = corridor_top;  ///< m: the schedule is searched for handovers from 0 to here
  double duration = 90.0;        ///< s, the same for a schedule over time
  TrimOptions trimming{.starts = 8, .max_boxes = 2000, .closest = false};  ///< of both sides
};

/// Every handover along the schedule, in order; a single one with verdict never or blended if the
/// schedule has none. At each the loop is trimmed on both sides, and the flight continues along the
/// schedule from the trim before the handover, in calm air.
[[nodiscard]] std::vector<HandOverCheck> check_hand_over(const Flight& flight,
                                                         const HandOverOptions& options = {});

}  // namespace tiltrim
