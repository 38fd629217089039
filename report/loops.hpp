/// Margins and Bode data of loops broken at their actuators, as text, CSV and JSON. Computes
/// nothing.
#pragma once

#include <string>
#include <vector>

#include "report/sheet.hpp"
#include "study/analyses.hpp"

namespace tiltrim {

/// Margins, one row per loop and condition: dB, degrees, seconds, rad/s.
Sheet margins_sheet(const std::vector<LoopsAnswer>& conditions);
/// L along the imaginary axis, one row per frequency and loop.
Sheet bode_sheet(const std::vector<LoopsAnswer>& conditions);
std::vector<Sheet> margins_document(const std::vector<LoopsAnswer>& conditions);
/// The margins, or the reason why a condition has none.
std::string margins_text(const std::vector<LoopsAnswer>& conditions, const TextStyle& style);
/// JSON as described in docs/cli.md.
std::string margins_json(const std::vector<LoopsAnswer>& conditions);

}  // namespace tiltrim
