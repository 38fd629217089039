/// Maps of verdicts alone, as text, CSV and JSON. Computes nothing.
#pragma once

#include <string>
#include <vector>

#include "report/sheet.hpp"
#include "sweep/verdict_map.hpp"

namespace tiltrim {

/// One row per stretch of equal verdicts along the last axis.
Sheet verdicts_sheet(const VerdictMap& map);
/// The contents of the text, for documents.
std::vector<Sheet> verdicts_document(const VerdictMap& map);
/// Counts of verdicts and borders.
std::string verdicts_text(const VerdictMap& map, const TextStyle& style);
/// JSON as described in docs/sweep.md.
std::string verdicts_json(const VerdictMap& map);

}  // namespace tiltrim
