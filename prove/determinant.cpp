// The determinant to second order in the numbers and the frequency, and what is beyond.
#include "prove/determinant.hpp"

#include <algorithm>
#include <array>
#include <functional>

#include "prove/permanents.hpp"

namespace tiltrim::proving {

using Eigen::Index;

// The least real part of v det(I - F) over the box.
double Value::floor(Complex v) const {
  double least = v.real() - std::abs(v) * rest;
  for (std::size_t k = 0; k < linear.size(); ++k) {
    least -= std::abs((v * linear[k]).real());
    for (std::size_t l = 0; l < k; ++l) least -= std::abs((v * quadratic[k][l]).real());
    least += std::min(0.0, (v * quadratic[k][k]).real());
  }
  return least;
}

namespace {

// The sum of all moduli for which the slack of count_roots covers the rounding.
constexpr double largest = 100.0;

using SmallC = dense::SmallComplexMatrix;

// Gauss and Jordan's inverse; any matrix near it serves.
SmallC near_inverse(SmallC A) {
  const Index n = A.rows();
  SmallC inverse = SmallC::Identity(n, n);
  for (Index k = 0; k < n; ++k) {
    Index pivot = k;
    for (Index i = k + 1; i < n; ++i)
      if (std::norm(A(i, k)) > std::norm(A(pivot, k))) pivot = i;
    A.row(k).swap(A.row(pivot));
    inverse.row(k).swap(inverse.row(pivot));
    const Complex over = 1.0 / A(k, k);
    A.row(k) *= over;
    inverse.row(k) *= over;
    for (Index i = 0; i < n; ++i) {
      if (i == k) continue;
      const Complex by = A(i, k);
      A.row(i) -= by * A.row(k);
      inverse.row(i) -= by * inverse.row(k);
    }
  }
  return inverse;
}

Complex trace_of_product(const SmallC& A, const SmallC& B) {
  return (A.transpose().array() * B.array()).sum();
}

// Sum of the moduli of the coefficients of third order in d of det(I - L - Q), where L = Σ d_k F_k
// and Q = Σ d_l d_m Q_lm:  those of tr L tr Q - tr L Q and of
//   -e₃(L) = -(tr³ L - 3 tr L tr L² + 2 tr L³) / 6,  by its polarization
double cubic_sum(const std::vector<SmallC>& F, const std::vector<SmallC>& Q) {
  const std::size_t n = F.size();
  std::vector<Complex> t, pairs(n * n), cubic(n * n * n);
  for (const SmallC& A : F) t.push_back(A.trace());
  for (std::size_t k = 0; k < n; ++k)
    for (std::size_t l = 0; l < n; ++l) pairs[k * n + l] = trace_of_product(F[k], F[l]);
  for (std::size_t k = 0; k < n; ++k)
    for (std::size_t l = 0; l <= k; ++l) {
      const SmallC FkFl = F[k] * F[l], FlFk = F[l] * F[k];
      const SmallC both = FkFl + FlFk;
      for (std::size_t m = 0; m <= l; ++m) {
        const Complex e3 = t[k] * t[l] * t[m] - t[k] * pairs[l * n + m] - t[l] * pairs[k * n + m] -
                           t[m] * pairs[k * n + l] + trace_of_product(F[m], both);
        const double same = k == m ? 6.0 : k == l || l == m ? 2.0 : 1.0;
        cubic[(k * n + l) * n + m] -= e3 / same;
      }
    }
  for (std::size_t l = 0, at = 0; at < Q.size(); ++l)
    for (std::size_t m = 0; m <= l; ++m, ++at)
      for (std::size_t k = 0; k < n; ++k) {
        std::array<std::size_t, 3> of{k, l, m};
        std::ranges::sort(of, std::greater{});
        cubic[(of[0] * n + of[1]) * n + of[2]] +=
            t[k] * Q[at].trace() - trace_of_product(F[k], Q[at]);
      }
  double sum = 0;
  for (const Complex c : cubic) sum += std::abs(c);
  return sum;
}

// |det(I - F)| without its terms of up to second order, where |F| <= linear + curved + rho.
double beyond(const Value& value, const std::vector<SmallC>& F, const std::vector<SmallC>& Q,
              const Small& linear, const Small& curved, const Small& rho) {
  const Index n = linear.rows();
  const Small phi = linear + curved + rho;
  const double all = permanent(phi + Small::Identity(n, n)), second = second_sum(phi);
  const double fourth = all - 1 - phi.trace() - second - third_sum(phi);
  const double third = third_sum(phi) - third_sum(linear) + cubic_sum(F, Q);
  const double cross = second_sum(linear + curved) - second_sum(linear) - second_sum(curved);
  const double mixed = second - second_sum(linear) - cross;
  const double size = 1 + value.total;
  return fourth + third + mixed + 1e-12 * (all + size * size * size);  // with the sums' rounding
}

// The terms of first and second order:
//   det(I - L - Q) = 1 - tr L + (tr² L - tr L²) / 2 - tr Q + ...
void add_traces(Value& value, const std::vector<SmallC>& F, const std::vector<SmallC>& Q) {
  for (std::size_t k = 0, bend = 0; k < F.size(); ++k) {
    value.linear.push_back(-F[k].trace());
    value.quadratic.emplace_back();
    for (std::size_t l = 0; l <= k; ++l) {
      const Complex q = value.linear[k] * value.linear[l] - trace_of_product(F[k], F[l]);
      value.quadratic[k].push_back((k == l ? 0.5 * q : q) - Q[bend++].trace());
    }
  }
}

// What each parameter adds, by which a box is cut.
std::vector<double> shares(const Value& value, const std::vector<SmallC>& F, std::size_t count) {
  std::vector<double> shares;
  for (std::size_t k = 0; k < count; ++k) {
    double share = std::abs(value.linear[k]) + 0.2 * F[k].cwiseAbs().sum() / double(F[k].rows());
    for (const Complex q : value.quadratic[k]) share += 0.5 * std::abs(q);
    shares.push_back(share);
  }
  return shares;
}

// H(t) = Σ H_j t^j, near the inverse of X + step t P for t in [-1, 1]; any matrices serve.
struct Inverse {
  std::vector<SmallC> H;
  Small error;   // |I - (X + step t P) H(t)| <= error
  Small moduli;  // Σ |H_j|
};

Inverse near_inverse(const SmallC& X, const SmallC& P, Complex step) {
  constexpr std::size_t terms = 5;
  const bool wide = step != 0.0;
  std::vector<SmallC> H{near_inverse(X)};
  if (wide)
    for (std::size_t j = 1; j < terms; ++j) H.push_back(-step * (H[0] * (P * H[j - 1])));
  Small error = (SmallC::Identity(X.rows(), X.rows()) - X * H[0]).cwiseAbs();
  Small moduli = H[0].cwiseAbs();
  for (std::size_t j = 1; j < H.size(); ++j) {
    error += (X * H[j] + step * (P * H[j - 1])).cwiseAbs();
    moduli += H[j].cwiseAbs();
  }
  if (wide) error += (step * (P * H.back())).cwiseAbs();
  return {H, error, moduli};
}

}  // namespace

Value value_at(const Family& f, double from, double to) {
  const Index n = f.B.rows();
  const double at = 0.5 * (from + to), half = (0.5 * (to - from)) * (1 + 4 * unit) + 4 * unit * to;
  const SmallC P = f.P.cast<Complex>(), X = (at * f.along) * P - f.E0.cast<Complex>();
  const Complex step = (from < to ? half : 0.0) * f.along;
  const Inverse inverse = near_inverse(X, P, step);
  const std::vector<SmallC>& H = inverse.H;
  Value value;
  // F = Σ d_k F_k + Σ d_k d_l Q_kl + ..., the last d is t.
  std::vector<SmallC> F, Q;
  Small curved = Small::Zero(n, n), high = curved;  // high: of third order and more
  for (const Small& A : f.curved) {
    Q.push_back(A.cast<Complex>() * H[0]);
    curved += Q.back().cwiseAbs();
    for (std::size_t j = 1; j < H.size(); ++j) high += (A.cast<Complex>() * H[j]).cwiseAbs();
  }
  for (const Small& E : f.E) {
    F.push_back(E.cast<Complex>() * H[0]);
    for (std::size_t j = 2; j < H.size(); ++j) high += (E.cast<Complex>() * H[j]).cwiseAbs();
  }
  if (from < to) {
    for (const Small& E : f.E) {
      Q.push_back(E.cast<Complex>() * H[1]);
      curved += Q.back().cwiseAbs();
    }
    F.push_back(SmallC::Zero(n, n));
    Q.push_back(F.back());
  }
  // Rounding of the products above, of s, and of the residual.
  double moduli =
      f.E0.cwiseAbs().maxCoeff() + 2 * to * f.P.cwiseAbs().maxCoeff() + f.bend_moduli.maxCoeff();
  for (const Small& E : f.E) moduli += E.cwiseAbs().maxCoeff();
  const double rounding = 64 * double(n * n) * unit * inverse.moduli.maxCoeff() * moduli;
  const Small rest = f.spread.array() + to * f.P_radius;
  Small rho = inverse.error + high + (rest + f.R) * inverse.moduli;
  rho.array() += rounding;
  // |tr(W R T H)| <= Σ |T H W|_ji R_ij
  value.weight = Small::Zero(n, n);
  for (const SmallC& own : H)
    value.weight += (f.T.cast<Complex>() * own * f.W.cast<Complex>()).cwiseAbs().transpose();
  double trace = (value.weight.array() * f.radius.array()).sum() * (1 + 1e-9) +
                 (rest * inverse.moduli).trace() + inverse.error.trace() + high.trace() +
                 double(n) * rounding * 2;
  trace += 64 * double(n * n) * unit *
           (f.T.cwiseAbs() * inverse.moduli * f.W.cwiseAbs()).maxCoeff() * f.radius.sum();
  trace = std::min(trace, rho.trace());
  Small linear = Small::Zero(n, n);
  for (const SmallC& A : F) linear += A.cwiseAbs();
  add_traces(value, F, Q);
  value.share = shares(value, F, f.E.size());
  value.total = (linear + curved + rho).sum();
  value.rest = beyond(value, F, Q, linear, curved, rho) + trace;
  if (!(value.total < largest)) value.rest = std::numeric_limits<double>::infinity();
  return value;
}

Direction best(const Value& value) {
  Direction best{value.floor(1.0), 1.0};
  const auto consider = [&](Complex v) {
    v /= std::abs(v);
    if (const double floor = value.floor(v); floor > best.floor) best = {floor, v};
  };
  if (best.floor > 0.3) return best;
  for (const Complex& t : value.linear) {
    if (std::abs(t) == 0) continue;
    const Complex v = Complex(0, 1) * std::conj(t);
    consider(v.real() > 0 ? v : -v);
    consider((v.real() > 0 ? v : -v) / std::abs(v) + 1.0);
  }
  return best;
}

}  // namespace tiltrim::proving
