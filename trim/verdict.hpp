/// Our own verdict on a point that a solver returned. Internal to trim/.
#pragma once

#include "trim/problem.hpp"

namespace tiltrim {

inline constexpr double bound_slack = 1e-10;  ///< scaled round-off of a bound that is kept

/// Evaluates z twice and judges it: residual, bounds, conditioning, implied rates. `optimal` says
/// whether the effort's optimum was verified (or nothing was to be optimized). A point that is no
/// equilibrium comes back as not_found, with all that is known of it.
TrimResult verify(const Problem& problem, const Eigen::VectorXd& z, bool optimal,
                  const TrimOptions& options);

/// Largest violation of lower <= v <= upper.
double excess(const Eigen::VectorXd& v, const Eigen::VectorXd& lower, const Eigen::VectorXd& upper);

/// "V' = -3.2 m/s², gap = 0 m instead of 1": the rows' values at a point, in words, and what those
/// equations hold that are not to vanish.
std::string left_over(const Problem& problem, const std::vector<Eigen::Index>& rows,
                      const TrimResult& at);
/// "V' = nan, thrust = inf": the rows that are not finite, in words.
std::string not_finite_in_words(const Problem& problem, const Eigen::VectorXd& rates,
                                const Eigen::VectorXd& outputs);
/// "with theta0 at its upper limit 1", or that none is reached.
std::string limits_in_words(const TrimResult& at);

}  // namespace tiltrim
