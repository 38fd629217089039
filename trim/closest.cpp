#include "trim/closest.hpp"

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "dense/dense.hpp"
#include "trim/nlp.hpp"
#include "trim/verdict.hpp"

namespace tiltrim {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

// ½‖r‖² is to be least, r being the residual or the excess of the limited outputs.
struct Squares {
  const Problem& p;
  bool of_excess;

  VectorXd r(const Values& v) const { return of_excess ? beyond_limits(p, v) : v.residual; }
  MatrixXd slopes(const Values& v, const Jacobians& s) const {
    if (!of_excess) return s.residual;
    const VectorXd exceeds = (beyond_limits(p, v).array() != 0).cast<double>();
    return exceeds.asDiagonal() * s.limited;
  }
  bool allows(const VectorXd& z, const Values& v) const {
    return v.finite && excess(z, p.lower, p.upper) <= bound_slack &&
           (of_excess || excess(v.limited, p.limited_lower, p.limited_upper) <= bound_slack);
  }
};

// slope · d <= room for a step d.
struct Constraint {
  VectorXd slope;
  double room;
  Index unknown = -1;  // whose bound it is; otherwise a limit of an output
  double bound = 0.0;
};

std::vector<Constraint> constraints(const Squares& of, const VectorXd& z, const Values& v,
                                    const Jacobians& s) {
  std::vector<Constraint> all;
  const auto add = [&](const VectorXd& slope, double at, double lower, double upper, Index k) {
    if (std::isfinite(lower)) all.push_back({-slope, at - lower, k, lower});
    if (std::isfinite(upper)) all.push_back({slope, upper - at, k, upper});
  };
  for (Index k = 0; k < z.size(); ++k)
    add(VectorXd::Unit(z.size(), k), z[k], of.p.lower[k], of.p.upper[k], k);
  if (of.of_excess) return all;
  for (Index i = 0; i < v.limited.size(); ++i)
    add(s.limited.row(i).transpose(), v.limited[i], of.p.limited_lower[i], of.p.limited_upper[i],
        -1);
  return all;
}

using Reached = std::vector<const Constraint*>;

MatrixXd slopes_of(const Reached& held, Index n) {
  MatrixXd A(std::ssize(held), n);
  for (Index i = 0; i < A.rows(); ++i) A.row(i) = held[std::size_t(i)]->slope.transpose();
  return A;
}

// The constraints reached that the gradient presses against: -g = Aᵀλ with λ > 0.
Reached pressed(const std::vector<Constraint>& all, const VectorXd& gradient) {
  Reached held;
  for (const Constraint& c : all)
    if (c.room <= bound_slack) held.push_back(&c);
  while (!held.empty()) {
    Index least = 0;
    const MatrixXd A = slopes_of(held, gradient.size());
    if (dense::least_squares(A.transpose(), -gradient).minCoeff(&least) > 0) break;
    held.erase(held.begin() + least);
  }
  return held;
}

// min ‖J d - b‖ without the directions in which J hardly changes anything.
VectorXd determined_step(const MatrixXd& J, const VectorXd& b) {
  constexpr double weak = 1e-8;
  dense::SVD svd = dense::svd(J);
  svd.sigma = (svd.sigma.array() >= weak * svd.sigma.maxCoeff()).select(svd.sigma, 0.0);
  return dense::solve(svd, b);
}

// min ‖r + J d‖ over the steps that put the held constraints exactly on their limits.
VectorXd held_step(const MatrixXd& J, const VectorXd& r, const Reached& held) {
  if (held.empty()) return determined_step(J, -r);
  const MatrixXd A = slopes_of(held, J.cols());
  VectorXd rooms(A.rows());
  for (Index i = 0; i < rooms.size(); ++i) rooms[i] = held[std::size_t(i)]->room;
  VectorXd d = dense::least_squares(A, rooms);
  const MatrixXd Z = dense::kernel(A);
  if (Z.cols() > 0) d += Z * determined_step(J * Z, -(r + J * d));
  return d;
}

struct LimitedStep {
  VectorXd d;
  Reached onto;  // the constraints on which it ends
};

// The Gauss-Newton step as far as the first limit in its way; a limit already reached is held.
LimitedStep limited_step(const MatrixXd& J, const VectorXd& r, const std::vector<Constraint>& all) {
  Reached held = pressed(all, J.transpose() * r);
  for (;;) {  // each time with one more
    const VectorXd d = held_step(J, r, held);
    double share = 1.0;
    const Constraint* first = nullptr;
    for (const Constraint& c : all) {
      const double towards = c.slope.dot(d);
      if (std::ranges::find(held, &c) != held.end() || !(c.room < share * towards)) continue;
      share = std::max(c.room, 0.0) / towards;
      first = &c;
    }
    if (first) held.push_back(first);
    if (!first || first->room > bound_slack) return {share * d, held};
  }
}

// Ipopt's barrier keeps its last point off the limits. Gauss-Newton steps with the limits that the
// point is pressed against held, as long as they make ‖r‖ less.                [4, sec. 10.3, 16.5]
VectorXd polish(const Squares& of, VectorXd z, const std::stop_token& stop) {
  constexpr int cap = 20, halvings = 8;
  const Problem& p = of.p;
  Values v = values(p, z);
  if (!of.allows(z, v)) return z;
  for (int i = 0; i < cap && !stop.stop_requested(); ++i) {
    const Jacobians s = jacobians(p, z);
    if (!s.finite) return z;
    const VectorXd r = of.r(v);
    const std::vector<Constraint> all = constraints(of, z, v, s);
    const LimitedStep step = limited_step(of.slopes(v, s), r, all);
    if (!step.d.allFinite()) return z;
    bool less = false;
    double share = 1.0;
    for (int k = 0; k <= halvings && !less; ++k, share /= 2) {
      VectorXd trial = z + share * step.d;
      for (const Constraint* c : step.onto)
        if (k == 0 && c->unknown >= 0) trial[c->unknown] = c->bound;
      Values there = values(p, trial);
      less = of.allows(trial, there) && of.r(there).norm() < r.norm();
      if (less) z = std::move(trial), v = std::move(there);
    }
    if (!less) return z;
  }
  return z;
}

}  // namespace

VectorXd closest_from(const Problem& p, const VectorXd& start, const TrimOptions& options) {
  return polish({p, false}, run_ipopt(p, closest_nlp(p), start, options), options.stop);
}

VectorXd least_excess_from(const Problem& p, const VectorXd& start, const TrimOptions& options) {
  return polish({p, true}, run_ipopt(p, least_excess_nlp(p), start, options), options.stop);
}

}  // namespace tiltrim
