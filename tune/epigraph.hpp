/// The epigraph form: max t, every eigenvalue of every point keeping t and the limits.
/// Internal to tune/.
#pragma once

#include <vector>

#include "optimize/optimize.hpp"
#include "tune/search.hpp"

namespace tiltrim {

/// From y and t, no farther than `radius` from y; eigenvalues that meet are held together.
void search_epigraph(Search& search, const std::vector<Meeting>& meetings, const Eigen::VectorXd& y,
                     double t, Optimizer algorithm, double radius, int evaluations);

}  // namespace tiltrim
