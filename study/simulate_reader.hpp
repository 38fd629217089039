/// Reads [simulate] and [montecarlo]. Internal to study/.
#pragma once

#include <vector>

#include "study/section.hpp"
#include "study/study.hpp"

namespace tiltrim::reading {

constexpr Accepted height{0, largest, "m"};
constexpr Accepted wind{-1000, 1000, "m/s"}, turbulence{0, 1000, "m/s"};

/// Reads [simulate]; throws StudyError.
SimulateTable read_simulate(const Section& section, const std::vector<Condition>& conditions);

/// Reads [simulate] of a study with [model]; throws StudyError.
UserMotion read_user_motion(const Section& section, const UserModel& own,
                            const std::vector<Condition>& conditions);

/// Reads [montecarlo] after the study's vehicle, gains and [simulate]; throws StudyError.
MonteCarloTable read_montecarlo(const Section& section, const Study& study);

}  // namespace tiltrim::reading
