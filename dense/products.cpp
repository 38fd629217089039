#include "dense/products.hpp"

namespace tiltrim::dense {

using Eigen::MatrixXcd;
using Eigen::MatrixXd;
using Eigen::VectorXcd;
using Eigen::VectorXd;

// Eigen's own operator is its member; A * B would be these functions again.
MatrixXd product(const MatrixXd& A, const MatrixXd& B) { return A.operator*(B); }
MatrixXcd product(const MatrixXd& A, const MatrixXcd& B) { return A.operator*(B); }
MatrixXcd product(const MatrixXcd& A, const MatrixXd& B) { return A.operator*(B); }
MatrixXcd product(const MatrixXcd& A, const MatrixXcd& B) { return A.operator*(B); }
VectorXd product(const MatrixXd& A, const VectorXd& x) { return A.operator*(x); }
VectorXcd product(const MatrixXd& A, const VectorXcd& x) { return A.operator*(x); }
VectorXcd product(const MatrixXcd& A, const VectorXd& x) { return A.operator*(x); }
VectorXcd product(const MatrixXcd& A, const VectorXcd& x) { return A.operator*(x); }
SmallMatrix product(const SmallMatrix& A, const SmallMatrix& B) { return A.operator*(B); }
SmallComplexMatrix product(const SmallComplexMatrix& A, const SmallComplexMatrix& B) {
  return A.operator*(B);
}

MatrixXd transposed_product(const MatrixXd& A, const MatrixXd& B) {
  return A.transpose().operator*(B);
}
VectorXd transposed_product(const MatrixXd& A, const VectorXd& x) {
  return A.transpose().operator*(x);
}

}  // namespace tiltrim::dense
