#include "sweep/track.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <stdexcept>
#include <utility>

#include "linearize/balance.hpp"
#include "sweep/basis.hpp"
#include "sweep/spectrum.hpp"

namespace tiltrim {

using dense::SmallMatrix;
using Eigen::Index;
using Eigen::MatrixXd;

namespace {

// Two modes that exchange places cross, and do not veer, if their mixing is below this: the gap is
// then smaller than twelve bisections of the step can resolve.
constexpr double crossing_mix = 1.0 / 4096;

// Modes that are linked together: a pair, modes that split or join, and modes that cannot be
// separated in a or in b. Returns the group number of each mode.
PerMode<int> grouped(const Basis& a, const Basis& b, const PerMode<int>& to) {
  const int n = int(to.size());
  double size2 = 0.0;
  for (int i = 0; i < n; ++i)
    size2 = std::max({size2, std::norm(a.lambda[i]), std::norm(b.lambda[i])});
  // a defective double eigenvalue is computed as two this far apart, squared
  const double same = std::numeric_limits<double>::epsilon() * size2;
  PerMode<int> group(n);
  for (int i = 0; i < n; ++i) group[i] = i;
  for (int i = 0; i < n; ++i)
    for (int k = 0; k < i; ++k) {
      const bool pair = a.kind.partner[i] == k || b.kind.partner[to[i]] == to[k];
      const bool one = distance2(a.lambda[i], a.lambda[k]) <= same &&
                       distance2(b.lambda[to[i]], b.lambda[to[k]]) <= same;
      if (pair || one) std::ranges::replace(group, group[i], group[k]);
    }
  return group;
}

// Confidence of the link of each group.
struct Judge {
  const Basis &a, &b;
  const PerMode<int>&to, &group;
  SmallMatrix trace;     // [group, group it is linked to], of their projectors
  PerMode<double> rank;  // number of modes of a group

  // 1 - 2 (overlap with other groups): 1 - 2 sin²θ if two modes mix by the angle θ.
  double character(int g) const {
    const double row = trace.row(g).cwiseAbs().sum(), column = trace.col(g).cwiseAbs().sum();
    const double others = std::max(row, column) - std::abs(trace(g, g));
    return 1 - 2 * others / rank[g];
  }

  double mixing(int g, int h) const {
    return std::max(std::abs(trace(g, h)), std::abs(trace(h, g))) / std::min(rank[g], rank[h]);
  }

  // 1 - 3 d/s, as in link_by_position(), ignoring members of the group; for the worst member, since
  // one that is out of place takes the place of another.
  double position(Spectrum from) const {
    double worst = 1.0;
    for (std::size_t i = 0; i < to.size(); ++i) {
      double s = infinity;
      for (std::size_t k = 0; k < to.size(); ++k)
        if (group[k] != group[i]) s = std::min(s, distance2(from[i], b.lambda[to[k]]));
      s = std::sqrt(s);
      const double d = std::sqrt(distance2(from[i], b.lambda[to[i]]));
      worst = std::min(worst, s > 0 ? 1 - nearer * d / s : 0.0);
    }
    return worst;
  }

  // Modes that exchange places cross if they do not mix, otherwise they may veer: 1 - √mixing,
  // weighted so that it is one half at the mixing below which a gap cannot be resolved; by group.
  PerMode<double> exchange() const {
    PerMode<double> worst(to.size(), 1.0);
    for (std::size_t i = 0; i < to.size(); ++i)
      for (std::size_t k = 0; k < to.size(); ++k) {
        const int g = group[i], h = group[k];
        if (h == g || !turned(a.lambda[i] - a.lambda[k], b.lambda[to[i]] - b.lambda[to[k]]))
          continue;
        worst[g] = std::min(worst[g], 1 - 0.5 * std::sqrt(mixing(g, h)) / crossing_mix);
      }
    return worst;
  }
};

PerMode<double> confidence(const SmallMatrix& M, const Basis& a, Spectrum predicted, const Basis& b,
                           const PerMode<int>& to) {
  const std::size_t n = to.size();
  const PerMode<int> group = grouped(a, b, to);
  Judge judge{a, b, to, group, SmallMatrix::Zero(n, n), PerMode<double>(n, 0.0)};
  for (std::size_t i = 0; i < n; ++i) {
    ++judge.rank[group[i]];
    for (std::size_t k = 0; k < n; ++k) judge.trace(group[i], group[k]) += M(i, to[k]);
  }
  const double place = std::max(judge.position(spectrum(a.lambda)), judge.position(predicted));
  const PerMode<double> exchange = judge.exchange();
  PerMode<double> sure(n);
  for (std::size_t i = 0; i < n; ++i) {
    const int g = group[i];
    sure[i] = std::clamp(std::min(std::max(place, judge.character(g)), exchange[g]), 0.0, 1.0);
  }
  // A wrong link takes another mode's place: doubt about one is doubt about those it mixes with.
  PerMode<double> together = sure;
  for (std::size_t i = 0; i < n; ++i)
    for (std::size_t k = 0; k < n; ++k)
      if (group[i] != group[k] && sure[k] < together[i])
        together[i] = std::clamp(1 - 4 * judge.mixing(group[i], group[k]), sure[k], together[i]);
  return together;
}

// A link without allocation.
struct SmallLink {
  PerMode<int> to;
  PerMode<double> confidence;
};

SmallLink link_once(const Basis& a, Spectrum predicted, const Basis& b) {
  const SmallMatrix M = correlation(a, b);
  SmallLink link{assign_kinds(costs(M, a, predicted, b), a, b), {}};
  link.confidence = confidence(M, a, predicted, b, link.to);
  return link;
}

double weakest(const SmallLink& link) {
  return link.to.empty() ? 1.0 : *std::ranges::min_element(link.confidence);
}

// The lowest confidence first, then the sum.
std::pair<double, double> strength(const SmallLink& link) {
  return {weakest(link), std::accumulate(link.confidence.begin(), link.confidence.end(), 0.0)};
}

SmallLink joined(const SmallLink& first, const SmallLink& second) {
  SmallLink link = first;
  for (std::size_t i = 0; i < link.to.size(); ++i) {
    const std::size_t k = std::size_t(first.to[i]);
    link.to[i] = second.to[k];
    link.confidence[i] = std::min(first.confidence[i], second.confidence[k]);
  }
  return link;
}

// Linear extrapolation from `mid`, in the order of its eigenvalues; modes that changed kind stay.
PerMode<Complex> onward(Spectrum last, const Basis& mid, const PerMode<int>& to) {
  PerMode<Complex> predicted = mid.lambda;
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
  int left;  // matrices that may still be evaluated

  std::optional<Basis> at(double share) {
    if (!between || left-- <= 0) return {};
    const std::optional<MatrixXd> A = between(share);
    if (!A) return {};
    if (A->rows() != balanced.B.rows() || A->cols() != balanced.B.cols())
      throw std::invalid_argument(
          fmt::format("link: the matrix between is {} x {}, the ends {} x {}", A->rows(), A->cols(),
                      balanced.B.rows(), balanced.B.cols()));
    const SmallMatrix same = balanced.same(*A);
    if (!same.allFinite()) return {};
    Basis b = basis(same, {});
    if (b.lambda.empty()) return {};
    return b;
  }

  SmallLink refined(const Basis& a, double from, Spectrum predicted, const Basis& b, double to,
                    int depth) {
    const SmallLink direct = link_once(a, predicted, b);
    if (weakest(direct) >= trusted || depth <= 0) return direct;
    const double middle = 0.5 * (from + to);
    const std::optional<Basis> mid = at(middle);
    if (!mid) return direct;
    PerMode<Complex> halfway(predicted.begin(), predicted.end());
    for (std::size_t i = 0; i < halfway.size(); ++i)
      halfway[i] = 0.5 * (a.lambda[i] + predicted[i]);
    const SmallLink first = refined(a, from, spectrum(halfway), *mid, middle, depth - 1);
    if (strength(first) <= strength(direct)) return direct;  // a chain is no stronger than a part
    const PerMode<Complex> beyond = onward(spectrum(a.lambda), *mid, first.to);
    const SmallLink second = refined(*mid, middle, spectrum(beyond), b, to, depth - 1);
    const SmallLink chain = joined(first, second);
    return strength(chain) > strength(direct) ? chain : direct;
  }
};

void check(const MatrixXd& A, Spectrum last, Spectrum predicted, const MatrixXd& B, Spectrum next) {
  const Index n = A.rows();
  if (A.cols() != n || B.rows() != n || B.cols() != n)
    throw std::invalid_argument(fmt::format("link: the matrices are {} x {} and {} x {}", A.rows(),
                                            A.cols(), B.rows(), B.cols()));
  if (n > dense::small_size)
    throw std::invalid_argument(
        fmt::format("link: {} modes, at most {} are supported", n, dense::small_size));
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
  const SmallLink found = path.refined(a, 0.0, predicted, b, 1.0, options.max_depth);
  return {{found.to.begin(), found.to.end()}, {found.confidence.begin(), found.confidence.end()}};
}

}  // namespace tiltrim
