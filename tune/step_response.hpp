/// The decay of y(t) = c exp(A t) x, sampled exactly. Internal to tune/.
#pragma once

#include <Eigen/Core>

namespace tiltrim {

struct Decaying {
  bool determined = false;   ///< every later value is shown to be smaller
  double largest = 0.0;      ///< of sign · y(t), at least 0, if `band` is 0
  double last_beyond = 0.0;  ///< otherwise the last time with |y| > band; 0: none
};
/// All eigenvalues of A must be left of the axis. Between samples y is a cubic, whose error in the
/// middle of each step is below 1e-8 of `size`; what is not sampled is bounded by the sum of the
/// modes' amplitudes or by a Lyapunov function. Not determined where neither bound is known, or
/// 100,000 samples do not suffice.
[[nodiscard]] Decaying decaying(const Eigen::MatrixXd& A, const Eigen::RowVectorXd& c,
                                const Eigen::VectorXd& x, double sign, double band, double size);

}  // namespace tiltrim
