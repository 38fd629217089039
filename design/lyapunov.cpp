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
using Eigen::VectorXd;

namespace {

constexpr double accurate = 1e-10;  // largest residual that counts as solved
constexpr double doubtful = 1e-6;   // a correction of X above this share of it

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

// With what solve(C) gives for A X + X B = C, refined once. A small residual does not make X
// accurate: the correction shows how much of it is rounding.
template <class Solve>
EquationSolution verified(const MatrixXd& A, const MatrixXd& B, const MatrixXd& C,
                          const Solve& solve, bool singular) {
  MatrixXd X = solve(C);
  const MatrixXd correction = solve(C - A * X - X * B);
  X += correction;
  const double terms = (A.norm() + B.norm()) * X.norm() + C.norm();
  const double left = (A * X + X * B - C).norm();
  const bool certain = correction.norm() <= doubtful * X.norm();
  EquationSolution answer{EquationStatus::solved, std::move(X), terms > 0 ? left / terms : 0.0};
  if (singular)
    answer.status = EquationStatus::singular;
  else if (!(answer.residual <= accurate) || !certain)
    answer.status = EquationStatus::inaccurate;
  return answer;
}

// In units that balance it.
MatrixXd balanced(const MatrixXd& A, const VectorXd& units) {
  return units.cwiseInverse().asDiagonal() * A * units.asDiagonal();
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
  const VectorXd units = lapack::scales(A), over = units.cwiseInverse();
  const MatrixXd a = balanced(A, units);
  const lapack::Schur s = lapack::schur(a);
  if (!s.converged) return {};
  // T Y + Y Tᵀ = Zᵀ C Z, X = Z Y Zᵀ                                                         [75]
  const auto solve = [&](const MatrixXd& c) -> MatrixXd {
    const MatrixXd Y = lapack::sylvester(s.T, s.T, true, s.Z.transpose() * c * s.Z);
    return s.Z * (Y + Y.transpose()) * s.Z.transpose() / 2;
  };
  EquationSolution answer = verified(a, a.transpose(), over.asDiagonal() * C * over.asDiagonal(),
                                     solve, singular_sum(s, s));
  answer.X = units.asDiagonal() * answer.X * units.asDiagonal();
  return answer;
}

EquationSolution sylvester(const MatrixXd& A, const MatrixXd& B, const MatrixXd& C) {
  const RoundToNearest environment;
  const Index m = A.rows(), n = B.rows();
  checks::shapes("sylvester", {{"A", A, m, m}, {"B", B, n, n}, {"C", C, m, n}});
  const VectorXd left = lapack::scales(A), right = lapack::scales(B);
  const MatrixXd a = balanced(A, left), b = balanced(B, right);
  const lapack::Schur s = lapack::schur(a), t = lapack::schur(b);
  if (!s.converged || !t.converged) return {};
  const auto solve = [&](const MatrixXd& c) -> MatrixXd {
    const MatrixXd Y = lapack::sylvester(s.T, t.T, false, s.Z.transpose() * c * t.Z);
    return s.Z * Y * t.Z.transpose();
  };
  EquationSolution answer = verified(
      a, b, left.cwiseInverse().asDiagonal() * C * right.asDiagonal(), solve, singular_sum(s, t));
  answer.X = left.asDiagonal() * answer.X * right.cwiseInverse().asDiagonal();
  return answer;
}

}  // namespace tiltrim
