/// @file
/// A study's flight: aircraft, schedule, weather, and the trim that it starts from.
#pragma once

#include <map>
#include <string>

#include "model/study.hpp"
#include "simulate/fly.hpp"
#include "trim/trim.hpp"

namespace tiltrim {

/// The closed loop's trim at a command, as a state of a flight at a height.
struct TrimmedStart {
  TrimStatus status = TrimStatus::not_found;  ///< of the trim
  std::string message;                        ///< why there is none
  FlightStart start;                          ///< if there is one

  /// There is one.
  explicit operator bool() const { return status <= TrimStatus::not_optimal; }
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

/// [simulate] of the study, or its defaults. Throws std::invalid_argument where its parts do not
/// fit each other.
[[nodiscard]] FlightPlan flight_plan(const Study& study, const TrimOptions& options = {});

/// Puts states given by name into one: V, gamma, theta, q, energy_integral, distribution_integral
/// (SI). V and gamma stay where they are not given, whatever becomes of theta.
void put(const std::map<std::string, double>& states, Axes axes, FlightState& x);

/// The study's aircraft, schedule, wind and disturbances alone.
[[nodiscard]] Flight flight_of(const Study& study, const SimulateTable& table);

}  // namespace tiltrim
