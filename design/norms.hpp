/// @file
/// Norms of y = G u, G(s) = C (sI - A)⁻¹ B + D: the largest gain, and the response to white noise.
#pragma once

#include <Eigen/Core>
#include <limits>
#include <string>

namespace tiltrim {

/// Status of an H∞ norm.
enum class PeakStatus {
  found,            ///< the norm lies between `gain` and `upper`, which differ by the tolerance
  unstable,         ///< an eigenvalue of A is not left of the axis: the norm is infinite
  iteration_limit,  ///< `gain` is a lower bound, `upper` is infinite or not within the tolerance
};
std::string to_string(PeakStatus status);  ///< in words, as in Python

/// The H∞ norm: the peak over frequency of the largest singular value of G(iω).
struct Peak {
  PeakStatus status = PeakStatus::unstable;                ///< whether the bounds are close
  double gain = std::numeric_limits<double>::infinity();   ///< G(iω) at `frequency`: lower bound
  double upper = std::numeric_limits<double>::infinity();  ///< no frequency reaches this gain
  double frequency = 0.0;                                  ///< rad/s; infinite if only D has it
  /// True if found.
  explicit operator bool() const { return status == PeakStatus::found; }
};

/// Options of hinf_norm().
struct PeakOptions {
  double tolerance = 1e-8;  ///< upper/gain - 1, between 1e-12 and 1
  int max_levels = 30;      ///< Hamiltonian matrices; one or two suffice
};

/// The H∞ norm by Bruinsma and Steinbuch [44, 45]: climb to a peak of the gain; a Hamiltonian
/// matrix has an eigenvalue iω for every frequency at which the gain is slightly above that; climb
/// from there. Shapes: A n x n, B n x m, C p x n, D p x m. A counts as unstable if an eigenvalue is
/// on the axis to rounding, even if the outputs do not show it. Throws std::invalid_argument for
/// shapes that do not match, values that are not finite, and options out of range.
[[nodiscard]] Peak hinf_norm(const Eigen::MatrixXd& A, const Eigen::MatrixXd& B,
                             const Eigen::MatrixXd& C, const Eigen::MatrixXd& D,
                             const PeakOptions& options = {});

/// The H2 norm, with its error.
struct H2Norm {
  double norm = std::numeric_limits<double>::infinity();  ///< infinite if unstable or D is not 0
  double error = 0.0;  ///< relative: difference between the two Gramians, residuals
};

/// The H2 norm: the root of the variance of y if u is white noise of unit intensity, or of the
/// energy of the impulse responses. From the controllability Gramian, compared with that from the
/// observability Gramian. Infinite if an eigenvalue of A is on the axis to rounding or right of it.
/// Throws std::invalid_argument for shapes that do not match and values that are not finite.
[[nodiscard]] H2Norm h2_norm(const Eigen::MatrixXd& A, const Eigen::MatrixXd& B,
                             const Eigen::MatrixXd& C, const Eigen::MatrixXd& D);

}  // namespace tiltrim
