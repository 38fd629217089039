/// What is asked of a candidate, as scores: numbers of which more is better.
/// Internal to tune/.
#pragma once

#include "tune/candidate.hpp"

namespace tiltrim {

/// The measure as a score and back: negated where less is better; a half-time as the decay rate.
double score_of(Measure what, double value);
double value_of(Measure what, double score);
/// d(value)/d(score).
double value_slope(Measure what, double score);
/// Over which a miss of the limit is measured.
double size_of(const Requirement& requirement);

/// Whether every eigenvalue is asked on its own: decay, damping, frequency.
bool spectral(Measure what);
/// The score of one eigenvalue, and its slope: d(score) = Re(conj(slope) dλ).
struct Scored {
  double score = 0.0;
  std::complex<double> slope;
};
Scored score(Measure what, std::complex<double> lambda);

/// Scores of what is not spectral, at an equilibrium; NaN where it does not apply.
double score(const TuneProblem& problem, const Requirement& requirement, const Place& place,
             const GridTrim& e, const Eigen::VectorXcd& eigenvalues);

/// The worst score over a place's eigenvalues, and which it is (-1: no eigenvalue decides).
struct Worst {
  double score = 0.0;
  Eigen::Index eigenvalue = -1;
};
Worst worst(std::size_t asked, const Requirement& requirement, const PlaceModes& modes);

/// Larger is better: the goal where all limits are met, else far below it by how much they are
/// missed; less still the more places have no equilibrium.
struct Merit {
  std::size_t without_trim = 0;
  bool feasible = false;
  double goal = 0.0;    ///< the worst score
  double missed = 0.0;  ///< largest miss of a limit, over the limit's size

  bool trimmed() const { return without_trim == 0; }
  double value() const;
  /// The same without its leaps: what a search that reads values, not ranks, is given.
  double penalised() const;
  bool operator<(const Merit& other) const { return value() < other.value(); }
};
Merit merit(const std::vector<Requirement>& asked, const std::vector<PlaceModes>& places);

/// Why some requirement applies at no place; empty if each applies somewhere. What applies nowhere
/// is not met.
std::string applies_nowhere(const Candidates& candidates, const std::vector<PlaceModes>& places);

}  // namespace tiltrim
