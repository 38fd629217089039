/// @file
/// [simulate] and [montecarlo] of a study: which flight, through what weather, how often.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "model/flight.hpp"
#include "model/tuning.hpp"

namespace tiltrim {

/// A change of a command or an actuator for a time.
struct DisturbanceTable {
  /// Its course over time.
  enum class Kind {
    step,                       ///< `size` from `at` on, for `duration` (0: to the end)
    doublet,                    ///< `size` for `duration`, then its opposite for as long
  } kind = Kind::step;          ///< which
  std::string on = "gamma";     ///< V, gamma, theta0, a1s or delta_e
  double at = 0.0, size = 0.0;  ///< s; SI, radians
  double duration = 0.0;        ///< s
};

/// Wind over the ground.
struct GustTable {
  /// Its course over time.
  enum class Kind {
    steady,            ///< `size` all the time
    one_minus_cosine,  ///< up to `size` and back, (1 - cos)/2 from `at` for `duration` [53]
    dryden,            ///< turbulence of standard deviation `size`, by a sum of waves [53]
  } kind = Kind::one_minus_cosine;  ///< which
  bool up = false;                  ///< else forward
  double size = 0.0;                ///< m/s
  double at = 0.0;                  ///< s
  double duration = 1.0;            ///< s
  double length = 50.0;             ///< m, scale of the turbulence
  double speed = 15.0;              ///< m/s at which it is flown through
  std::uint64_t seed = 1;           ///< of the turbulence
};

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

/// [montecarlo]: the flight of [simulate] again and again.
struct MonteCarloTable {
  long flights = 1000;             ///< how many
  std::uint64_t seed = 1;          ///< of all that is random
  std::vector<Uncertain> scatter;  ///< uniform, SI; "aircraft.mass", "gains.K_Lp" (the same at all
                                   ///< tilts), "theta", "height", "gust_size" (of every gust)
  int worst = 10;                  ///< flights kept and named
  /// A flight is good if at its end |V - Vd| and |gamma - gamma_d| are at most these,
  double V_within = 0.2;       ///< m/s
  double gamma_within = 0.01;  ///< rad
  double theta_within = 1.3;   ///< rad: |theta| on all the way
};

}  // namespace tiltrim
