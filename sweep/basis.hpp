/// Eigenvalues with eigenvectors, and the assignment of one matrix's modes to those of the next.
/// Internal to sweep/.
#pragma once

#include <Eigen/Core>
#include <array>
#include <vector>

#include "sweep/spectrum.hpp"

namespace tiltrim {

/// Which eigenvalues are real, and which are conjugate pairs.
struct Kinds {
  std::vector<std::array<int, 2>> pairs;  ///< the member with positive imaginary part first
  std::vector<int> reals;
  std::vector<int> partner;  ///< of each; a real eigenvalue is its own partner
};

/// Eigenvalues in the caller's order and their eigenvectors, A V = V Λ, W = V⁻¹.
struct Basis {
  std::vector<Complex> lambda;
  Kinds kind;
  Eigen::MatrixXcd V, W;  ///< not finite if A is defective
};

/// For a matrix in balanced coordinates; `lambda` empty: the eigenvalues in the solver's order.
/// If the iteration limit is reached, the eigenvectors and any computed eigenvalues are empty.
Basis basis(const Eigen::MatrixXd& balanced, Spectrum lambda);

/// Between every mode of a and every mode of b, by their spectral projectors. All ones (no
/// information) if an eigenvector is missing.
Eigen::MatrixXcd correlation(const Basis& a, const Basis& b);

/// The cost of linking each mode of a to each of b; M is their correlation.
Eigen::MatrixXd costs(const Eigen::MatrixXcd& M, const Basis& a, Spectrum predicted,
                      const Basis& b);

/// Minimum total cost: pairs to pairs and reals to reals; as many pairs split as b has fewer.
std::vector<int> assign_kinds(const Eigen::MatrixXd& cost, const Basis& a, const Basis& b);

}  // namespace tiltrim
