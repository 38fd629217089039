/// Shapes and values of the matrices that callers pass. Internal to design/.
#pragma once

#include <Eigen/Core>
#include <initializer_list>

namespace tiltrim::checks {

struct Named {
  const char* name;
  const Eigen::MatrixXd& matrix;
  Eigen::Index rows, cols;  ///< required
};
/// Throws std::invalid_argument that lists every shape if one does not match, or names the first
/// entry that is not finite.
void shapes(const char* verb, std::initializer_list<Named> all);
/// Throws std::invalid_argument unless M is symmetric to rounding; returns (M + Mᵀ)/2.
Eigen::MatrixXd symmetric(const char* verb, const char* name, const Eigen::MatrixXd& M);

}  // namespace tiltrim::checks
