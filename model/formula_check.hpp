/// Checks of formulas and of names in them, for readers of studies.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "model/formulas.hpp"

namespace tiltrim {

/// The functions that a formula may call: "sin", "atan2", "min", ...
[[nodiscard]] const std::vector<std::string>& formula_functions();

/// Throws std::invalid_argument, quoting the place, if the text is not a valid formula of these
/// names and tables.
void check_formula(std::string_view text, const std::vector<std::string>& names,
                   const std::vector<LookupTable>& tables = {});

/// Throws std::invalid_argument if the text is not a valid name in a formula.
void check_formula_name(std::string_view name);

}  // namespace tiltrim
