/// Trims and linear models of a study's conditions, as text, CSV and JSON. Computes nothing.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "follow/envelope.hpp"
#include "linearize/linearize.hpp"
#include "linearize/modes.hpp"
#include "report/sheet.hpp"
#include "study/analyses.hpp"

namespace tiltrim {

/// What is known of one condition; `linear` and `modes` where they were asked for and exist.
struct ConditionReport {
  Answer answer;
  std::optional<LinearModel> linear;
  std::optional<Modes> modes;
  std::optional<AllEquilibria> all;  ///< trim --all
  std::optional<Explanation> why;    ///< where there is no equilibrium
};

/// Equilibria, one row for each condition, angles in degrees.
Sheet trim_sheet(const std::vector<ConditionReport>& conditions);
/// All equilibria that were found, one row for each.
Sheet all_sheet(const std::vector<ConditionReport>& conditions);
/// Eigenvalues of one condition, one row for each (a pair is one row).
Sheet modes_sheet(const ConditionReport& condition);
/// Eigenvalues of all conditions, one row for each eigenvalue, for CSV.
Sheet all_modes_sheet(const std::vector<ConditionReport>& conditions);

/// What the text has, for documents: equilibria, all of them if asked for, eigenvalues of each.
std::vector<Sheet> conditions_document(const std::vector<ConditionReport>& conditions);
/// The trims, remarks and, where there are any, linear models and modes of all conditions.
std::string conditions_text(const std::vector<ConditionReport>& conditions, const TextStyle& style);
/// The stable JSON that docs/cli.md describes.
std::string conditions_json(const std::vector<ConditionReport>& conditions);

}  // namespace tiltrim
