#include <complex>
#include <limits>

#include "dense/products.hpp"
#include "design/checks.hpp"
#include "design/design.hpp"
#include "design/lapack.hpp"
#include "runtime/rounding.hpp"

namespace tiltrim {

using Eigen::Index;
using Eigen::MatrixXd;

namespace {

constexpr double accurate = 1e-10;  // largest residual that counts as solved

// λᵢ(A) + λⱼ(B) = 0 to rounding, for some i and j.
bool singular_sum(const lapack::Schur& A, const lapack::Schur& B) {
  const double scale = A.T.norm() + B.T.norm();
  const double rounding =
      double(A.T.rows() + B.T.rows()) * std::numeric_limits<double>::epsilon() * scale;
  for (const std::complex<double>& a : A.values)
    for (const std::complex<double>& b : B.values)
      if (std::abs(a + b) <= rounding) return true;
  return false;
}

EquationSolution verified(const MatrixXd& A, const MatrixXd& B, const MatrixXd& C, MatrixXd X,
                          bool singular) {
  const double terms = (A.norm() + B.norm()) * X.norm() + C.norm();
  const double left = (A * X + X * B - C).norm();
  EquationSolution answer{EquationStatus::solved, std::move(X), terms > 0 ? left / terms : 0.0};
  if (singular)
    answer.status = EquationStatus::singular;
  else if (!(answer.residual <= accurate))
    answer.status = EquationStatus::inaccurate;
  return answer;
}

}  // namespace

std::string to_string(EquationStatus status) {
  switch (status) {
    case EquationStatus::solved:
      return "solved";
    case EquationStatus::singular:
      return "singular";
    case EquationStatus::inaccurate:
      return "inaccurate";
    case EquationStatus::not_converged:
      break;
  }
  return "not_converged";
}

EquationSolution lyapunov(const MatrixXd& A, const MatrixXd& Q) {
  const RoundToNearest environment;
  const Index n = A.rows();
  checks::shapes("lyapunov", {{"A", A, n, n}, {"Q", Q, n, n}});
  const MatrixXd C = -checks::symmetric("lyapunov", "Q", Q);
  const lapack::Schur s = lapack::schur(A);
  if (!s.converged) return {};
  // T Y + Y Tᵀ = Zᵀ C Z, X = Z Y Zᵀ                                                         [75]
  const MatrixXd Y = lapack::sylvester(s.T, s.T, true, s.Z.transpose() * C * s.Z);
  const MatrixXd X = s.Z * (Y + Y.transpose()) * s.Z.transpose() / 2;
  return verified(A, A.transpose(), C, X, singular_sum(s, s));
}

EquationSolution sylvester(const MatrixXd& A, const MatrixXd& B, const MatrixXd& C) {
  const RoundToNearest environment;
  const Index m = A.rows(), n = B.rows();
  checks::shapes("sylvester", {{"A", A, m, m}, {"B", B, n, n}, {"C", C, m, n}});
  const lapack::Schur a = lapack::schur(A), b = lapack::schur(B);
  if (!a.converged || !b.converged) return {};
  const MatrixXd Y = lapack::sylvester(a.T, b.T, false, a.Z.transpose() * C * b.Z);
  return verified(A, B, C, a.Z * Y * b.Z.transpose(), singular_sum(a, b));
}

}  // namespace tiltrim
