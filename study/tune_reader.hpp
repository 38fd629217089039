/// [tune]: what is free, where it is to hold and what is asked.
/// Internal to study/.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "study/section.hpp"
#include "study/study.hpp"

namespace tiltrim::reading {

/// Reads [tune]; uncertain numbers may be shares of the vehicle's. Throws StudyError.
TuneTable read_tune(const Section& section, const std::filesystem::path& file,
                    const Vehicle& vehicle, const std::vector<Condition>& conditions);

/// The same of a study with [model].
TuneTable read_user_tune(const Section& section, const std::filesystem::path& file,
                         const UserModel& own, const std::vector<Condition>& conditions);

// What [[montecarlo.scatter]] has in common with [[tune.uncertain]]; names are the models' signals.

/// A number of the aircraft or the gains, SI.
double own_value(Vehicle vehicle, const std::string& name);
/// From `from` to `to`, or `percent` of the number's own value to either side; SI.
Range read_reach(const Section& section, const Key& key,
                 const std::function<double(const std::string& name)>& own);
/// Refuses ends between which the control law (13) divides by zero, at the key that moves them in
/// the tables of these lists; `reach` has the ends of each number.
void check_divisors(const Section& section, const std::vector<std::string>& lists,
                    const std::function<Range(const std::string& name)>& reach);

}  // namespace tiltrim::reading
