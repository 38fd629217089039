#include <Eigen/Eigenvalues>
#include <cmath>
#include <complex>

#include "dense/dense.hpp"

namespace tiltrim::dense {

using Eigen::Index;
using Eigen::MatrixXcd;
using Eigen::MatrixXd;
using Eigen::VectorXcd;
using Eigen::VectorXd;

Schur schur(const MatrixXd& A, Index max_iterations) {
  Eigen::RealSchur<MatrixXd> solver(A.rows());
  solver.setMaxIterations(max_iterations * A.rows()).compute(A);
  if (solver.info() != Eigen::Success) return {};
  return {true, solver.matrixU(), solver.matrixT()};
}

// Replaces solver.eigenvectors(), which returns the real and imaginary parts as two real vectors
// if the imaginary part of a pair is below ε times its real part.
static MatrixXcd eigenvectors(const Eigen::EigenSolver<MatrixXd>& solver) {
  const VectorXcd& lambda = solver.eigenvalues();
  const MatrixXd P = solver.pseudoEigenvectors();
  MatrixXcd V = P.cast<std::complex<double>>();
  for (Index j = 0; j + 1 < V.cols(); ++j) {
    if (!(lambda[j].imag() > 0)) continue;
    V.col(j).imag() = P.col(j + 1);
    V.col(j + 1) = V.col(j).conjugate();
  }
  V.colwise().normalize();
  return V;
}

static Eigensystem solved(const MatrixXd& A, Index max_iterations, bool vectors) {
  Eigen::EigenSolver<MatrixXd> solver(A.rows());
  solver.setMaxIterations(max_iterations * A.rows()).compute(A, vectors);
  if (solver.info() != Eigen::Success) return {};
  return {true, solver.eigenvalues(), vectors ? eigenvectors(solver) : MatrixXcd()};
}

Eigensystem eigensystem(const MatrixXd& A, Index max_iterations) {
  return solved(A, max_iterations, true);
}

Eigensystem eigenvalues(const MatrixXd& A, Index max_iterations) {
  return solved(A, max_iterations, false);
}

VectorXd symmetric_eigenvalues(const MatrixXd& S) {
  return Eigen::SelfAdjointEigenSolver<MatrixXd>(S, Eigen::EigenvaluesOnly).eigenvalues();
}

double spectral_norm(const MatrixXd& A) {
  return std::sqrt(symmetric_eigenvalues(A * A.transpose()).maxCoeff());
}

}  // namespace tiltrim::dense
