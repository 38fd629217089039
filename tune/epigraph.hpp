/// The epigraph form: max t, subject to t and the limits for every eigenvalue of every point.
/// Internal to tune/.
#pragma once

#include <vector>

#include "optimize/optimize.hpp"
#include "tune/search.hpp"

namespace tiltrim {

/// Starts from y and t, within `radius` of y; eigenvalues that coalesce are kept together.
void search_epigraph(Search& search, const std::vector<Meeting>& meetings, const Eigen::VectorXd& y,
                     double t, Optimizer algorithm, double radius, int evaluations);

/// Within `radius` of y: minimizes the largest violation of a limit until there is none.
void meet_limits(Search& search, const Eigen::VectorXd& y, Optimizer algorithm, double radius,
                 int evaluations);

}  // namespace tiltrim
