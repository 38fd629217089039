#include "optimize/nonsmooth.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <vector>

#include "dense/dense.hpp"

namespace tiltrim {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();

struct Sample {
  VectorXd x, gradient;
  double value = infinity;
};

// A gradient may cost many times as much as a value.
Sample value_at(const Nonsmooth& f, const VectorXd& x) {
  Sample s{x, {}, f(x, nullptr)};
  if (!std::isfinite(s.value)) s.value = infinity;
  return s;
}

void add_gradient(const Nonsmooth& f, Sample& s) {
  s.gradient = VectorXd::Zero(s.x.size());
  s.value = f(s.x, &s.gradient);
  if (!std::isfinite(s.value) || !s.gradient.allFinite()) s.value = infinity;
}

Sample sample(const Nonsmooth& f, const VectorXd& x) {
  Sample s{x, {}, infinity};
  add_gradient(f, s);
  return s;
}

// A step along `direction` that decreases f (Armijo) and after which its slope is flatter (weak
// Wolfe), by doubling and bisection. Without one within `most` trials: the lowest sample.
struct LineSearch {
  Sample end;
  bool wolfe = false;
};

LineSearch line_search(const Nonsmooth& f, const Sample& from, const VectorXd& direction) {
  constexpr double armijo = 1e-4, flatter = 0.5;
  constexpr int most = 40;
  const double slope = from.gradient.dot(direction);
  double lower = 0.0, upper = infinity, t = 1.0;
  LineSearch best{from};
  for (int trial = 0; trial < most; ++trial) {
    Sample here = value_at(f, from.x + t * direction);
    bool lower_enough = here.value < from.value + armijo * t * slope;
    if (lower_enough) add_gradient(f, here);
    lower_enough = lower_enough && std::isfinite(here.value);
    if (here.value < best.end.value) best.end = here;
    if (!lower_enough)
      upper = t;
    else if (here.gradient.dot(direction) < flatter * slope)
      lower = t;
    else
      return {here, true};
    t = std::isfinite(upper) ? 0.5 * (lower + upper) : 2 * lower;
    if (std::isfinite(upper) && upper - lower < 1e-14 * upper) break;
  }
  if (best.end.gradient.size() == 0) add_gradient(f, best.end);
  return best;
}

// BFGS's update of the inverse Hessian.
void update(MatrixXd& H, const VectorXd& s, const VectorXd& y, bool first) {
  const double sy = s.dot(y);
  if (!(sy > 0)) return;
  if (first) H = sy / y.squaredNorm() * MatrixXd::Identity(s.size(), s.size());
  const VectorXd Hy = H * y;
  const double factor = (1 + y.dot(Hy) / sy) / sy;
  H += factor * s * s.transpose() - (Hy * s.transpose() + s * Hy.transpose()) / sy;
}

}  // namespace

NonsmoothMinimum minimize_nonsmooth(const Nonsmooth& f, const VectorXd& start,
                                    const NonsmoothOptions& options) {
  constexpr int over = 10;  // steps
  const Index n = start.size();
  Sample here = sample(f, start);
  MatrixXd H = MatrixXd::Identity(n, n);
  std::vector<double> values{here.value};
  bool fresh = true;
  for (int step = 0; step < options.steps; ++step) {
    const double size = here.gradient.norm();
    if (!std::isfinite(here.value) || size == 0) return {here.x, here.value, size == 0};
    if (fresh) H = options.first_step / size * MatrixXd::Identity(n, n);
    const VectorXd direction = -H * here.gradient;
    const bool descends = here.gradient.dot(direction) < 0;
    const LineSearch found = descends ? line_search(f, here, direction) : LineSearch{here};
    const bool stuck = !(found.end.value < here.value);
    if (stuck && fresh) return {here.x, here.value, true};
    if (found.wolfe) update(H, found.end.x - here.x, found.end.gradient - here.gradient, fresh);
    fresh = !found.wolfe;  // begins again with steepest descent
    if (!stuck) here = found.end;
    values.push_back(here.value);
    const auto before = std::ssize(values) - 1 - over;
    if (before >= 0 && values[std::size_t(before)] - here.value <=
                           options.tolerance * std::max(std::abs(here.value), 1e-3))
      return {here.x, here.value, true};
  }
  return {here.x, here.value, false};
}

VectorXd least_in_hull(const MatrixXd& G) {
  constexpr double rounding = 1e-12;
  const Index m = G.cols();
  if (m == 0) return VectorXd::Zero(G.rows());
  // A column's weight; those with a weight span a simplex that has x in its interior.
  VectorXd weight = VectorXd::Zero(m);
  Index first = 0;
  G.colwise().squaredNorm().minCoeff(&first);
  weight[first] = 1;
  VectorXd x = G.col(first);
  const double scale = G.colwise().squaredNorm().maxCoeff();
  std::vector<Index> corral{first};
  for (Index round = 0; round < 10 * (m + 10); ++round) {
    Index next = 0;
    const double along = (G.transpose() * x).minCoeff(&next);
    if (x.squaredNorm() - along <= rounding * scale ||
        std::ranges::find(corral, next) != corral.end())
      break;
    corral.push_back(next);
    while (!corral.empty()) {
      // The least point of the affine hull: Gc' Gc v = 1, weights v / sum v.
      const Index k = std::ssize(corral);
      MatrixXd Gc(G.rows(), k);
      for (Index i = 0; i < k; ++i) Gc.col(i) = G.col(corral[std::size_t(i)]);
      const MatrixXd S = MatrixXd::Constant(k, k, scale) + Gc.transpose() * Gc;
      VectorXd v = dense::least_squares(S, VectorXd::Ones(k));
      v /= v.sum();
      // Towards it as far as the weights stay positive.
      double share = 1.0;
      for (Index i = 0; i < k; ++i) {
        const double old = weight[corral[std::size_t(i)]];
        if (v[i] <= rounding) share = std::min(share, old / std::max(old - v[i], rounding));
      }
      for (Index i = 0; i < k; ++i) {
        double& w = weight[corral[std::size_t(i)]];
        w += share * (v[i] - w);
      }
      if (share >= 1.0) break;
      const auto gone = [&](Index i) { return weight[i] <= rounding; };
      for (const Index i : corral)
        if (gone(i)) weight[i] = 0;
      if (std::erase_if(corral, gone) == 0) break;
    }
    x = G * weight / weight.sum();
  }
  return x;
}

double stationarity(const Nonsmooth& f, const VectorXd& x, double radius, std::uint64_t seed) {
  const Index n = x.size(), most = 2 * n + 10;  // on both sides of a bound, to 1 in 1000
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> uniform(-1.0, 1.0);
  MatrixXd G(n, 0);
  for (Index i = 0; i < most; ++i) {
    VectorXd at = x;
    if (i > 0)
      for (double& v : at) v += radius * uniform(random);
    const Sample s = sample(f, at);
    if (!std::isfinite(s.value)) continue;
    G.conservativeResize(n, G.cols() + 1);
    G.rightCols(1) = s.gradient;
  }
  if (G.cols() == 0) return 1.0;
  const double largest = G.colwise().norm().maxCoeff();
  return largest == 0 ? 0.0 : least_in_hull(G).norm() / largest;
}

}  // namespace tiltrim
