/// A branch of trims as a curve: the trim problem with its parameter set free. Internal to follow/.
#pragma once

#include "follow/curve.hpp"
#include "trim/optimality.hpp"
#include "trim/problem.hpp"

namespace tiltrim {

/// A trim problem whose last unknown is the parameter. Where the equations (and the limits held at
/// present) decide, y = z and G is their residual; where an effort decides, y = (z, λ) and G is its
/// optimality conditions.
struct Path {
  const Problem& problem;
  bool optimal = false;  ///< of least effort: more unknowns than equations
  ActiveSet held{};

  Eigen::Index parameter() const { return problem.n() - 1; }  ///< its position in y
  Eigen::Index free() const;  ///< unknowns left over by equations and held limits, parameter apart
  bool deciding() const { return optimal && free() > 0; }  ///< the effort has a say
  Eigen::VectorXd start(const Eigen::VectorXd& z) const;   ///< y at z, multipliers by least squares
  Curve curve() const;                                     ///< refers to this path
  Eigen::VectorXd z(const Eigen::VectorXd& y) const { return y.head(problem.n()); }
};

/// The spec with `parameter` set free, last, and any equal-ended bounds on it dropped. Throws
/// std::invalid_argument if the model has no such variable, or the trim itself moves it.
TrimSpec with_parameter(const Model& model, TrimSpec spec, const std::string& parameter);

/// Of every limit, those that are held last: its distance, positive inside; held, its multiplier,
/// positive while it still holds the optimum back (up to a positive factor).
struct LimitName {
  std::string signal;
  bool upper;
  bool held;
  Held as;          ///< the limit as an equation
  bool of_unknown;  ///< or of a limited row
};
std::vector<LimitName> limit_names(const Path& path);
Eigen::VectorXd limit_distances(const Path& path, const std::vector<LimitName>& limits,
                                const Eigen::VectorXd& y);

}  // namespace tiltrim
