#include <Eigen/Eigenvalues>
#include <complex>

#include "dense/dense.hpp"

namespace tiltrim::dense {

using Eigen::Index;
using Eigen::MatrixXcd;
using Eigen::MatrixXd;

// Replaces solver.eigenvectors(), which returns the real and imaginary parts as two real vectors
// if the imaginary part of a pair is below ε times its real part.
template <class Solver>
static MatrixXcd eigenvectors(const Solver& solver) {
  const auto& lambda = solver.eigenvalues();
  const auto P = solver.pseudoEigenvectors();
  MatrixXcd V = P.template cast<std::complex<double>>();
  for (Index j = 0; j + 1 < V.cols(); ++j) {
    if (!(lambda[j].imag() > 0)) continue;
    V.col(j).imag() = P.col(j + 1);
    V.col(j + 1) = V.col(j).conjugate();
  }
  V.colwise().normalize();
  return V;
}

template <class Matrix>
static Eigensystem solved(const Matrix& A, Index max_iterations, bool vectors) {
  Eigen::EigenSolver<Matrix> solver(A.rows());
  solver.setMaxIterations(max_iterations * A.rows()).compute(A, vectors);
  if (solver.info() != Eigen::Success) return {};
  return {true, solver.eigenvalues(), vectors ? eigenvectors(solver) : MatrixXcd()};
}

Eigensystem eigensystem(const MatrixXd& A, Index max_iterations) {
  if (A.rows() <= small_size) return solved(SmallMatrix(A), max_iterations, true);
  return solved(A, max_iterations, true);
}

Eigensystem eigenvalues(const MatrixXd& A, Index max_iterations) {
  return solved(A, max_iterations, false);
}

}  // namespace tiltrim::dense
