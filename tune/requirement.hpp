/// What is asked of a candidate's eigenvalues, as numbers that are to be positive.
/// Internal to tune/.
#pragma once

#include "tune/candidate.hpp"

namespace tiltrim {

/// The measure of one eigenvalue, and its slope: d(value) = Re(conj(slope) dλ).
struct Measured {
  double value = 0.0;
  std::complex<double> slope;
};
Measured measure(Measure what, std::complex<double> lambda);

/// +1 where more is better, -1 where less is.
double better(Measure what);

/// The worst over a point's eigenvalues, and which it is.
struct Worst {
  double value = 0.0;
  Eigen::Index eigenvalue = -1;
};
Worst worst(Measure what, const PointModes& modes);

/// Larger is better: the goal where all limits are met, else far below it by how much they are
/// missed; less still where a point has no equilibrium.
struct Merit {
  bool trimmed = false, feasible = false;
  double goal = 0.0;    ///< worst, in its own unit, more being better
  double missed = 0.0;  ///< largest miss of a limit, over the limit's size

  double value() const;
  bool operator<(const Merit& other) const { return value() < other.value(); }
};
Merit merit(const TuneProblem& problem, const std::vector<PointModes>& points);

}  // namespace tiltrim
