/// @file
/// State feedback u = -K x: the linear-quadratic regulator and pole placement.
#pragma once

#include <Eigen/Core>
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

}  // namespace tiltrim
