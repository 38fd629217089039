#include <Eigen/Cholesky>
#include <Eigen/LU>

#include "dense/dense.hpp"

namespace tiltrim::dense {

using Eigen::MatrixXcd;
using Eigen::MatrixXd;
using Eigen::VectorXcd;
using Eigen::VectorXd;

template <class Matrix>
LU<Matrix> lu(const Matrix& A) {
  const Eigen::PartialPivLU<Matrix> found(A);
  return {found.matrixLU(), found.permutationP()};
}
template LU<MatrixXd> lu(const MatrixXd& A);
template LU<MatrixXcd> lu(const MatrixXcd& A);
template LU<SmallMatrix> lu(const SmallMatrix& A);

template <class Matrix, class Right>
static void substitute_in(const Matrix& factors, Right& x) {
  factors.template triangularView<Eigen::UnitLower>().solveInPlace(x);
  factors.template triangularView<Eigen::Upper>().solveInPlace(x);
}
void substitute(const LU<MatrixXd>& lu, VectorXd& x) { substitute_in(lu.factors, x); }
void substitute(const LU<MatrixXd>& lu, MatrixXd& x) { substitute_in(lu.factors, x); }
void substitute(const LU<MatrixXcd>& lu, VectorXcd& x) { substitute_in(lu.factors, x); }
void substitute(const LU<MatrixXcd>& lu, MatrixXcd& x) { substitute_in(lu.factors, x); }
void substitute(const LU<SmallMatrix>& lu, SmallVector& x) { substitute_in(lu.factors, x); }

SmallVector small_solve(const SmallMatrix& A, const SmallVector& b) {
  return Eigen::PartialPivLU<SmallMatrix>(A).solve(b);
}

double determinant(const LU<MatrixXd>& lu) {
  return double(lu.P.determinant()) * lu.pivots().prod();
}

MatrixXcd inverse(const MatrixXcd& A) {
  using Small = Eigen::Matrix<std::complex<double>, Eigen::Dynamic, Eigen::Dynamic, 0, small_size,
                              small_size>;  // without allocations
  if (A.rows() <= small_size) return Small(A).partialPivLu().inverse();
  return A.partialPivLu().inverse();
}

std::optional<MatrixXd> cholesky(const MatrixXd& S) {
  const Eigen::LLT<MatrixXd> llt(S);
  if (llt.info() != Eigen::Success) return {};
  return llt.matrixL();
}

MatrixXd solve_lower(const MatrixXd& L, const MatrixXd& B) {
  return L.triangularView<Eigen::Lower>().solve(B);
}

}  // namespace tiltrim::dense
