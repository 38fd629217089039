/// Newton's method on a trim problem. Internal to trim/.
#pragma once

#include "trim/problem.hpp"

namespace tiltrim {

struct NewtonResult {
  Eigen::VectorXd z;      ///< the iterate with the least residual
  double residual = 0.0;  ///< its largest scaled residual; infinite if never finite
  double step = 0.0;      ///< last full Newton step, largest component
  int iterations = 0;
};

/// Damped Newton from z, least-norm steps where there are more unknowns than equations, until the
/// residual no longer falls.
NewtonResult newton(const Problem& problem, Eigen::VectorXd z, const TrimOptions& options);

/// Newton on the optimality conditions of the effort (more unknowns than equations), from a point
/// near the optimum: bounds active there are held, those whose multiplier has the wrong sign let
/// go.
struct Optimum {
  Eigen::VectorXd z;
  bool verified = false;  ///< residual, bounds and the projected gradient of the effort all hold
};
Optimum polish_optimum(const Problem& problem, const Eigen::VectorXd& z,
                       const TrimOptions& options);

/// Symmetric Hessian of a function whose gradient is given, by central differences of it.
template <class Gradient>
Eigen::MatrixXd hessian_of(const Gradient& gradient, const Eigen::VectorXd& z) {
  constexpr double h = 1e-5;  // of a nominal size: truncation and round-off both near 1e-10
  Eigen::MatrixXd H(z.size(), z.size());
  for (Eigen::Index k = 0; k < z.size(); ++k) {
    Eigen::VectorXd ahead = z, behind = z;
    ahead[k] += h;
    behind[k] -= h;
    H.col(k) = (gradient(ahead) - gradient(behind)) / (ahead[k] - behind[k]);
  }
  return 0.5 * (H + H.transpose());
}

}  // namespace tiltrim
