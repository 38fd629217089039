/// Bounds of a computed spectrum: disks that contain the eigenvalues, and their side of the axis.
/// Internal to linearize/.
#pragma once

#include <Eigen/Core>
#include <limits>
#include <vector>

#include "dense/dense.hpp"
#include "linearize/modes.hpp"

namespace tiltrim {

namespace machine {
inline constexpr double infinity = std::numeric_limits<double>::infinity();
inline constexpr double epsilon = std::numeric_limits<double>::epsilon();
}  // namespace machine

/// V⁻¹ = (I - E)⁻¹ Wᴴ, ‖E‖∞ <= defect, W in real columns as V is.
struct Inverse {
  Eigen::MatrixXd W;
  double defect = std::numeric_limits<double>::infinity();
};
Inverse inverse(const dense::RealEigensystem& solved);
/// Row sums of |I - Wᴴ V|, with the rounding of the product, which is given as Wᵀ P.
Eigen::VectorXd defects(const dense::RealEigensystem& solved, const Eigen::MatrixXd& W,
                        Eigen::MatrixXd product);

/// Error bounds of the eigenvalues, and stability.
struct Bounds {
  Eigen::VectorXd error;  ///< to the far side of the group of overlapping disks
  Verdict verdict = Verdict::undecided;
};

/// For all matrices within `error`, for each entry, of B, whose eigensystem is given; rounding of
/// the decompositions is included.
Bounds bounds(const Eigen::MatrixXd& B, const Eigen::MatrixXd& error,
              const dense::RealEigensystem& solved, const Inverse& inverse);

/// Index sets by which exact zeros of A and its error make A block triangular: the strongly
/// connected components of its graph, each in ascending order. In their order A is block upper
/// triangular. A single set if A is irreducible.
std::vector<std::vector<Eigen::Index>> irreducible_blocks(const Eigen::MatrixXd& A,
                                                          const Eigen::MatrixXd& A_error);

}  // namespace tiltrim
