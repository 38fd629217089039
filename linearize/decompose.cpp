#include "linearize/decompose.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace tiltrim {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXcd;
using Eigen::VectorXd;

namespace {

constexpr double ill_conditioned = 1e6;  // above which balancing may do harm

// Bound of the underflow in B caused by A/scale and balancing.
MatrixXd lost(const MatrixXd& A, double scale, const Balanced& b) {
  constexpr double least = std::numeric_limits<double>::min();
  MatrixXd lost = MatrixXd::Zero(A.rows(), A.cols());
  for (Index i = 0; i < A.rows(); ++i)
    for (Index j = 0; j < A.cols(); ++j) {
      const double kept = b.B(i, j) * (b.scale[i] / b.scale[j]) * scale;
      if (kept != A(b.order[std::size_t(i)], b.order[std::size_t(j)]))
        lost(i, j) = least * (1 + b.scale[j] / b.scale[i]);
    }
  return lost;
}

// 1/|wᴴv| of unit vectors, where wᴴv = 1, unless the defect of its row of W is too large.
VectorXd conditions(const dense::RealEigensystem& solved, const MatrixXd& W,
                    const VectorXd& defects, double most) {
  const VectorXcd& values = solved.values;
  VectorXd all(values.size());
  for (Index i = 0; i < values.size(); ++i) {
    const Index columns = values[i].imag() > 0 ? 2 : 1;
    if (values[i].imag() < 0)
      all[i] = all[i - 1];
    else if (defects[i] < most)
      all[i] = W.middleCols(i, columns).norm() * solved.P.middleCols(i, columns).norm();
    else
      all[i] = machine::infinity;
  }
  return all;
}

Decomposed decompose(const MatrixXd& A, const MatrixXd& A_error, Balanced balanced, double scale,
                     int max_iterations) {
  Decomposed d{scale, std::move(balanced), {}, {}, {}, {}, {A.rows()}};
  d.error = lost(A, scale, d.balanced);
  if (A_error.size() > 0) d.error += d.balanced.same(A_error / scale);
  d.solved = dense::real_eigensystem(d.balanced.B, max_iterations);
  if (!d.solved.converged) return d;
  d.inv = inverse(d.solved);
  d.condition = conditions(d.solved, d.inv.W, VectorXd::Constant(A.rows(), d.inv.defect), 1.0);
  return d;
}

// Balanced, unless that worsens an ill-conditioned eigenvalue.                   [67]
Decomposed decompose(const MatrixXd& A, const MatrixXd& A_error, int max_iterations) {
  const double scale = unit(A);
  Decomposed d = decompose(A, A_error, balance(A / scale), scale, max_iterations);
  const bool converged = d.solved.converged;
  if (converged && d.condition.maxCoeff() < ill_conditioned) return d;
  Decomposed plain = decompose(A, A_error, as_given(A / scale), scale, max_iterations);
  if (!converged) return plain;
  const auto error = [](const Decomposed& of) {
    return bounds(of.balanced.B, of.error, of.solved, of.inv).error.sum();
  };
  return plain.solved.converged && error(plain) < error(d) ? plain : d;
}

// Calls visit(block, first row, rows) for each.
template <class Visit>
void each_of(const std::vector<Decomposed>& blocks, const Visit& visit) {
  Index at = 0;
  for (const Decomposed& block : blocks) {
    const Index rows = std::ssize(block.balanced.order);
    visit(block, at, rows);
    at += rows;
  }
}

// Unit length, and wᴴ v = 1.
void normalize(MatrixXd& V, MatrixXd& W, const VectorXcd& values) {
  for (Index j = 0; j < V.cols(); ++j) {
    const VectorXcd v = dense::complex_column(V, values, j).normalized();
    V.col(j) = v.real();
    if (!(values[j].imag() > 0)) {
      W.col(j) /= W.col(j).dot(V.col(j));
      continue;
    }
    VectorXcd w = dense::complex_column(W, values, j);
    w *= 1.0 / std::conj(w.dot(v));
    W.col(j) = w.real();
    V.col(++j) = v.imag();
    W.col(j) = w.imag();
  }
}

// Of A in units of `scale`, in the coordinates of `whole`. Each block is Aᵢᵢ = Uᵢ Tᵢᵢ Uᵢᵀ in
// coordinates of its own, which a power of two brings close to those. With Tᵢⱼ = Uᵢᵀ Aᵢⱼ Uⱼ this is
// a Schur form of the whole: it takes no iteration, and its vectors follow by substitution.
Decomposed join(const MatrixXd& A, const std::vector<Decomposed>& blocks,
                const VectorXcd& eigenvalues, const Balanced& whole, double scale) {
  const Index n = A.rows();
  VectorXd of_state(n);
  for (Index k = 0; k < n; ++k) of_state[whole.order[std::size_t(k)]] = whole.scale[k];
  Decomposed d{scale, {{}, {}, VectorXd(n)}, {}, {}, {}, {}, {}};
  Balanced own{{}, {}, VectorXd(n)};
  each_of(blocks, [&](const Decomposed& block, Index at, Index m) {
    const auto& [B, order, scales] = block.balanced;
    own.order.insert(own.order.end(), order.begin(), order.end());
    own.scale.segment(at, m) = scales * (of_state[order[0]] / scales[0]);
    d.balanced.scale.segment(at, m) = of_state(order);
    d.ends.push_back(at + m);
  });
  d.balanced.order = own.order;
  d.solved.values = eigenvalues / scale;

  MatrixXd T = own.same(A);
  each_of(blocks, [&](const Decomposed& block, Index at, Index m) {
    T.block(0, at, at, m) = T.block(0, at, at, m) * block.solved.U;
    T.block(at, at, m, m) = block.solved.T * (block.scale / scale);
  });
  each_of(blocks, [&](const Decomposed& block, Index at, Index m) {
    auto after = T.block(at, at + m, m, n - at - m);
    after = block.solved.U.transpose() * after;
  });
  MatrixXd& P = d.solved.P = dense::triangular_vectors(T, d.solved.values);
  MatrixXd& W = d.inv.W = dense::left_triangular_vectors(T, d.solved.values);
  each_of(blocks, [&](const Decomposed& block, Index at, Index m) {
    auto right = P.block(at, at, m, n - at), left = W.block(at, 0, m, at + m);
    right = block.solved.U * right;
    left = block.solved.U * left;
  });
  const VectorXd S = own.scale.cwiseQuotient(d.balanced.scale);
  P = S.asDiagonal() * P;
  W = S.cwiseInverse().asDiagonal() * W;
  normalize(P, W, d.solved.values);
  // Of several blocks with one eigenvalue, W need not be the inverse of V: then three digits count.
  constexpr double most = 1e-3;
  d.condition =
      conditions(d.solved, W, defects(d.solved, W, product(W.transpose(), P, d.ends)), most);
  return d;
}

}  // namespace

double unit(const MatrixXd& A) {
  const double largest = A.cwiseAbs().maxCoeff();
  return largest > 0 ? std::ldexp(1.0, std::clamp(std::ilogb(largest), -1000, 1000)) : 1.0;
}

Decomposed decompose(const MatrixXd& A, const MatrixXd& A_error, const std::vector<Index>& states,
                     int max_iterations) {
  const MatrixXd error = A_error.size() > 0 ? MatrixXd(A_error(states, states)) : MatrixXd();
  Decomposed d = decompose(A(states, states), error, max_iterations);
  for (Index& k : d.balanced.order) k = states[std::size_t(k)];
  return d;
}

// In balanced coordinates, unless they worsen an ill-conditioned eigenvalue.
Decomposed join(const MatrixXd& A, const std::vector<Decomposed>& blocks,
                const VectorXcd& eigenvalues) {
  const double scale = unit(A);
  const MatrixXd scaled = A / scale;
  Decomposed d = join(scaled, blocks, eigenvalues, balance(scaled), scale);
  if (d.condition.maxCoeff() < ill_conditioned) return d;
  Decomposed plain = join(scaled, blocks, eigenvalues, as_given(scaled), scale);
  return plain.condition.maxCoeff() < d.condition.maxCoeff() ? plain : d;
}

MatrixXd product(const MatrixXd& A, const MatrixXd& B, const std::vector<Index>& ends) {
  constexpr Index narrow = 16;  // columns below which a product costs more than the zeros it skips
  const Index n = A.rows();
  if (n <= narrow || ends.size() == 1) return A * B;
  MatrixXd AB = MatrixXd::Zero(n, n);
  Index from = 0;
  for (const Index end : ends) {
    if (end - from < narrow && end < n) continue;
    AB.block(0, from, end, end - from).noalias() =
        A.topLeftCorner(end, end) * B.block(0, from, end, end - from);
    from = end;
  }
  return AB;
}

}  // namespace tiltrim
