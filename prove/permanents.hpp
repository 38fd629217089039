/// Sums that bound the terms of a determinant by moduli. Internal to prove/.
#pragma once

#include <Eigen/Core>
#include <bit>
#include <cstddef>
#include <vector>

#include "dense/dense.hpp"

namespace tiltrim::proving {

// The permanent of a matrix of few rows, by subsets of columns.
inline double permanent(const dense::SmallMatrix& M) {
  const std::size_t n = std::size_t(M.rows()), all = std::size_t(1) << n;
  thread_local std::vector<double> of;
  of.assign(all, 0.0);
  of[0] = 1;
  for (std::size_t set = 0; set < all - 1; ++set) {
    if (of[set] == 0) continue;
    const Eigen::Index row = Eigen::Index(std::popcount(set));
    for (std::size_t j = 0; j < n; ++j)
      if (!(set >> j & 1)) of[set | std::size_t(1) << j] += of[set] * M(row, Eigen::Index(j));
  }
  return of[all - 1];
}

inline double second_sum(const dense::SmallMatrix& M) {  // Σ_{i<j} M_ii M_jj + M_ij M_ji
  double sum = 0;
  for (Eigen::Index i = 0; i < M.rows(); ++i)
    for (Eigen::Index j = 0; j < i; ++j) sum += M(i, i) * M(j, j) + M(i, j) * M(j, i);
  return sum;
}

// Σ_{i<j<k} permanents of the minors of order three
inline double third_sum(const dense::SmallMatrix& M) {
  double sum = 0;
  for (Eigen::Index i = 0; i < M.rows(); ++i)
    for (Eigen::Index j = 0; j < i; ++j)
      for (Eigen::Index k = 0; k < j; ++k)
        sum += M(i, i) * (M(j, j) * M(k, k) + M(j, k) * M(k, j)) +
               M(i, j) * (M(j, i) * M(k, k) + M(j, k) * M(k, i)) +
               M(i, k) * (M(j, i) * M(k, j) + M(j, j) * M(k, i));
  return sum;
}

}  // namespace tiltrim::proving
