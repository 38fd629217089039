/// @file
/// A model written as formulas, as in [model] of a study: parsed at run time, no compiler needed.
#pragma once

#include <string>
#include <vector>

#include "model/model.hpp"

namespace tiltrim {

/// A name and the formula of its value.
struct Formula {
  std::string name, text;  ///< name: letters, digits and _; text: as in a study
};

/// A function of one to three arguments by its values on a grid, which formulas call by its name:
/// "CL(alpha, flap)". Outside the grid the model throws std::domain_error, which names the table.
struct LookupTable {
  std::string name;                     ///< letters, digits and _
  std::vector<std::vector<double>> at;  ///< rising entries of each argument
  std::vector<double> values;           ///< for all combinations; the last argument's vary fastest
  /// False: linear along each argument between entries, with kinks there. True: cubics with
  /// continuous slopes, those of parabolas through three neighbours.
  bool smooth = false;
};

/// ẋ and y as formulas of states, inputs, parameters and, in their order, the values of `let`.
/// Operators + - * / ^, comparisons, && || and a ? b : c; functions as in docs/study.md; pi.
struct Formulas {
  std::string name;                             ///< of the model
  Signals states, inputs, outputs, parameters;  ///< names of letters, digits and _
  std::vector<Formula> let{};                   ///< each may use the names before it
  std::vector<std::string> rates{};             ///< one for each state
  std::vector<std::string> values{};            ///< one for each output
  std::vector<Formula> switches{};              ///< kinks and jumps, as Model::switches
  std::vector<LookupTable> tables{};            ///< look-up tables, for all formulas
};

/// The model, with exact derivatives; NaN where a formula has a kink, a jump or a singular slope,
/// as x == 0 ? 1 : sin(x)/x at 0. It may be evaluated from any number of threads at once. Throws
/// std::invalid_argument if a name or formula is invalid, a name occurs twice, or the number of
/// formulas does not match.
[[nodiscard]] Model model_of(const Formulas& formulas);

}  // namespace tiltrim
