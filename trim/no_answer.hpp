/// What a search without an equilibrium says. Internal to trim/.
#pragma once

#include "trim/trim_search.hpp"

namespace tiltrim {

/// The closest point, why there is no equilibrium, and in words how near that point is; or an
/// equilibrium that the search for the closest point has found.
TrimResult no_answer(TrimSearch& search);

}  // namespace tiltrim
