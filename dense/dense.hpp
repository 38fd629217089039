/// Dense linear algebra, compiled once: Eigen's decompositions as plain functions. Other folders
/// include Eigen/Core alone, and so compile neither the headers nor the templates of the
/// decompositions. Internal to tiltrim. Shapes are not checked.
#pragma once

#include <Eigen/Core>
#include <optional>

namespace tiltrim::dense {

/// A matrix and a vector of at most 16 rows, which allocate nothing.
inline constexpr int small_size = 16;
using SmallMatrix =
    Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, small_size, small_size>;
using SmallVector = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, small_size, 1>;

// --- Square systems.

/// P A = L U with partial pivoting; Matrix is MatrixXd, MatrixXcd or SmallMatrix.   [11,
/// alg. 3.4.1]
template <class Matrix>
struct LU {
  Matrix factors;  ///< L below the diagonal (its own diagonal is one), U on it and above
  Eigen::PermutationMatrix<Eigen::Dynamic, Matrix::MaxRowsAtCompileTime> P;

  auto pivots() const { return factors.diagonal(); }  ///< the diagonal of U
};
/// A is n x n, n >= 1. A singular one has a pivot that is zero.
template <class Matrix>
LU<Matrix> lu(const Matrix& A);

/// x becomes U⁻¹ L⁻¹ x.
void substitute(const LU<Eigen::MatrixXd>& lu, Eigen::VectorXd& x);
void substitute(const LU<Eigen::MatrixXd>& lu, Eigen::MatrixXd& x);
void substitute(const LU<Eigen::MatrixXcd>& lu, Eigen::VectorXcd& x);
void substitute(const LU<Eigen::MatrixXcd>& lu, Eigen::MatrixXcd& x);
void substitute(const LU<SmallMatrix>& lu, SmallVector& x);

/// A⁻¹ b, of one column or several; not finite where A is singular.
template <class Matrix, class Right>
typename Right::PlainObject solve(const LU<Matrix>& lu, const Eigen::MatrixBase<Right>& b) {
  typename Right::PlainObject x = lu.P * b;
  substitute(lu, x);
  return x;
}
template <class Right>
typename Right::PlainObject solve(const Eigen::MatrixXd& A, const Eigen::MatrixBase<Right>& b) {
  return solve(lu(A), b);
}
template <class Right>
typename Right::PlainObject solve(const Eigen::MatrixXcd& A, const Eigen::MatrixBase<Right>& b) {
  return solve(lu(A), b);
}
double determinant(const LU<Eigen::MatrixXd>& lu);
Eigen::MatrixXcd inverse(const Eigen::MatrixXcd& A);

// --- Any shape.

/// The x of least length among those of least ‖A x - b‖, whatever A's shape and rank.  [11,
/// sec. 5.5]
Eigen::VectorXd least_squares(const Eigen::MatrixXd& A, const Eigen::VectorXd& b);

/// A = U Σ Vᵀ, U and V square, σ falling.
struct SVD {
  Eigen::MatrixXd U;
  Eigen::VectorXd sigma;
  Eigen::MatrixXd V;
};
SVD svd(const Eigen::MatrixXd& A);
Eigen::VectorXd singular_values(const Eigen::MatrixXd& A);
/// The x of least length among those of least ‖A x - b‖; σ below rounding of the largest is zero.
Eigen::VectorXd solve(const SVD& svd, const Eigen::VectorXd& b);
/// An orthonormal basis of the null space of A, n columns; no columns where A has full column rank.
Eigen::MatrixXd kernel(const Eigen::MatrixXd& A);
/// The unit vector that A shrinks most.
Eigen::VectorXcd least_singular_vector(const Eigen::MatrixXcd& A);
/// ‖A‖₂
double spectral_norm(const Eigen::MatrixXd& A);

// --- Eigenvalues. A is n x n, n >= 1, and finite; max_iterations: QR steps for each eigenvalue.

/// A = U T Uᵀ, T quasi-triangular; not converged: the cap was met, the rest is empty.
struct Schur {
  bool converged = false;
  Eigen::MatrixXd U, T;
};
Schur schur(const Eigen::MatrixXd& A, Eigen::Index max_iterations = 40);

/// A V = V diag(values); columns of V have length one, and those of a pair are exactly conjugate.
struct Eigensystem {
  bool converged = false;
  Eigen::VectorXcd values;  ///< of a pair, the one with the positive imaginary part first
  Eigen::MatrixXcd V;
};
Eigensystem eigensystem(const Eigen::MatrixXd& A, Eigen::Index max_iterations = 40);
/// The same without V.
Eigensystem eigenvalues(const Eigen::MatrixXd& A, Eigen::Index max_iterations = 40);
/// Rising; only the lower triangle of S is read.
Eigen::VectorXd symmetric_eigenvalues(const Eigen::MatrixXd& S);

// --- Others.

/// S = L Lᵀ; nothing where S is not positive definite.
std::optional<Eigen::MatrixXd> cholesky(const Eigen::MatrixXd& S);
/// L⁻¹ B, L lower triangular.
Eigen::MatrixXd solve_lower(const Eigen::MatrixXd& L, const Eigen::MatrixXd& B);
/// eᴬ
Eigen::MatrixXd exponential(const Eigen::MatrixXd& A);

/// The x of
///   after[i-1] x[i-1] + at[i] x[i] + after[i] x[i+1] = b.row(i),  indices modulo n >= 3,
/// a system that is symmetric and must be positive definite. In time proportional to n.
Eigen::MatrixXd solve_cyclic(const Eigen::VectorXd& at, const Eigen::VectorXd& after,
                             const Eigen::MatrixXd& b);

}  // namespace tiltrim::dense
