/// The requirements on a candidate as scores, of which larger is better.
/// Internal to tune/.
#pragma once

#include "tune/candidate.hpp"

namespace tiltrim {

/// Converts a measure to a score and back: negated if smaller is better; half-time as decay rate.
double score_of(Measure what, double value);
double value_of(Measure what, double score);
/// True for measures that may have no finite value, or none that is determined: value_of() is then
/// infinite.
bool may_be_unbounded(Measure what);
/// d(value)/d(score).
double value_slope(Measure what, double score);
/// The scale of a violation of the limit.
double size_of(const Requirement& requirement);
/// By how much a score misses the limit, over the limit's size; negative if it is met.
double missed_by(const Requirement& requirement, double own);

/// The score of one goal, or of several the reserve; and back to a value.
double goal_score(const TuneProblem& problem, const Requirement& goal, double score);
double goal_value(const TuneProblem& problem, double score);
/// d(goal_score)/d(score).
double goal_slope(const TuneProblem& problem, const Requirement& goal);

/// True if the requirement applies to every eigenvalue: decay, damping, frequency, pole_region.
bool spectral(Measure what);
/// The score of one eigenvalue, and its derivative: d(score) = Re(conj(slope) dλ).
struct Scored {
  double score = 0.0;
  std::complex<double> slope;
};
Scored score(const Requirement& requirement, std::complex<double> lambda);

/// Scores of requirements on the whole system, at an equilibrium; NaN if not applicable.
double score(const TuneProblem& problem, const Requirement& requirement, const Place& place,
             const GridTrim& e, const Eigen::VectorXcd& eigenvalues);

/// The worst score over a place's eigenvalues, and its index (-1: no eigenvalue decides).
struct Worst {
  double score = 0.0;
  Eigen::Index eigenvalue = -1;
};
Worst worst(std::size_t asked, const Requirement& requirement, const PlaceModes& modes);
/// Derivatives of that score with respect to the tuned values, in SI units; needs the slopes.
Eigen::RowVectorXd score_slope(std::size_t asked, const Requirement& requirement,
                               const PlaceModes& modes);

/// Larger is better: the goal if all limits are met, otherwise far below it depending on the
/// violation, and lower still the more places have no equilibrium.
struct Merit {
  std::size_t without_trim = 0;
  bool feasible = false;
  double goal = 0.0;    ///< the worst score
  double missed = 0.0;  ///< largest violation of a limit, relative to the limit's size

  bool trimmed() const { return without_trim == 0; }
  double value() const;
  /// The same without discontinuities, for searches that use values and not ranks.
  double penalised() const;
  bool operator<(const Merit& other) const { return value() < other.value(); }
};
Merit merit(const Candidates& candidates, const std::vector<PlaceModes>& places);

/// Which requirement applies at no place, as text; empty if each applies somewhere. A requirement
/// that applies nowhere is not met.
std::string applies_nowhere(const Candidates& candidates, const std::vector<PlaceModes>& places);

}  // namespace tiltrim
