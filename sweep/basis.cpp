#include "sweep/basis.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <stdexcept>
#include <utility>

#include "dense/known_size.hpp"

namespace tiltrim {

using dense::SmallMatrix;
using Eigen::Index;

namespace {

Kinds kinds(Spectrum lambda) {
  const int n = int(lambda.size());
  Kinds k;
  k.partner.resize(lambda.size(), -1);
  for (int i = 0; i < n; ++i) {
    if (lambda[i].imag() == 0) {
      k.reals.push_back(i);
      k.partner[i] = i;
    }
    if (!(lambda[i].imag() > 0)) continue;
    int nearest = -1;
    for (int j = 0; j < n; ++j) {
      if (!(lambda[j].imag() < 0) || k.partner[j] >= 0) continue;
      const auto miss = [&](int of) { return distance2(lambda[of], std::conj(lambda[i])); };
      if (nearest < 0 || miss(j) < miss(nearest)) nearest = j;
    }
    if (nearest < 0) break;
    k.pairs.push_back({i, nearest});
    k.partner[i] = nearest;
    k.partner[nearest] = i;
  }
  if (std::ranges::find(k.partner, -1) != k.partner.end())
    throw std::invalid_argument("link: complex eigenvalues are not in conjugate pairs");
  return k;
}

// The permutation p that minimizes Σ cost(i, p(i)). Rows are added one by one, each along the
// shortest path of reduced costs cᵢⱼ - uᵢ - vⱼ >= 0 to a free column. Ties: the first.      [37]
PerMode<int> shortest_paths(const SmallMatrix& cost) {
  constexpr std::size_t most = dense::small_size + 1;
  const int n = int(cost.rows());
  std::array<double, most> u{}, v{};
  std::array<int, most> row;  // of each column; the path starts at column n
  row.fill(-1);
  for (int i = 0; i < n; ++i) {
    std::array<double, most> length;
    std::array<int, most> before;
    std::array<bool, most> reached{};
    length.fill(infinity);
    before.fill(n);
    int j = n;
    row[n] = i;
    while (row[j] >= 0) {
      reached[j] = true;
      int next = n;
      for (int k = 0; k < n; ++k) {
        if (reached[k]) continue;
        const double reduced = cost(row[j], k) - u[row[j]] - v[k];
        if (reduced < length[k]) {
          length[k] = reduced;
          before[k] = j;
        }
        if (next == n || length[k] < length[next]) next = k;
      }
      const double step = length[next];
      for (int k = 0; k <= n; ++k) {
        if (reached[k]) {
          u[row[k]] += step;
          v[k] -= step;
        } else {
          length[k] -= step;
        }
      }
      j = next;
    }
    for (; j != n; j = before[j]) row[j] = row[before[j]];
  }
  PerMode<int> to(n);
  for (int j = 0; j < n; ++j) to[row[j]] = j;
  return to;
}

// The same, at once if every row has one smallest cost, in a column of its own.
PerMode<int> assign(const SmallMatrix& cost) {
  const int n = int(cost.rows());
  PerMode<int> to(n);
  std::array<bool, dense::small_size> taken{};
  for (int i = 0; i < n; ++i) {
    int best = 0;
    double second = infinity;
    for (int j = 1; j < n; ++j) {
      const bool less = cost(i, j) < cost(i, best);
      second = std::min(second, less ? cost(i, best) : cost(i, j));
      if (less) best = j;
    }
    if (!(cost(i, best) < second) || std::exchange(taken[best], true)) return shortest_paths(cost);
    to[i] = best;
  }
  return to;
}

// Each eigenvector on its own, at its known eigenvalue; false if two are close to each other.
bool one_by_one(const SmallMatrix& balanced, Spectrum lambda, Basis& b) {
  b.lambda.assign(lambda.begin(), lambda.end());
  b.kind = kinds(spectrum(b.lambda));
  b.place.resize(b.lambda.size());
  PerMode<Complex> upper;
  int column = 0;
  for (const int i : b.kind.reals) {
    upper.push_back(b.lambda[i]);
    b.place[i] = {column, column, 0.0};
    ++column;
  }
  for (const auto& [plus, minus] : b.kind.pairs) {
    upper.push_back(b.lambda[plus]);
    b.place[plus] = {column, column + 1, 1.0};
    b.place[minus] = {column, column + 1, -1.0};
    column += 2;
  }
  const std::optional<SmallMatrix> P = dense::small_vectors(balanced, spectrum(upper));
  if (P) b.P = *P;
  return P.has_value();
}

// All at once, by the QR iteration.
void together(const SmallMatrix& balanced, Spectrum lambda, Basis& b) {
  const Index n = balanced.rows();
  const dense::SmallEigensystem solved = dense::small_eigensystem(balanced);
  b.place.clear();
  b.lambda.assign(lambda.begin(), lambda.end());
  if (solved.converged) {
    const dense::SmallComplexVector& found = solved.values;
    if (lambda.empty()) b.lambda.assign(found.begin(), found.end());
    SmallMatrix miss(n, n);
    for (Index i = 0; i < n; ++i)
      for (Index j = 0; j < n; ++j) miss(i, j) = std::sqrt(distance2(b.lambda[i], found[j]));
    for (const int j : assign(miss)) {
      const int of = side(found[j]);
      b.place.push_back({of < 0 ? j - 1 : j, of > 0 ? j + 1 : j, double(of)});
    }
    b.P = solved.P;
  }
  b.kind = kinds(spectrum(b.lambda));
}

}  // namespace

Basis basis(const SmallMatrix& balanced, Spectrum lambda) {
  Basis b;
  if (lambda.empty() || !one_by_one(balanced, lambda, b)) together(balanced, lambda, b);
  if (!b.place.empty()) b.R = dense::small_inverse(b.P);
  return b;
}

namespace {

template <class Matrix>
Matrix product(const Matrix& R, const Matrix& P) {
  Matrix X = Matrix::Zero(R.rows(), P.cols());
  for (Index j = 0; j < X.cols(); ++j)
    for (Index k = 0; k < X.cols(); ++k)
      for (Index i = 0; i < X.rows(); ++i) X(i, j) += R(i, k) * P(k, j);
  return X;
}

// wᵢ vⱼ of X = R P, times two if mode i is of a pair.
Complex entry(const SmallMatrix& X, const Basis::Place& w, const Basis::Place& v) {
  return {X(w.re, v.re) + w.side * v.side * X(w.im, v.im),
          v.side * X(w.re, v.im) - w.side * X(w.im, v.re)};
}

}  // namespace

dense::SmallComplexMatrix in_eigenvectors(const Basis& of, const SmallMatrix& A) {
  const SmallMatrix X =
      dense::with_known_size([](const auto& R, const auto& A_,
                                const auto& P) { return SmallMatrix(product(R, product(A_, P))); },
                             of.R, A, of.P);
  const Index n = A.rows();
  dense::SmallComplexMatrix B(n, n);
  for (Index j = 0; j < n; ++j)
    for (Index i = 0; i < n; ++i) {
      const Basis::Place &w = of.place[i], &v = of.place[j];
      B(i, j) = (w.side == 0 ? 1.0 : 0.5) * entry(X, w, v);
    }
  return B;
}

// tr(Pᵢ Qⱼ) of the spectral projectors Pᵢ = vᵢ wᵢᴴ of a and Qⱼ of b: independent of the scaling of
// eigenvectors and states; rows and columns sum to one.                          [38, 39]
SmallMatrix correlation(const Basis& a, const Basis& b) {
  const Index n = Index(a.lambda.size());
  if (a.place.empty() || b.place.empty()) return SmallMatrix::Ones(n, n);
  const auto multiplied = [](const auto& R, const auto& P) { return SmallMatrix(product(R, P)); };
  const SmallMatrix ab = dense::with_known_size(multiplied, a.R, b.P),
                    ba = dense::with_known_size(multiplied, b.R, a.P);
  SmallMatrix M(n, n);
  for (Index i = 0; i < n; ++i)
    for (Index j = 0; j < n; ++j) {
      const Basis::Place &at = a.place[i], &to = b.place[j];
      const Complex x = entry(ab, at, to), y = entry(ba, to, at);
      const double share = (at.side == 0 ? 1.0 : 0.5) * (to.side == 0 ? 1.0 : 0.5);
      M(i, j) = share * (x.real() * y.real() - x.imag() * y.imag());
    }
  return M.allFinite() ? M : SmallMatrix::Ones(n, n);
}

namespace {

// Distance of each eigenvalue to the nearest other one that is not its conjugate.
PerMode<double> gaps(const Basis& a) {
  const int n = int(a.lambda.size());
  PerMode<double> gap(n, infinity);
  for (int i = 0; i < n; ++i)
    for (int k = 0; k < n; ++k)
      if (k != i && k != a.kind.partner[i])
        gap[i] = std::min(gap[i], distance2(a.lambda[i], a.lambda[k]));
  for (double& g : gap) g = std::sqrt(g);
  return gap;
}

// Half the sum of the two smallest costs at which a pair becomes two real eigenvalues.
double cost_of_split(const SmallMatrix& cost, int member, const PerMode<int>& reals) {
  double least = infinity, second = infinity;
  for (const int j : reals) {
    const double c = cost(member, j);
    second = std::min(second, std::max(c, least));
    least = std::min(least, c);
  }
  return 0.5 * (least + second);
}

}  // namespace

// 1 - (correlation, 0 .. 1) + d/(d + gap) with d the distance from the predicted place. A pair
// counts as a whole: near the real axis its projector stays bounded, those of its members do not.
SmallMatrix costs(const SmallMatrix& M, const Basis& a, Spectrum predicted, const Basis& b) {
  const int n = int(a.lambda.size());
  const PerMode<double> gap = gaps(a);
  SmallMatrix cost(n, n);
  for (int i = 0; i < n; ++i)
    for (int j = 0; j < n; ++j) {
      const int i2 = a.kind.partner[i], j2 = b.kind.partner[j];
      double trace = M(i, j);
      if (i2 != i) trace += M(i2, j);
      if (j2 != j) trace += M(i, j2);
      if (i2 != i && j2 != j) trace = 0.5 * (trace + M(i2, j2));
      const double d = std::sqrt(distance2(predicted[i], b.lambda[j]));
      const double way = d > 0 ? 1 / (1 + gap[i] / d) : 0.0;
      cost(i, j) = 1 - std::clamp(trace, 0.0, 1.0) + way;
    }
  return cost;
}

// Pairs to pairs and reals to reals; as many pairs split as b has fewer. Which pairs split is
// decided with the pairs, at their smallest cost of splitting; into which reals, with the reals.
PerMode<int> assign_kinds(const SmallMatrix& cost, const Basis& a, const Basis& b) {
  const auto &pairs = a.kind.pairs, &next = b.kind.pairs;
  if (pairs.size() < next.size()) {  // reals join: in reverse, pairs split
    const PerMode<int> from = assign_kinds(cost.transpose(), b, a);
    PerMode<int> to(from.size());
    for (std::size_t j = 0; j < from.size(); ++j) to[from[j]] = int(j);
    return to;
  }
  PerMode<int> to(a.lambda.size()), rows = a.kind.reals;
  SmallMatrix C(pairs.size(), pairs.size());
  for (std::size_t i = 0; i < pairs.size(); ++i)
    for (std::size_t j = 0; j < pairs.size(); ++j)
      C(i, j) = j < next.size() ? cost(pairs[i][0], next[j][0])
                                : cost_of_split(cost, pairs[i][0], b.kind.reals);
  const PerMode<int> paired = assign(C);
  PerMode<std::array<int, 2>> split;
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    const bool splits = std::size_t(paired[i]) >= next.size();
    if (splits) split.push_back(pairs[i]);
    for (std::size_t m = 0; m < 2; ++m)
      splits ? rows.push_back(pairs[i][m]) : void(to[pairs[i][m]] = next[paired[i]][m]);
  }
  const PerMode<int> alone = assign(cost(rows, b.kind.reals));
  for (std::size_t i = 0; i < rows.size(); ++i) to[rows[i]] = b.kind.reals[alone[i]];
  for (const auto& [plus, minus] : split)  // by convention
    if (b.lambda[to[plus]].real() < b.lambda[to[minus]].real()) std::swap(to[plus], to[minus]);
  return to;
}

}  // namespace tiltrim
