/// Balancing: a similarity that brings rows and columns to like size. Internal to linearize/.
#pragma once

#include <Eigen/Core>
#include <vector>

namespace tiltrim {

/// B = D⁻¹ Pᵀ A P D, exactly: D holds powers of two. Row k of B is row order[k] of A.
struct Balanced {
  Eigen::MatrixXd B;
  std::vector<Eigen::Index> order;
  Eigen::VectorXd scale;  // diagonal of D

  /// The same similarity of the magnitudes of a perturbation of A.
  Eigen::MatrixXd same(const Eigen::MatrixXd& of) const;
  /// Eigenvectors of B as eigenvectors of A.
  Eigen::MatrixXcd back(const Eigen::MatrixXcd& V) const;
  /// A row w of the inverse of B's eigenvectors as a left eigenvector of A, up to length.
  Eigen::VectorXcd back_left(const Eigen::RowVectorXcd& w) const;
};

/// Isolated eigenvalues are permuted to the ends (so that a permuted triangular matrix becomes
/// triangular), the rest is scaled.                                              [8, 9]
Balanced balance(const Eigen::MatrixXd& A);
/// A itself, as if balanced.
Balanced as_given(const Eigen::MatrixXd& A);

}  // namespace tiltrim
