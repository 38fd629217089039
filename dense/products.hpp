/// A B and A x for matrices whose shape the compiler does not know, compiled once. Eigen compiles a
/// product anew for each pair of types and in each source, half a second each time; where this
/// header is included, the same `A * B` finds these instead. The factors are evaluated first.
/// Internal to tiltrim.
#pragma once

#include <Eigen/Core>
#include <complex>
#include <type_traits>

namespace tiltrim {

namespace dense {

/// Matrices of at most 16 rows, stored without allocation.
inline constexpr int small_size = 16;
using SmallMatrix =
    Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, small_size, small_size>;
using SmallComplexMatrix =
    Eigen::Matrix<std::complex<double>, Eigen::Dynamic, Eigen::Dynamic, 0, small_size, small_size>;

Eigen::MatrixXd product(const Eigen::MatrixXd& A, const Eigen::MatrixXd& B);
Eigen::MatrixXcd product(const Eigen::MatrixXd& A, const Eigen::MatrixXcd& B);
Eigen::MatrixXcd product(const Eigen::MatrixXcd& A, const Eigen::MatrixXd& B);
Eigen::MatrixXcd product(const Eigen::MatrixXcd& A, const Eigen::MatrixXcd& B);
Eigen::VectorXd product(const Eigen::MatrixXd& A, const Eigen::VectorXd& x);
Eigen::VectorXcd product(const Eigen::MatrixXd& A, const Eigen::VectorXcd& x);
Eigen::VectorXcd product(const Eigen::MatrixXcd& A, const Eigen::VectorXd& x);
Eigen::VectorXcd product(const Eigen::MatrixXcd& A, const Eigen::VectorXcd& x);
SmallMatrix product(const SmallMatrix& A, const SmallMatrix& B);
SmallComplexMatrix product(const SmallComplexMatrix& A, const SmallComplexMatrix& B);
/// Aᵀ B and Aᵀ x
Eigen::MatrixXd transposed_product(const Eigen::MatrixXd& A, const Eigen::MatrixXd& B);
Eigen::VectorXd transposed_product(const Eigen::MatrixXd& A, const Eigen::VectorXd& x);

/// The type an expression is evaluated to.
template <class M>
using Plain = Eigen::Matrix<typename M::Scalar, M::RowsAtCompileTime, M::ColsAtCompileTime, 0,
                            M::MaxRowsAtCompileTime, M::MaxColsAtCompileTime>;
template <class M, class... Types>
concept EvaluatesTo = std::is_base_of_v<Eigen::MatrixBase<M>, M> &&
    (std::is_same_v<Plain<M>, Types> || ...);
template <class M>
concept AnyMatrix = EvaluatesTo<M, Eigen::MatrixXd, Eigen::MatrixXcd>;
template <class M>
concept AnyVector = EvaluatesTo<M, Eigen::VectorXd, Eigen::VectorXcd>;
template <class M>
concept AnySmallMatrix = EvaluatesTo<M, SmallMatrix, SmallComplexMatrix>;

template <class Left, class Right>
auto product_of(const Left& A, const Right& B) {
  const Plain<Right>& right = B;
  if constexpr (std::is_same_v<Left, Eigen::Transpose<const Eigen::MatrixXd>> &&
                std::is_same_v<typename Right::Scalar, double>) {
    return transposed_product(A.nestedExpression(), right);
  } else {
    const Plain<Left>& left = A;
    return product(left, right);
  }
}

}  // namespace dense

template <dense::AnyMatrix Left, dense::AnyMatrix Right>
auto operator*(const Left& A, const Right& B) {
  return dense::product_of(A, B);
}
template <dense::AnyMatrix Left, dense::AnyVector Right>
auto operator*(const Left& A, const Right& x) {
  return dense::product_of(A, x);
}
template <dense::AnySmallMatrix Left, dense::EvaluatesTo<dense::Plain<Left>> Right>
auto operator*(const Left& A, const Right& B) {
  return dense::product_of(A, B);
}

}  // namespace tiltrim
