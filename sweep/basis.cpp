#include "sweep/basis.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <utility>

#include "dense/dense.hpp"

namespace tiltrim {

using Eigen::Index;
using Eigen::MatrixXcd;
using Eigen::MatrixXd;

namespace {

Kinds kinds(Spectrum lambda) {
  const int n = int(lambda.size());
  Kinds k;
  k.partner.assign(lambda.size(), -1);
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
std::vector<int> assign(const MatrixXd& cost) {
  const int n = int(cost.rows());
  std::vector<double> u(n, 0.0), v(n + 1, 0.0);
  std::vector<int> row(n + 1, -1);  // of each column; the path starts at column n
  for (int i = 0; i < n; ++i) {
    std::vector<double> length(n + 1, infinity);
    std::vector<int> before(n + 1, n);
    std::vector<char> reached(n + 1, false);
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
  std::vector<int> to(n);
  for (int j = 0; j < n; ++j) to[row[j]] = j;
  return to;
}

}  // namespace

Basis basis(const MatrixXd& balanced, Spectrum lambda) {
  const Index n = balanced.rows();
  const dense::Eigensystem solved = dense::eigensystem(balanced);
  Basis b;
  b.lambda.assign(lambda.begin(), lambda.end());
  if (solved.converged) {
    const Eigen::VectorXcd& found = solved.values;
    if (lambda.empty()) b.lambda.assign(found.begin(), found.end());
    MatrixXd miss(n, n);
    for (Index i = 0; i < n; ++i)
      for (Index j = 0; j < n; ++j) miss(i, j) = std::sqrt(distance2(b.lambda[i], found[j]));
    b.V = solved.V(Eigen::all, assign(miss));
    b.W = dense::inverse(b.V);
  }
  b.kind = kinds(b.lambda);
  return b;
}

// tr(Pᵢ Qⱼ) of the spectral projectors Pᵢ = vᵢ wᵢᴴ of a and Qⱼ of b: independent of the scaling of
// eigenvectors and states; rows and columns sum to one.                          [38, 39]
MatrixXcd correlation(const Basis& a, const Basis& b) {
  const Index n = Index(a.lambda.size());
  if (a.V.size() == 0 || b.V.size() == 0) return MatrixXcd::Ones(n, n);
  const MatrixXcd M = (a.W * b.V).cwiseProduct((b.W * a.V).transpose());
  return M.allFinite() ? M : MatrixXcd::Ones(n, n);
}

namespace {

// Distance of each eigenvalue to the nearest other one that is not its conjugate.
std::vector<double> gaps(const Basis& a) {
  const int n = int(a.lambda.size());
  std::vector<double> gap(n, infinity);
  for (int i = 0; i < n; ++i)
    for (int k = 0; k < n; ++k)
      if (k != i && k != a.kind.partner[i])
        gap[i] = std::min(gap[i], distance2(a.lambda[i], a.lambda[k]));
  for (double& g : gap) g = std::sqrt(g);
  return gap;
}

// Half the sum of the two smallest costs at which a pair becomes two real eigenvalues.
double cost_of_split(const MatrixXd& cost, int member, const std::vector<int>& reals) {
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
MatrixXd costs(const MatrixXcd& M, const Basis& a, Spectrum predicted, const Basis& b) {
  const int n = int(a.lambda.size());
  const std::vector<double> gap = gaps(a);
  MatrixXd cost(n, n);
  for (int i = 0; i < n; ++i)
    for (int j = 0; j < n; ++j) {
      const int i2 = a.kind.partner[i], j2 = b.kind.partner[j];
      Complex trace = M(i, j);
      if (i2 != i) trace += M(i2, j);
      if (j2 != j) trace += M(i, j2);
      if (i2 != i && j2 != j) trace = 0.5 * (trace + M(i2, j2));
      const double d = std::sqrt(distance2(predicted[i], b.lambda[j]));
      const double way = d > 0 ? 1 / (1 + gap[i] / d) : 0.0;
      cost(i, j) = 1 - std::clamp(trace.real(), 0.0, 1.0) + way;
    }
  return cost;
}

// Pairs to pairs and reals to reals; as many pairs split as b has fewer. Which pairs split is
// decided with the pairs, at their smallest cost of splitting; into which reals, with the reals.
std::vector<int> assign_kinds(const MatrixXd& cost, const Basis& a, const Basis& b) {
  const auto &pairs = a.kind.pairs, &next = b.kind.pairs;
  if (pairs.size() < next.size()) {  // reals join: in reverse, pairs split
    const std::vector<int> from = assign_kinds(cost.transpose(), b, a);
    std::vector<int> to(from.size());
    for (std::size_t j = 0; j < from.size(); ++j) to[from[j]] = int(j);
    return to;
  }
  std::vector<int> to(a.lambda.size()), rows = a.kind.reals;
  MatrixXd C(pairs.size(), pairs.size());
  for (std::size_t i = 0; i < pairs.size(); ++i)
    for (std::size_t j = 0; j < pairs.size(); ++j)
      C(i, j) = j < next.size() ? cost(pairs[i][0], next[j][0])
                                : cost_of_split(cost, pairs[i][0], b.kind.reals);
  const std::vector<int> paired = assign(C);
  std::vector<std::array<int, 2>> split;
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    const bool splits = std::size_t(paired[i]) >= next.size();
    if (splits) split.push_back(pairs[i]);
    for (std::size_t m = 0; m < 2; ++m)
      splits ? rows.push_back(pairs[i][m]) : void(to[pairs[i][m]] = next[paired[i]][m]);
  }
  const std::vector<int> alone = assign(cost(rows, b.kind.reals));
  for (std::size_t i = 0; i < rows.size(); ++i) to[rows[i]] = b.kind.reals[alone[i]];
  for (const auto& [plus, minus] : split)  // by convention
    if (b.lambda[to[plus]].real() < b.lambda[to[minus]].real()) std::swap(to[plus], to[minus]);
  return to;
}

}  // namespace tiltrim
