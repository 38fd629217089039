/// One remedy of a trim without solution: the search for it, and its text. Internal to tiltrim.
#pragma once

#include <string>

#include "trim/diagnosis.hpp"

namespace tiltrim {

/// One decision variable only: the value nearest to the guess at which an equilibrium exists.
[[nodiscard]] Remedy nearest(const Model& model, const TrimSpec& spec, const OperatingPoint& guess,
                             const DecisionVariable& decision, const TrimOptions& options = {});

/// "theta0 up to 1.31 instead of 1": a remedy as text, its numbers times `factor` in `unit`.
std::string in_words(const Remedy& remedy, double factor = 1.0, const std::string& unit = "");

}  // namespace tiltrim
