/// A branch of trims as a curve: the trim problem with a free parameter. Internal to follow/.
#pragma once

#include "follow/curve.hpp"
#include "trim/optimality.hpp"
#include "trim/problem.hpp"

namespace tiltrim {

/// A trim problem whose last unknown is the parameter. If the equations (and the limits held at
/// present) determine the trim, y = z and G is their residual; if a cost selects it, y = (z, λ) and
/// G holds its optimality conditions.
struct Path {
  const Problem& problem;
  bool optimal = false;  ///< least cost: more unknowns than equations
  ActiveSet held{};

  Eigen::Index parameter() const { return problem.n() - 1; }  ///< its position in y
  Eigen::Index free() const;  ///< degrees of freedom left, parameter excluded
  bool deciding() const { return optimal && free() > 0; }  ///< the cost matters
  Eigen::VectorXd start(const Eigen::VectorXd& z) const;   ///< multipliers by least squares
  Curve curve() const;                                     ///< refers to this path
  Eigen::VectorXd z(const Eigen::VectorXd& y) const { return y.head(problem.n()); }
};

/// Relative error of the derivatives of G.
double slope_error(const Path& path);

/// The spec with `parameter` as its last free variable, and equal bounds on it dropped. Throws
/// std::invalid_argument if the model has no such variable, or if the trim already frees it.
TrimSpec with_parameter(const Model& model, TrimSpec spec, const std::string& parameter);

/// For every limit, held limits last: its distance, positive inside; for a held limit its
/// multiplier, positive while the limit is active (up to a positive factor).
struct LimitName {
  std::string signal;
  bool upper;
  bool held;
  Held as;          ///< the limit as an equation
  bool of_unknown;  ///< otherwise of a limited row
};
std::vector<LimitName> limit_names(const Path& path);
Eigen::VectorXd limit_distances(const Path& path, const std::vector<LimitName>& limits,
                                const Eigen::VectorXd& y);

}  // namespace tiltrim
