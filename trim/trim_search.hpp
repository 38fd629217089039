/// The search for equilibria from many starts. Internal to trim/.
#pragma once

#include <optional>

#include "trim/problem.hpp"
#include "trim/proof.hpp"

namespace tiltrim {

/// Distinct verified solutions, and the closest point if there are none.
struct TrimSearch {
  // As an aggregate it would be filled with zeros first.
  TrimSearch(const Problem& problem, const TrimOptions& with) : p(problem), options(with) {}

  const Problem& p;
  const TrimOptions& options;
  std::vector<TrimResult> answers;
  std::optional<TrimResult> not_repeatable;
  std::optional<TrimResult> output_not_finite;
  Eigen::VectorXd closest;
  double closest_residual = std::numeric_limits<double>::infinity();
  bool none_within = false;  ///< no point within the limits was found
  Proof proof;               ///< before the search
  int starts = 0;

  /// `undetermined`: directions along which neither the equations nor the cost change.
  void add(const Eigen::VectorXd& z, bool optimal, const Eigen::MatrixXd& undetermined = {});
  void from_newton(Eigen::VectorXd z0, const TrimOptions& with);
  void from_ipopt(const Eigen::VectorXd& z0, const TrimOptions& with);
  void polish(const Eigen::VectorXd& z, const TrimOptions& with);
};

/// By the method of the options from the guess and from the further starts.
void search(TrimSearch& search);

/// Whether the search ends with the first verified equilibrium, from the guess or else a further
/// start, after few evaluations.
bool first_found(TrimSearch& search);

/// By status, then cost; among costs equal to rounding the nearest to the guess, and among equal
/// distances the one found first.
TrimResult best_answer(TrimSearch& search);

/// The least residual within the limits, from several starts. A point with a small residual may be
/// an equilibrium that the search missed: it is refined and added to the solutions. If no point is
/// within the limits, the one that exceeds those of the outputs least.
TrimResult closest_to(TrimSearch& search);

}  // namespace tiltrim
