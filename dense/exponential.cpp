#include <unsupported/Eigen/MatrixFunctions>

#include "dense/dense.hpp"

namespace tiltrim::dense {

Eigen::MatrixXd exponential(const Eigen::MatrixXd& A) { return A.exp(); }

}  // namespace tiltrim::dense
