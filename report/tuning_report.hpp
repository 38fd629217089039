/// @file
/// Tuning results as text, JSON, CSV, and as TOML to paste into a study.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "report/sheet.hpp"
#include "tune/tune.hpp"

namespace tiltrim {

/// The results of `tiltrim tune` for one study.
struct TuningReport {
  TuneProblem problem;                     ///< as given
  bool user_model = false;                 ///< of a study with [model]
  TuneOptions options{};                   ///< as given
  TuneResult result{};                     ///< the answer
  std::string second_algorithm{};          ///< algorithm of the comparison; empty: none
  std::optional<TuneResult> second{};      ///< its result
  std::optional<Robustness> robustness{};  ///< of the result
  /// One point of the front: the limit and the optimum.
  struct FrontPoint {
    double limit;       ///< value of the limit
    TuneResult result;  ///< optimum with it
  };
  bool interrupted = false;         ///< later parts were not computed
  Requirement front_limit{};        ///< the limit that is varied
  std::vector<FrontPoint> front{};  ///< in order of the limit
};

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
/// schedule_eta_deg. For a study with [model] "[model.values]". Empty if the result has no gains; a
/// comment for variables that no study has.
std::string tuning_toml(const TuningReport& report);

}  // namespace tiltrim
