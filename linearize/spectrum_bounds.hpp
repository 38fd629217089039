/// What is known of a computed spectrum: discs that hold the eigenvalues, and on which side of the
/// axis they are. Internal to linearize/.
#pragma once

#include <Eigen/Core>
#include <limits>
#include <vector>

#include "dense/dense.hpp"
#include "linearize/modes.hpp"

namespace tiltrim {

namespace spectrum {
inline constexpr double infinity = std::numeric_limits<double>::infinity();
inline constexpr double epsilon = std::numeric_limits<double>::epsilon();
}  // namespace spectrum

/// V⁻¹ and a bound of what its computed form is wrong by: V⁻¹ = (I - E)⁻¹ X, ‖E‖∞ <= defect.
struct Inverse {
  Eigen::MatrixXcd X;
  double defect = std::numeric_limits<double>::infinity();
};
Inverse inverse(const Eigen::MatrixXcd& V);

/// Of each eigenvalue, and of stability.
struct Bounds {
  Eigen::VectorXd error;  ///< to the far side of the group of discs that touch
  Verdict verdict = Verdict::undecided;
};

/// Of all matrices within `error`, entry by entry, of B = V diag(lambda) V⁻¹ = U T Uᵀ; every
/// rounding of the decompositions included.
Bounds bounds(const Eigen::MatrixXd& B, const Eigen::MatrixXd& error,
              const dense::Eigensystem& solved, const Inverse& inverse, const dense::Schur& schur);

/// Index sets by which exact zeros of A and its error make A block triangular: the strongly
/// connected components of its graph, each in rising order. One, of all, where A is irreducible.
std::vector<std::vector<Eigen::Index>> irreducible_blocks(const Eigen::MatrixXd& A,
                                                          const Eigen::MatrixXd& A_error);

}  // namespace tiltrim
