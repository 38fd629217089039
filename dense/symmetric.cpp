#include <Eigen/Eigenvalues>
#include <cmath>

#include "dense/dense.hpp"

namespace tiltrim::dense {

using Eigen::MatrixXd;
using Eigen::VectorXd;

VectorXd symmetric_eigenvalues(const MatrixXd& S) {
  return Eigen::SelfAdjointEigenSolver<MatrixXd>(S, Eigen::EigenvaluesOnly).eigenvalues();
}

double spectral_norm(const MatrixXd& A) {
  return std::sqrt(symmetric_eigenvalues(A * A.transpose()).maxCoeff());
}

}  // namespace tiltrim::dense
