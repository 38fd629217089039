#include <fmt/core.h>

#include <cmath>
#include <complex>
#include <limits>
#include <stdexcept>
#include <vector>

#include "dense/dense.hpp"
#include "design/checks.hpp"
#include "design/design.hpp"
#include "design/lapack.hpp"
#include "runtime/rounding.hpp"

namespace tiltrim {

using Eigen::Index;
using Eigen::MatrixXcd;
using Eigen::MatrixXd;
using Eigen::VectorXcd;
using Eigen::VectorXd;
using Complex = std::complex<double>;

namespace {

constexpr double near_axis = 1e-8;   // over ‖A‖: eigenvalues that may be on the axis
constexpr double rank_lost = 1e-10;  // over the norms: singular
constexpr double small_left = 1e-8;  // largest residual of a regulator

// Eigenvalues λ of A with lowest <= Re λ <= highest at which [A - λI, B] loses rank.
VectorXcd hidden(const MatrixXd& A, const MatrixXd& B, double lowest, double highest) {
  const Index n = A.rows(), m = B.cols();
  const double size = A.norm() > 0 ? A.norm() : 1.0;
  const double unit = B.norm() > 0 ? size / B.norm() : 0.0;
  std::vector<Complex> found;
  for (const Complex& lambda : lapack::eigenvalues(A)) {
    if (lambda.real() < lowest || lambda.real() > highest) continue;
    // The singular values of M = X + iY are those of [X, -Y; Y, X].
    MatrixXd M(2 * n, 2 * (n + m));
    const MatrixXd I = MatrixXd::Identity(n, n), zero = MatrixXd::Zero(n, m);
    M << A - lambda.real() * I, unit * B, lambda.imag() * I, zero,  //
        -lambda.imag() * I, zero, A - lambda.real() * I, unit * B;
    if (dense::singular_values(M)[2 * n - 1] <= rank_lost * size) found.push_back(lambda);
  }
  return Eigen::Map<const VectorXcd>(found.data(), std::ssize(found));
}

// ‖AᵀS + S A - S G S + Q‖ over the norms of these terms.
double riccati_residual(const MatrixXd& A, const MatrixXd& G, const MatrixXd& Q,
                        const MatrixXd& S) {
  const MatrixXd SA = S * A, SGS = S * G * S;
  const double terms = 2 * SA.norm() + SGS.norm() + Q.norm();
  return terms > 0 ? (SA.transpose() + SA - SGS + Q).norm() / terms : 0.0;
}

// One step of Newton's method for S: a Lyapunov equation. Kept if it leaves less.            [77]
void refine(const MatrixXd& A, const MatrixXd& G, const MatrixXd& Q, MatrixXd& S) {
  const MatrixXd closed = (A - G * S).transpose();
  const MatrixXd cost = Q + S * G * S;
  const EquationSolution next = lyapunov(closed, (cost + cost.transpose()) / 2);
  if (next && riccati_residual(A, G, Q, next.X) < riccati_residual(A, G, Q, S)) S = next.X;
}

MatrixXd hamiltonian(const MatrixXd& A, const MatrixXd& G, const MatrixXd& Q) {
  MatrixXd H(2 * A.rows(), 2 * A.rows());
  H << A, -G, -Q, -A.transpose();
  return H;
}

// Units d of the states: diag(d) A diag(d)⁻¹, diag(d) G diag(d), diag(d)⁻¹ Q diag(d)⁻¹ have similar
// norms. Powers of two.
VectorXd units(const MatrixXd& A, const MatrixXd& G, const MatrixXd& Q) {
  const Index n = A.rows();
  const VectorXd scale = lapack::scales(hamiltonian(A, G, Q));
  return (scale.tail(n).array() / scale.head(n).array()).unaryExpr([](double square) {
    return std::exp2(std::round(std::log2(square) / 2));
  });
}

// S = V U⁻¹ from the stable subspace [U; V] of the Hamiltonian matrix; empty if that has not n
// dimensions.                                                                               [76]
MatrixXd stabilizing(const MatrixXd& A, const MatrixXd& G, const MatrixXd& Q) {
  const Index n = A.rows();
  const lapack::Schur schur = lapack::schur(hamiltonian(A, G, Q), true);
  if (!schur.converged || schur.leading != n) return {};
  const MatrixXd U = schur.Z.topLeftCorner(n, n), V = schur.Z.bottomLeftCorner(n, n);
  MatrixXd S = dense::solve(MatrixXd(U.transpose()), MatrixXd(V.transpose())).transpose();
  S = (S + S.transpose()).eval() / 2;
  if (!S.allFinite()) return {};
  refine(A, G, Q, S);
  return S;
}

void check_definite(const MatrixXd& Q, const MatrixXd& R) {
  constexpr double rounding = 1e-10;
  if (Q.rows() > 0) {
    const double least = dense::symmetric_eigenvalues(Q).minCoeff();
    if (least < -rounding * Q.norm())
      throw std::invalid_argument(
          fmt::format("lqr: Q is not positive semidefinite: it has the eigenvalue {:.4g}", least));
  }
  if (R.rows() > 0 && !dense::cholesky(R))
    throw std::invalid_argument(
        fmt::format("lqr: R is not positive definite: it has the eigenvalue {:.4g}",
                    dense::symmetric_eigenvalues(R).minCoeff()));
}

// K, S and the residual, not yet verified, or why there are none; RB is R⁻¹ Bᵀ.
Regulator in_units(const MatrixXd& A, const MatrixXd& B, const MatrixXd& RB, const MatrixXd& Q) {
  constexpr double infinity = std::numeric_limits<double>::infinity();
  const double axis = near_axis * A.norm();
  Regulator answer;
  answer.modes = hidden(A, B, -axis, infinity);
  answer.status = LqrStatus::not_stabilizable;
  if (answer.modes.size() > 0) return answer;
  answer.modes = hidden(A.transpose(), Q, -axis, axis);
  answer.status = LqrStatus::not_detectable;
  if (answer.modes.size() > 0) return answer;

  answer.status = LqrStatus::inaccurate;
  const MatrixXd BRB = B * RB, G = (BRB + BRB.transpose()) / 2;
  answer.S = stabilizing(A, G, Q);
  if (answer.S.size() == 0) return answer;
  answer.K = RB * answer.S;
  answer.residual = riccati_residual(A, G, Q, answer.S);
  return answer;
}

}  // namespace

std::string to_string(LqrStatus status) {
  switch (status) {
    case LqrStatus::optimal:
      return "optimal";
    case LqrStatus::not_stabilizable:
      return "not_stabilizable";
    case LqrStatus::not_detectable:
      return "not_detectable";
    case LqrStatus::inaccurate:
      break;
  }
  return "inaccurate";
}

Regulator lqr(const MatrixXd& A, const MatrixXd& B, const MatrixXd& Q, const MatrixXd& R) {
  const RoundToNearest environment;
  const Index n = A.rows(), m = B.cols();
  checks::shapes("lqr", {{"A", A, n, n}, {"B", B, n, m}, {"Q", Q, n, n}, {"R", R, m, m}});
  const MatrixXd weight = checks::symmetric("lqr", "Q", Q);
  const MatrixXd effort = checks::symmetric("lqr", "R", R);
  check_definite(weight, effort);
  if (n == 0) return {LqrStatus::optimal, MatrixXd(m, 0), MatrixXd(0, 0), {}, 0.0, {}};

  const MatrixXd RB = m > 0 ? dense::solve(effort, MatrixXd(B.transpose())) : MatrixXd(0, n);
  const VectorXd d = units(A, B * RB, weight), over = d.cwiseInverse();
  const Regulator scaled =
      in_units(d.asDiagonal() * A * over.asDiagonal(), d.asDiagonal() * B, RB * d.asDiagonal(),
               over.asDiagonal() * weight * over.asDiagonal());
  Regulator answer = scaled;
  if (scaled.S.size() == 0) return answer;
  answer.S = d.asDiagonal() * scaled.S * d.asDiagonal();
  answer.K = scaled.K * d.asDiagonal();
  answer.poles = lapack::eigenvalues(A - B * answer.K);
  const bool stable = answer.poles.size() == n && answer.poles.real().maxCoeff() < 0;
  if (stable && answer.residual <= small_left) answer.status = LqrStatus::optimal;
  return answer;
}

}  // namespace tiltrim
