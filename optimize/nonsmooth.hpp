/// Local minima of functions with kinks, such as the worst of many eigenvalues.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <functional>

namespace tiltrim {

/// f(x) and, if the pointer is not null, its gradient, wherever f has one. Infinite where f is
/// not defined. May throw: the exception is passed on.
using Nonsmooth = std::function<double(const Eigen::VectorXd& x, Eigen::VectorXd* gradient)>;

struct NonsmoothOptions {
  double first_step = 0.1;  ///< length of the first step
  double tolerance = 1e-8;  ///< relative decrease of f over a few steps below which the search ends
  int steps = 200;          ///< at most
};

struct NonsmoothMinimum {
  Eigen::VectorXd x;
  double value = 0.0;
  bool converged = false;  ///< false: the most steps were taken
};

/// Quasi-Newton descent with a line search of weak Wolfe type, which does not stop at kinks.
/// A.S. Lewis and M.L. Overton, Nonsmooth optimization via quasi-Newton methods, Math. Program. 141
/// (2013) 135-163, algorithms 2.1 and 2.6.
[[nodiscard]] NonsmoothMinimum minimize_nonsmooth(const Nonsmooth& f, const Eigen::VectorXd& start,
                                                  const NonsmoothOptions& options = {});

/// The element of least norm in the convex hull of the columns of G.
/// P. Wolfe, Finding the nearest point in a polytope, Math. Program. 11 (1976) 128-149.
[[nodiscard]] Eigen::VectorXd least_in_hull(const Eigen::MatrixXd& G);

/// How nearly x is stationary, in [0, 1]: the least norm in the hull of the gradients at x and at
/// random points within `radius` of it, over the norm of the largest of them. 0: stationary; 1:
/// every gradient points the same way; 0 as well where all gradients vanish. J.V. Burke, A.S. Lewis
/// and M.L. Overton, A robust gradient sampling algorithm for nonsmooth, nonconvex optimization,
/// SIAM J. Optim. 15 (2005) 751-779.
[[nodiscard]] double stationarity(const Nonsmooth& f, const Eigen::VectorXd& x, double radius,
                                  std::uint64_t seed);

}  // namespace tiltrim
