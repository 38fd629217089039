/// Short period and phugoid among the modes, and distances in the plane of eigenvalues. Internal to
/// qualities/.
#pragma once

#include <complex>
#include <functional>

#include "qualities/qualities.hpp"

namespace tiltrim {

/// Frequency and damping of all eigenvalues in the disk |z - λ| <= error.
Bounded frequency_of(const Mode& mode);
Bounded damping_of(const Mode& mode);

/// The pair with the largest share, if that is above one half; otherwise two stable real roots,
/// each with a share above one half. `name` for the message.
Oscillation oscillation_with(const Modes& modes, const std::vector<Qualities::ModeShares>& shares,
                             double Qualities::ModeShares::*share, const char* name,
                             const std::vector<std::size_t>& taken);

/// Signed distances [rad/s] of an eigenvalue to lines and circles, positive on the better side;
/// they change by at most the distance that the eigenvalue moves, and so do minima and maxima of
/// them.
double beyond_damping(std::complex<double> root, double ratio);  // damping ratio above `ratio`
double slower_than(std::complex<double> root, double time);      // doubles in more than `time` s
double below_frequency(std::complex<double> root, double frequency);

}  // namespace tiltrim
