/// Sensitivities of trims and modes, as text, CSV and JSON. Computes nothing.
#pragma once

#include <string>
#include <vector>

#include "report/sheet.hpp"
#include "study/analyses.hpp"

namespace tiltrim {

/// All derivatives of all conditions, one row for each parameter and quantity.
Sheet sensitivities_sheet(const std::vector<SensitivityAnswer>& conditions);
/// For each mode the `most` parameters that move it most.
std::vector<Sheet> sensitivities_document(const std::vector<SensitivityAnswer>& conditions,
                                          std::size_t most);
std::string sensitivities_text(const std::vector<SensitivityAnswer>& conditions, std::size_t most,
                               const TextStyle& style);
/// The stable JSON that docs/cli.md describes.
std::string sensitivities_json(const std::vector<SensitivityAnswer>& conditions);

}  // namespace tiltrim
