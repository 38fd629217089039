/// @file
/// [tune] of a study: which gains are free, where they are to hold, and what is asked of them.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "model/signal.hpp"
#include "tune/measure.hpp"

namespace tiltrim {

/// [tune]
struct TuneTable {
  std::vector<std::string> conditions;  ///< names of the study's, in its order
  std::vector<double> heights;          ///< points along corridor (16) beside them, m
  std::vector<FreeGain> gains;          ///< at least one
  std::vector<double> schedule;  ///< tilts [rad], rising: the gains are linear in eta between them;
                                 ///< empty: constant
  std::vector<Uncertain> uncertain;           ///< empty: none
  bool corners = true;                        ///< all of them are operating points
  int samples = 0;                            ///< seeded ones beside them
  std::map<std::string, double> disturbance;  ///< of V [m/s], gamma, theta [rad], q [rad/s] by name
  Requirement goal{Measure::decay};           ///< whose worst value is to be best
  std::vector<Requirement> limits;            ///< that hold at all points
  std::string global = "multistart", local = "slsqp";  ///< as tune/tune.hpp spells them
  std::string second = "crs2";                         ///< whose answer stands beside; "none"
  std::uint64_t seed = 1;                              ///< of all that is random
  long evaluations = 4000;                             ///< candidates tried
  double seconds = 0.0;                                ///< 0: no limit
  long robustness = 10'000;  ///< random samples that the answer is tried on
  /// The goal over a limit that moves.
  struct Front {
    Requirement limit;            ///< NaN
    double from = 0.0, to = 0.0;  ///< of its value, in the measure's unit
    int count = 0;                ///< of values
  };
  std::optional<Front> front;  ///< not given: none
};

}  // namespace tiltrim
