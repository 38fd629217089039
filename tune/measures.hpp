/// Names, units and senses of measures and goals; algorithms by name.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "tune/tune.hpp"

namespace tiltrim {

/// "1/s", "rad/s", "dB", "degrees", "s" or "".
std::string_view unit(Measure measure);
/// True if larger is better: the limit is then a minimum, otherwise a maximum.
bool more_is_better(Measure measure);
/// All measures, in order.
const std::vector<Measure>& measures();

/// Name of the requirement: the measure's, or the figure's.
std::string name_of(const Requirement& requirement);

/// All requirements: the goal or goals, the limits, and stability (decay of 0) if neither the goal
/// nor a limit is on decay or damping.
[[nodiscard]] std::vector<Requirement> asked_of(const TuneProblem& problem);
/// Number of goals: the first of these requirements.
inline std::size_t goals_of(const TuneProblem& problem) {
  return problem.goals.empty() ? 1 : problem.goals.size();
}
/// "decay", "reserve of 3 goals".
std::string goal_name(const TuneProblem& problem);
/// Unit of TuneResult::goal; "" for several goals.
std::string_view goal_unit(const TuneProblem& problem);
/// True if a larger TuneResult::goal is better.
bool more_goal_is_better(const TuneProblem& problem);

/// From its name; throws std::invalid_argument with all names if it is unknown.
GlobalSearch global_search(const std::string& name);
/// The same.
LocalSearch local_search(const std::string& name);

}  // namespace tiltrim
