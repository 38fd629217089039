/// Independent verification of a point returned by a solver. Internal to trim/.
#pragma once

#include "trim/problem.hpp"

namespace tiltrim {

inline constexpr double bound_slack = 1e-10;  ///< scaled round-off allowed at a bound

/// Evaluates z twice, or once more where a model evaluated in place was evaluated there last, and
/// verifies residual, bounds, conditioning and implied rates. `optimal`: whether the optimum of the
/// cost was verified (or there is no cost). A point that is not an equilibrium is returned as
/// not_found with all values computed.
TrimResult verify(const Problem& problem, const Eigen::VectorXd& z, bool optimal,
                  const TrimOptions& options);

/// Largest violation of lower <= v <= upper.
double excess(const Eigen::VectorXd& v, const Eigen::VectorXd& lower, const Eigen::VectorXd& upper);

/// The unknowns that take part in these directions, the most first: what is not determined.
std::string free_directions(const Problem& problem, const Eigen::MatrixXd& directions);

/// "V' = -3.2 m/s², gap = 0 m instead of 1": the values of the rows at a point as text, with the
/// required value if it is not zero.
std::string left_over(const Problem& problem, const std::vector<Eigen::Index>& rows,
                      const TrimResult& at);
/// "V' = nan, thrust = inf": the rows that are not finite, as text.
std::string not_finite_in_words(const Problem& problem, const Eigen::VectorXd& rates,
                                const Eigen::VectorXd& outputs);
/// "with theta0 at its upper limit 1", that no limit is reached, or which limits are exceeded, and
/// by how much: "with load 19 N above its upper limit -1 N".
std::string limits_in_words(const Problem& problem, const TrimResult& at);

}  // namespace tiltrim
