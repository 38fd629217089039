/// Small matrices of frequent sizes as types of that size, whose loops the compiler unrolls: the
/// same bits. Internal to dense/ and sweep/.
#pragma once

#include "dense/dense.hpp"

namespace tiltrim::dense {

/// f(A, others...), all square and of one size.
template <int n = 2, class F, class... Others>
auto with_known_size(const F& f, const SmallMatrix& A, const Others&... others) {
  constexpr int frequent = 8;
  if constexpr (n > frequent) {
    return f(A, others...);
  } else {
    if (A.rows() != n) return with_known_size<n + 1>(f, A, others...);
    using Known = Eigen::Matrix<double, n, n>;
    return f(Known(A), Known(others)...);
  }
}

}  // namespace tiltrim::dense
