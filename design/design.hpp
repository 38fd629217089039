/// @file
/// Linear systems without a model: state feedback, norms, linear matrix equations.
#pragma once

#include <Eigen/Core>
#include <limits>
#include <string>

namespace tiltrim {

/// Status of a linear-quadratic regulator.
enum class LqrStatus {
  optimal,           ///< A - B K is stable and S solves the Riccati equation to rounding
  not_stabilizable,  ///< `modes` are not stable and no input moves them
  not_detectable,    ///< `modes` are on the imaginary axis and the cost does not depend on them
  inaccurate,        ///< A - B K is not stable, or the residual is above 1e-8
};
std::string to_string(LqrStatus status);  ///< in words, as in Python

/// The regulator u = -K x that minimizes ∫ (xᵀ Q x + uᵀ R u) dt.
struct Regulator {
  LqrStatus status = LqrStatus::inaccurate;  ///< whether it exists
  Eigen::MatrixXd K;                         ///< nu x nx, R⁻¹ Bᵀ S; empty unless found
  Eigen::MatrixXd S;  ///< Aᵀ S + S A - S B R⁻¹ Bᵀ S + Q = 0; the least cost is x(0)ᵀ S x(0)
  Eigen::VectorXcd poles;  ///< eigenvalues of A - B K [1/s], by ascending real part
  double residual = 0.0;  ///< ‖what remains of the Riccati equation‖ over the norms of its terms,
                          ///< in units of the states that balance them
  Eigen::VectorXcd modes;  ///< eigenvalues of A because of which there is no regulator [1/s]
  /// True if optimal.
  explicit operator bool() const { return status == LqrStatus::optimal; }
};

/// The stabilizing solution, from the stable subspace of the Hamiltonian matrix [76] and one Newton
/// step [77]. A is n x n, B n x m, Q n x n positive semidefinite, R m x m positive definite; modes
/// within 1e-10 of the norms count as uncontrollable, or as absent from the cost. Throws
/// std::invalid_argument for shapes that do not match, values that are not finite, and a Q or R
/// that is not symmetric or not (semi)definite.
[[nodiscard]] Regulator lqr(const Eigen::MatrixXd& A, const Eigen::MatrixXd& B,
                            const Eigen::MatrixXd& Q, const Eigen::MatrixXd& R);

/// Status of a pole placement.
enum class PlaceStatus {
  placed,          ///< A - B K has the poles
  uncontrollable,  ///< no input moves `uncontrollable`; as many poles could not be placed
  inaccurate,      ///< a pole is further off than rounding moves one of its multiplicity
};
std::string to_string(PlaceStatus status);  ///< in words, as in Python

/// State feedback u = -K x with chosen poles.
struct Placement {
  PlaceStatus status = PlaceStatus::inaccurate;  ///< whether it has them
  Eigen::MatrixXd K;                             ///< nu x nx
  Eigen::VectorXcd poles;           ///< eigenvalues of A - B K [1/s], by ascending real part
  double residual = 0.0;            ///< largest distance between these and those wanted [1/s]
  Eigen::VectorXcd uncontrollable;  ///< eigenvalues of A that no input moves [1/s]
  /// True if placed.
  explicit operator bool() const { return status == PlaceStatus::placed; }
};

/// Gains that place the n poles, in any order and any multiplicity, complex ones in conjugate
/// pairs: the Schur method [78], which moves one eigenvalue or pair after another and keeps the
/// gain of each move small. With several inputs K is not unique. Left eigenvectors w with
/// ‖wᵀB‖ <= 1e-10 ‖B‖ count as uncontrollable; the wanted poles nearest to their eigenvalues are
/// given up. Throws std::invalid_argument for shapes that do not match, values that are not finite,
/// a wrong number of poles, and one without its conjugate.
[[nodiscard]] Placement place(const Eigen::MatrixXd& A, const Eigen::MatrixXd& B,
                              const Eigen::VectorXcd& poles);

/// Status of an H∞ norm.
enum class PeakStatus {
  found,            ///< the norm lies between `gain` and `upper`, which differ by the tolerance
  unstable,         ///< an eigenvalue of A is not left of the axis: the norm is infinite
  iteration_limit,  ///< `upper` is infinite or not within the tolerance: rounding, or the limit
};
std::string to_string(PeakStatus status);  ///< in words, as in Python

/// The H∞ norm: the peak over frequency of the largest singular value of G(iω).
struct Peak {
  PeakStatus status = PeakStatus::unstable;                ///< whether the bounds are close
  double gain = std::numeric_limits<double>::infinity();   ///< G(iω) at `frequency`: lower bound,
                                                           ///< but for rounding < upper - gain
  double upper = std::numeric_limits<double>::infinity();  ///< no frequency reaches this gain,
                                                           ///< rounding included
  double frequency = 0.0;                                  ///< rad/s; infinite if only D has it
  /// True if found.
  explicit operator bool() const { return status == PeakStatus::found; }
};

/// The H∞ norm by Bruinsma and Steinbuch [44, 45]: climb to a peak of the gain; a Hamiltonian
/// matrix has an eigenvalue iω for every frequency at which the gain passes a level slightly above
/// that; climb from there. Where rounding may have moved eigenvalues from the axis, Taylor
/// expansions of G bound the gain; a level that rounding hides is raised tenfold. Shapes: A n x n,
/// B n x m, C p x n, D p x m. A counts as unstable if an eigenvalue is on the axis to rounding,
/// even if the outputs do not show it. Throws std::invalid_argument for shapes that do not match,
/// values that are not finite, a `tolerance` of upper/gain - 1 that is not between 1e-12 and 1, and
/// `max_levels`, the most Hamiltonian matrices, less than 1.
[[nodiscard]] Peak hinf_norm(const Eigen::MatrixXd& A, const Eigen::MatrixXd& B,
                             const Eigen::MatrixXd& C, const Eigen::MatrixXd& D,
                             double tolerance = 1e-8, int max_levels = 30);

/// The H2 norm, with its error.
struct H2Norm {
  double norm = std::numeric_limits<double>::infinity();  ///< infinite if unstable or D is not 0,
                                                          ///< NaN: not found
  double error = 0.0;  ///< relative, a bound; infinite: not determined
};

/// The H2 norm: the root of the variance of y if u is white noise of unit intensity, or of the
/// energy of the impulse responses. From the controllability or the observability Gramian,
/// whichever has the smaller error: a second Lyapunov equation turns what the first leaves into a
/// bound. Infinite if an eigenvalue of A is on the axis to rounding or right of it.
/// Throws std::invalid_argument for shapes that do not match and values that are not finite.
[[nodiscard]] H2Norm h2_norm(const Eigen::MatrixXd& A, const Eigen::MatrixXd& B,
                             const Eigen::MatrixXd& C, const Eigen::MatrixXd& D);

/// Status of a linear matrix equation.
enum class EquationStatus {
  solved,         ///< the residual is a rounding error
  singular,       ///< no unique solution: a sum of two eigenvalues is zero to rounding
  inaccurate,     ///< the residual is above 1e-10, or a step of refinement moves X by over 1e-6
  not_converged,  ///< the QR iteration for the Schur form reached its limit; no X
};
std::string to_string(EquationStatus status);  ///< in words, as in Python

/// The solution of a linear matrix equation.
struct EquationSolution {
  EquationStatus status = EquationStatus::not_converged;  ///< whether X solves it
  Eigen::MatrixXd X;                                      ///< solution, or the best found
  /// ‖what remains of the equation‖ over the norms of its terms, in units that balance A and B.
  double residual = 0.0;
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
