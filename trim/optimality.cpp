#include "trim/optimality.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "dense/dense.hpp"
#include "trim/verdict.hpp"

namespace tiltrim {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

VectorXd active_residual(const ActiveSet& a, const VectorXd& z, const Values& v) {
  const Index m = v.residual.size();
  VectorXd c(m + std::ssize(a.unknowns) + std::ssize(a.limited));
  c.head(m) = v.residual;
  Index row = m;
  for (const Held& h : a.unknowns) c[row++] = z[h.position] - h.bound;
  for (const Held& h : a.limited) c[row++] = v.limited[h.position] - h.bound;
  return c;
}

MatrixXd active_slopes(const ActiveSet& a, const Jacobians& s) {
  const Index m = s.residual.rows();
  MatrixXd J =
      MatrixXd::Zero(m + std::ssize(a.unknowns) + std::ssize(a.limited), s.residual.cols());
  J.topRows(m) = s.residual;
  Index row = m;
  for (const Held& h : a.unknowns) J(row++, h.position) = 1.0;
  for (const Held& h : a.limited) J.row(row++) = s.limited.row(h.position);
  return J;
}

Gradient lagrangian_gradient(const Problem& p, const ActiveSet& a, const VectorXd& lambda) {
  return [&p, &a, &lambda](const VectorXd& z) -> VectorXd {
    const Jacobians s = jacobians(p, z);
    if (!s.finite) return VectorXd::Constant(z.size(), std::numeric_limits<double>::quiet_NaN());
    return s.effort + active_slopes(a, s).transpose() * lambda;
  };
}

MatrixXd hessian_of(const Gradient& gradient, const VectorXd& z) {
  constexpr double h = 1e-5;  // relative to nominal size: truncation and round-off both near 1e-10
  MatrixXd H(z.size(), z.size());
  for (Index k = 0; k < z.size(); ++k) {
    VectorXd ahead = z, behind = z;
    ahead[k] += h;
    behind[k] -= h;
    H.col(k) = (gradient(ahead) - gradient(behind)) / (ahead[k] - behind[k]);
  }
  return 0.5 * (H + H.transpose());
}

// The point nearest to z on c(z) = 0, within the bounds, if Newton's method finds one.
static std::optional<Values> onto_constraints(const Problem& p, const ActiveSet& a, VectorXd z) {
  constexpr int cap = 10;
  constexpr double small = 1e-10;
  for (int i = 0; i < cap; ++i) {
    const Values v = values(p, z);
    const Jacobians s = jacobians(p, z);
    if (!v.finite || !s.finite) return {};
    const VectorXd c = active_residual(a, z, v);
    if (c.size() == 0 || c.lpNorm<Eigen::Infinity>() <= small) {
      const bool inside = (z.array() >= p.lower.array() - small).all() &&
                          (z.array() <= p.upper.array() + small).all() &&
                          (v.limited.array() >= p.limited_lower.array() - small).all() &&
                          (v.limited.array() <= p.limited_upper.array() + small).all();
      return inside ? std::optional(v) : std::nullopt;
    }
    z -= dense::least_squares(active_slopes(a, s), c);
  }
  return {};
}

// How far the cost falls and rises over steps along a direction on c(z) = 0.
struct Change {
  double least = 0.0, most = 0.0;
  bool far = false;  // a step of 0.1 nominal sizes is possible
};

static Change change_along(const Problem& p, const ActiveSet& a, const VectorXd& z,
                           const VectorXd& direction) {
  const double here = values(p, z).effort;
  Change change;
  for (const double step : {-0.1, -0.01, 0.01, 0.1}) {
    const std::optional<Values> there = onto_constraints(p, a, z + step * direction);
    if (!there) continue;
    change.least = std::min(change.least, there->effort - here);
    change.most = std::max(change.most, there->effort - here);
    change.far = change.far || std::abs(step) == 0.1;
  }
  constexpr double rounding = 1e-9;  // of the cost
  const double size = rounding * std::max(1.0, std::abs(here));
  if (change.least >= -size) change.least = 0.0;
  if (change.most <= size) change.most = 0.0;
  return change;
}

Least least_at(const Problem& p, const ActiveSet& a, const VectorXd& z, const VectorXd& lambda) {
  constexpr double rounding = 1e-6;  // of a Hessian by repeated differences
  constexpr double flat = 1e-3;      // relative: next to a point without curvature there is little
  const Jacobians s = jacobians(p, z);
  if (!s.finite) return {};
  const MatrixXd A = active_slopes(a, s);
  const MatrixXd Z = dense::kernel(A.rows() > 0 ? A : MatrixXd::Zero(1, z.size()));
  Least answer{true, MatrixXd(z.size(), 0)};
  if (Z.cols() == 0) return answer;
  const MatrixXd H = hessian_of(lagrangian_gradient(p, a, lambda), z);
  if (!H.allFinite()) return {};
  const MatrixXd reduced = Z.transpose() * H * Z;
  const double size = std::max(1.0, H.norm());
  const double least = dense::symmetric_eigenvalues(reduced).minCoeff();
  if (least < -rounding * size) return {};
  if (least > flat * size) return answer;
  // Without curvature the second order does not decide: v = 0 is no minimum of -v⁴, nor of v³.
  const dense::SVD svd = dense::svd(reduced);
  for (Index k = 0; k < Z.cols(); ++k) {
    if (svd.sigma[k] > flat * size) continue;
    const VectorXd direction = Z * svd.V.col(k);
    const Change change = change_along(p, a, z, direction);
    if (change.least < 0) return {};
    if (change.most > 0 || !change.far) continue;
    answer.undetermined.conservativeResize(Eigen::NoChange, answer.undetermined.cols() + 1);
    answer.undetermined.rightCols(1) = direction;
  }
  return answer;
}

bool is_least(const Problem& p, const ActiveSet& a, const VectorXd& z, const VectorXd& lambda) {
  return least_at(p, a, z, lambda).least;
}

namespace {

constexpr double near_bound = 1e-6;  // scaled; an interior-point solution stops short of its bounds

void hold_near(const VectorXd& v, const VectorXd& lower, const VectorXd& upper, double distance,
               std::vector<Held>& held) {
  for (Index k = 0; k < v.size(); ++k) {
    if (std::ranges::any_of(held, [k](const Held& h) { return h.position == k; })) continue;
    if (v[k] >= upper[k] - distance)
      held.push_back({k, upper[k], 1.0});
    else if (v[k] <= lower[k] + distance)
      held.push_back({k, lower[k], -1.0});
  }
}

// A bound whose multiplier has the wrong sign is not active: with ∇f + Jᵀλ = 0 and c = z - bound, λ
// must be >= 0 at an upper bound and <= 0 at a lower one. Returns whether one was released.
bool let_go(ActiveSet& a, const VectorXd& lambda, Index m) {
  constexpr double wrong = 1e-9;
  Index row = m;
  for (std::vector<Held>* held : {&a.unknowns, &a.limited})
    for (auto h = held->begin(); h != held->end(); ++h, ++row)
      if (lambda[row] * h->side < -wrong) {
        held->erase(h);
        return true;
      }
  return false;
}

// Newton on  ∇f(z) + J(z)ᵀλ = 0,  c(z) = 0.                                     [4, sec. 18.1]
bool optimality_newton(const Problem& p, const ActiveSet& a, VectorXd& z, VectorXd& lambda) {
  constexpr int cap = 20;
  constexpr double small = 1e-9;
  const Index n = p.n();
  double last = std::numeric_limits<double>::infinity();
  for (int i = 0; i < cap; ++i) {
    const Values v = values(p, z);
    const Jacobians s = jacobians(p, z);
    if (!v.finite || !s.finite) return false;
    const VectorXd c = active_residual(a, z, v);
    const MatrixXd J = active_slopes(a, s);
    if (i == 0) lambda = VectorXd::Zero(c.size());
    if (i == 0 && c.size() > 0) lambda = dense::least_squares(J.transpose(), -s.effort);
    const VectorXd gradient = s.effort + J.transpose() * lambda;
    const double size = std::max(gradient.lpNorm<Eigen::Infinity>(), c.lpNorm<Eigen::Infinity>());
    if (size < small && size >= 0.5 * last) return true;  // round-off
    last = size;
    MatrixXd K = MatrixXd::Zero(n + c.size(), n + c.size());
    K.topLeftCorner(n, n) = hessian_of(lagrangian_gradient(p, a, lambda), z);
    K.topRightCorner(n, c.size()) = J.transpose();
    K.bottomLeftCorner(c.size(), n) = J;
    if (!K.allFinite()) return false;
    VectorXd rhs(n + c.size());
    rhs << -gradient, -c;
    const VectorXd d = dense::least_squares(K, rhs);
    if (!d.allFinite()) return false;
    z += d.head(n);
    lambda += d.tail(c.size());
  }
  return last < small;
}

}  // namespace

Optimum polish_optimum(const Problem& p, const VectorXd& z0, const TrimOptions& options) {
  Optimum best{z0, false, {}, {}, {}};
  const Values v0 = values(p, z0);
  if (!v0.finite) return best;
  ActiveSet active;
  hold_near(z0, p.lower, p.upper, near_bound, active.unknowns);
  hold_near(v0.limited, p.limited_lower, p.limited_upper, near_bound, active.limited);
  const Index most = 2 * (p.n() + std::ssize(p.limited)) + 1;
  for (Index round = 0; round < most && !options.stop.stop_requested(); ++round) {
    VectorXd z = z0;
    VectorXd lambda;
    if (!optimality_newton(p, active, z, lambda)) return best;
    for (const Held& h : active.unknowns) z[h.position] = h.bound;
    if (let_go(active, lambda, p.m())) continue;
    const Values v = values(p, z);
    if (!v.finite) return best;
    const auto held = active.unknowns.size() + active.limited.size();
    hold_near(z, p.lower, p.upper, -bound_slack, active.unknowns);  // the overshoot of the step
    hold_near(v.limited, p.limited_lower, p.limited_upper, -bound_slack, active.limited);
    const bool inside = active.unknowns.size() + active.limited.size() == held;
    const Least answer = inside ? least_at(p, active, z, lambda) : Least{};
    best = {z, answer.least, active, lambda, answer.undetermined};
    if (inside) return best;
  }
  return best;
}

}  // namespace tiltrim
