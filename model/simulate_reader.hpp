/// [simulate] and [montecarlo]: which flight, through what weather, how often.
/// Internal to model/.
#pragma once

#include <vector>

#include "model/section.hpp"
#include "model/study.hpp"

namespace tiltrim::reading {

/// Reads [simulate]; throws StudyError.
SimulateTable read_simulate(const Section& section, const std::vector<Condition>& conditions);

/// Reads [simulate] of a study with [model]; throws StudyError.
OwnMotion read_own_motion(const Section& section, const OwnModel& own,
                          const std::vector<Condition>& conditions);

/// Reads [montecarlo] of a study whose vehicle, gains and [simulate] are read; throws StudyError.
MonteCarloTable read_montecarlo(const Section& section, const Study& study);

}  // namespace tiltrim::reading
