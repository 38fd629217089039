/// @file
/// Maps of eigenvalues over a grid as text, CSV and JSON. Computes nothing.
#pragma once

#include <string>
#include <vector>

#include "report/sheet.hpp"
#include "sweep/map.hpp"

namespace tiltrim {

/// One row per grid point.
Sheet map_sheet(const SweepMap& map);
/// Verdicts between the points along an axis, one row per interval: verdict, distance to the
/// imaginary axis, what ends the interval.
Sheet intervals_sheet(const SweepMap& map, std::size_t condition, std::size_t axis);
/// Verdict of a grid with one axis: "stable throughout [0, 120] m; ...".
std::string line_in_words(const SweepMap& map, std::size_t condition, std::size_t axis);
/// "227 stable, 14 unstable, ...".
std::string counts_in_words(const SweepMap& map, std::size_t condition);
/// Why points have no equilibrium, most frequent first: "12 x delta_e ...".
std::vector<std::string> reasons_of(const SweepMap& map, std::size_t condition);
/// The contents of the text, for documents.
std::vector<Sheet> map_document(const SweepMap& map);
/// Counts, and intervals and crossings: listed for one axis, counted for more.
std::string map_text(const SweepMap& map, const TextStyle& style);
/// JSON as described in docs/sweep.md.
std::string map_json(const SweepMap& map);

}  // namespace tiltrim
