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
  TuneProblem problem;
  TuneOptions options;
  TuneResult result;
  std::string second_algorithm;  ///< whose answer stands beside; empty: none
  std::optional<TuneResult> second;
  std::optional<Robustness> robustness;
  /// The goal over a limit that moves: with the limit at each value, the answer.
  struct FrontPoint {
    double limit;
    TuneResult result;
  };
  Requirement front_limit;
  std::vector<FrontPoint> front;
};

std::string tuning_text(const TuningReport& report, const TextStyle& style);
std::string tuning_json(const TuningReport& report);
Sheet tuning_sheet(const TuningReport& report);
/// "[gains]" with the tuned numbers, in the study's units; with a schedule one "[[schedule]]" table
/// for each of its places.
std::string tuning_toml(const TuningReport& report);

}  // namespace tiltrim
