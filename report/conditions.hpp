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
#include "study/qualities_study.hpp"

namespace tiltrim {

/// Results for one condition; `linear` and `modes` if requested and available.
struct ConditionReport {
  Answer answer;
  std::optional<LinearModel> linear;
  std::optional<Modes> modes;
  std::optional<AllEquilibria> all;            ///< trim --all
  std::optional<Explanation> why;              ///< if no equilibrium exists
  std::optional<JudgedQualities> qualities{};  ///< if requested, or the study has [qualities]
};

/// Equilibria, one row per condition, angles in degrees.
Sheet trim_sheet(const std::vector<ConditionReport>& conditions);
/// All equilibria found, one row each.
Sheet all_sheet(const std::vector<ConditionReport>& conditions);
/// Eigenvalues of one condition, one row each (one row per complex pair).
Sheet modes_sheet(const ConditionReport& condition);
/// Eigenvalues of all conditions, one row each, for CSV.
Sheet all_modes_sheet(const std::vector<ConditionReport>& conditions);

/// The contents of the text, for documents: equilibria (all, if requested), eigenvalues of each.
std::vector<Sheet> conditions_document(const std::vector<ConditionReport>& conditions);
/// The trims, remarks and, if available, linear models and modes of all conditions.
std::string conditions_text(const std::vector<ConditionReport>& conditions, const TextStyle& style);
/// JSON as described in docs/cli.md.
std::string conditions_json(const std::vector<ConditionReport>& conditions);

}  // namespace tiltrim
