#include <Eigen/Eigenvalues>
#include <stdexcept>

#include "tests/algebra.hpp"

std::vector<std::complex<long double>> algebra::eigenvalues(const WideMatrix& A) {
  const Eigen::EigenSolver<WideMatrix> solver(A, false);
  if (solver.info() != Eigen::Success) throw std::runtime_error("no convergence");
  const auto& values = solver.eigenvalues();
  return {values.begin(), values.end()};
}
