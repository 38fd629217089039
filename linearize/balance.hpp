/// Balancing: a similarity that equalizes row and column norms. Internal to linearize/.
#pragma once

#include <Eigen/Core>
#include <vector>

namespace tiltrim {

/// B = D⁻¹ Pᵀ A P D, exactly: D holds powers of two. Row k of B is row order[k] of A.
struct Balanced {
  Eigen::MatrixXd B;
  std::vector<Eigen::Index> order;
  Eigen::VectorXd scale;  // diagonal of D

  /// The same transformation applied to the magnitudes of a perturbation of A.
  Eigen::MatrixXd same(const Eigen::MatrixXd& of) const;
};

/// Isolated eigenvalues are permuted to the ends (so that a permuted triangular matrix becomes
/// triangular), the remaining block is scaled.                                   [8, 9]
Balanced balance(const Eigen::MatrixXd& A);
/// A itself, with identity scaling and permutation.
Balanced as_given(const Eigen::MatrixXd& A);

}  // namespace tiltrim
