/// The audit of the paper's Tables 1-3 as text, CSV and JSON. Computes nothing.
#pragma once

#include <string>
#include <vector>

#include "report/sheet.hpp"
#include "tables/tables.hpp"

namespace tiltrim {

/// Tables 1-3 with recomputed values, and the tables that explain them.
std::vector<Sheet> paper_sheets(const PaperTables& tables);
/// The contents of the text, for documents.
std::vector<Sheet> paper_document(const PaperTables& tables);
std::string paper_text(const PaperTables& tables, const TextStyle& style);
/// Tables 1-3, one row per printed number.
std::string paper_csv(const PaperTables& tables);
/// JSON as described in docs/cli.md.
std::string paper_json(const PaperTables& tables);

}  // namespace tiltrim
