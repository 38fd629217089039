/// A matrix with its eigensystem in balanced coordinates. Internal to linearize/.
#pragma once

#include <Eigen/Core>
#include <cmath>
#include <vector>

#include "dense/dense.hpp"
#include "linearize/balance.hpp"
#include "linearize/spectrum_bounds.hpp"

namespace tiltrim {

/// A matrix in units of `scale` and balanced coordinates B, with its eigensystem.
struct Decomposed {
  double scale = 1.0;
  Balanced balanced;
  Eigen::MatrixXd error;  ///< of B
  dense::RealEigensystem solved;
  Inverse inv;
  Eigen::VectorXd condition;       ///< |w| |v|; infinite if v is not distinct from the others
  std::vector<Eigen::Index> ends;  ///< of the blocks in whose order B is block upper triangular

  bool distinct(Eigen::Index i) const { return std::isfinite(condition[i]); }
};

/// Power of two that scales the norm to about one, so that no square overflows or underflows.
double unit(const Eigen::MatrixXd& A);

/// The part of A, and of its error if there is one, that belongs to some of the states.
Decomposed decompose(const Eigen::MatrixXd& A, const Eigen::MatrixXd& A_error,
                     const std::vector<Eigen::Index>& states, int max_iterations);

/// A block upper triangular A from its blocks and their eigenvalues: vectors, not the matrix B.
Decomposed join(const Eigen::MatrixXd& A, const std::vector<Decomposed>& blocks,
                const Eigen::VectorXcd& eigenvalues);

/// A B of two block upper triangular matrices with these ends of their blocks.
Eigen::MatrixXd product(const Eigen::MatrixXd& A, const Eigen::MatrixXd& B,
                        const std::vector<Eigen::Index>& ends);

}  // namespace tiltrim
