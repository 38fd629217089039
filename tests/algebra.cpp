#include "tests/algebra.hpp"

#include <Eigen/LU>
#include <Eigen/QR>
#include <Eigen/SVD>
#include <algorithm>
#include <cmath>
#include <limits>

namespace algebra {

namespace {

using Eigen::Index;

// Solves A x = b in place by elimination with partial pivoting; returns det A.
template <class Matrix>
typename Matrix::Scalar eliminate(Matrix A, Matrix& b) {
  const Index n = A.rows();
  typename Matrix::Scalar determinant(1);
  for (Index k = 0; k < n; ++k) {
    Index pivot = k;
    for (Index i = k + 1; i < n; ++i)
      if (std::abs(A(i, k)) > std::abs(A(pivot, k))) pivot = i;
    if (pivot != k) {
      A.row(k).swap(A.row(pivot));
      b.row(k).swap(b.row(pivot));
      determinant = -determinant;
    }
    determinant *= A(k, k);
    for (Index i = k + 1; i < n; ++i) {
      const typename Matrix::Scalar factor = A(i, k) / A(k, k);
      if (factor == typename Matrix::Scalar(0)) continue;
      A.row(i).tail(n - k) -= factor * A.row(k).tail(n - k);
      b.row(i) -= factor * b.row(k);
    }
  }
  for (Index k = n - 1; k >= 0; --k) {
    for (Index i = k + 1; i < n; ++i)
      if (A(k, i) != typename Matrix::Scalar(0)) b.row(k) -= A(k, i) * b.row(i);
    b.row(k) /= A(k, k);
  }
  return determinant;
}

template <class Matrix>
Matrix solved(const Matrix& A, Matrix b) {
  eliminate(A, b);
  return b;
}

}  // namespace

MatrixXd solve(const MatrixXd& A, const MatrixXd& b) { return solved(A, b); }
MatrixXcd solve(const MatrixXcd& A, const MatrixXcd& b) { return solved(A, b); }
WideMatrix solve(const WideMatrix& A, const WideMatrix& b) { return solved(A, b); }

MatrixXd inverse(const MatrixXd& A) { return A.partialPivLu().inverse(); }
MatrixXcd inverse(const MatrixXcd& A) {
  return solved(A, MatrixXcd(MatrixXcd::Identity(A.rows(), A.rows())));
}

double determinant(const MatrixXd& A) {
  MatrixXd none(A.rows(), 0);
  return eliminate(A, none);
}

MatrixXd orthogonal(const MatrixXd& A) { return A.householderQr().householderQ(); }

SingularValues singular_values(const MatrixXd& A) {
  const Eigen::JacobiSVD<MatrixXd, Eigen::NoQRPreconditioner> svd(
      A, Eigen::ComputeFullU | Eigen::ComputeFullV);
  return {svd.matrixU(), svd.matrixV(), svd.singularValues()};
}

double largest_singular_value(const MatrixXd& A) {
  return Eigen::JacobiSVD<MatrixXd, Eigen::NoQRPreconditioner>(A).singularValues()[0];
}

// The eigenvalues of [Re A, -Im A; Im A, Re A] are those of A, each twice.
double least_singular_value(const MatrixXcd& A) {
  const Index n = A.rows();
  MatrixXd real(2 * n, 2 * n);
  real << A.real(), -A.imag(), A.imag(), A.real();
  return Eigen::JacobiSVD<MatrixXd, Eigen::NoQRPreconditioner>(real).singularValues()[2 * n - 1];
}

MatrixXd pseudo_inverse(const MatrixXd& A) {
  const Index n = std::max(A.rows(), A.cols());
  MatrixXd square = MatrixXd::Zero(n, n);
  square.topLeftCorner(A.rows(), A.cols()) = A;
  const auto [U, V, values] = singular_values(square);
  const double zero = double(n) * std::numeric_limits<double>::epsilon() * values[0];
  const VectorXd inverted = values.unaryExpr([&](double s) { return s > zero ? 1 / s : 0.0; });
  const MatrixXd whole = V.lazyProduct(MatrixXd(inverted.asDiagonal() * U.transpose()));
  return whole.topLeftCorner(A.cols(), A.rows());
}

// exp(A) = exp(A/2ⁿ)^(2ⁿ), by the Taylor series of a matrix whose entries sum to at most 1/2.
MatrixXd exponential(const MatrixXd& A) {
  const double size = A.cwiseAbs().sum();
  const int halvings = size > 0 ? std::max(0, std::ilogb(size) + 2) : 0;
  const MatrixXd small = A / std::exp2(halvings);
  MatrixXd term = MatrixXd::Identity(A.rows(), A.rows()), sum = term;
  for (int k = 1; k <= 16; ++k) {  // 2⁻¹⁶/16! is below rounding
    term = MatrixXd(term.lazyProduct(small)) / k;
    sum += term;
  }
  for (int k = 0; k < halvings; ++k) sum = MatrixXd(sum.lazyProduct(sum));
  return sum;
}

}  // namespace algebra
