/// Dense linear algebra, compiled once: Eigen's decompositions as plain functions. Other folders
/// include only Eigen/Core and so do not compile the decomposition templates. Internal to tiltrim.
/// Shapes are not checked.
#pragma once

#include <Eigen/Core>
#include <complex>
#include <optional>
#include <span>

#include "dense/products.hpp"

namespace tiltrim::dense {

/// Vectors of at most small_size rows, stored without allocation.
using SmallVector = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, small_size, 1>;
using SmallComplexVector = Eigen::Matrix<std::complex<double>, Eigen::Dynamic, 1, 0, small_size, 1>;

// --- Square systems.

/// P A = L U with partial pivoting; Matrix is MatrixXd, MatrixXcd or SmallMatrix.   [11,
/// alg. 3.4.1]
template <class Matrix>
struct LU {
  Matrix factors;  ///< L below the diagonal (unit diagonal, not stored), U on and above it
  Eigen::PermutationMatrix<Eigen::Dynamic, Matrix::MaxRowsAtCompileTime> P;

  auto pivots() const { return factors.diagonal(); }  ///< the diagonal of U
};
/// A is n x n, n >= 1. If A is singular, a pivot is zero.
template <class Matrix>
LU<Matrix> lu(const Matrix& A);

/// A⁻¹ b for one or several columns; not finite if A is singular.
Eigen::VectorXd solve(const LU<Eigen::MatrixXd>& lu, const Eigen::VectorXd& b);
Eigen::MatrixXd solve(const LU<Eigen::MatrixXd>& lu, const Eigen::MatrixXd& b);
Eigen::VectorXcd solve(const LU<Eigen::MatrixXcd>& lu, const Eigen::VectorXcd& b);
Eigen::MatrixXcd solve(const LU<Eigen::MatrixXcd>& lu, const Eigen::MatrixXcd& b);
SmallVector solve(const LU<SmallMatrix>& lu, const SmallVector& b);
template <class Matrix, class Right>
Plain<Right> solve(const LU<Matrix>& lu, const Eigen::MatrixBase<Right>& b) {
  const Plain<Right>& evaluated = b.derived();
  return solve(lu, evaluated);
}
template <class Right>
Plain<Right> solve(const Eigen::MatrixXd& A, const Eigen::MatrixBase<Right>& b) {
  return solve(lu(A), b.derived());
}
template <class Right>
Plain<Right> solve(const Eigen::MatrixXcd& A, const Eigen::MatrixBase<Right>& b) {
  return solve(lu(A), b.derived());
}
/// The same for at most small_size equations, without allocation.
SmallVector small_solve(const SmallMatrix& A, const SmallVector& b);
double determinant(const LU<Eigen::MatrixXd>& lu);
Eigen::MatrixXd inverse(const Eigen::MatrixXd& A);
Eigen::MatrixXcd inverse(const Eigen::MatrixXcd& A);
/// Not finite if A is singular.
SmallMatrix small_inverse(const SmallMatrix& A);

// --- Any shape.

/// The minimum-norm least-squares solution of A x = b, for A of any shape and rank.  [11, sec. 5.5]
Eigen::VectorXd least_squares(const Eigen::MatrixXd& A, const Eigen::VectorXd& b);

/// A = U Σ Vᵀ, U and V square, σ in descending order.
template <class Matrix, class Vector>
struct SVDOf {
  Matrix U;
  Vector sigma;
  Matrix V;
};
using SVD = SVDOf<Eigen::MatrixXd, Eigen::VectorXd>;
using SmallSVD = SVDOf<SmallMatrix, SmallVector>;
SVD svd(const Eigen::MatrixXd& A);
SmallSVD small_svd(const SmallMatrix& A);
Eigen::VectorXd singular_values(const Eigen::MatrixXd& A);
/// Of a square matrix, in no order; empty if rotations do not find them, as for entries beyond
/// 1e±70.
SmallVector small_singular_values(const SmallMatrix& A);
/// The minimum-norm least-squares solution; σ below the rounding error of the largest counts as
/// zero.
Eigen::VectorXd solve(const SVD& svd, const Eigen::VectorXd& b);
SmallVector solve(const SmallSVD& svd, const SmallVector& b);
/// An orthonormal basis of the null space of A, in columns; no columns if A has full column rank.
Eigen::MatrixXd kernel(const Eigen::MatrixXd& A);
/// The right singular vector of the smallest singular value of A, of unit length.
Eigen::VectorXcd least_singular_vector(const Eigen::MatrixXcd& A);
/// ‖A‖₂
double spectral_norm(const Eigen::MatrixXd& A);

// --- Eigenvalues. A is n x n, n >= 1, and finite; max_iterations: QR steps per eigenvalue.

/// A V = V diag(values); columns of V have unit length, those of a pair are exactly conjugate.
struct Eigensystem {
  bool converged = false;
  Eigen::VectorXcd values;  ///< in a pair, the one with positive imaginary part first
  Eigen::MatrixXcd V;
};
Eigensystem eigensystem(const Eigen::MatrixXd& A, Eigen::Index max_iterations = 40);

/// The same in real columns, and the Schur form it was computed from.
template <class Matrix, class Vector>
struct RealEigensystemOf {
  bool converged = false;
  Vector values;
  Matrix P;     ///< columns of V; of a pair p and q, where its columns are p + iq, p - iq
  Matrix U, T;  ///< A = U T Uᵀ, T quasi-triangular
};
using RealEigensystem = RealEigensystemOf<Eigen::MatrixXd, Eigen::VectorXcd>;
using SmallEigensystem = RealEigensystemOf<SmallMatrix, SmallComplexVector>;
RealEigensystem real_eigensystem(const Eigen::MatrixXd& A, Eigen::Index max_iterations = 40);
/// The same without allocation.
SmallEigensystem small_eigensystem(const SmallMatrix& A, Eigen::Index max_iterations = 40);
/// Eigenvectors of A at its known eigenvalues on and above the real axis, in that order, in such
/// columns. Each is verified; empty if one is wrong or two eigenvalues are close to each other.
std::optional<SmallMatrix> small_vectors(const SmallMatrix& A,
                                         std::span<const std::complex<double>> upper);
/// Column j of V, or of another matrix in such columns.
Eigen::VectorXcd complex_column(const Eigen::Ref<const Eigen::MatrixXd>& P,
                                const Eigen::VectorXcd& values, Eigen::Index j);
/// Eigenvectors of a quasi-triangular T with these eigenvalues in such columns, of any length.
Eigen::MatrixXd triangular_vectors(const Eigen::MatrixXd& T, const Eigen::VectorXcd& values);
Eigen::MatrixXd left_triangular_vectors(const Eigen::MatrixXd& T, const Eigen::VectorXcd& values);
/// Eigenvalues only.
Eigensystem eigenvalues(const Eigen::MatrixXd& A, Eigen::Index max_iterations = 40);
/// In ascending order; only the lower triangle of S is read.
Eigen::VectorXd symmetric_eigenvalues(const Eigen::MatrixXd& S);

// --- Others.

/// S = L Lᵀ; empty if S is not positive definite.
std::optional<Eigen::MatrixXd> cholesky(const Eigen::MatrixXd& S);
/// L⁻¹ B, L lower triangular.
Eigen::MatrixXd solve_lower(const Eigen::MatrixXd& L, const Eigen::MatrixXd& B);
/// eᴬ
Eigen::MatrixXd exponential(const Eigen::MatrixXd& A);

/// Solves the symmetric positive definite cyclic tridiagonal system
///   after[i-1] x[i-1] + at[i] x[i] + after[i] x[i+1] = b.row(i),  indices modulo n >= 3,
/// in time proportional to n.
Eigen::MatrixXd solve_cyclic(const Eigen::VectorXd& at, const Eigen::VectorXd& after,
                             const Eigen::MatrixXd& b);

}  // namespace tiltrim::dense
