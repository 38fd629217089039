/// Eigenvalues with their eigenvectors, and the modes of one matrix assigned to those of the next.
/// Internal to sweep/.
#pragma once

#include <Eigen/Core>
#include <array>
#include <vector>

#include "sweep/spectrum.hpp"

namespace tiltrim {

/// Which eigenvalues are real, and which are each other's conjugates.
struct Kinds {
  std::vector<std::array<int, 2>> pairs;  ///< the member with positive imaginary part first
  std::vector<int> reals;
  std::vector<int> partner;  ///< of each; a real one is its own
};

/// Eigenvalues in the caller's order and their eigenvectors, A V = V Λ, W = V⁻¹.
struct Basis {
  std::vector<Complex> lambda;
  Kinds kind;
  Eigen::MatrixXcd V, W;  ///< not finite where A is defective
};

/// Of a matrix in balanced coordinates; `lambda` empty: the eigenvalues in the solver's order.
/// Where the QR iteration meets its cap the eigenvectors are empty, and so are eigenvalues not
/// given.
Basis basis(const Eigen::MatrixXd& balanced, Spectrum lambda);

/// Of every mode of a with every mode of b, by their spectral projectors. All ones, which tells
/// nothing, where an eigenvector is missing.
Eigen::MatrixXcd correlation(const Basis& a, const Basis& b);

/// What it costs to link each mode of a to each of b; M is their correlation.
Eigen::MatrixXd costs(const Eigen::MatrixXcd& M, const Basis& a, Spectrum predicted,
                      const Basis& b);

/// At least total cost: pairs to pairs and reals to reals; as many pairs split as b has fewer.
std::vector<int> assign_kinds(const Eigen::MatrixXd& cost, const Basis& a, const Basis& b);

}  // namespace tiltrim
