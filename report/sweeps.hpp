/// @file
/// Maps of eigenvalues over a grid, and their differences, as text, CSV and JSON. Computes nothing.
#pragma once

#include <string>
#include <vector>

#include "report/sheet.hpp"
#include "sweep/map.hpp"

namespace tiltrim {

/// One row for each point of the grid.
Sheet map_sheet(const SweepMap& map);
/// What lies between the points along an axis, one row for each interval: verdict, how near the
/// axis, what ends it.
Sheet intervals_sheet(const SweepMap& map, std::size_t condition, std::size_t axis);
/// "stable on all of [0, 120] m; ..." of a grid of one axis, or what is not.
std::string line_in_words(const SweepMap& map, std::size_t condition, std::size_t axis);
/// "227 stable, 14 unstable, ...".
std::string counts_in_words(const SweepMap& map, std::size_t condition);
/// Why points have no equilibrium, the commonest first: "12 x delta_e ...".
std::vector<std::string> reasons_of(const SweepMap& map, std::size_t condition);
/// What the text has, for documents.
std::vector<Sheet> map_document(const SweepMap& map);
/// Counts; for a grid of one axis the intervals and crossings too, else how many there are.
std::string map_text(const SweepMap& map, const TextStyle& style);
/// The stable JSON that docs/sweep.md describes.
std::string map_json(const SweepMap& map);

/// One row for each point whose status or verdict changed.
Sheet difference_sheet(const SweepMap& before, const MapDifference& difference);
/// What the text has, for documents.
std::vector<Sheet> difference_document(const SweepMap& before, const MapDifference& difference);
/// What changed, in words and tables.
std::string difference_text(const SweepMap& before, const MapDifference& difference,
                            const TextStyle& style);
/// The stable JSON that docs/sweep.md describes.
std::string difference_json(const SweepMap& before, const MapDifference& difference);

}  // namespace tiltrim
