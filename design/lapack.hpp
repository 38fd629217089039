/// Ordered Schur forms, Sylvester equations and balancing by LAPACK. Internal to design/. Shapes
/// are not checked; matrices are finite.
#pragma once

#include <Eigen/Core>

namespace tiltrim::lapack {

/// A = Z T Zᵀ, T quasi-triangular with standardized 2 x 2 blocks.
struct Schur {
  bool converged = false;
  Eigen::MatrixXd Z, T;
  Eigen::VectorXcd values;  ///< on the diagonal of T, in its order
  Eigen::Index leading =
      0;  ///< number of eigenvalues with a negative real part, if those are first
};
Schur schur(const Eigen::MatrixXd& A, bool stable_first = false);
/// Moves the diagonal block at row `from` to row `to`. Returns false if the blocks are too close.
bool move(Schur& schur, Eigen::Index from, Eigen::Index to);

/// Y with T Y + Y S = F, or T Y + Y Sᵀ = F; T and S are quasi-triangular. Coefficients are changed
/// by a rounding error if there is no unique solution.
Eigen::MatrixXd sylvester(const Eigen::MatrixXd& T, const Eigen::MatrixXd& S, bool S_transposed,
                          const Eigen::MatrixXd& F);

/// Eigenvalues of A, balanced, by ascending real part; empty if the iteration reached its limit.
Eigen::VectorXcd eigenvalues(const Eigen::MatrixXd& A);

/// Eigenvalues alpha/beta of the pencil A - λ B, balanced; infinite where beta = 0. Empty if the
/// iteration reached its limit.
struct Pencil {
  Eigen::VectorXcd alpha;
  Eigen::VectorXd beta;
};
Pencil generalized_eigenvalues(const Eigen::MatrixXd& A, const Eigen::MatrixXd& B);

/// Powers of two d: the rows and columns of diag(d)⁻¹ A diag(d) have similar norms.
Eigen::VectorXd scales(const Eigen::MatrixXd& A);

/// The largest singular value of G.
double spectral_norm(const Eigen::MatrixXcd& G);

}  // namespace tiltrim::lapack
