/// @file
/// Linear matrix equations: Lyapunov and Sylvester.
#pragma once

#include <Eigen/Core>
#include <string>

namespace tiltrim {

/// Status of a linear matrix equation.
enum class EquationStatus {
  solved,         ///< the residual is a rounding error
  singular,       ///< no unique solution: a sum of two eigenvalues is zero to rounding
  inaccurate,     ///< the residual is above 1e-10
  not_converged,  ///< the QR iteration for the Schur form reached its limit; no X
};
std::string to_string(EquationStatus status);  ///< in words, as in Python

/// The solution of a linear matrix equation.
struct EquationSolution {
  EquationStatus status = EquationStatus::not_converged;  ///< whether X solves it
  Eigen::MatrixXd X;                                      ///< solution, or the best found
  double residual = 0.0;  ///< ‖what remains of the equation‖ over the norms of its terms
  /// True if solved.
  explicit operator bool() const { return status == EquationStatus::solved; }
};

/// X with A X + X Aᵀ + Q = 0, Q symmetric (Bartels and Stewart [75]). Then X is symmetric: the
/// covariance of x' = A x + w with white noise w of intensity Q, if A is stable. Throws
/// std::invalid_argument for shapes that do not match, values that are not finite, and a Q that is
/// not symmetric.
[[nodiscard]] EquationSolution lyapunov(const Eigen::MatrixXd& A, const Eigen::MatrixXd& Q);

/// X with A X + X B = C. Throws std::invalid_argument for shapes that do not match and values that
/// are not finite.
[[nodiscard]] EquationSolution sylvester(const Eigen::MatrixXd& A, const Eigen::MatrixXd& B,
                                         const Eigen::MatrixXd& C);

}  // namespace tiltrim
