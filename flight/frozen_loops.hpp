/// The closed loop frozen at tilts along the corridor, and linear theory for slow tilting. Internal
/// to flight/.
#pragma once

#include <string>
#include <vector>

#include "flight/tilt_rate.hpp"

namespace tiltrim {

inline constexpr double hair = 1e-9;  ///< rad: intervals end this far from the handover

/// The loops at tilts from helicopter to airplane, falling; empty if one has no trim, with the
/// reason in `why`, or if interrupted.
std::vector<FrozenLoop> frozen_loops(const Flight& flight, std::vector<double> tilts,
                                     const TiltRateOptions& options, std::string& why);

/// Divides the tilts into intervals over which the loop varies smoothly: split at the handover and
/// at kinks of the scheduled gains.
std::vector<std::vector<double>> stretches_of(const Flight& flight, const TiltRateOptions& options);

/// Tilt rates certified by the loops frozen at these tilts, on a grid as fine as the certificate
/// needs.
SlowTilt slow_tilt(const Flight& flight, const std::vector<double>& tilts,
                   const TiltRateOptions& options);

/// Growth ‖Φ(t, s)‖ over the transition at a tilt rate.
Growth growth(const std::vector<FrozenLoop>& loops, double rate);

}  // namespace tiltrim
