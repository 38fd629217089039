/// @file
/// Where a flight starts, and all that fly() is given.
#pragma once

#include <map>
#include <string>

#include "flight/fly.hpp"
#include "trim/trim.hpp"

namespace tiltrim {

/// The closed loop's trim at a command, as a state of a flight at a height.
struct TrimmedStart {
  TrimStatus status = TrimStatus::not_found;  ///< of the trim
  std::string message;                        ///< why there is none
  FlightStart start;                          ///< if there is one

  /// There is one.
  explicit operator bool() const { return is_equilibrium(status); }
};
/// Trims the closed loop there.
[[nodiscard]] TrimmedStart trimmed_start(const Flight& flight, const Command& command,
                                         double height, const TrimOptions& options = {});

/// All that fly() is given.
struct FlightPlan {
  Flight flight;                                    ///< its first argument
  FlyOptions options;                               ///< its third
  FlightStart start;                                ///< its second
  TrimStatus start_status = TrimStatus::converged;  ///< of the trim that it starts from
  std::string message;      ///< why there is no trim to start from; else empty
  std::string start_words;  ///< "at rest on the ground", "from the trim at 15 m/s, 0°, tilt 0°"
  bool lands = false;       ///< the schedule ends on the ground
};

/// Puts states given by name into one: V, gamma, theta, q, energy_integral, distribution_integral
/// (SI). V and gamma stay where they are not given, whatever becomes of theta.
void put(const std::map<std::string, double>& states, Axes axes, FlightState& x);

}  // namespace tiltrim
