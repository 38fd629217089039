/// Optimality conditions of the cost, if there are more unknowns than equations.
/// Internal to trim/ and follow/.
#pragma once

#include <functional>
#include <vector>

#include "trim/problem.hpp"

namespace tiltrim {

/// A bound treated as an equation.
struct Held {
  Eigen::Index position;  ///< in z, or among the limited rows
  double bound, side;     ///< side: +1 at an upper bound, -1 at a lower one
};
struct ActiveSet {
  std::vector<Held> unknowns, limited;
};

/// The active constraints of an optimum, c(z) = 0: residuals, then unknowns, then limited rows.
Eigen::VectorXd active_residual(const ActiveSet& active, const Eigen::VectorXd& z,
                                const Values& values);
Eigen::MatrixXd active_slopes(const ActiveSet& active, const Jacobians& slopes);

using Gradient = std::function<Eigen::VectorXd(const Eigen::VectorXd&)>;
/// ∇f(z) + c'(z)ᵀλ as a function of z; keeps references to all three arguments. NaN if not finite.
Gradient lagrangian_gradient(const Problem& problem, const ActiveSet& active,
                             const Eigen::VectorXd& lambda);
/// Symmetric Hessian of a function from its gradient, by central differences.
Eigen::MatrixXd hessian_of(const Gradient& gradient, const Eigen::VectorXd& z);

/// Whether the cost is least, and the directions along which it is constant: neither the equations
/// nor the cost determine the point.
struct Least {
  bool least = false;
  Eigen::MatrixXd undetermined;  ///< one a column
};
Least least_at(const Problem& problem, const ActiveSet& active, const Eigen::VectorXd& z,
               const Eigen::VectorXd& lambda);
/// No direction that keeps c(z) = 0 lowers the cost to second order [4, thm. 12.5]; along those
/// that do not change it to second order, no step of 0.01 or 0.1 nominal sizes lowers it.
bool is_least(const Problem& problem, const ActiveSet& active, const Eigen::VectorXd& z,
              const Eigen::VectorXd& lambda);

/// Newton on the optimality conditions, from a point near the optimum: bounds active there are
/// held, and those whose multiplier has the wrong sign released.
struct Optimum {
  Eigen::VectorXd z;
  bool verified = false;           ///< residual, bounds and projected gradient are within tolerance
  ActiveSet active;                ///< if verified, with
  Eigen::VectorXd lambda;          ///< the multipliers of c(z) = 0
  Eigen::MatrixXd undetermined{};  ///< directions of constant cost, one a column
};
Optimum polish_optimum(const Problem& problem, const Eigen::VectorXd& z,
                       const TrimOptions& options);

}  // namespace tiltrim
