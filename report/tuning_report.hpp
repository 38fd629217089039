/// @file
/// Tuning results as text, JSON, CSV, and as TOML to paste into a study.
#pragma once

#include <string>
#include <vector>

#include "report/sheet.hpp"
#include "study/problems.hpp"

namespace tiltrim {

/// The verdict, the gains to paste, the requirements and their values, the effect of each gain; in
/// the study's units.
std::string tuning_text(const TuningReport& report, const TextStyle& style);
/// The contents of the text, for documents.
std::vector<Sheet> tuning_document(const TuningReport& report);
/// Everything, in SI units and the measures' own, with every digit; null for values that are not
/// finite.
std::string tuning_json(const TuningReport& report);
/// One row per requirement and place; empty if it does not apply.
Sheet tuning_sheet(const TuningReport& report);
/// "[gains]" (and "[aircraft]") with the tuned values in the study's units, from which
/// parse_study() recovers the same bits (angles: to rounding). With a schedule, lists over
/// schedule_eta_deg. For a study with [model] "[model.values]", of a published vehicle "[gains]".
/// Empty if the result has no gains; a comment for variables that no study has.
std::string tuning_toml(const TuningReport& report);

}  // namespace tiltrim
