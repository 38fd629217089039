#include "tests/random_draws.hpp"

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

double uniform(Random& random, double low, double high) {
  return std::uniform_real_distribution(low, high)(random);
}

double uniform(std::mt19937& random) { return static_cast<double>(random()) / 4294967296.0; }

VectorXd uniform(Random& random, Index n, double low, double high) {
  return VectorXd::NullaryExpr(n, [&] { return uniform(random, low, high); });
}

MatrixXd normal(Random& random, Index rows, Index columns) {
  std::normal_distribution<double> gauss;
  return MatrixXd::NullaryExpr(rows, columns, [&] { return gauss(random); });
}
