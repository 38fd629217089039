/// Reads [[model.table]] of a study. Internal to study/.
#pragma once

#include "model/formulas.hpp"
#include "study/section.hpp"

namespace tiltrim::reading {

/// All but its name; throws StudyError.
LookupTable read_lookup_table(const Section& section);

}  // namespace tiltrim::reading
