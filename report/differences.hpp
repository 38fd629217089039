/// Differences between two maps of a kind, as text, CSV and JSON. Computes nothing.
#pragma once

#include <string>
#include <vector>

#include "report/sheet.hpp"
#include "sweep/difference.hpp"

namespace tiltrim {

/// One row per point whose status or verdict changed.
Sheet difference_sheet(const SweepMap& before, const MapDifference& difference);
/// The contents of the text, for documents.
std::vector<Sheet> difference_document(const SweepMap& before, const MapDifference& difference);
/// The changes, as text with tables.
std::string difference_text(const SweepMap& before, const MapDifference& difference,
                            const TextStyle& style);
/// JSON as described in docs/sweep.md.
std::string difference_json(const SweepMap& before, const MapDifference& difference);

/// One row per stretch of points along the last axis whose verdict changed in the same way.
Sheet difference_sheet(const VerdictMap& before, const VerdictDifference& difference);
/// The contents of the text, for documents.
std::vector<Sheet> difference_document(const VerdictMap& before,
                                       const VerdictDifference& difference);
/// Points by their verdicts before and after, crossings, the first stretches.
std::string difference_text(const VerdictMap& before, const VerdictDifference& difference,
                            const TextStyle& style);
/// JSON as described in docs/sweep.md.
std::string difference_json(const VerdictMap& before, const VerdictDifference& difference);

}  // namespace tiltrim
