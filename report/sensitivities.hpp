/// Sensitivities of trims and modes, as text, CSV and JSON. Computes nothing.
#pragma once

#include <string>
#include <vector>

#include "report/sheet.hpp"
#include "study/analyses.hpp"

namespace tiltrim {

/// All derivatives of all conditions, one row per parameter and quantity.
Sheet sensitivities_sheet(const std::vector<SensitivityAnswer>& conditions);
/// For each mode the `most` most influential parameters.
std::vector<Sheet> sensitivities_document(const std::vector<SensitivityAnswer>& conditions,
                                          std::size_t most);
std::string sensitivities_text(const std::vector<SensitivityAnswer>& conditions, std::size_t most,
                               const TextStyle& style);
/// JSON as described in docs/cli.md.
std::string sensitivities_json(const std::vector<SensitivityAnswer>& conditions);

}  // namespace tiltrim
