/// @file
/// A model written as formulas, as [model] of a study has them: compiled once, no compiler needed.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "model/model.hpp"

namespace tiltrim {

/// A name and the formula of its value.
struct Formula {
  std::string name, text;  ///< of letters, digits and _; as in a study
};

/// ẋ and y as formulas of states, inputs, parameters and, in their order, the values of `let`.
/// Operators + - * / ^, comparisons, && || and a ? b : c; functions formula_functions(); pi.
struct Formulas {
  std::string name;                             ///< of the model
  Signals states, inputs, outputs, parameters;  ///< names of letters, digits and _
  std::vector<Formula> let{};                   ///< each of the names before it
  std::vector<std::string> rates{};             ///< one for each state
  std::vector<std::string> values{};            ///< one for each output
  std::vector<Formula> switches{};              ///< kinks and jumps, as Model::switches
};

/// The functions that a formula may call: "sin", "atan2", "min", ...
[[nodiscard]] const std::vector<std::string>& formula_functions();

/// Throws std::invalid_argument, in words that quote the place, where the text is no formula of
/// these names.
void check_formula(std::string_view text, const std::vector<std::string>& names);

/// Throws std::invalid_argument where the text is no name that a formula can use.
void check_formula_name(std::string_view name);

/// The model, which may be evaluated from any number of threads at once. Throws
/// std::invalid_argument where a name or formula is none, a name stands twice, or a count does not
/// fit.
[[nodiscard]] Model model_of(const Formulas& formulas);

}  // namespace tiltrim
