/// Maps of eigenvalues over a grid, and their differences, as text, CSV and JSON. Computes nothing.
#pragma once

#include <string>
#include <vector>

#include "report/sheet.hpp"
#include "sweep/difference.hpp"
#include "sweep/map.hpp"

namespace tiltrim {

/// One row for each point of the grid.
Sheet map_sheet(const SweepMap& map);
/// Counts; for a grid of one axis the intervals and crossings too, else how many there are.
std::string map_text(const SweepMap& map, const TextStyle& style);
/// The stable JSON that docs/sweep.md describes.
std::string map_json(const SweepMap& map);

Sheet difference_sheet(const SweepMap& before, const MapDifference& difference);
std::string difference_text(const SweepMap& before, const MapDifference& difference,
                            const TextStyle& style);
std::string difference_json(const SweepMap& before, const MapDifference& difference);

}  // namespace tiltrim
