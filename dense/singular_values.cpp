#include <Eigen/SVD>
#include <algorithm>
#include <cmath>
#include <limits>

#include "dense/dense.hpp"
#include "dense/known_size.hpp"

namespace tiltrim::dense {

using Eigen::Index;
using Eigen::MatrixXcd;
using Eigen::MatrixXd;
using Eigen::VectorXcd;
using Eigen::VectorXd;

// Full pivoting is Eigen's most accurate preconditioner; one instantiation serves all uses.
template <class Matrix>
using JacobiOf = Eigen::JacobiSVD<Matrix, Eigen::FullPivHouseholderQRPreconditioner>;
using Jacobi = JacobiOf<MatrixXd>;

SVD svd(const MatrixXd& A) {
  const Jacobi found(A, Eigen::ComputeFullU | Eigen::ComputeFullV);
  return {found.matrixU(), found.singularValues(), found.matrixV()};
}
SmallSVD small_svd(const SmallMatrix& A) {
  const JacobiOf<SmallMatrix> found(A, Eigen::ComputeFullU | Eigen::ComputeFullV);
  return {found.matrixU(), found.singularValues(), found.matrixV()};
}

VectorXd singular_values(const MatrixXd& A) { return Jacobi(A).singularValues(); }

// Columns are rotated in pairs until all are orthogonal: their lengths are the singular values.
//                                                                              [11, sec. 8.6.3]
template <class Matrix>
static SmallVector lengths_when_orthogonal(Matrix W) {
  constexpr int most_sweeps = 30;
  constexpr double orthogonal = 4 * std::numeric_limits<double>::epsilon();
  const Index n = W.cols(), rows = W.rows();
  bool rotated = true;
  for (int sweep = 0; rotated && sweep < most_sweeps; ++sweep) {
    rotated = false;
    for (Index j = 1; j < n; ++j)
      for (Index i = 0; i < j; ++i) {
        double* const a = &W(0, i);
        double* const b = &W(0, j);
        double aa = 0, bb = 0, ab = 0;
        for (Index k = 0; k < rows; ++k) aa += a[k] * a[k], bb += b[k] * b[k], ab += a[k] * b[k];
        if (!(std::abs(ab) > orthogonal * std::sqrt(aa * bb))) continue;
        rotated = true;
        const double apart = bb - aa, twice = 2 * ab;
        const double t =
            twice / (apart + std::copysign(std::sqrt(apart * apart + twice * twice), apart));
        const double c = 1 / std::sqrt(1 + t * t), s = c * t;
        for (Index k = 0; k < rows; ++k) {
          const double was = a[k];
          a[k] = c * was - s * b[k];
          b[k] = s * was + c * b[k];
        }
      }
  }
  if (rotated || !W.allFinite()) return {};
  return W.colwise().norm().transpose();
}
SmallVector small_singular_values(const SmallMatrix& A) {
  constexpr double largest = 1e70;  // its fourth power is finite
  const double size = A.size() > 0 ? A.cwiseAbs().maxCoeff() : 0.0;
  if (!(size > 1 / largest && size < largest)) return {};
  const auto of = [](auto M) { return lengths_when_orthogonal(M); };
  return A.rows() == A.cols() ? with_known_size(of, A) : of(A);
}

template <class Vector>
static Index rank(const Vector& sigma) {
  constexpr double epsilon = std::numeric_limits<double>::epsilon();
  if (sigma.size() == 0) return 0;
  const double least =
      std::max(sigma[0] * double(sigma.size()) * epsilon, std::numeric_limits<double>::min());
  return (sigma.array() > least).count();
}

template <class Matrix, class Vector>
static Vector solve_by(const SVDOf<Matrix, Vector>& svd, const Vector& b) {
  const Index r = rank(svd.sigma);
  const Vector along = svd.U.leftCols(r).transpose() * b;
  return svd.V.leftCols(r) * along.cwiseQuotient(svd.sigma.head(r));
}
VectorXd solve(const SVD& svd, const VectorXd& b) { return solve_by(svd, b); }
SmallVector solve(const SmallSVD& svd, const SmallVector& b) { return solve_by(svd, b); }

MatrixXd kernel(const MatrixXd& A) {
  const SVD found = svd(A);
  return found.V.rightCols(A.cols() - rank(found.sigma));
}

// ‖A (x + iy)‖ equals the norm of [Re A, -Im A; Im A, Re A] (x, y).
VectorXcd least_singular_vector(const MatrixXcd& A) {
  const Index m = A.rows(), n = A.cols();
  MatrixXd real(2 * m, 2 * n);
  real << A.real(), -A.imag(), A.imag(), A.real();
  const VectorXd least = svd(real).V.col(2 * n - 1);
  VectorXcd v(n);
  v.real() = least.head(n);
  v.imag() = least.tail(n);
  return v;
}

}  // namespace tiltrim::dense
