/// The spacing of values that are multiples of one. Internal to model/.
#pragma once

#include <array>

namespace tiltrim {

/// Spacing of the values that these samples can have, if it is wider than that of numbers of their
/// size: of decimals, of single precision, of what large terms that cancel leave. Otherwise zero,
/// as for samples that are all equal or not finite.
double spacing(const std::array<double, 5>& samples);

}  // namespace tiltrim
