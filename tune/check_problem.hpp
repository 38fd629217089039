/// Checks of a tuning problem before anything is computed. Internal to tune/.
#pragma once

#include "tune/tune.hpp"

namespace tiltrim {

/// Throws std::invalid_argument if gains, uncertain parameters or requirements make no sense, or
/// need models that the problem does not have.
void check(const TuneProblem& problem);

}  // namespace tiltrim
