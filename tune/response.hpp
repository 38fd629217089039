/// Measures of the linear closed loop's responses: norms of transfers, quadratic cost, steps.
/// Internal to tune/.
#pragma once

#include "tune/candidate.hpp"

namespace tiltrim {

/// A measure that has no finite value, or whose value is not determined, has minus this as its
/// score; a loop that is not stable has less, the further its eigenvalues are from the axis. Beyond
/// any value and any limit, but so small that products of scores do not overflow.
inline constexpr double unbounded = 1e30;

/// True for peak_gain, peak_sensitivity, h2_norm, quadratic_cost, overshoot, settling_time.
bool of_a_response(Measure what);

/// The score of such a requirement at an equilibrium, and its exact derivatives with respect to the
/// place's gains: at the peak's frequency, or by the adjoint Lyapunov equation.
struct ResponseScore {
  double score = 0.0;         ///< NaN: not applicable
  Eigen::RowVectorXd slopes;  ///< empty if not requested, or where differences are needed
};
ResponseScore response_score(const TuneProblem& problem, const Requirement& requirement,
                             const Place& place, const GridTrim& e,
                             const Eigen::VectorXcd& eigenvalues, bool slopes);

/// Throws std::invalid_argument for signals the point's model does not have, a weight that is
/// improper or not stable, and so on.
void check_response(const TuneProblem& problem, const Requirement& requirement, const Model& model);

}  // namespace tiltrim
