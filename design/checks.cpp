#include "design/checks.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>

namespace tiltrim::checks {

using Eigen::Index;
using Eigen::MatrixXd;

void shapes(const char* verb, std::initializer_list<Named> all) {
  std::string given;
  bool match = true;
  for (const Named& m : all) {
    const bool same = m.matrix.rows() == m.rows && m.matrix.cols() == m.cols;
    match = match && same;
    given += fmt::format("{}{} is {} x {}", given.empty() ? "" : ", ", m.name, m.matrix.rows(),
                         m.matrix.cols());
    if (!same) given += fmt::format(" (expected {} x {})", m.rows, m.cols);
  }
  if (!match) throw std::invalid_argument(fmt::format("{}: {}", verb, given));
  for (const Named& m : all)
    for (Index j = 0; j < m.cols; ++j)
      for (Index i = 0; i < m.rows; ++i)
        if (!std::isfinite(m.matrix(i, j)))
          throw std::invalid_argument(
              fmt::format("{}: {}({}, {}) is {}", verb, m.name, i + 1, j + 1, m.matrix(i, j)));
}

MatrixXd symmetric(const char* verb, const char* name, const MatrixXd& M) {
  constexpr double rounding = 1e-12;  // of matrices that are products
  const double largest = M.size() == 0 ? 0.0 : M.cwiseAbs().maxCoeff();
  for (Index j = 0; j < M.cols(); ++j)
    for (Index i = 0; i < j; ++i)
      if (std::abs(M(i, j) - M(j, i)) > rounding * largest)
        throw std::invalid_argument(
            fmt::format("{}: {} is not symmetric: {} in row {}, column {}, "
                        "but {} in row {}, column {}",
                        verb, name, M(i, j), i + 1, j + 1, M(j, i), j + 1, i + 1));
  return (M + M.transpose()) / 2;
}

}  // namespace tiltrim::checks
