#include <Eigen/QR>

#include "dense/dense.hpp"

namespace tiltrim::dense {

Eigen::VectorXd least_squares(const Eigen::MatrixXd& A, const Eigen::VectorXd& b) {
  return A.completeOrthogonalDecomposition().solve(b);
}

}  // namespace tiltrim::dense
