#include "dense/newton_step.hpp"

#include <cstring>
#include <limits>

#include "dense/dense.hpp"

namespace tiltrim::dense {

using Eigen::MatrixXd;
using Eigen::VectorXd;

VectorXd newton_step(const MatrixXd& J, const VectorXd& residual) {
  const VectorXd largest = J.rowwise().lpNorm<Eigen::Infinity>();
  const VectorXd over = (largest.array() > 0).select(largest.cwiseInverse(), 0.0);
  return solve(svd(over.asDiagonal() * J), -over.cwiseProduct(residual));
}

double length_of_steps(double first, double second) {
  return second < first ? first / (1 - second / first) : std::numeric_limits<double>::infinity();
}

bool same_bits(const VectorXd& a, const VectorXd& b) {
  const auto bytes = std::size_t(a.size()) * sizeof(double);
  return a.size() == b.size() && (bytes == 0 || std::memcmp(a.data(), b.data(), bytes) == 0);
}

}  // namespace tiltrim::dense
