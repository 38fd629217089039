/// Local descent on the worst of many eigenvalues.
/// Internal to tune/.
#pragma once

#include "optimize/nonsmooth.hpp"
#include "tune/search.hpp"

namespace tiltrim {

/// Minus the goal plus `weight` times the largest violation of a limit, or that violation alone
/// if `weight` is infinite, in coordinates that fold at the bounds: a minimum at a bound is a kink.
/// Every evaluation counts as a candidate. `search` must outlive it.
[[nodiscard]] Nonsmooth penalty(Search& search, double weight);

/// Descends from y: first until all limits are met, then in the goal, with a penalty on violations
/// that grows until they vanish. Returns the weight of the last.
double descend(Search& search, const Eigen::VectorXd& y);
/// From near a point that meets all limits: a few steps with that weight.
void descend_near(Search& search, const Eigen::VectorXd& y, double weight);

/// The weight with which descend() begins.
double first_weight(const Merit& merit);

}  // namespace tiltrim
