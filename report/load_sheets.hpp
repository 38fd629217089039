/// @file
/// Component loads as text, CSV and JSON.
#pragma once

#include <string>
#include <vector>

#include "report/sheet.hpp"
#include "study/loads_study.hpp"

namespace tiltrim {

/// A table for each condition: X, Z [N] and M [N m] in body axes about the center of gravity.
std::vector<Sheet> loads_document(const std::vector<LoadsAnswer>& answers);
std::string loads_text(const std::vector<LoadsAnswer>& answers, const TextStyle& style);
Sheet loads_sheet(const std::vector<LoadsAnswer>& answers);       ///< of all conditions, for CSV
std::string loads_json(const std::vector<LoadsAnswer>& answers);  ///< docs/cli.md

}  // namespace tiltrim
