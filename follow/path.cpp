#include "follow/path.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "dense/dense.hpp"
#include "model/lookup.hpp"

namespace tiltrim {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

bool square_path(const Path& path, const VectorXd& z, VectorXd& G, MatrixXd& J) {
  const Values v = values(path.problem, z);
  if (!v.finite) return false;
  Jacobians s = jacobians(path.problem, z);
  if (!s.finite) return false;
  G = path.optimal ? active_residual(path.held, z, v) : v.residual;
  J = path.optimal ? active_slopes(path.held, s) : std::move(s.residual);
  return true;
}

// ∇f + c'ᵀλ = 0 (except the parameter's row),  c = 0.                           [4, eq. 18.2]
bool optimal_path(const Path& path, const VectorXd& y, VectorXd& G, MatrixXd& J) {
  const Problem& p = path.problem;
  const Index n = p.n(), m = y.size() - n;
  const VectorXd z = y.head(n), lambda = y.tail(m);
  const Values v = values(p, z);
  if (!v.finite) return false;
  const Jacobians s = jacobians(p, z);
  if (!s.finite) return false;
  const MatrixXd c_slopes = active_slopes(path.held, s);
  const Gradient gradient = lagrangian_gradient(p, path.held, lambda);
  const MatrixXd H = hessian_of(gradient, z);
  if (!H.allFinite()) return false;
  G.resize(n - 1 + m);
  G << (s.effort + c_slopes.transpose() * lambda).head(n - 1), active_residual(path.held, z, v);
  J = MatrixXd::Zero(n - 1 + m, n + m);
  J.topLeftCorner(n - 1, n) = H.topRows(n - 1);
  J.topRightCorner(n - 1, m) = c_slopes.transpose().topRows(n - 1);
  J.bottomLeftCorner(m, n) = c_slopes;
  return true;
}

bool is_held(const std::vector<Held>& held, Index position, double side) {
  return std::ranges::any_of(
      held, [&](const Held& h) { return h.position == position && h.side == side; });
}

}  // namespace

Index Path::free() const {
  return problem.n() - 1 - problem.m() - std::ssize(held.unknowns) - std::ssize(held.limited);
}

Curve Path::curve() const {
  return {[this](const VectorXd& y, VectorXd& G, MatrixXd& J) {
    return deciding() ? optimal_path(*this, y, G, J) : square_path(*this, y, G, J);
  }};
}

VectorXd Path::start(const VectorXd& z) const {
  if (!deciding()) return z;
  const Jacobians s = jacobians(problem, z);
  const MatrixXd c = active_slopes(held, s);
  const Index of_trim = problem.n() - 1;
  const VectorXd lambda =
      dense::least_squares(c.leftCols(of_trim).transpose(), -s.effort.head(of_trim));
  VectorXd y(z.size() + lambda.size());
  y << z, lambda;
  return y;
}

TrimSpec with_parameter(const Model& model, TrimSpec spec, const std::string& parameter) {
  variable(model, parameter);
  if (std::ranges::find(spec.free, parameter) != spec.free.end() &&
      !(spec.bounds.contains(parameter) &&
        spec.bounds.at(parameter).lower == spec.bounds.at(parameter).upper))
    throw std::invalid_argument(fmt::format(
        "'{}' is free in the trim: it cannot be the parameter of a branch too", parameter));
  if (const auto bound = spec.bounds.find(parameter);
      bound != spec.bounds.end() && bound->second.lower == bound->second.upper)
    spec.bounds.erase(bound);
  std::erase(spec.free, parameter);
  spec.free.push_back(parameter);
  return spec;
}

std::vector<LimitName> limit_names(const Path& path) {
  const Problem& p = path.problem;
  std::vector<LimitName> names;
  const auto add = [&](const std::string& signal, Index k, double bound, bool upper,
                       bool of_unknown) {
    const double side = upper ? 1.0 : -1.0;
    if (!std::isfinite(bound)) return;
    if (is_held(of_unknown ? path.held.unknowns : path.held.limited, k, side)) return;
    names.push_back({signal, upper, false, {k, bound, side}, of_unknown});
  };
  for (Index k = 0; k < p.n(); ++k) {
    const std::string& name = signal_of(p.model, p.unknowns[std::size_t(k)]).name;
    add(name, k, p.lower[k], false, true);
    add(name, k, p.upper[k], true, true);
  }
  for (Index i = 0; i < std::ssize(p.limited); ++i) {
    const std::string name = row_name(p.model, p.limited[std::size_t(i)]);
    add(name, i, p.limited_lower[i], false, false);
    add(name, i, p.limited_upper[i], true, false);
  }
  for (const bool of_unknown : {true, false})
    for (const Held& h : of_unknown ? path.held.unknowns : path.held.limited) {
      const auto k = std::size_t(h.position);
      names.push_back(
          {of_unknown ? signal_of(p.model, p.unknowns[k]).name : row_name(p.model, p.limited[k]),
           h.side > 0, true, h, of_unknown});
    }
  return names;
}

// ∇f + c'ᵀλ = 0 where the held equations alone determine the trim: λ times the absolute value of
// their determinant, which remains finite at a fold.
static VectorXd multipliers(const Path& path, const VectorXd& z) {
  const Jacobians s = jacobians(path.problem, z);
  const Index n = path.problem.n() - 1;
  const auto lu = dense::lu<MatrixXd>(active_slopes(path.held, s).leftCols(n).transpose());
  return dense::solve(lu, -s.effort.head(n)) * std::abs(dense::determinant(lu));
}

VectorXd limit_distances(const Path& path, const std::vector<LimitName>& limits,
                         const VectorXd& y) {
  const Problem& p = path.problem;
  const VectorXd z = path.z(y);
  const Values v = p.limited.empty() ? Values{} : values(p, z);
  VectorXd distance(std::ssize(limits));
  VectorXd lambda;
  if (!path.held.unknowns.empty() || !path.held.limited.empty())
    lambda = path.deciding() ? y.tail(y.size() - p.n()) : multipliers(path, z);
  Index multiplier = p.m();
  for (Index i = 0; i < distance.size(); ++i) {
    const LimitName& limit = limits[std::size_t(i)];
    if (limit.held) {
      distance[i] = lambda[multiplier++] * limit.as.side;
      continue;
    }
    const double at = limit.of_unknown ? z[limit.as.position]
                      : v.finite       ? v.limited[limit.as.position]
                                       : std::numeric_limits<double>::quiet_NaN();
    distance[i] = (limit.as.bound - at) * limit.as.side;
  }
  return distance;
}

double slope_error(const Path& path) {
  constexpr double exact = 1e-13, differences = 1e-8, of_gradients = 1e-5;
  if (path.deciding()) return of_gradients;
  return path.problem.model.derivatives ? exact : differences;
}

}  // namespace tiltrim
