#include <Eigen/SparseCholesky>
#include <vector>

#include "dense/dense.hpp"

namespace tiltrim::dense {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

MatrixXd solve_cyclic(const VectorXd& at, const VectorXd& after, const MatrixXd& b) {
  const Index n = at.size();
  std::vector<Eigen::Triplet<double>> entries;
  for (Index i = 0; i < n; ++i) {
    const Index next = (i + 1) % n;
    entries.emplace_back(i, i, at[i]);
    entries.emplace_back(i, next, after[i]);
    entries.emplace_back(next, i, after[i]);
  }
  Eigen::SparseMatrix<double> matrix(n, n);
  matrix.setFromTriplets(entries.begin(), entries.end());
  return Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>>(matrix).solve(b);
}

}  // namespace tiltrim::dense
