/// Shared by the text, JSON and TOML of a tuning result. Internal to report/.
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>

#include "report/tuning_report.hpp"
#include "study/keys.hpp"
#include "tune/measures.hpp"

namespace tiltrim::tuning {

inline constexpr double nan = std::numeric_limits<double>::quiet_NaN();

std::size_t places(const TuningReport& report);
bool has_gains(const TuneProblem& problem, const TuneResult& result);
const std::string& point_name(const TuneProblem& problem, const Achieved::Place& place);
/// A gain's values at the tilts of the schedule; without a schedule, its only value.
std::vector<double> values_of(const TuneProblem& problem, const TuneResult& result,
                              std::size_t gain);
/// The study's key of a signal; a user-defined model may have other keys.
Key key_of(const TuneProblem& problem, const std::string& signal);

/// The worst value of a requirement over the places that count; empty if it applies at none.
template <class Counts>
const Achieved* worst(const TuneResult& result, std::size_t asked, const Counts& counts) {
  const Achieved* found = nullptr;
  for (const Achieved& a : result.achieved) {
    if (a.asked != asked || std::isnan(a.value) || !counts(a.place)) continue;
    const bool more = more_is_better(a.requirement.measure);
    if (!found || (more ? a.value < found->value : a.value > found->value)) found = &a;
  }
  return found;
}

template <class Counts>
bool any_active(const TuneResult& result, std::size_t asked, const Counts& counts) {
  return std::ranges::any_of(result.achieved, [&](const Achieved& a) {
    return a.asked == asked && a.active && counts(a.place);
  });
}

inline bool everywhere(const Achieved::Place&) { return true; }

}  // namespace tiltrim::tuning
