#include <Eigen/Eigenvalues>
#include <complex>

#include "dense/dense.hpp"

namespace tiltrim::dense {

using Eigen::Index;
using Eigen::MatrixXcd;
using Eigen::MatrixXd;
using Eigen::VectorXcd;

VectorXcd complex_column(const MatrixXd& P, const VectorXcd& values, Index j) {
  const double im = values[j].imag();
  VectorXcd v = P.col(im < 0 ? j - 1 : j).cast<std::complex<double>>();
  if (im > 0) v.imag() = P.col(j + 1);
  if (im < 0) v.imag() = -P.col(j);
  return v;
}

namespace {

// Eigen keeps the Schur form from which it computes eigenvalues and vectors.
template <class Matrix>
struct Solver : Eigen::EigenSolver<Matrix> {
  using Eigen::EigenSolver<Matrix>::EigenSolver;
  const Eigen::RealSchur<Matrix>& schur() const { return this->m_realSchur; }
};

// solver.eigenvectors() would return the real and imaginary parts as two real vectors if the
// imaginary part of a pair is below ε times its real part.
template <class Matrix>
RealEigensystem with_vectors(const Matrix& A, Index max_iterations) {
  Solver<Matrix> solver(A.rows());
  solver.setMaxIterations(max_iterations * A.rows()).compute(A);
  if (solver.info() != Eigen::Success) return {};
  RealEigensystem found{true, solver.eigenvalues(), solver.pseudoEigenvectors(),
                        solver.schur().matrixU(), solver.schur().matrixT()};
  for (Index j = 0; j < A.cols(); ++j) {
    const VectorXcd v = complex_column(found.P, found.values, j).normalized();
    found.P.col(j) = v.real();
    if (found.values[j].imag() > 0) found.P.col(++j) = v.imag();
  }
  return found;
}

}  // namespace

RealEigensystem real_eigensystem(const MatrixXd& A, Index max_iterations) {
  if (A.rows() <= small_size) return with_vectors(SmallMatrix(A), max_iterations);
  return with_vectors(A, max_iterations);
}

Eigensystem eigensystem(const MatrixXd& A, Index max_iterations) {
  const RealEigensystem found = real_eigensystem(A, max_iterations);
  if (!found.converged) return {};
  MatrixXcd V(A.rows(), A.cols());
  for (Index j = 0; j < A.cols(); ++j) V.col(j) = complex_column(found.P, found.values, j);
  return {true, found.values, V};
}

Eigensystem eigenvalues(const MatrixXd& A, Index max_iterations) {
  Eigen::EigenSolver<MatrixXd> solver(A.rows());
  solver.setMaxIterations(max_iterations * A.rows()).compute(A, false);
  if (solver.info() != Eigen::Success) return {};
  return {true, solver.eigenvalues(), {}};
}

}  // namespace tiltrim::dense
