/// A tuning result in words, for its text and tables. Internal to report/.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "report/tuning_report.hpp"

namespace tiltrim::tuning {

inline constexpr double rounding = 1e-9;  ///< tolerance on a reserve: not yet a violation

/// "phase margin of theta0"
std::string in_words(const Requirement& asked);
/// "decay", "reserve of 3 goals"
std::string goal_in_words(const TuneProblem& problem);
const char* sign(Measure measure);
/// "≥ 45°"
std::string limit_in_words(const Requirement& asked);
std::string asked_in_words(const Requirement& asked, bool goal);
std::string place_in_words(const TuneProblem& problem, const Achieved::Place& place);
std::string status_in_words(TuneStatus status);
Tone tone_of(TuneStatus status);
std::string without_prefix(const std::string& name);
std::string unit_in_text(std::string_view unit);
/// "12,345"
std::string grouped(long count);

/// The verdict that precedes the tables.
std::string verdict_text(const TuningReport& report, const TextStyle& style);
/// The paragraphs after the tables.
std::vector<std::string> paragraphs(const TuningReport& report);
std::string effort_in_words(const TuningReport& report);

}  // namespace tiltrim::tuning
