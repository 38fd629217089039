/// @file
/// Tuning, as text, JSON, CSV, and as TOML to paste into a study.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "report/sheet.hpp"
#include "tune/tune.hpp"

namespace tiltrim {

/// What `tiltrim tune` has to say of one study.
struct TuningReport {
  TuneProblem problem;                     ///< as asked
  bool user_model = false;                 ///< of a study with [model]
  TuneOptions options{};                   ///< as asked
  TuneResult result{};                     ///< the answer
  std::string second_algorithm{};          ///< whose answer stands beside; empty: none
  std::optional<TuneResult> second{};      ///< that answer
  std::optional<Robustness> robustness{};  ///< of the answer
  /// The goal over a limit that moves: with the limit at each value, the answer.
  struct FrontPoint {
    double limit;       ///< its value
    TuneResult result;  ///< with it
  };
  bool interrupted = false;         ///< somewhere: what comes after was not done
  Requirement front_limit{};        ///< the limit that moves
  std::vector<FrontPoint> front{};  ///< in the order of its values
};

/// The verdict, the gains to paste, what was asked and what became of it, what each gain does; for
/// people, in the study's units.
std::string tuning_text(const TuningReport& report, const TextStyle& style);
/// What the text has, for documents.
std::vector<Sheet> tuning_document(const TuningReport& report);
/// Everything, in SI units and the measures' own, every digit; null for what is not finite.
std::string tuning_json(const TuningReport& report);
/// Each requirement at each place, one row each; empty where it does not apply.
Sheet tuning_sheet(const TuningReport& report);
/// "[gains]" (and "[aircraft]") with the tuned numbers in the study's units, so that parse_study()
/// reads the same bits; angles to rounding. With a schedule, lists over schedule_eta_deg. Of a
/// study with [model] "[model.values]". Empty where the result has no gains; a comment for what no
/// study has.
std::string tuning_toml(const TuningReport& report);

}  // namespace tiltrim
