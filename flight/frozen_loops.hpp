/// The closed loop frozen at tilts along the corridor, and what linear theory says of tilting
/// slowly from one to the next. Internal to flight/.
#pragma once

#include <string>
#include <vector>

#include "flight/tilt_rate.hpp"

namespace tiltrim {

inline constexpr double hair = 1e-9;  ///< rad beside the hand-over, where a stretch ends

/// The loops at tilts from helicopter to airplane, falling; none where one has no trim, which `why`
/// says, or where it is interrupted.
std::vector<FrozenLoop> frozen_loops(const Flight& flight, std::vector<double> tilts,
                                     const TiltRateOptions& options, std::string& why);

/// The tilts in stretches along which the loop changes smoothly: between the hand-over and the
/// tilts at which scheduled gains have kinks.
std::vector<std::vector<double>> stretches_of(const Flight& flight, const TiltRateOptions& options);

/// Rates up to which the loops frozen at these tilts decide, on a grid as fine as the certificate
/// needs.
SlowTilt slow_tilt(const Flight& flight, const std::vector<double>& tilts,
                   const TiltRateOptions& options);

/// ‖Φ(t, s)‖ over the transition at a rate.
Growth growth(const std::vector<FrozenLoop>& loops, double rate);

}  // namespace tiltrim
