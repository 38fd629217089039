/// Eigenvalues without error bounds, and modes with a given cap on the QR iteration. Internal to
/// tiltrim.
#pragma once

#include <Eigen/Core>
#include <memory>
#include <string>
#include <vector>

#include "linearize/modes.hpp"

namespace tiltrim {

/// QR steps per eigenvalue at most.
inline constexpr int qr_steps = 40;

/// Eigenvalues of a finite square matrix only (balanced, then shifted QR), by ascending real part,
/// then ascending imaginary part; empty if the iteration reached its limit. For scanning many
/// matrices; use modes() for results to be reported.
[[nodiscard]] Eigen::VectorXcd eigenvalues(const Eigen::MatrixXd& A, int max_iterations = qr_steps);

/// modes() with at most this many QR steps per eigenvalue.
[[nodiscard]] Modes modes(const Eigen::MatrixXd& A, const Eigen::MatrixXd& A_error,
                          const std::vector<std::string>& state_names,
                          const std::shared_ptr<const std::vector<ModeName>>& mode_names,
                          int max_iterations);

}  // namespace tiltrim
