// The roots right of a line and outside a sector, for every matrix of a family: zero excluded from
// a determinant.
#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <functional>
#include <numeric>

#include "dense/dense.hpp"
#include "prove/determinant.hpp"
#include "prove/parts.hpp"

namespace tiltrim::proving {

using Eigen::Index;
using Eigen::MatrixXcd;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

constexpr double slack = 0.05;  // left for a checker with slightly wider remainders

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

// Eigenvalues λ_i of one matrix, and the discs of its pencil s W V - W B V, homotopic to the
// diagonal: s is no root if |s - λ_i| > Σ_j |s| |P_ij| + |Q_ij|, at most p_i |s| + q_i, for all i.
struct Discs {
  Eigen::VectorXcd values;  // empty: not known
  VectorXd p, q;
};

Discs discs_of(const MatrixXd& B) {
  const dense::Eigensystem solved = dense::eigensystem(B);
  if (!solved.converged) return {};
  const MatrixXcd &V = solved.V, W = dense::inverse(V);
  const Index n = B.rows();
  const MatrixXcd P = W * V - MatrixXcd::Identity(n, n);
  const MatrixXcd Q = W * B.cast<Complex>() * V - MatrixXcd(solved.values.asDiagonal());
  const MatrixXd Wa = W.cwiseAbs(), Va = V.cwiseAbs();
  const double rounding = 64 * double(n * n) * unit;
  return {solved.values, (P.cwiseAbs() + rounding * (Wa * Va)).rowwise().sum(),
          (Q.cwiseAbs() + rounding * (Wa * B.cwiseAbs() * Va)).rowwise().sum() +
              rounding * solved.values.cwiseAbs()};
}

// Roots right of the axis. Negative: not certified.
int roots_right(const Discs& d) {
  if (d.values.size() == 0) return -1;
  int count = 0;
  for (Index i = 0; i < d.values.size(); ++i) {
    const Complex at = d.values[i];
    const bool clear =
        d.p[i] < 0.5 && std::abs(at.real()) > 1.5 * (d.p[i] * std::abs(at.imag()) + d.q[i]);
    if (!clear) return -1;
    count += at.real() > 0;
  }
  return count;
}

// Roots right of the ray s = w along, w >= 0, and its conjugate. On them |s| <= |λ| + |s - λ|: with
// p < 1/2, s is in no disc if |s - λ| > 2 (p |λ| + q).
int roots_outside(const Discs& d, Complex along) {
  if (d.values.size() == 0) return -1;
  int count = 0;
  for (Index i = 0; i < d.values.size(); ++i) {
    const Complex at(d.values[i].real(), std::abs(d.values[i].imag()));  // the upper ray is nearer
    const Complex turned = at * std::conj(along);
    const double distance = turned.real() > 0 ? std::abs(turned.imag()) : std::abs(at);
    if (!(d.p[i] < 0.5 && distance > 3 * (d.p[i] * std::abs(at) + d.q[i]))) return -1;
    count += turned.imag() < 0;
  }
  return count;
}

// The family in the two bases that prove most.
struct Bases {
  Family own, rows;  // eigenvectors; few rows
  double end;        // no member has a root of this modulus; infinite: not known
};

Bases bases_of(Family f, Complex along) {
  f.along = along;
  Family plain = f, rows = f;
  transform(plain, Basis::plain);
  transform(rows, Basis::few_rows);
  transform(f, Basis::eigenvectors);
  const double end = std::min(root_bound(f), root_bound(plain));
  return {std::move(f), std::move(rows), end};
}

// Directions on intervals of w that prove that no member has a root s = w along, w >= 0; false with
// failure if there are none.
bool exclude(const Bases& bases, std::vector<double>& w, std::vector<Complex>& v,
             Failure& failure) {
  const auto refuse = [&](const char* cause, const Value& value) {
    failure = {cause, -1, Eigen::Map<const VectorXd>(value.share.data(), std::ssize(value.share)),
               value.weight};
    return false;
  };
  constexpr std::size_t most = 2000;  // intervals
  const double end = bases.end;
  w = {0.0};
  v.clear();
  double step = end / 64;
  while (w.back() < end) {
    const double from = w.back();
    Value value = value_at(bases.rows, from, from + step);
    Direction direction = best(value);
    if (direction.floor < slack) {
      const Value other = value_at(bases.own, from, from + step);
      if (const Direction own = best(other); own.floor > direction.floor) {
        value = other;
        direction = own;
      }
    }
    if (direction.floor >= slack) {
      w.push_back(from + step);
      v.push_back(direction.v);
      step *= direction.floor > 0.4 ? 3 : 1.5;
      if (v.size() > most) return refuse("width", value);
      continue;
    }
    Value fixed = value_at(bases.rows, from, from);
    if (best(fixed).floor < 1.2 * slack) fixed = value_at(bases.own, from, from);
    if (best(fixed).floor < 1.2 * slack) return refuse("crossing", fixed);
    step *= 0.4;
    if (step < 1e-9 * end && step < 1e-6 * from) return refuse("crossing", fixed);
    if (step < 1e-14 * end) return refuse("crossing", fixed);
  }
  return true;
}

}  // namespace

bool count_roots(const Setup& s, Tube& tube, const Required& required, Failure& failure) {
  const Family f = family(s, tube, required.margin);
  std::vector<double> widths;
  for (std::size_t k = 0; k < s.k(); ++k) widths.push_back(f.A[k].norm());
  const auto refuse = [&](const char* cause) {
    failure = {cause, -1, Eigen::Map<const VectorXd>(widths.data(), std::ssize(widths)), {}};
    return false;
  };
  if (!f.B.allFinite() || !f.radius.allFinite()) return refuse("width");
  const Bases line = bases_of(f, {0, 1});
  if (!std::isfinite(line.end)) return refuse("width");
  Record& r = tube.record;
  r.roots = roots_right(discs_of(f.B));  // zero is excluded for all remainders in the radius
  if (r.roots < 0) return refuse("crossing");
  r.T = line.own.T;
  if (!exclude(line, r.w, r.v, failure)) return false;
  if (required.damping == 0) return true;
  const Complex along(-required.damping, std::sqrt(1 - required.damping * required.damping));
  const Family unmoved = family(s, tube, 0);
  const Bases ray = bases_of(unmoved, along);
  if (!std::isfinite(ray.end)) return refuse("width");
  r.outside = roots_outside(discs_of(unmoved.B), along);
  if (r.outside < 0) return refuse("crossing");
  return exclude(ray, r.ray_w, r.ray_v, failure);
}

}  // namespace tiltrim::proving
