#include <Eigen/Eigenvalues>
#include <algorithm>
#include <complex>
#include <limits>
#include <type_traits>
#include <utility>

#include "dense/dense.hpp"

namespace tiltrim::dense {

using SmallBlock = Eigen::Block<SmallMatrix, Eigen::Dynamic, Eigen::Dynamic, false>;

// (I - τ v vᵀ) M, v = (1, rest)
template <int rest>
static void reflect_rows(SmallBlock& M, const Eigen::Matrix<double, rest, 1>& v, double tau) {
  if (tau == 0) return;
  const Eigen::Matrix<double, rest, 1> turned = tau * v;
  for (Eigen::Index j = 0; j < M.cols(); ++j) {
    double* const column = &M.coeffRef(0, j);
    double sum = v[0] * column[1];
    for (int i = 1; i < rest; ++i) sum += v[i] * column[i + 1];
    sum += column[0];
    column[0] -= tau * sum;
    for (int i = 0; i < rest; ++i) column[i + 1] -= turned[i] * sum;
  }
}

// M (I - τ v vᵀ)
template <int rest>
static void reflect_columns(SmallBlock& M, const Eigen::Matrix<double, rest, 1>& v, double tau) {
  if (tau == 0) return;
  const Eigen::Index stride = M.outerStride();
  for (Eigen::Index i = 0; i < M.rows(); ++i) {
    double* const row = &M.coeffRef(i, 0);
    double sum = v[0] * row[stride];
    for (int j = 1; j < rest; ++j) sum += v[j] * row[(j + 1) * stride];
    sum = tau * (sum + row[0]);
    row[0] -= sum;
    for (int j = 0; j < rest; ++j) row[(j + 1) * stride] -= sum * v[j];
  }
}

}  // namespace tiltrim::dense

// Reflectors of two and three rows, of which the QR iteration on small matrices consists: the bits
// of Eigen's products of blocks, whose calls take longer than their few numbers.
template <>
template <>
void Eigen::MatrixBase<tiltrim::dense::SmallBlock>::applyHouseholderOnTheLeft(
    const Matrix<double, 2, 1>& v, const double& tau, double*) {
  tiltrim::dense::reflect_rows(derived(), v, tau);
}
template <>
template <>
void Eigen::MatrixBase<tiltrim::dense::SmallBlock>::applyHouseholderOnTheLeft(
    const Matrix<double, 1, 1>& v, const double& tau, double*) {
  tiltrim::dense::reflect_rows(derived(), v, tau);
}
template <>
template <>
void Eigen::MatrixBase<tiltrim::dense::SmallBlock>::applyHouseholderOnTheRight(
    const Matrix<double, 2, 1>& v, const double& tau, double*) {
  tiltrim::dense::reflect_columns(derived(), v, tau);
}
template <>
template <>
void Eigen::MatrixBase<tiltrim::dense::SmallBlock>::applyHouseholderOnTheRight(
    const Matrix<double, 1, 1>& v, const double& tau, double*) {
  tiltrim::dense::reflect_columns(derived(), v, tau);
}

namespace tiltrim::dense {

using Eigen::Index;
using Eigen::MatrixXcd;
using Eigen::MatrixXd;
using Eigen::VectorXcd;
using Eigen::VectorXd;

template <class Vector>
static Vector complex_column(const auto& P, const Vector& values, Index j) {
  const double im = values[j].imag();
  Vector v = P.col(im < 0 ? j - 1 : j).template cast<std::complex<double>>();
  if (im > 0) v.imag() = P.col(j + 1);
  if (im < 0) v.imag() = -P.col(j);
  return v;
}
VectorXcd complex_column(const Eigen::Ref<const MatrixXd>& P, const VectorXcd& values, Index j) {
  return complex_column<VectorXcd>(P, values, j);
}

namespace {

// Eigen keeps the Schur form from which it computes eigenvalues and vectors.
template <class Matrix>
struct Solver : Eigen::EigenSolver<Matrix> {
  using Eigen::EigenSolver<Matrix>::EigenSolver;
  const Eigen::RealSchur<Matrix>& schur() const { return this->m_realSchur; }
};

// solver.eigenvectors() would return the real and imaginary parts as two real vectors if the
// imaginary part of a pair is below ε times its real part.
template <class Found, class Matrix>
Found with_vectors(const Matrix& A, Index max_iterations) {
  Solver<Matrix> solver(A.rows());
  solver.setMaxIterations(max_iterations * A.rows()).compute(A);
  if (solver.info() != Eigen::Success) return {};
  Found found{true, solver.eigenvalues(), solver.pseudoEigenvectors(), solver.schur().matrixU(),
              solver.schur().matrixT()};
  for (Index j = 0; j < A.cols(); ++j) {
    const auto v = complex_column(found.P, found.values, j).normalized().eval();
    found.P.col(j) = v.real();
    if (found.values[j].imag() > 0) found.P.col(++j) = v.imag();
  }
  return found;
}

template <class Scalar>
double size(Scalar x) {
  return std::abs(std::real(x)) + std::abs(std::imag(x));
}

// Overwrites the rows of x above `top`: (T - λI) x = 0 with those from `top` on, which are given.
// The columns of x are its real part and, for a complex λ, its imaginary part.
template <class Columns, class Scalar>
void substitute_up(const MatrixXd& T, const VectorXcd& values, Scalar lambda, double least,
                   Index top, Columns x) {
  constexpr double large = 1e8;  // whose products with any entry stay far below overflow
  const auto pivot = [&](Scalar a) { return a == 0.0 ? Scalar(least) : a; };
  const auto parts = [](const Scalar& a) {
    return Eigen::Map<const Eigen::Matrix<double, 1, Columns::ColsAtCompileTime>>(
        reinterpret_cast<const double*>(&a));
  };
  const auto entry = [&](Index i) {
    if constexpr (std::is_same_v<Scalar, double>)
      return x(i, 0);
    else
      return Scalar(x(i, 0), x(i, 1));
  };
  for (Index i = top - 1; i >= 0; --i) {
    if (values[i].imag() != 0) {
      Scalar a = T(i - 1, i - 1) - lambda, b = T(i - 1, i), c = T(i, i - 1), d = T(i, i) - lambda;
      Scalar r = entry(i - 1), s = entry(i);
      if (size(c) > size(a)) {
        std::swap(a, c);
        std::swap(b, d);
        std::swap(r, s);
      }
      const Scalar by = c / pivot(a), q = (s - by * r) / pivot(d - by * b),
                   p = (r - b * q) / pivot(a);
      x.row(i) = parts(q);
      x.row(--i) = parts(p);
      for (Index k = 0; k < x.cols(); ++k)
        x.col(k).head(i) -= parts(p)[k] * T.col(i).head(i) + parts(q)[k] * T.col(i + 1).head(i);
      if (const double most = std::max(size(p), size(q)); most > large) x /= most;
      continue;
    }
    const Scalar p = entry(i) / pivot(T(i, i) - lambda);
    x.row(i) = parts(p);
    for (Index k = 0; k < x.cols(); ++k) x.col(k).head(i) -= parts(p)[k] * T.col(i).head(i);
    if (size(p) > large) x /= size(p);
  }
}

}  // namespace

MatrixXd triangular_vectors(const MatrixXd& T, const VectorXcd& values) {
  const Index n = T.rows();
  using Limits = std::numeric_limits<double>;
  const double least = std::max(Limits::epsilon() * T.norm(), Limits::min());
  MatrixXd X = MatrixXd::Zero(n, n);
  for (Index j = 0; j < n; ++j) {
    if (values[j].imag() == 0) {
      auto x = X.block<Eigen::Dynamic, 1>(0, j, j + 1, 1);
      x = -T.col(j).head(j + 1);
      x[j] = 1;
      substitute_up(T, values, values[j].real(), least, j, x);
      continue;
    }
    const std::complex<double> i(0, 1), lambda = values[j];
    const double b = T(j, j + 1), c = T(j + 1, j);
    const auto last =
        std::abs(c) < std::abs(b) ? i * b / (lambda - T(j, j)) : i * (lambda - T(j + 1, j + 1)) / c;
    auto x = X.block<Eigen::Dynamic, 2>(0, j, j + 2, 2);
    x.col(0).head(j) = -last.real() * T.col(j).head(j);
    x.col(1).head(j) = -(last.imag() * T.col(j).head(j) + T.col(j + 1).head(j));
    x.bottomRows<2>() << last.real(), last.imag(), 0, 1;
    substitute_up(T, values, lambda, least, j, x);
    ++j;
  }
  return X;
}

// wᴴ T = λ wᴴ is Tᵀ w̄ = λ w̄, upper triangular from the last row to the first.
MatrixXd left_triangular_vectors(const MatrixXd& T, const VectorXcd& values) {
  const MatrixXd turned = T.transpose().reverse();
  MatrixXd W = triangular_vectors(turned, values.conjugate().reverse()).reverse();
  for (Index j = 0; j < W.cols(); ++j)
    if (values[j].imag() > 0) {
      W.col(j).swap(W.col(j + 1));
      W.col(++j) *= -1;
    }
  return W;
}

RealEigensystem real_eigensystem(const MatrixXd& A, Index max_iterations) {
  if (A.rows() == 1) return {true, A.col(0), MatrixXd::Ones(1, 1), MatrixXd::Ones(1, 1), A};
  if (A.rows() <= small_size) return with_vectors<RealEigensystem>(SmallMatrix(A), max_iterations);
  return with_vectors<RealEigensystem>(A, max_iterations);
}
SmallEigensystem small_eigensystem(const SmallMatrix& A, Index max_iterations) {
  return with_vectors<SmallEigensystem>(A, max_iterations);
}

Eigensystem eigensystem(const MatrixXd& A, Index max_iterations) {
  const RealEigensystem found = real_eigensystem(A, max_iterations);
  if (!found.converged) return {};
  MatrixXcd V(A.rows(), A.cols());
  for (Index j = 0; j < A.cols(); ++j) V.col(j) = complex_column(found.P, found.values, j);
  return {true, found.values, V};
}

template <class Matrix>
static Eigensystem without_vectors(const Matrix& A, Index max_iterations) {
  Eigen::EigenSolver<Matrix> solver(A.rows());
  solver.setMaxIterations(max_iterations * A.rows()).compute(A, false);
  if (solver.info() != Eigen::Success) return {};
  return {true, solver.eigenvalues(), {}};
}
Eigensystem eigenvalues(const MatrixXd& A, Index max_iterations) {
  if (A.rows() <= small_size) return without_vectors(SmallMatrix(A), max_iterations);
  return without_vectors(A, max_iterations);
}

}  // namespace tiltrim::dense
