#include <Eigen/Eigenvalues>
#include <cmath>

#include "dense/dense.hpp"

namespace tiltrim::dense {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

Schur schur(const MatrixXd& A, Index max_iterations) {
  Eigen::RealSchur<MatrixXd> solver(A.rows());
  solver.setMaxIterations(max_iterations * A.rows()).compute(A);
  if (solver.info() != Eigen::Success) return {};
  return {true, solver.matrixU(), solver.matrixT()};
}

VectorXd symmetric_eigenvalues(const MatrixXd& S) {
  return Eigen::SelfAdjointEigenSolver<MatrixXd>(S, Eigen::EigenvaluesOnly).eigenvalues();
}

double spectral_norm(const MatrixXd& A) {
  return std::sqrt(symmetric_eigenvalues(A * A.transpose()).maxCoeff());
}

}  // namespace tiltrim::dense
