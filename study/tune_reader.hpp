/// Reads [tune]: free variables, operating points and requirements. Internal to study/.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "study/section.hpp"
#include "study/study.hpp"

namespace tiltrim::reading {

/// Reads [tune]; uncertainties may be percentages of the vehicle's values. Throws StudyError.
TuneTable read_tune(const Section& section, const std::filesystem::path& file,
                    const Vehicle& vehicle, const std::vector<Condition>& conditions);

/// The same for a study with [model].
TuneTable read_user_tune(const Section& section, const std::filesystem::path& file,
                         const UserModel& own, const std::vector<Condition>& conditions,
                         const std::vector<std::string>& figures);

// Shared by [[montecarlo.scatter]] and [[tune.uncertain]]; names are the models' signals.

/// A parameter of the aircraft or a gain, SI.
double own_value(Vehicle vehicle, const std::string& name);
/// From `from` to `to`, or `percent` of the nominal value to either side; SI.
Range read_reach(const Section& section, const Key& key,
                 const std::function<double(const std::string& name)>& own);
/// Refuses ranges in which the control law (13) divides by zero, at the key in the tables of these
/// lists that varies the divisor; `reach` has the range of each variable.
void check_divisors(const Section& section, const std::vector<std::string>& lists,
                    const std::function<Range(const std::string& name)>& reach);

}  // namespace tiltrim::reading
