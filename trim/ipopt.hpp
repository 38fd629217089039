/// Interface to Ipopt. Internal to trim/.
#pragma once

#include <Eigen/Core>
#include <functional>
#include <stop_token>

namespace tiltrim {

/// minimize f(z) with lower <= z <= upper and c_lower <= c(z) <= c_upper; all dense. Callbacks
/// return false if the functions are not finite.
struct Nlp {
  Eigen::VectorXd lower, upper, c_lower, c_upper;
  std::function<bool(const Eigen::VectorXd& z, double& f, Eigen::VectorXd& c)> values;
  std::function<bool(const Eigen::VectorXd& z, Eigen::VectorXd& gradient, Eigen::MatrixXd& J)>
      slopes;
  /// Hessian of sigma f + λᵀc.
  std::function<bool(const Eigen::VectorXd& z, double sigma, const Eigen::VectorXd& lambda,
                     Eigen::MatrixXd& H)>
      hessian;
};

/// Runs Ipopt and returns its last point. Ipopt's status is not passed on: the caller verifies the
/// point. MUMPS keeps global state, so solves in one process are serialized.
Eigen::VectorXd ipopt(const Nlp& nlp, const Eigen::VectorXd& start, int max_iterations,
                      const std::stop_token& stop);

}  // namespace tiltrim
