#include "tune/shift.hpp"

#include <algorithm>
#include <cmath>

#include "dense/dense.hpp"
#include "linearize/balance.hpp"
#include "model/differentiate.hpp"
#include "model/lookup.hpp"

namespace tiltrim {

using Eigen::Index;
using Eigen::MatrixXcd;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

OperatingPoint moved(const OperatingPoint& from, const VectorXd& by) {
  OperatingPoint to = from;
  to.x += by.head(from.x.size());
  to.u += by.segment(from.x.size(), from.u.size());
  to.p += by.tail(from.p.size());
  return to;
}

// Real parts, then imaginary parts, of the derivatives of each eigenvalue with respect to every
// entry of A, in a column: wᵢ vᵢᵀ with the left eigenvectors W = V⁻¹, both without the balancing.
MatrixXd weights_of(const Balanced& balanced, const MatrixXcd& V) {
  const MatrixXcd W = dense::inverse(V);
  const Index n = V.rows();
  MatrixXd parts(n * n, 2 * n);
  for (Index i = 0; i < n; ++i)
    for (Index k = 0; k < n; ++k)
      for (Index r = 0; r < n; ++r) {
        const std::complex<double> part =
            W(i, r) * V(k, i) * (balanced.scale[k] / balanced.scale[r]);
        const Index entry = balanced.order[std::size_t(r)] + n * balanced.order[std::size_t(k)];
        parts(entry, i) = part.real();
        parts(entry, n + i) = part.imag();
      }
  return parts;
}

}  // namespace

// dz = -(∂r/∂z)⁻¹ ∂r/∂p with z the unknowns and r the equations of the trim.
MatrixXd shifts(const Prepared& sweep, const GridTrim& e, const std::vector<Index>& parameters) {
  const Problem& p = sweep.problem;
  std::vector<Index> along = sweep.along;
  along.insert(along.end(), parameters.begin(), parameters.end());
  const MatrixXd all = jacobian(sweep.model(), e.at, along);
  const Index count = std::ssize(parameters), first = std::ssize(sweep.along);
  MatrixXd J(p.m(), p.n()), r(p.m(), count);
  for (Index i = 0; i < p.m(); ++i) {
    const Index row = p.equations[std::size_t(i)];
    r.row(i) = all.row(row).segment(first, count) / p.row_nominal[row];
    for (Index k = 0; k < p.n(); ++k)
      J(i, k) = all(row, sweep.unknowns[std::size_t(k)]) * p.nominal[k] / p.row_nominal[row];
  }
  const MatrixXd dz = -dense::solve(J, r);
  MatrixXd by = MatrixXd::Zero(e.at.x.size() + e.at.u.size() + e.at.p.size(), count);
  for (Index k = 0; k < p.n(); ++k) by.row(p.unknowns[std::size_t(k)]) = dz.row(k) * p.nominal[k];
  for (Index j = 0; j < count; ++j) by(parameters[std::size_t(j)], j) = 1.0;
  return by;
}

VectorXd steps_along(const OperatingPoint& at, const std::vector<Index>& parameters) {
  VectorXd steps(std::ssize(parameters));
  for (Index j = 0; j < steps.size(); ++j)
    steps[j] = 1e-5 * std::max(std::abs(value_of(at, parameters[std::size_t(j)])), 1e-3);
  return steps;
}

std::vector<MatrixXd> jacobian_slopes(const Model& model, const OperatingPoint& at,
                                      const MatrixXd& by, const VectorXd& steps,
                                      const std::vector<Index>& along) {
  std::vector<MatrixXd> slopes;
  for (Index j = 0; j < by.cols(); ++j) {
    const double h = steps[j];
    const MatrixXd ahead = jacobian(model, moved(at, h * by.col(j)), along);
    const MatrixXd behind = jacobian(model, moved(at, -h * by.col(j)), along);
    slopes.emplace_back((ahead - behind) / (2 * h));
  }
  return slopes;
}

// dλᵢ = wᵢᵀ dA vᵢ, dA along the parameter and the shift of the trim.               [26, eq. 2.3]
EigenvalueSlopes spectrum_of(const Prepared& sweep, const GridTrim& e,
                             const std::vector<Index>& parameters) {
  EigenvalueSlopes spectrum;
  const Index n = sweep.states();
  const MatrixXd own = e.A(sweep);
  if (!own.allFinite()) return spectrum;
  const Balanced balanced = balance(own);
  const dense::Eigensystem found =
      parameters.empty() ? dense::eigenvalues(balanced.B) : dense::eigensystem(balanced.B);
  if (!found.converged) return spectrum;
  spectrum.eigenvalues = found.values;
  if (parameters.empty()) return spectrum;
  const MatrixXd parts = weights_of(balanced, found.V);
  const MatrixXd by = shifts(sweep, e, parameters);
  std::vector<Index> states;
  for (Index i = 0; i < n; ++i) states.push_back(i);
  spectrum.slopes.resize(n, std::ssize(parameters));
  const std::vector<MatrixXd> changes =
      jacobian_slopes(sweep.model(), e.at, by, steps_along(e.at, parameters), states);
  for (std::size_t j = 0; j < parameters.size(); ++j) {
    const MatrixXd dA = changes[j].topRows(n);
    const VectorXd d = parts.transpose() * dA.reshaped();
    spectrum.slopes.col(Index(j)).real() = d.head(n);
    spectrum.slopes.col(Index(j)).imag() = d.tail(n);
  }
  return spectrum;
}

}  // namespace tiltrim
