/// @file
/// [simulate] of a study: which flight, through what weather.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "flight/flight.hpp"
#include "flight/monte_carlo.hpp"
#include "flight/weather.hpp"

namespace tiltrim {

/// Which commands are flown.
struct ScheduleTable {
  /// Where they come from.
  enum class Kind {
    corridor,      ///< (16) over height
    hold,          ///< the command of the condition that `start` names, else of the first one
    reconversion,  ///< (16) backwards over time on a level path, then down to the ground
    table,         ///< numbers over height or time
  } kind = Kind::corridor;      ///< which
  bool over_time = false;       ///< table: else over height
  std::vector<double> at{};     ///< table: s or m, rising by 1e-4 or more; two at least
  std::vector<double> V{};      ///< table: m/s; empty: the corridor's (over height alone)
  std::vector<double> gamma{};  ///< table: rad; empty: the same
  std::vector<double> eta{};    ///< table: rad; empty: the same
};

/// [simulate]
struct SimulateTable {
  ScheduleTable schedule;  ///< the commands
  double duration = 90.0;  ///< s
  std::string start;       ///< "ground", "trim" of the schedule's first command, or a condition's
                           ///< name; empty: "ground" for a schedule over height, else "trim"
  double height = 0.0;     ///< m at the start; reconversion: 120
  /// Other states at the start, by name, SI: V, gamma, theta, q, energy_integral,
  /// distribution_integral.
  std::map<std::string, double> states;
  Axes axes = Axes::body;                      ///< in which it is integrated
  HandOver hand_over = HandOver::as_printed;   ///< where there is no blend
  double anti_windup = 1.0;                    ///< s; infinite: none
  ActuatorRates rates;                         ///< largest ones
  double lag = 0.05;                           ///< s, of actuators whose rate is limited
  std::vector<DisturbanceTable> disturbances;  ///< all together
  std::vector<GustTable> gusts;                ///< all together
  double tolerance = 1e-9;                     ///< as in IntegrateOptions
  double sample = 0.1;                         ///< s
};

/// Whether the flight begins on the ground, said or by default.
inline bool from_ground(const SimulateTable& simulate) {
  using Kind = ScheduleTable::Kind;
  const ScheduleTable& schedule = simulate.schedule;
  if (!simulate.start.empty()) return simulate.start == "ground";
  return schedule.kind == Kind::corridor || (schedule.kind == Kind::table && !schedule.over_time);
}

}  // namespace tiltrim
