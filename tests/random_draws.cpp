#include "tests/random_draws.hpp"

#include <cstdio>
#include <cstdlib>

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

Random draws(std::uint64_t number) {
  const char* seed = std::getenv("TILTRIM_SEED");
  return Random(number + (seed ? 1'000'003 * std::strtoull(seed, nullptr, 10) : 0));
}

void tally(const char* kind, int trials, int wrong, int unanswered) {
  if (std::getenv("TILTRIM_SEED"))
    std::printf("planted: %s: %d trials, %d wrong, %d unanswered\n", kind, trials, wrong,
                unanswered);
}

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
