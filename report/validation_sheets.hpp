/// @file
/// A validation as text, CSV, JSON and Markdown.
#pragma once

#include <string>
#include <vector>

#include "report/sheet.hpp"
#include "study/validation.hpp"

namespace tiltrim {

/// A table for each group, and the summary.
std::vector<Sheet> validation_document(const Validation& validation);
std::string validation_text(const Validation& validation, const TextStyle& style);
Sheet validation_sheet(const Validation& validation);  ///< of all groups, for CSV
std::string validation_json(const Validation& validation);

}  // namespace tiltrim
