// A * B of dense/products.hpp against sums in loops.
#include "dense/products.hpp"

#include <complex>

#include "tests/check.hpp"

using namespace tiltrim;
using dense::SmallComplexMatrix;
using dense::SmallMatrix;
using Eigen::Index;
using Eigen::MatrixXcd;
using Eigen::MatrixXd;
using Eigen::VectorXcd;
using Eigen::VectorXd;

namespace products_test {

namespace {

// The sum of |A B - AB| over all entries.
double distance(const auto& A, const auto& B, const auto& AB) {
  REQUIRE(AB.rows() == A.rows());
  REQUIRE(AB.cols() == B.cols());
  double off = 0;
  for (Index i = 0; i < A.rows(); ++i)
    for (Index j = 0; j < B.cols(); ++j) {
      std::complex<double> entry = 0;
      for (Index k = 0; k < A.cols(); ++k)
        entry += std::complex<double>(A.coeff(i, k)) * std::complex<double>(B.coeff(k, j));
      off += std::abs(entry - AB(i, j));
    }
  return off;
}

template <class Left, class Right>
void check(Index rows, Index inner, Index columns) {
  CAPTURE(rows);
  CAPTURE(inner);
  CAPTURE(columns);
  const Left A = Left::Random(rows, inner), a = Left::Random(inner, rows);
  const Right B = Right::Random(inner, columns);
  // Some units of the last place per term; a term that is missing is a million million of them.
  const double rounding = 1e-15 * double(rows * inner * columns);
  CHECK(distance(A, B, A * B) <= rounding);
  CHECK(distance(a.transpose(), B, a.transpose() * B) <= rounding);
  CHECK(distance(A.topRows(rows / 2), B, A.topRows(rows / 2) * B) <= rounding);
  CHECK(distance(A.cwiseAbs(), -2.0 * B, A.cwiseAbs() * (-2.0 * B)) <= 2 * rounding);
}

template <class Left, class Right>
void check_shapes(Index most) {
  for (const Index columns : {Index(1), Index(0), most})
    for (const Index inner : {Index(0), Index(1), Index(7), most})
      check<Left, Right>(most - 1, inner, Right::ColsAtCompileTime == 1 ? 1 : columns);
}

}  // namespace

TEST_CASE("products of matrices of every type and of their parts are sums") {
  check_shapes<MatrixXd, MatrixXd>(40);
  check_shapes<MatrixXd, MatrixXcd>(40);
  check_shapes<MatrixXcd, MatrixXd>(40);
  check_shapes<MatrixXcd, MatrixXcd>(40);
  check_shapes<MatrixXd, VectorXd>(40);
  check_shapes<MatrixXd, VectorXcd>(40);
  check_shapes<MatrixXcd, VectorXd>(40);
  check_shapes<MatrixXcd, VectorXcd>(40);
  check_shapes<SmallMatrix, SmallMatrix>(dense::small_size);
  check_shapes<SmallComplexMatrix, SmallComplexMatrix>(dense::small_size);
}

TEST_CASE("a factor may be what the product overwrites") {
  const MatrixXd A = MatrixXd::Random(9, 9);
  const double rounding = 1e-15 * 9 * 9 * 9;
  MatrixXd B = A;
  B = B * B;
  CHECK(distance(A, A, B) <= rounding);
  B = A;
  B.topRows(3) = B.topRows(3) * B;
  CHECK(distance(A.topRows(3), A, B.topRows(3)) <= rounding);
}

}  // namespace products_test
