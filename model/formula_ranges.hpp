/// Formulas on ranges: enclosures of their values over a box. Internal to model/.
#pragma once

#include <vector>

#include "model/formula.hpp"
#include "model/interval.hpp"

namespace tiltrim::formula {

/// A range that contains every value of the formula with variables in these ranges; NaN if it
/// cannot be determined, as where a function is undefined in part of the box.
Interval range_of(const Tape& tape, const std::vector<Interval>& variables,
                  const std::vector<LookupTable>& tables = {});

}  // namespace tiltrim::formula
