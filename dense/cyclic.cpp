#include <Eigen/SparseLU>

#include "dense/dense.hpp"

namespace tiltrim::dense {

using Eigen::Index;
using Eigen::MatrixXd;

MatrixXd solve_cyclic(const std::vector<CyclicRow>& rows, const MatrixXd& b) {
  const Index n = std::ssize(rows);
  std::vector<Eigen::Triplet<double>> entries;
  for (Index i = 0; i < n; ++i) {
    const CyclicRow& row = rows[std::size_t(i)];
    entries.emplace_back(i, (i + n - 1) % n, row.before);
    entries.emplace_back(i, i, row.at);
    entries.emplace_back(i, (i + 1) % n, row.after);
  }
  Eigen::SparseMatrix<double> matrix(n, n);
  matrix.setFromTriplets(entries.begin(), entries.end());
  return Eigen::SparseLU<Eigen::SparseMatrix<double>>(matrix).solve(b);
}

}  // namespace tiltrim::dense
