/// Formulas on ranges with derivatives, for proofs. Internal to model/.
#pragma once

#include <string>
#include <vector>

#include "model/formula.hpp"
#include "model/jet.hpp"

namespace tiltrim::formula {

/// A formula and what it gives, in words: "the rate of 'x'".
struct Titled {
  Tape tape;
  std::string title;
};

/// The values of `rows` at these variables; those of `let` are appended to the variables as they
/// are computed. A value that may be undefined, or have no slope, is not known (Jet::known()), and
/// an open comparison is left to current_branches.
std::vector<Jet> on_ranges(const std::vector<Titled>& let, const std::vector<Titled>& rows,
                           const std::vector<LookupTable>& tables, std::size_t depth,
                           std::vector<Jet> variables);

}  // namespace tiltrim::formula
