#include "linearize/loop_transfer.hpp"

#include <fmt/core.h>

#include <cmath>
#include <stdexcept>

#include "dense/dense.hpp"
#include "linearize/balance.hpp"
#include "linearize/eigenvalues.hpp"
#include "model/lookup.hpp"
#include "runtime/rounding.hpp"

namespace tiltrim {

using Eigen::Index, Eigen::MatrixXd, Eigen::RowVectorXd, Eigen::VectorXcd, Eigen::VectorXd;

namespace transfer {

namespace {

// 1/g = 1/d - c/d (sI - A + b c/d)⁻¹ b/d
LoopTransfer inverse(const LoopTransfer& g) {
  return {g.A - g.b * (g.c / g.d), g.b / g.d, -g.c / g.d, 1 / g.d};
}

// With c = (γ 0 ... 0) a zero has x₁ = 0, and the equation for x₁' becomes the output.       [46]
LoopTransfer without_output_state(const LoopTransfer& g) {
  const Index rest = g.A.rows() - 1;
  const MatrixXd Q = dense::svd(g.c.transpose()).U;
  const MatrixXd A = Q.transpose() * g.A * Q;
  const VectorXd b = Q.transpose() * g.b;
  return {A.bottomRightCorner(rest, rest), b.tail(rest), A.row(0).tail(rest), b[0]};
}

}  // namespace

void check(const LoopTransfer& loop) {
  const Index n = loop.A.rows();
  if (loop.A.cols() != n || loop.b.size() != n || loop.c.size() != n)
    throw std::invalid_argument(fmt::format("loop: A is {} x {}, b has {} rows, c {} columns", n,
                                            loop.A.cols(), loop.b.size(), loop.c.size()));
  if (!loop.A.allFinite() || !loop.b.allFinite() || !loop.c.allFinite() || !std::isfinite(loop.d))
    throw std::invalid_argument("loop: A, b, c or d is not finite");
}

Complex proper(const LoopTransfer& g, double frequency) {
  if (g.A.rows() == 0 || std::isinf(frequency)) return 0.0;
  Eigen::MatrixXcd M = -g.A.cast<Complex>();
  M.diagonal().array() += Complex(0, frequency);
  const VectorXcd x = dense::solve(M, g.b.cast<Complex>());
  const Complex y = (g.c.cast<Complex>() * x).value();
  return std::isfinite(std::abs(y)) ? y : Complex(std::numeric_limits<double>::infinity());
}

LoopTransfer inverse_of_one_plus(LoopTransfer g) {
  check(g);
  g.d += 1;
  if (g.d == 0) throw std::invalid_argument("loop: 1 + d = 0, the closed loop is not well posed");
  return inverse(g);
}

LoopTransfer balanced(const LoopTransfer& g) {
  const Index n = g.A.rows();
  MatrixXd M(n + 1, n + 1);
  M << g.A, g.b, g.c, g.d;
  const Balanced as = balance(M);
  VectorXd unit(n + 1);
  for (Index i = 0; i <= n; ++i) unit[as.order[std::size_t(i)]] = as.scale[i];
  M = unit.cwiseInverse().asDiagonal() * M * unit.asDiagonal();
  return {M.topLeftCorner(n, n), M.topRightCorner(n, 1), M.bottomLeftCorner(1, n), g.d};
}

LoopTransfer combined(const LoopTransfer& g, const Terms& k) {
  const Index n = g.A.rows();
  LoopTransfer f{MatrixXd::Zero(2 * n, 2 * n), VectorXd(2 * n), RowVectorXd(2 * n), 0.0};
  f.A.topLeftCorner(n, n) = g.A;
  f.A.bottomLeftCorner(n, n) = -k.t * g.c.transpose() * g.c;
  f.A.bottomRightCorner(n, n) = -g.A.transpose();
  f.b << g.b, -(k.r + k.t * g.d) * g.c.transpose();
  f.c << (k.q + k.t * g.d) * g.c, g.b.transpose();
  f.d = k.p + (k.q + k.r) * g.d + k.t * g.d * g.d;
  return f;
}

bool collect_zeros(LoopTransfer g, std::vector<Complex>& found) {
  constexpr double certainly_zero = std::numeric_limits<double>::epsilon(),
                   certainly_not = 1e-3;  // d relative to the rest
  bool complete = true;
  for (; g.A.rows() > 0; g = without_output_state(g)) {
    const double dynamic = g.b.norm() * g.c.norm(), direct = std::abs(g.d) * g.A.norm();
    if (direct > certainly_zero * dynamic) {
      const VectorXcd zeros = eigenvalues(inverse(g).A);
      complete = complete && zeros.size() == g.A.rows();
      found.insert(found.end(), zeros.begin(), zeros.end());
    }
    if (direct > certainly_not * dynamic || dynamic == 0) break;
  }
  return complete;
}

}  // namespace transfer

std::complex<double> response(const LoopTransfer& loop, double frequency) {
  transfer::check(loop);
  if (std::isnan(frequency)) throw std::invalid_argument("loop: the frequency is not a number");
  return loop.d + transfer::proper(loop, frequency);
}

LoopTransfer opened(const MatrixXd& A_closed, const VectorXd& b, const RowVectorXd& c, double d) {
  const RoundToNearest environment;
  LoopTransfer loop = transfer::inverse_of_one_plus({A_closed, b, c, d});
  loop.d = -d / (1 + d);
  return loop;
}
LoopTransfer opened(const LinearModel& closed, std::string_view input, std::string_view output) {
  const Index j = index_of(closed.inputs, input, "input");
  const Index i = index_of(closed.outputs, output, "output");
  return opened(closed.A, closed.B.col(j), closed.C.row(i), closed.D(i, j));
}

}  // namespace tiltrim
