/// @file
/// Flying qualities as text, CSV and JSON.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "report/conditions.hpp"
#include "report/sheet.hpp"
#include "study/qualities_study.hpp"

namespace tiltrim {

/// A table for each condition: the criteria with their figures, levels and distances.
std::vector<Sheet> qualities_document(const std::vector<ConditionReport>& conditions);
std::string qualities_text(const std::vector<ConditionReport>& conditions, const TextStyle& style);
Sheet qualities_sheet(const std::vector<ConditionReport>& conditions);       ///< of all, for CSV
std::string qualities_json(const std::vector<ConditionReport>& conditions);  ///< docs/cli.md
/// The key `qualities` of a condition in the JSON of linearize and qualities.
nlohmann::ordered_json qualities_object(const JudgedQualities& judged);

/// Borders of levels along a sweep, one row each; empty without borders.
Sheet borders_sheet(const SweepMap& map, const QualityLayer& layer);
/// The map's JSON with the key `qualities` added.
std::string with_qualities(const std::string& map_json, const SweepMap& map,
                           const QualityLayer& layer);

}  // namespace tiltrim
