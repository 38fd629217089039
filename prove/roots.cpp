// The roots right of a line, for every matrix of a family: zero excluded from a determinant.
#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <complex>
#include <functional>
#include <numeric>

#include "dense/dense.hpp"
#include "prove/parts.hpp"
#include "prove/permanents.hpp"

namespace tiltrim::proving {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using Complex = std::complex<double>;
using Eigen::MatrixXcd;

namespace {

constexpr double unit = std::numeric_limits<double>::epsilon() / 2;
constexpr double slack = 0.05;     // left for a checker with slightly wider remainders
constexpr double largest = 100.0;  // sum of all moduli for which `slack` covers the rounding

// At most 16 rows, without allocation.
using Small = dense::SmallMatrix;
using SmallC =
    Eigen::Matrix<Complex, Eigen::Dynamic, Eigen::Dynamic, 0, dense::small_size, dense::small_size>;

// B(d) = B_0 + Σ d_k A_k + Σ d_k d_l A_kl + R with R within `radius`, and W B T, W T for a basis T.
struct Family {
  Small B;
  std::vector<Small> A, bends;  // bends: A_kl, row by row of the lower triangle
  Small radius;
  Small T, W;
  Small E0, P;                   // middles of W B_0 T and W T
  std::vector<Small> E, curved;  // of W A_k T, W A_kl T
  Small spread;                  // radius of all of W B T, without R's
  Small bend_moduli;             // Σ |W A_kl T|
  Small R;                       // |W| radius |T|
  double P_radius = 0;
};

// |error| of a product of n terms: n u times the product of moduli, generously.
Small transformed(const Family& f, const Small& A, Small& error) {
  const double n = double(A.rows());
  error += 8 * n * unit * (f.W.cwiseAbs() * A.cwiseAbs() * f.T.cwiseAbs());
  return f.W * A * f.T;
}

// A over the tube, and the margin.
Family family(const Setup& s, const Tube& tube, double margin) {
  const Index n = Index(s.states);
  Family f;
  f.B = f.radius = Small::Zero(n, n);
  f.A.assign(s.k(), f.B);
  f.bends.assign(s.k() * (s.k() + 1) / 2, f.B);
  for (Index i = 0; i < n; ++i)
    for (Index j = 0; j < n; ++j) {
      const Quadratic entry = tube.over[std::size_t(i)].slope(std::size_t(j));
      f.B(i, j) = entry.centre() + (i == j ? margin : 0.0);
      f.radius(i, j) = (entry.rest() + 2 * unit * std::abs(f.B(i, j))) * (1 + 1e-12);
      for (std::size_t k = 0, at = 0; k < s.k(); ++k) {
        f.A[k](i, j) = entry.slope(k);
        for (std::size_t l = 0; l <= k; ++l) f.bends[at++](i, j) = entry.bend(k, l);
      }
    }
  return f;
}

// Eigenvectors; of a pair an orthonormal basis of its plane; nearly parallel ones orthonormal.
MatrixXd basis(const MatrixXd& B) {
  const dense::Eigensystem solved = dense::eigensystem(B);
  if (!solved.converged) return MatrixXd::Identity(B.rows(), B.cols());
  const MatrixXcd& V = solved.V;
  MatrixXd T(B.rows(), B.cols());
  for (Index j = 0; j < T.cols(); ++j) {
    if (solved.values[j].imag() != 0 && j + 1 < T.cols()) {
      T.col(j) = V.col(j).real();
      T.col(j + 1) = V.col(j).imag();
      ++j;
    } else {
      T.col(j) = V.col(j).real();
    }
  }
  for (Index j = 0; j < T.cols(); ++j) {
    T.col(j).normalize();
    const bool second = j > 0 && solved.values[j].imag() < 0;
    for (Index i = 0; i < j; ++i) {
      const double along = T.col(i).dot(T.col(j));
      if ((second && i == j - 1) || std::abs(along) > 0.95) T.col(j) -= along * T.col(i);
    }
    T.col(j).normalize();
  }
  return T;
}

// W for which W A_k, W A_kl have few rows: those that others determine, but for a small part, are
// replaced by that part. Of the tiltrotor these are the rates of the integrals, which follow V'.
Small few_rows(const Family& f) {
  const Index n = f.B.rows();
  MatrixXd left(n, n * std::ssize(f.A) + n * std::ssize(f.bends));
  Index at = 0;
  for (const auto* of : {&f.A, &f.bends})
    for (const Small& A : *of) {
      left.middleCols(at, n) = A;
      at += n;
    }
  const VectorXd before = left.rowwise().lpNorm<1>();
  Small W = Small::Identity(n, n), reduced = W;
  std::vector<Index> order(static_cast<std::size_t>(n));
  std::iota(order.begin(), order.end(), 0);
  std::ranges::sort(order, std::greater{}, [&](Index i) { return before[i]; });
  std::vector<std::pair<Index, Index>> pivots;  // row and column
  for (const Index i : order) {
    for (const auto& [row, column] : pivots) {
      const double by = left(i, column) / left(row, column);
      left.row(i) -= by * left.row(row);
      reduced.row(i) -= by * reduced.row(row);
    }
    constexpr double small = 0.1, nothing = 1e-12;
    const double remains = left.row(i).lpNorm<1>();
    if (remains <= small * before[i]) W.row(i) = reduced.row(i);
    if (!(remains > nothing * before[i])) continue;
    Index column = 0;
    left.row(i).cwiseAbs().maxCoeff(&column);
    pivots.emplace_back(i, column);
  }
  return W;
}

enum class Basis { plain, few_rows, eigenvectors };

void transform(Family& f, Basis of) {
  const Index n = f.B.rows();
  f.T = Small::Identity(n, n);
  f.W = f.T;
  if (of == Basis::eigenvectors) f.T = basis(f.B);
  if (of == Basis::few_rows) f.T = dense::solve(MatrixXd(few_rows(f)), MatrixXd::Identity(n, n));
  if (of != Basis::plain) f.W = dense::solve(MatrixXd(f.T), MatrixXd::Identity(n, n));
  f.E.clear();
  f.curved.clear();
  f.spread = Small::Zero(n, n);
  f.E0 = transformed(f, f.B, f.spread);
  for (const Small& A : f.A) f.E.push_back(transformed(f, A, f.spread));
  f.bend_moduli = Small::Zero(n, n);
  for (const Small& A : f.bends) {
    f.curved.push_back(transformed(f, A, f.spread));
    f.bend_moduli += f.curved.back().cwiseAbs();
  }
  const Small error = 8 * double(n) * unit * (f.W.cwiseAbs() * f.T.cwiseAbs());
  f.P = f.W * f.T;
  f.P_radius = error.maxCoeff() * (1 + 1e-12);
  f.R = f.W.cwiseAbs() * f.radius * f.T.cwiseAbs();
}

// A frequency beyond which no member has a root: ‖T⁻¹ B T‖ with T⁻¹ = (W T)⁻¹ W.
double root_bound(const Family& f) {
  Small sum = f.E0.cwiseAbs() + f.spread + f.R + f.bend_moduli;
  for (const Small& E : f.E) sum += E.cwiseAbs();
  const double n = double(f.P.rows());
  const double off =
      (f.P - Small::Identity(f.P.rows(), f.P.cols())).cwiseAbs().rowwise().sum().maxCoeff() +
      n * f.P_radius;
  if (!(off < 0.5)) return std::numeric_limits<double>::infinity();
  return sum.rowwise().sum().maxCoeff() / (1 - off) * 1.001;
}

// I - F = (i w W T - W B(d) T) H(w) on an interval of frequencies.
struct Value {
  std::vector<Complex> linear;                  // of each parameter, and of the frequency
  std::vector<std::vector<Complex>> quadratic;  // lower triangle
  double rest = 0;
  double total = 0;
  std::vector<double> share;  // of each parameter
  Small weight;               // of R
  double floor(Complex v) const;
};

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

Value value_at(const Family& f, double from, double to) {
  const Index n = f.B.rows();
  const double at = 0.5 * (from + to), half = (0.5 * (to - from)) * (1 + 4 * unit) + 4 * unit * to;
  const SmallC P = f.P.cast<Complex>(), X = Complex(0, at) * P - f.E0.cast<Complex>();
  const Complex step(0, from < to ? half : 0.0);
  // H(t) = Σ H_j t^j, near the inverse of X + step t P for t in [-1, 1]; any matrices serve.
  constexpr std::size_t terms = 5;
  std::vector<SmallC> H{near_inverse(X)};
  if (from < to)
    for (std::size_t j = 1; j < terms; ++j) H.push_back(-step * (H[0] * (P * H[j - 1])));
  // |I - (X + step t P) H(t)| <= inverse
  Small inverse = (SmallC::Identity(n, n) - X * H[0]).cwiseAbs();
  Small Ha = H[0].cwiseAbs();
  for (std::size_t j = 1; j < H.size(); ++j) {
    inverse += (X * H[j] + step * (P * H[j - 1])).cwiseAbs();
    Ha += H[j].cwiseAbs();
  }
  if (from < to) inverse += (step * (P * H.back())).cwiseAbs();
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
  // Rounding of the products above, and of the residual.
  double moduli =
      f.E0.cwiseAbs().maxCoeff() + 2 * to * f.P.cwiseAbs().maxCoeff() + f.bend_moduli.maxCoeff();
  for (const Small& E : f.E) moduli += E.cwiseAbs().maxCoeff();
  const double rounding = 64 * double(n * n) * unit * Ha.maxCoeff() * moduli;
  const Small rest = f.spread.array() + to * f.P_radius;
  Small rho = inverse + high + (rest + f.R) * Ha;
  rho.array() += rounding;
  // |tr(W R T H)| <= Σ |T H W|_ji R_ij
  value.weight = Small::Zero(n, n);
  for (const SmallC& own : H)
    value.weight += (f.T.cast<Complex>() * own * f.W.cast<Complex>()).cwiseAbs().transpose();
  double trace = (value.weight.array() * f.radius.array()).sum() * (1 + 1e-9) +
                 (rest * Ha).trace() + inverse.trace() + high.trace() + double(n) * rounding * 2;
  trace += 64 * double(n * n) * unit * (f.T.cwiseAbs() * Ha * f.W.cwiseAbs()).maxCoeff() *
           f.radius.sum();
  trace = std::min(trace, rho.trace());
  Small linear = Small::Zero(n, n);
  for (std::size_t k = 0, bend = 0; k < F.size(); ++k) {
    linear += F[k].cwiseAbs();
    value.linear.push_back(-F[k].trace());
    value.quadratic.emplace_back();
    for (std::size_t l = 0; l <= k; ++l) {
      const Complex q = value.linear[k] * value.linear[l] - trace_of_product(F[k], F[l]);
      value.quadratic[k].push_back((k == l ? 0.5 * q : q) - Q[bend++].trace());
    }
  }
  for (std::size_t k = 0; k < f.E.size(); ++k) {
    double share = std::abs(value.linear[k]) + 0.2 * F[k].cwiseAbs().sum() / double(n);
    for (const Complex q : value.quadratic[k]) share += 0.5 * std::abs(q);
    value.share.push_back(share);
  }
  value.total = (linear + curved + rho).sum();
  value.rest = beyond(value, F, Q, linear, curved, rho) + trace;
  if (!(value.total < largest)) value.rest = std::numeric_limits<double>::infinity();
  return value;
}

struct Direction {
  double floor;
  Complex v;
};

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

// Roots right of the axis of one matrix, by discs of its pencil s W V - W B V, homotopic to the
// diagonal: on s = i w, |s - λ_i| > Σ_j |s| |P_ij| + |Q_ij|. Negative: not certified.
int roots_of(const MatrixXd& B) {
  const dense::Eigensystem solved = dense::eigensystem(B);
  if (!solved.converged) return -1;
  const MatrixXcd &V = solved.V, W = dense::inverse(V);
  const Index n = B.rows();
  const MatrixXcd P = W * V - MatrixXcd::Identity(n, n);
  const MatrixXcd Q = W * B.cast<Complex>() * V - MatrixXcd(solved.values.asDiagonal());
  const MatrixXd Wa = W.cwiseAbs(), Va = V.cwiseAbs();
  const double rounding = 64 * double(n * n) * unit;
  const VectorXd p = (P.cwiseAbs() + rounding * (Wa * Va)).rowwise().sum();
  const VectorXd q = (Q.cwiseAbs() + rounding * (Wa * B.cwiseAbs() * Va)).rowwise().sum() +
                     rounding * solved.values.cwiseAbs();
  int count = 0;
  for (Index i = 0; i < n; ++i) {
    const Complex at = solved.values[i];
    const bool clear =
        p[i] < 0.5 && std::abs(at.real()) > 1.5 * (p[i] * std::abs(at.imag()) + q[i]);
    if (!clear) return -1;
    count += at.real() > 0;
  }
  return count;
}

}  // namespace

bool count_roots(const Setup& s, Tube& tube, double margin, Failure& failure) {
  Family f = family(s, tube, margin);
  const auto refuse = [&](const char* cause, const std::vector<double>& share,
                          const Small& weight = {}) {
    failure = {cause, -1, Eigen::Map<const VectorXd>(share.data(), std::ssize(share)), weight};
    return false;
  };
  std::vector<double> widths;
  for (std::size_t k = 0; k < s.k(); ++k) widths.push_back(f.A[k].norm());
  if (!f.B.allFinite() || !f.radius.allFinite()) return refuse("width", widths);
  Family plain = f;
  Family rows = f;
  transform(plain, Basis::plain);
  transform(rows, Basis::few_rows);
  transform(f, Basis::eigenvectors);
  const double end = std::min(root_bound(f), root_bound(plain));
  if (!std::isfinite(end)) return refuse("width", widths);
  Record& r = tube.record;
  r.roots = roots_of(f.B);  // zero is excluded for all remainders in the radius, so for none
  if (r.roots < 0) return refuse("crossing", widths);
  r.T = f.T;
  r.w = {0.0};
  r.v.clear();
  double step = end / 64;
  while (r.w.back() < end) {
    const double from = r.w.back();
    Value value = value_at(rows, from, from + step);
    Direction direction = best(value);
    if (direction.floor < slack) {
      const Value other = value_at(f, from, from + step);
      if (const Direction own = best(other); own.floor > direction.floor) {
        value = other;
        direction = own;
      }
    }
    if (direction.floor >= slack) {
      r.w.push_back(from + step);
      r.v.push_back(direction.v);
      step *= direction.floor > 0.4 ? 3 : 1.5;
      if (r.v.size() > 2000) return refuse("width", value.share, value.weight);
      continue;
    }
    Value still = value_at(rows, from, from);
    if (best(still).floor < 1.2 * slack) still = value_at(f, from, from);
    if (best(still).floor < 1.2 * slack) return refuse("crossing", still.share, still.weight);
    step *= 0.4;
    if (step < 1e-9 * end && step < 1e-6 * from)
      return refuse("crossing", still.share, still.weight);
    if (step < 1e-14 * end) return refuse("crossing", still.share, still.weight);
  }
  return true;
}

}  // namespace tiltrim::proving
