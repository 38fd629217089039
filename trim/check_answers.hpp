/// The first evaluation of a problem's model. Internal to trim/.
#pragma once

#include "trim/problem.hpp"

namespace tiltrim {

/// Throws CallerMistake if f or h returns vectors of a wrong size at the guess.
void check_answers(const Problem& problem);

}  // namespace tiltrim
