#include <Eigen/Eigenvalues>

#include "tests/algebra.hpp"

algebra::VectorXcd algebra::eigenvalues(const MatrixXcd& A) {
  return Eigen::ComplexEigenSolver<MatrixXcd>(A, false).eigenvalues();
}
