/// Comparison of a flight with the paper's figures, as a table and as text. Internal to report/.
#pragma once

#include "flight/paper_flight.hpp"
#include "report/sheet.hpp"

namespace tiltrim {

Sheet facts_sheet(const std::vector<PaperFact>& facts);
std::string facts_text(const std::vector<PaperFact>& facts, const TextStyle& style);

}  // namespace tiltrim
