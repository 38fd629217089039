#include "trim/newton.hpp"

#include <algorithm>
#include <limits>
#include <utility>

#include "dense/dense.hpp"

namespace tiltrim {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

// False if the step is not finite.
static bool solve(const MatrixXd& J, const VectorXd& r, VectorXd& dz) {
  if (J.rows() == J.cols()) {
    if (J.rows() > 0 && J.rows() <= dense::small_size)
      dz = dense::small_solve(J, -r);
    else
      dz = dense::solve(J, -r);
    if (dz.allFinite()) return true;
  }
  dz = dense::least_squares(J, -r);
  return dz.allFinite();
}

NewtonResult newton(const Problem& problem, const VectorXd& start, const TrimOptions& options) {
  evaluate(problem, start, problem.memory.here);
  problem.memory.z_of_here = start;
  return newton_from_here(problem, options);
}

NewtonResult newton_from_here(const Problem& problem, const TrimOptions& options) {
  constexpr double shortest = 1e-4;
  constexpr double rounding = 1e-14;  // a shorter step changes no more than rounding does
  Values &at = problem.memory.here, &next = problem.memory.next;
  Jacobians& slope = problem.memory.slopes;
  VectorXd &z_of_at = problem.memory.z_of_here, &z_of_slope = problem.memory.z_of_slopes;
  NewtonResult result{z_of_at, std::numeric_limits<double>::infinity(),
                      std::numeric_limits<double>::infinity(), 0};
  VectorXd& z = result.z;
  if (!at.finite) return result;
  result.residual = at.residual.size() > 0 ? at.residual.lpNorm<Eigen::Infinity>() : 0.0;
  VectorXd dz, trial;
  for (; result.iterations < options.max_iterations; ++result.iterations) {
    if (options.observe) options.observe(point_of(problem, z));
    if (options.stop.stop_requested()) return result;
    differentiate(problem, z, at, slope);
    z_of_slope = z;
    if (!slope.finite) return result;
    if (!solve(slope.residual, at.residual, dz)) return result;
    result.step = dz.size() > 0 ? dz.lpNorm<Eigen::Infinity>() : 0.0;
    const double size = z.size() > 0 ? z.lpNorm<Eigen::Infinity>() : 0.0;
    const double least = rounding * std::max(1.0, size);
    if (result.step <= least) return result;

    // Halve α until ‖r(z + α Δz)‖ < (1 - ½α) ‖r(z)‖; a trial without finite values is rejected.
    double alpha = 1.0;
    do {
      trial = z + alpha * dz;
      evaluate(problem, trial, next);
      if (next.finite && next.residual.norm() < (1 - 0.5 * alpha) * at.residual.norm()) break;
      alpha /= 2;
    } while (alpha > shortest && alpha * result.step > least);
    if (!(next.finite && next.residual.norm() < at.residual.norm())) return result;  // round-off

    std::swap(z, trial);
    std::swap(at, next);
    z_of_at = z;
    result.residual = at.residual.lpNorm<Eigen::Infinity>();
  }
  return result;
}

}  // namespace tiltrim
