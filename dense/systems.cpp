#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <array>
#include <cmath>
#include <numeric>
#include <type_traits>
#include <utility>

#include "dense/dense.hpp"
#include "dense/known_size.hpp"

namespace tiltrim::dense {

using Eigen::Index;
using Eigen::MatrixXcd;
using Eigen::MatrixXd;
using Eigen::VectorXcd;
using Eigen::VectorXd;

// Eigen's operations in plain loops: its blocks and calls cost more than these. Returns the row of
// A at each of U's.
template <class Matrix>
static std::array<int, small_size> eliminate(Matrix& a) {
  const Index n = a.rows();
  std::array<int, small_size> row_at{};
  std::iota(row_at.begin(), row_at.end(), 0);
  for (Index k = 0; k < n; ++k) {
    Index pivot = k;
    for (Index i = k + 1; i < n; ++i)
      if (std::abs(a(i, k)) > std::abs(a(pivot, k))) pivot = i;
    if (a(pivot, k) != 0) {
      std::swap(row_at[std::size_t(k)], row_at[std::size_t(pivot)]);
      if (pivot != k)
        for (Index j = 0; j < n; ++j) std::swap(a(k, j), a(pivot, j));
      for (Index i = k + 1; i < n; ++i) a(i, k) /= a(k, k);
    }
    for (Index j = k + 1; j < n; ++j)
      for (Index i = k + 1; i < n; ++i) a(i, j) -= a(i, k) * a(k, j);
  }
  return row_at;
}

static LU<SmallMatrix> small_lu(const SmallMatrix& A) {
  LU<SmallMatrix> found{A, decltype(LU<SmallMatrix>::P)(A.rows())};
  const std::array<int, small_size> row_at = eliminate(found.factors);
  for (int k = 0; k < A.rows(); ++k) found.P.indices()[row_at[std::size_t(k)]] = k;
  return found;
}

template <class Matrix>
LU<Matrix> lu(const Matrix& A) {
  if constexpr (std::is_same_v<Matrix, SmallMatrix>) {
    return small_lu(A);
  } else {
    const Eigen::PartialPivLU<Matrix> found(A);
    return {found.matrixLU(), found.permutationP()};
  }
}
template LU<MatrixXd> lu(const MatrixXd& A);
template LU<MatrixXcd> lu(const MatrixXcd& A);
template LU<SmallMatrix> lu(const SmallMatrix& A);

template <class Matrix, class Right>
static Right solved(const LU<Matrix>& lu, const Right& b) {
  Right x = lu.P * b;
  lu.factors.template triangularView<Eigen::UnitLower>().solveInPlace(x);
  lu.factors.template triangularView<Eigen::Upper>().solveInPlace(x);
  return x;
}
VectorXd solve(const LU<MatrixXd>& lu, const VectorXd& b) { return solved(lu, b); }
MatrixXd solve(const LU<MatrixXd>& lu, const MatrixXd& b) { return solved(lu, b); }
VectorXcd solve(const LU<MatrixXcd>& lu, const VectorXcd& b) { return solved(lu, b); }
MatrixXcd solve(const LU<MatrixXcd>& lu, const MatrixXcd& b) { return solved(lu, b); }
SmallVector solve(const LU<SmallMatrix>& lu, const SmallVector& b) {
  SmallVector x = lu.P * b;
  const auto& a = lu.factors;
  const Index n = x.size();
  for (Index j = 0; j < n; ++j)
    for (Index i = j + 1; i < n; ++i) x[i] -= x[j] * a(i, j);
  for (Index j = n - 1; j >= 0; --j) {
    if (x[j] == 0) continue;  // zero, as in Eigen, even over a pivot that is zero
    x[j] /= a(j, j);
    for (Index i = 0; i < j; ++i) x[i] -= x[j] * a(i, j);
  }
  return x;
}

SmallVector small_solve(const SmallMatrix& A, const SmallVector& b) {
  return solve(small_lu(A), b);
}

// All columns at once, so that none waits for its own quotients: column i of Y is row i of A⁻¹.
template <class Matrix>
static SmallMatrix inverse_by_columns(Matrix a) {
  const std::array<int, small_size> row_at = eliminate(a);
  const Index n = a.rows();
  Matrix Y = Matrix::Zero(n, n);
  for (Index k = 0; k < n; ++k) Y(row_at[std::size_t(k)], k) = 1;
  for (Index j = 0; j < n; ++j)
    for (Index i = j + 1; i < n; ++i)
      for (Index k = 0; k < n; ++k) Y(k, i) -= a(i, j) * Y(k, j);
  for (Index j = n - 1; j >= 0; --j) {
    for (Index k = 0; k < n; ++k) Y(k, j) /= a(j, j);
    for (Index i = 0; i < j; ++i)
      for (Index k = 0; k < n; ++k) Y(k, i) -= a(i, j) * Y(k, j);
  }
  return Y.transpose();
}
SmallMatrix small_inverse(const SmallMatrix& A) {
  return with_known_size([](const auto& known) { return inverse_by_columns(known); }, A);
}

double determinant(const LU<MatrixXd>& lu) {
  return double(lu.P.determinant()) * lu.pivots().prod();
}

template <class Matrix>
static Matrix inverse_of(const Matrix& A) {
  using Small = Eigen::Matrix<typename Matrix::Scalar, Eigen::Dynamic, Eigen::Dynamic, 0,
                              small_size, small_size>;  // without allocations
  if (A.rows() <= small_size) return Small(A).partialPivLu().inverse();
  return A.partialPivLu().inverse();
}
MatrixXd inverse(const MatrixXd& A) { return inverse_of(A); }
MatrixXcd inverse(const MatrixXcd& A) { return inverse_of(A); }

std::optional<MatrixXd> cholesky(const MatrixXd& S) {
  const Eigen::LLT<MatrixXd> llt(S);
  if (llt.info() != Eigen::Success) return {};
  return llt.matrixL();
}

MatrixXd solve_lower(const MatrixXd& L, const MatrixXd& B) {
  return L.triangularView<Eigen::Lower>().solve(B);
}

}  // namespace tiltrim::dense
