/// The audit of the paper's Tables 1-3 as text, CSV and JSON. Computes nothing.
#pragma once

#include <string>

#include "report/sheet.hpp"
#include "tables/tables.hpp"

namespace tiltrim {

std::string paper_text(const PaperTables& tables, const TextStyle& style);
/// Tables 1-3, one row for each printed number.
std::string paper_csv(const PaperTables& tables);
/// The stable JSON that docs/cli.md describes.
std::string paper_json(const PaperTables& tables);

}  // namespace tiltrim
