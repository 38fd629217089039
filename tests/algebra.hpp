/// Linear algebra independent of the library's own: Eigen's decompositions, and elimination.
/// Compiled once: a test that calls it needs Eigen/Core only.
#pragma once

#include <Eigen/Core>
#include <complex>
#include <vector>

namespace algebra {

using Eigen::MatrixXcd;
using Eigen::MatrixXd;
using Eigen::VectorXcd;
using Eigen::VectorXd;
using WideMatrix = Eigen::Matrix<long double, Eigen::Dynamic, Eigen::Dynamic>;

VectorXcd eigenvalues(const MatrixXd& A);
VectorXcd eigenvalues(const MatrixXcd& A);
/// Throws std::runtime_error if they do not converge.
std::vector<std::complex<long double>> eigenvalues(const WideMatrix& A);

/// A V = V diag(values), the columns of V of length one.
struct Eigensystem {
  VectorXcd values;
  MatrixXcd vectors;
};
Eigensystem eigensystem(const MatrixXd& A);

MatrixXd solve(const MatrixXd& A, const MatrixXd& b);
MatrixXcd solve(const MatrixXcd& A, const MatrixXcd& b);
WideMatrix solve(const WideMatrix& A, const WideMatrix& b);
MatrixXd inverse(const MatrixXd& A);
MatrixXcd inverse(const MatrixXcd& A);
double determinant(const MatrixXd& A);

/// Q of A = Q R, A square.
MatrixXd orthogonal(const MatrixXd& A);

/// A = U diag(values) Vᵀ of a square A, the values falling.
struct SingularValues {
  MatrixXd U, V;
  VectorXd values;
};
SingularValues singular_values(const MatrixXd& A);
double largest_singular_value(const MatrixXd& A);
double least_singular_value(const MatrixXcd& A);

MatrixXd pseudo_inverse(const MatrixXd& A);

MatrixXd exponential(const MatrixXd& A);

}  // namespace algebra
