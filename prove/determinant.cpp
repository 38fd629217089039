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

using Eigen::MatrixXd;
using SmallC = dense::SmallComplexMatrix;

// Complex matrices of n rows and columns in a grid of blocks, real and imaginary parts apart.
struct Blocks {
  Index n;
  MatrixXd re{}, im{};

  Blocks(Index size, Index rows, Index columns)
      : n(size), re(rows * n, columns * n), im(rows * n, columns * n) {}
  Index columns() const { return re.cols() / n; }
  auto real(Index i, Index j) const { return re.block(i * n, j * n, n, n); }
  auto imaginary(Index i, Index j) const { return im.block(i * n, j * n, n, n); }
  Complex trace(Index i, Index j) const { return {real(i, j).trace(), imaginary(i, j).trace()}; }
  void put(Index i, Index j, const SmallC& A) {
    re.block(i * n, j * n, n, n) = A.real();
    im.block(i * n, j * n, n, n) = A.imag();
  }
};

// The moduli of their entries; underflow is far below the rounding added to them.
MatrixXd moduli(const MatrixXd& re, const MatrixXd& im) {
  return (re.array().square() + im.array().square()).sqrt();
}

// tr A B of block i, j of A and block k, l of B
Complex trace_of_product(const Blocks& A, Index i, Index j, const Blocks& B, Index k, Index l) {
  const auto trace = [](const auto& a, const auto& b) {
    return (a.transpose().array() * b.array()).sum();
  };
  return {trace(A.real(i, j), B.real(k, l)) - trace(A.imaginary(i, j), B.imaginary(k, l)),
          trace(A.real(i, j), B.imaginary(k, l)) + trace(A.imaginary(i, j), B.real(k, l))};
}

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

// H(t) = Σ H_j t^j, near the inverse of X + step t P for t in [-1, 1]; any matrices serve.
Blocks near_inverse(const Family& f, Complex s, Complex step) {
  constexpr Index terms = 5;
  const SmallC P = f.P.cast<Complex>();
  SmallC own = near_inverse(s * P - f.E0.cast<Complex>());
  Blocks H(P.rows(), 1, step != 0.0 ? terms : 1);
  H.put(0, 0, own);
  if (H.columns() == 1) return H;
  const SmallC next = -step * (own * P);
  for (Index j = 1; j < terms; ++j) H.put(0, j, own = next * own);
  return H;
}

// The products of the family's matrices with all H_j. Rows: E_k, the curved ones, E0, P, T.
struct Products {
  Index linear, curved;  // how many
  Blocks of;
  MatrixXd moduli;

  Index E0() const { return linear + curved; }
  Index P() const { return linear + curved + 1; }
  Index T() const { return linear + curved + 2; }
  auto modulus(Index i, Index j) const { return moduli.block(i * of.n, j * of.n, of.n, of.n); }
};

Products products(const Family& f, const Blocks& H) {
  const Index n = H.n, linear = std::ssize(f.E), curved = std::ssize(f.curved);
  MatrixXd all((linear + curved + 3) * n, n);
  Index at = 0;
  const auto add = [&](const Small& A) { all.middleRows(n * at++, n) = A; };
  for (const Small& A : f.E) add(A);
  for (const Small& A : f.curved) add(A);
  for (const Small* A : {&f.E0, &f.P, &f.T}) add(*A);
  Blocks of(n, at, H.columns());
  of.re = all * H.re;
  of.im = all * H.im;
  return {linear, curved, of, moduli(of.re, of.im)};
}

// |I - (X + step t P) H(t)|, X = s P - E0
Small error_of(const Products& p, Complex s, Complex step) {
  const Index n = p.of.n, terms = p.of.columns();
  const auto term = [&](Index j) {  // of t^j
    MatrixXd re = MatrixXd::Zero(n, n), im = re;
    if (j == 0) re.setIdentity();
    const auto subtract = [&](Complex by, Index row, Index column) {
      re -= by.real() * p.of.real(row, column) - by.imag() * p.of.imaginary(row, column);
      im -= by.real() * p.of.imaginary(row, column) + by.imag() * p.of.real(row, column);
    };
    if (j < terms) subtract(s, p.P(), j);
    if (j < terms) subtract(-1.0, p.E0(), j);
    if (j > 0) subtract(step, p.P(), j - 1);
    return moduli(re, im);
  };
  Small error = term(0);
  for (Index j = 1; terms > 1 && j <= terms; ++j) error += term(j);
  return error;
}

// A matrix Q_lm of F = Σ d_k F_k + Σ d_l d_m Q_lm + ..., m <= l, where in the products; the last d
// is t, without F_k of its own.
struct Bend {
  Index l, m, row, column;
};

std::vector<Bend> bends(const Products& p) {
  std::vector<Bend> all;
  for (Index l = 0, at = p.linear; l < p.linear && p.curved > 0; ++l)
    for (Index m = 0; m <= l; ++m) all.push_back({l, m, at++, 0});
  for (Index l = 0; l < p.linear && p.of.columns() > 1; ++l) all.push_back({p.linear, l, l, 1});
  return all;
}

// Sum of the moduli of the coefficients of third order in d of det(I - L - Q), where L = Σ d_k F_k
// and Q = Σ d_l d_m Q_lm:  those of tr L tr Q - tr L Q and of
//   -e₃(L) = -(tr³ L - 3 tr L tr L² + 2 tr L³) / 6,  by its polarization
double cubic_sum(const Products& p, const std::vector<Complex>& t, const Blocks& FF) {
  const Index k_all = p.linear, n = k_all + 1;
  std::vector<Complex> cubic(std::size_t(n * n * n));
  const auto of = [&](Index k, Index l, Index m) -> Complex& {
    std::array<Index, 3> at{k, l, m};
    std::ranges::sort(at, std::greater{});
    return cubic[std::size_t((at[0] * n + at[1]) * n + at[2])];
  };
  const auto trace = [&](Index k) { return t[std::size_t(k)]; };
  for (Index k = 0; k < k_all; ++k)
    for (Index l = 0; l <= k; ++l)
      for (Index m = 0; m <= l; ++m) {
        const Complex e3 = trace(k) * trace(l) * trace(m) - trace(k) * FF.trace(l, m) -
                           trace(l) * FF.trace(k, m) - trace(m) * FF.trace(k, l) +
                           trace_of_product(p.of, m, 0, FF, k, l) +
                           trace_of_product(p.of, m, 0, FF, l, k);
        of(k, l, m) -= e3 / (k == m ? 6.0 : k == l || l == m ? 2.0 : 1.0);
      }
  for (const Bend& b : bends(p))
    for (Index k = 0; k < k_all; ++k)
      of(k, b.l, b.m) += trace(k) * p.of.trace(b.row, b.column) -
                         trace_of_product(p.of, k, 0, p.of, b.row, b.column);
  double sum = 0;
  for (const Complex c : cubic) sum += std::abs(c);
  return sum;
}

// All F_k F_l.
Blocks pairs(const Products& p) {
  const Index n = p.of.n, k = p.linear;
  const MatrixXd re = p.of.re.topLeftCorner(k * n, n), im = p.of.im.topLeftCorner(k * n, n);
  MatrixXd beside_re(n, k * n), beside_im(n, k * n);
  for (Index i = 0; i < k; ++i) {
    beside_re.middleCols(i * n, n) = re.middleRows(i * n, n);
    beside_im.middleCols(i * n, n) = im.middleRows(i * n, n);
  }
  Blocks all(n, k, k);
  all.re = re * beside_re - im * beside_im;
  all.im = re * beside_im + im * beside_re;
  return all;
}

// |det(I - F)| without its terms of up to second order, where |F| <= linear + curved + rho.
double beyond(double total, double cubic, const Small& linear, const Small& curved,
              const Small& rho) {
  const Index n = linear.rows();
  const Small phi = linear + curved + rho;
  const double all = permanent(phi + Small::Identity(n, n)), second = second_sum(phi);
  const double fourth = all - 1 - phi.trace() - second - third_sum(phi);
  const double third = third_sum(phi) - third_sum(linear) + cubic;
  const double cross = second_sum(linear + curved) - second_sum(linear) - second_sum(curved);
  const double mixed = second - second_sum(linear) - cross;
  const double size = 1 + total;
  return fourth + third + mixed + 1e-12 * (all + size * size * size);  // with the sums' rounding
}

// The terms of first and second order:
//   det(I - L - Q) = 1 - tr L + (tr² L - tr L²) / 2 - tr Q + ...
void add_traces(Value& value, const Products& p, const std::vector<Complex>& t, const Blocks& FF) {
  for (std::size_t k = 0; k < t.size(); ++k) {
    value.linear.push_back(-t[k]);
    value.quadratic.emplace_back();
    for (std::size_t l = 0; l <= k; ++l) {
      const Complex q = t[k] * t[l] - FF.trace(Index(k), Index(l));
      value.quadratic[k].push_back(k == l ? 0.5 * q : q);
    }
  }
  if (p.of.columns() > 1) {
    value.linear.push_back(0.0);
    value.quadratic.emplace_back(t.size() + 1);
  }
  for (const Bend& b : bends(p))
    value.quadratic[std::size_t(b.l)][std::size_t(b.m)] -= p.of.trace(b.row, b.column);
}

// What each parameter adds, by which a box is cut.
std::vector<double> shares(const Value& value, const Products& p) {
  std::vector<double> shares;
  for (Index k = 0; k < p.linear; ++k) {
    const std::size_t own = std::size_t(k);
    double share = std::abs(value.linear[own]) + 0.2 * p.modulus(k, 0).sum() / double(p.of.n);
    for (const Complex q : value.quadratic[own]) share += 0.5 * std::abs(q);
    shares.push_back(share);
  }
  return shares;
}

// Σ_j |T H_j W|ᵀ: of |tr(W R T H)| <= Σ |T H W|_ji R_ij.
Small weight_of(const Products& p, const Small& W) {
  const Index n = p.of.n, terms = p.of.columns();
  MatrixXd re(terms * n, n), im(terms * n, n);
  for (Index j = 0; j < terms; ++j) {
    re.middleRows(j * n, n) = p.of.real(p.T(), j);
    im.middleRows(j * n, n) = p.of.imaginary(p.T(), j);
  }
  const MatrixXd w = W, all = moduli(re * w, im * w);
  Small sum = Small::Zero(n, n);
  for (Index j = 0; j < terms; ++j) sum += all.middleRows(j * n, n).transpose();
  return sum;
}

Small moduli_of(const Blocks& H) {
  const MatrixXd all = moduli(H.re, H.im);
  Small sum = all.leftCols(H.n);
  for (Index j = 1; j < H.columns(); ++j) sum += all.middleCols(j * H.n, H.n);
  return sum;
}

}  // namespace

Value value_at(const Family& f, double from, double to) {
  const Index n = f.B.rows();
  const double at = 0.5 * (from + to), half = (0.5 * (to - from)) * (1 + 4 * unit) + 4 * unit * to;
  const Complex s = at * f.along, step = (from < to ? half : 0.0) * f.along;
  const Blocks H = near_inverse(f, s, step);
  const Products p = products(f, H);
  const Small inverse = moduli_of(H), error = error_of(p, s, step);
  // F = Σ d_k F_k + Σ d_k d_l Q_kl + ..., the last d is t; high: of third order and more.
  Small linear = Small::Zero(n, n), curved = linear, high = linear;
  std::vector<Complex> traces;
  for (Index k = 0; k < p.linear; ++k) {
    traces.push_back(p.of.trace(k, 0));
    linear += p.modulus(k, 0);
    if (H.columns() > 1) curved += p.modulus(k, 1);
    for (Index j = 2; j < H.columns(); ++j) high += p.modulus(k, j);
  }
  for (Index k = p.linear; k < p.E0(); ++k) {
    curved += p.modulus(k, 0);
    for (Index j = 1; j < H.columns(); ++j) high += p.modulus(k, j);
  }
  // Rounding of the products above, of s, and of the residual.
  double moduli =
      f.E0.cwiseAbs().maxCoeff() + 2 * to * f.P.cwiseAbs().maxCoeff() + f.bend_moduli.maxCoeff();
  for (const Small& E : f.E) moduli += E.cwiseAbs().maxCoeff();
  const double rounding = 64 * double(n * n) * unit * inverse.maxCoeff() * moduli;
  const Small rest = f.spread.array() + to * f.P_radius;
  Small rho = error + high + (rest + f.R) * inverse;
  rho.array() += rounding;
  Value value;
  value.weight = weight_of(p, f.W);
  double trace = (value.weight.array() * f.radius.array()).sum() * (1 + 1e-9) +
                 (rest * inverse).trace() + error.trace() + high.trace() + double(n) * rounding * 2;
  trace += 64 * double(n * n) * unit * (f.T.cwiseAbs() * inverse * f.W.cwiseAbs()).maxCoeff() *
           f.radius.sum();
  trace = std::min(trace, rho.trace());
  const Blocks FF = pairs(p);
  add_traces(value, p, traces, FF);
  value.share = shares(value, p);
  value.total = (linear + curved + rho).sum();
  value.rest = beyond(value.total, cubic_sum(p, traces, FF), linear, curved, rho) + trace;
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
