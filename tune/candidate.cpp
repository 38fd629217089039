#include "tune/candidate.hpp"

#include <fmt/core.h>

#include <Eigen/Dense>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "linearize/balance.hpp"
#include "model/differentiate.hpp"

namespace tiltrim {

using Eigen::Index;
using Eigen::MatrixXcd;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

const std::vector<SweepAxis> no_axes;

void check(const TuneProblem& problem) {
  if (problem.points.empty())
    throw std::invalid_argument("nothing to tune for: no operating point");
  if (problem.gains.empty()) throw std::invalid_argument("nothing to tune: no gain is free");
  for (const FreeGain& g : problem.gains) {
    if (!std::isfinite(g.lower) || !std::isfinite(g.upper) || !(g.lower < g.upper))
      throw std::invalid_argument(
          fmt::format("{} is free in [{}, {}]; expected finite bounds, the lower below the upper",
                      g.name, g.lower, g.upper));
    if (g.logarithmic && !(g.lower > 0))
      throw std::invalid_argument(
          fmt::format("{} is free in [{}, {}] on a logarithmic scale; expected bounds above zero",
                      g.name, g.lower, g.upper));
  }
}

// How all variables move with one of the gains: dz = -(∂r/∂z)⁻¹ ∂r/∂gain.
VectorXd shift(const Prepared& sweep, const MatrixXd& slopes, Index column, Index variables,
               Index gain) {
  const Problem& p = sweep.problem;
  MatrixXd J(p.m(), p.n());
  VectorXd r(p.m());
  for (Index i = 0; i < p.m(); ++i) {
    const Index row = p.equations[std::size_t(i)];
    r[i] = slopes(row, column) / p.row_nominal[row];
    for (Index k = 0; k < p.n(); ++k)
      J(i, k) = slopes(row, sweep.unknowns[std::size_t(k)]) * p.nominal[k] / p.row_nominal[row];
  }
  const VectorXd dz = -J.partialPivLu().solve(r);
  VectorXd all = VectorXd::Zero(variables);
  for (Index k = 0; k < p.n(); ++k) all[p.unknowns[std::size_t(k)]] = dz[k] * p.nominal[k];
  all[gain] = 1.0;
  return all;
}

OperatingPoint moved(const OperatingPoint& from, const VectorXd& by) {
  OperatingPoint to = from;
  to.x += by.head(from.x.size());
  to.u += by.segment(from.x.size(), from.u.size());
  to.p += by.tail(from.p.size());
  return to;
}

}  // namespace

Candidates::Candidates(const TuneProblem& problem, const TrimOptions& trimming)
    : problem_(problem) {
  check(problem);
  for (const SweepRequest& request : problem.points) {
    Point point{std::make_unique<Prepared>(request, no_axes, trimming), {}, {}};
    for (const FreeGain& g : problem.gains) {
      const Index variable = tiltrim::variable(request.model, g.name);
      const std::vector<Index>& unknowns = point.prepared->problem.unknowns;
      if (std::ranges::find(unknowns, variable) != unknowns.end())
        throw std::invalid_argument(
            fmt::format("{} is found by the trim of '{}'; expected a parameter that it is given",
                        g.name, request.name));
      point.gains.push_back(variable);
    }
    points_.push_back(std::move(point));
  }
}

PointModes Candidates::modes(Point& point, const VectorXd& gains, bool slopes, bool anew) {
  const Prepared& sweep = *point.prepared;
  const auto set_gains = [&](OperatingPoint& at) {
    for (std::size_t j = 0; j < point.gains.size(); ++j)
      set_value(at, point.gains[j], gains[Index(j)]);
  };
  Settled e;
  bool settled = false;
  if (point.nearest && !anew) {
    e.at = *point.nearest;
    set_gains(e.at);
    settled = settle(sweep, e);
  }
  if (!settled) {
    OperatingPoint at = sweep.request.guess;
    set_gains(at);
    e = from_nothing(sweep, at);
  }
  PointModes result;
  result.status = e.status;
  result.message = e.message;
  if (!e.valid()) return result;
  point.nearest = result.at = e.at;
  result.A = e.A(sweep);
  if (!result.A.allFinite()) return result;
  const Index n = sweep.states();
  const Balanced balanced = balance(result.A);
  const Eigen::EigenSolver<MatrixXd> solver(balanced.B, slopes);
  if (solver.info() != Eigen::Success) {
    result.message = "the eigenvalues do not converge";
    return result;
  }
  result.eigenvalues = solver.eigenvalues();
  if (!slopes) return result;

  // dλ = (V⁻¹ dA V)ᵢᵢ, dA along the gain and the trim's own shift.                    [26, eq. 2.3]
  const MatrixXcd V = solver.eigenvectors();
  const Eigen::PartialPivLU<MatrixXcd> lu(V);
  std::vector<Index> along = sweep.along, states;
  along.insert(along.end(), point.gains.begin(), point.gains.end());
  for (Index i = 0; i < n; ++i) states.push_back(i);
  const MatrixXd all = jacobian(sweep.model(), e.at, along);
  const Index variables = e.at.x.size() + e.at.u.size() + e.at.p.size();
  result.slopes.resize(n, std::ssize(point.gains));
  for (std::size_t j = 0; j < point.gains.size(); ++j) {
    const VectorXd by =
        shift(sweep, all, std::ssize(sweep.along) + Index(j), variables, point.gains[j]);
    const double h = 1e-5 * std::max(std::abs(gains[Index(j)]), 1e-3);
    const auto A = [&](double t) -> MatrixXd {
      return jacobian(sweep.model(), moved(e.at, t * by), states).topRows(n);
    };
    const MatrixXd dA = (A(h) - A(-h)) / (2 * h);
    MatrixXd dB(n, n);
    for (Index i = 0; i < n; ++i)
      for (Index k = 0; k < n; ++k)
        dB(i, k) = dA(balanced.order[std::size_t(i)], balanced.order[std::size_t(k)]) *
                   (balanced.scale[k] / balanced.scale[i]);
    result.slopes.col(Index(j)) = lu.solve(dB * V).diagonal();
  }
  return result;
}

std::vector<PointModes> Candidates::at(const VectorXd& gains, bool slopes) {
  std::vector<PointModes> all;
  for (Point& point : points_) all.push_back(modes(point, gains, slopes, false));
  return all;
}

std::vector<PointModes> Candidates::anew(const VectorXd& gains) {
  std::vector<PointModes> all;
  for (Point& point : points_) all.push_back(modes(point, gains, false, true));
  return all;
}

}  // namespace tiltrim
