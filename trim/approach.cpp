#include "trim/approach.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "dense/dense.hpp"
#include "model/many.hpp"

namespace tiltrim {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

Problem equations_of(const Problem& problem) {
  Problem p = problem;
  if (p.notes_nearest) return p;
  const Index nx = std::ssize(p.model.states);
  p.limited.clear();
  p.limited_lower.resize(0);
  p.limited_upper.resize(0);
  p.terms.clear();
  p.needs_outputs = std::ranges::any_of(p.equations, [nx](Index row) { return row >= nx; });
  return p;
}

namespace {

// Slopes from one evaluation for each unknown, ahead of z or, at the edge of the model's domain,
// behind. Models with derivatives, or that take many points, have better ones in one call.
bool slopes(const Problem& p, const VectorXd& z, const Values& at, MatrixXd& J) {
  static const double step = std::sqrt(std::numeric_limits<double>::epsilon());
  if (p.model.derivatives || many(p.model)) {
    Jacobians& s = p.memory.slopes;
    differentiate(p, z, at, s);
    J = s.residual;
    return s.finite;
  }
  J.resize(p.m(), p.n());
  VectorXd beside = z;
  Values& near = p.memory.next;
  for (Index k = 0; k < p.n(); ++k) {
    const double h = step * std::max(1.0, std::abs(z[k]));
    for (const double side : {h, -h}) {
      beside[k] = z[k] + side;
      evaluate(p, beside, near);
      if (near.finite) break;
    }
    if (!near.finite) return false;
    J.col(k) = (near.residual - at.residual) / (beside[k] - z[k]);
    beside[k] = z[k];
  }
  return true;
}

NewtonResult approach(const Problem& p, VectorXd z, const TrimOptions& options) {
  constexpr double rounding = 1e-14;  // as in newton()
  constexpr double shortest = 0.25;   // of a step; a start that needs shorter ones takes long
  constexpr double converging = 0.8;  // by which steps reduce the residual
  constexpr int patience = 2;         // with slopes in a row that do not
  Values &at = p.memory.here, &next = p.memory.next;
  constexpr double infinite = std::numeric_limits<double>::infinity();
  NewtonResult result{z, infinite, infinite, 0};
  const auto reached = [&] {
    result.z = p.memory.z_of_here = z;
    result.residual = at.finite ? at.residual.lpNorm<Eigen::Infinity>() : infinite;
  };
  evaluate(p, z, at);
  reached();
  MatrixXd J;
  bool known = false, fresh = false;
  double before = infinite;
  int slow = 0;
  for (; at.finite && result.iterations < options.max_iterations; ++result.iterations) {
    if (options.observe) options.observe(point_of(p, z));
    if (options.stop.stop_requested()) break;
    fresh = !known;
    if (fresh) {
      slow = at.residual.norm() < converging * before ? 0 : slow + 1;
      before = at.residual.norm();
      if (slow > patience || !slopes(p, z, at, J)) break;
    }
    const VectorXd dz = dense::solve(J, -at.residual);
    result.step = dz.lpNorm<Eigen::Infinity>();
    const double least = rounding * std::max(1.0, z.lpNorm<Eigen::Infinity>());
    if (!dz.allFinite() || result.step <= least) break;
    double alpha = 1.0;
    const auto shorter = [&] {
      evaluate(p, z + alpha * dz, next);
      const double enough = fresh ? 1 - 0.5 * alpha : converging;
      return next.finite && next.residual.norm() < enough * at.residual.norm();
    };
    bool accepted = shorter();
    while (!accepted && fresh && alpha > shortest) {
      alpha /= 2;
      accepted = shorter();
    }
    if (!accepted && (fresh || result.residual <= options.tolerance)) break;
    known = accepted && next.residual.norm() < converging * at.residual.norm();
    if (!accepted) continue;
    // J ← J + (r(z + s) - r(z) - J s) sᵀ / sᵀs,  s = α Δz                       [4, sec. 11.1]
    const VectorXd s = alpha * dz;
    if (known) J += (next.residual - (1 - alpha) * at.residual) * s.transpose() / s.squaredNorm();
    z += s;
    std::swap(at, next);
    reached();
  }
  return result;
}

}  // namespace

std::optional<VectorXd> few_evaluations(const Problem& problem, const Problem& equations,
                                        VectorXd z, const TrimOptions& options) {
  equations.evaluations = 0;
  std::optional<VectorXd> root;
  if (approach(equations, std::move(z), options).residual <= options.tolerance) {
    TrimOptions quiet = options;
    quiet.observe = {};
    root = newton_from_here(equations, quiet).z;
    std::swap(problem.memory.slopes, equations.memory.slopes);
    std::swap(problem.memory.z_of_slopes, equations.memory.z_of_slopes);
  }
  problem.evaluations += equations.evaluations;
  if (problem.thrown.empty()) problem.thrown = equations.thrown;
  if (problem.notes_nearest) problem.nearest = equations.nearest;
  return root;
}

}  // namespace tiltrim
