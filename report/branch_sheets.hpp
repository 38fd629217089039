/// Branches of trims and their events, as text, CSV and JSON. Computes nothing.
#pragma once

#include <string>
#include <vector>

#include "report/sheet.hpp"
#include "study/analyses.hpp"

namespace tiltrim {

/// Start and events of a branch, one row each, angles in degrees.
Sheet events_sheet(const BranchAnswer& branch);
/// All points and events of all branches, in order along each branch.
Sheet branches_sheet(const std::vector<BranchAnswer>& branches);

/// The contents of the text, for documents.
std::vector<Sheet> branches_document(const std::vector<BranchAnswer>& branches);
std::string branches_text(const std::vector<BranchAnswer>& branches, const TextStyle& style);
/// JSON as described in docs/cli.md.
std::string branches_json(const std::vector<BranchAnswer>& branches);

}  // namespace tiltrim
