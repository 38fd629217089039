#include "sweep/track.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>
#include <stdexcept>
#include <utility>

#include "dense/dense.hpp"
#include "linearize/balance.hpp"
#include "sweep/spectrum.hpp"

namespace tiltrim {

using Eigen::Index;
using Eigen::MatrixXcd;
using Eigen::MatrixXd;

namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();

// Two modes that change places are said to cross, not to veer, where they mix by less than this:
// their gap is then below what twelve halvings of the step would resolve.
constexpr double crossing_mix = 1.0 / 4096;

// Which eigenvalues are real, and which are each other's conjugates.
struct Kinds {
  std::vector<std::array<int, 2>> pairs;  // the member with positive imaginary part first
  std::vector<int> reals;
  std::vector<int> partner;  // of each; a real one is its own
};

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

// The permutation p of least Σ cost(i, p(i)). Rows join one by one, each along the shortest path of
// reduced costs cᵢⱼ - uᵢ - vⱼ >= 0 to a free column. Of equals the first is taken.          [37]
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

// Eigenvalues in the caller's order and their eigenvectors, A V = V Λ, W = V⁻¹.
struct Basis {
  std::vector<Complex> lambda;
  Kinds kind;
  MatrixXcd V, W;  // not finite where A is defective
};

// Of a matrix in balanced coordinates; `lambda` empty: the eigenvalues in the solver's order. Where
// the QR iteration meets its cap the eigenvectors are empty, and so are eigenvalues not given.
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
      for (Index j = 0; j < n; ++j) miss(i, j) = std::abs(b.lambda[i] - found[j]);
    b.V = solved.V(Eigen::all, assign(miss));
    b.W = dense::inverse(b.V);
  }
  b.kind = kinds(b.lambda);
  return b;
}

// tr(Pᵢ Qⱼ) of the spectral projectors Pᵢ = vᵢ wᵢᴴ of a and Qⱼ of b: no scaling of eigenvectors or
// states enters, rows and columns sum to one.                                    [38, 39]
// All ones, which tells nothing, where an eigenvector is missing.
MatrixXcd correlation(const Basis& a, const Basis& b) {
  const Index n = Index(a.lambda.size());
  if (a.V.size() == 0 || b.V.size() == 0) return MatrixXcd::Ones(n, n);
  const MatrixXcd M = (a.W * b.V).cwiseProduct((b.W * a.V).transpose());
  return M.allFinite() ? M : MatrixXcd::Ones(n, n);
}

// Distance of each eigenvalue to the nearest that is not its conjugate.
std::vector<double> gaps(const Basis& a) {
  const int n = int(a.lambda.size());
  std::vector<double> gap(n, infinity);
  for (int i = 0; i < n; ++i)
    for (int k = 0; k < n; ++k)
      if (k != i && k != a.kind.partner[i])
        gap[i] = std::min(gap[i], std::abs(a.lambda[i] - a.lambda[k]));
  return gap;
}

// 1 - (correlation, 0 .. 1) + d/(d + gap) with d the way from the predicted place. A pair takes
// part whole: its projector stays where those of its members grow without bound, near the axis.
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
      const double d = std::abs(predicted[i] - b.lambda[j]);
      const double way = d > 0 ? 1 / (1 + gap[i] / d) : 0.0;
      cost(i, j) = 1 - std::clamp(trace.real(), 0.0, 1.0) + way;
    }
  return cost;
}

// Half of the two least costs of a pair's becoming two real eigenvalues.
double cost_of_split(const MatrixXd& cost, int member, const std::vector<int>& reals) {
  double least = infinity, second = infinity;
  for (const int j : reals) {
    const double c = cost(member, j);
    second = std::min(second, std::max(c, least));
    least = std::min(least, c);
  }
  return 0.5 * (least + second);
}

// Pairs to pairs and reals to reals; as many pairs split as b has fewer. Which do is decided with
// the pairs, each at its least cost of splitting; which reals they become, with the reals.
std::vector<int> assign_kinds(const MatrixXd& cost, const Basis& a, const Basis& b) {
  const auto &pairs = a.kind.pairs, &next = b.kind.pairs;
  if (pairs.size() < next.size()) {  // reals join: backwards, pairs split
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
  for (const auto& [plus, minus] : split)  // the convention
    if (b.lambda[to[plus]].real() < b.lambda[to[minus]].real()) std::swap(to[plus], to[minus]);
  return to;
}

// Modes that are linked as one: a pair, what splits or joins, and what is told apart neither in a
// nor in b. The number of the group each mode belongs to.
std::vector<int> grouped(const Basis& a, const Basis& b, const std::vector<int>& to) {
  const int n = int(to.size());
  double size = 0.0;
  for (int i = 0; i < n; ++i) size = std::max({size, std::abs(a.lambda[i]), std::abs(b.lambda[i])});
  // a double eigenvalue, defective, is computed as two this far apart
  const double same = std::sqrt(std::numeric_limits<double>::epsilon()) * size;
  std::vector<int> group(n);
  for (int i = 0; i < n; ++i) group[i] = i;
  for (int i = 0; i < n; ++i)
    for (int k = 0; k < i; ++k) {
      const bool pair = a.kind.partner[i] == k || b.kind.partner[to[i]] == to[k];
      const bool one = std::abs(a.lambda[i] - a.lambda[k]) <= same &&
                       std::abs(b.lambda[to[i]] - b.lambda[to[k]]) <= same;
      if (pair || one) std::ranges::replace(group, group[i], group[k]);
    }
  return group;
}

// How surely each group goes where its modes are linked to.
struct Judge {
  const Basis &a, &b;
  const std::vector<int>&to, &group;
  MatrixXcd trace;           // [group, group it should meet alone], of their projectors
  std::vector<double> rank;  // modes of a group

  // 1 - 2 (what it shares with other groups): 1 - 2 sin²θ where two modes mix by the angle θ.
  double character(int g) const {
    const double row = trace.row(g).cwiseAbs().sum(), column = trace.col(g).cwiseAbs().sum();
    const double others = std::max(row, column) - std::abs(trace(g, g));
    return 1 - 2 * others / rank[g];
  }

  double mixing(int g, int h) const {
    return std::max(std::abs(trace(g, h)), std::abs(trace(h, g))) / std::min(rank[g], rank[h]);
  }

  // 1 - 3 d/s, as link_by_position(), a group's own members apart; of the worst, as there: one that
  // is out of place leaves its place to another.
  double position(Spectrum from) const {
    double worst = 1.0;
    for (std::size_t i = 0; i < to.size(); ++i) {
      double s = infinity;
      for (std::size_t k = 0; k < to.size(); ++k)
        if (group[k] != group[i]) s = std::min(s, std::abs(from[i] - b.lambda[to[k]]));
      const double d = std::abs(from[i] - b.lambda[to[i]]);
      worst = std::min(worst, s > 0 ? 1 - nearer * d / s : 0.0);
    }
    return worst;
  }

  // Modes that change places cross if they do not mix, else they may as well veer: 1 - √mixing
  // against the share of the step below which a gap is taken for none, one half at that share.
  double exchange(int g) const {
    double worst = 1.0;
    for (std::size_t i = 0; i < to.size(); ++i)
      for (std::size_t k = 0; k < to.size(); ++k) {
        const int h = group[k];
        if (group[i] != g || h == g ||
            !turned(a.lambda[i] - a.lambda[k], b.lambda[to[i]] - b.lambda[to[k]]))
          continue;
        worst = std::min(worst, 1 - 0.5 * std::sqrt(mixing(g, h)) / crossing_mix);
      }
    return worst;
  }
};

std::vector<double> confidence(const MatrixXcd& M, const Basis& a, Spectrum predicted,
                               const Basis& b, const std::vector<int>& to) {
  const std::size_t n = to.size();
  const std::vector<int> group = grouped(a, b, to);
  Judge judge{a, b, to, group, MatrixXcd::Zero(n, n), std::vector<double>(n, 0.0)};
  for (std::size_t i = 0; i < n; ++i) {
    ++judge.rank[group[i]];
    for (std::size_t k = 0; k < n; ++k) judge.trace(group[i], group[k]) += M(i, to[k]);
  }
  const double place = std::max(judge.position(a.lambda), judge.position(predicted));
  std::vector<double> sure(n);
  for (std::size_t i = 0; i < n; ++i) {
    const int g = group[i];
    sure[i] =
        std::clamp(std::min(std::max(place, judge.character(g)), judge.exchange(g)), 0.0, 1.0);
  }
  // Who is linked wrongly has another's place: doubt of one is doubt of those it mixes with.
  std::vector<double> together = sure;
  for (std::size_t i = 0; i < n; ++i)
    for (std::size_t k = 0; k < n; ++k)
      if (group[i] != group[k] && sure[k] < together[i])
        together[i] = std::clamp(1 - 4 * judge.mixing(group[i], group[k]), sure[k], together[i]);
  return together;
}

Link link_once(const Basis& a, Spectrum predicted, const Basis& b) {
  const MatrixXcd M = correlation(a, b);
  Link link{assign_kinds(costs(M, a, predicted, b), a, b), {}};
  link.confidence = confidence(M, a, predicted, b, link.to);
  return link;
}

double weakest(const Link& link) {
  return link.to.empty() ? 1.0 : *std::ranges::min_element(link.confidence);
}

// The weakest confidence first, then their sum.
std::pair<double, double> strength(const Link& link) {
  return {weakest(link), std::accumulate(link.confidence.begin(), link.confidence.end(), 0.0)};
}

Link joined(const Link& first, const Link& second) {
  Link link = first;
  for (std::size_t i = 0; i < link.to.size(); ++i) {
    const std::size_t k = std::size_t(first.to[i]);
    link.to[i] = second.to[k];
    link.confidence[i] = std::min(first.confidence[i], second.confidence[k]);
  }
  return link;
}

// Straight on from `mid`, in the order of its eigenvalues; from `mid` itself what changed its kind.
std::vector<Complex> onward(Spectrum last, const Basis& mid, const std::vector<int>& to) {
  std::vector<Complex> predicted = mid.lambda;
  for (std::size_t i = 0; i < to.size(); ++i)
    if (side(last[i]) == side(mid.lambda[to[i]]))
      predicted[to[i]] = 2.0 * mid.lambda[to[i]] - last[i];
  return predicted;
}

// The path between the two matrices, in coordinates balanced for both ends.
struct Path {
  const std::function<std::optional<MatrixXd>(double)>& between;
  const Balanced& balanced;
  double trusted;
  int left;  // matrices that may still be asked for

  std::optional<Basis> at(double share) {
    if (!between || left-- <= 0) return {};
    const std::optional<MatrixXd> A = between(share);
    if (!A) return {};
    if (A->rows() != balanced.B.rows() || A->cols() != balanced.B.cols())
      throw std::invalid_argument(
          fmt::format("link: the matrix between is {} x {}, the ends {} x {}", A->rows(), A->cols(),
                      balanced.B.rows(), balanced.B.cols()));
    const MatrixXd same = balanced.same(*A);
    if (!same.allFinite()) return {};
    Basis b = basis(same, {});
    if (b.lambda.empty()) return {};
    return b;
  }

  Link refined(const Basis& a, double from, Spectrum predicted, const Basis& b, double to,
               int depth) {
    const Link direct = link_once(a, predicted, b);
    if (weakest(direct) >= trusted || depth <= 0) return direct;
    const double middle = 0.5 * (from + to);
    const std::optional<Basis> mid = at(middle);
    if (!mid) return direct;
    std::vector<Complex> halfway(predicted.begin(), predicted.end());
    for (std::size_t i = 0; i < halfway.size(); ++i)
      halfway[i] = 0.5 * (a.lambda[i] + predicted[i]);
    const Link first = refined(a, from, halfway, *mid, middle, depth - 1);
    const Link second = refined(*mid, middle, onward(a.lambda, *mid, first.to), b, to, depth - 1);
    const Link chain = joined(first, second);
    return strength(chain) > strength(direct) ? chain : direct;
  }
};

void check(const MatrixXd& A, Spectrum last, Spectrum predicted, const MatrixXd& B, Spectrum next) {
  const Index n = A.rows();
  if (A.cols() != n || B.rows() != n || B.cols() != n)
    throw std::invalid_argument(fmt::format("link: the matrices are {} x {} and {} x {}", A.rows(),
                                            A.cols(), B.rows(), B.cols()));
  if (std::ssize(last) != n || std::ssize(predicted) != n || std::ssize(next) != n)
    throw std::invalid_argument(
        fmt::format("link: {}, {} and {} eigenvalues for matrices of size {}", last.size(),
                    predicted.size(), next.size(), n));
  const auto finite = [](Complex z) { return std::isfinite(z.real()) && std::isfinite(z.imag()); };
  if (!A.allFinite() || !B.allFinite() || !std::ranges::all_of(last, finite) ||
      !std::ranges::all_of(predicted, finite) || !std::ranges::all_of(next, finite))
    throw std::invalid_argument("link: a matrix or an eigenvalue is not finite");
}

}  // namespace

Link link(const MatrixXd& A, Spectrum last, Spectrum predicted, const MatrixXd& B, Spectrum next) {
  return link(A, last, predicted, B, next, {}, {.max_depth = 0});
}

Link link(const MatrixXd& A, Spectrum last, Spectrum predicted, const MatrixXd& B, Spectrum next,
          const std::function<std::optional<MatrixXd>(double share)>& between,
          const TrackOptions& options) {
  check(A, last, predicted, B, next);
  if (A.rows() == 0) return {};
  const Balanced balanced = balance(0.5 * A.cwiseAbs() + 0.5 * B.cwiseAbs());
  const Basis a = basis(balanced.same(A), last), b = basis(balanced.same(B), next);
  Path path{between, balanced, options.trusted, options.max_between};
  return path.refined(a, 0.0, predicted, b, 1.0, options.max_depth);
}

}  // namespace tiltrim
