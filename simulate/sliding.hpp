/// Why steps become short: a motion that slides along a switch. Internal to simulate/.
#pragma once

#include <string>
#include <vector>

#include "simulate/integrate.hpp"

namespace tiltrim {

/// "the motion slides along 'name': ..." if the state lies on the zero of an event function and the
/// rates jump there and lead back to it from both sides; otherwise empty.
std::string slides_along(const Motion& motion, double t, const std::vector<double>& x, int mode);

/// That the limit of steps is reached, and the cause or the possible causes.
std::string step_limit_in_words(const Motion& motion, double t, const std::vector<double>& x,
                                int mode, long max_steps);

}  // namespace tiltrim
