// Gains whose control law is nearest to linear-quadratic regulators.
#include <fmt/core.h>

#include <cmath>
#include <stdexcept>
#include <vector>

#include "dense/dense.hpp"
#include "design/regulator.hpp"
#include "model/differentiate.hpp"
#include "runtime/rounding.hpp"
#include "tune/candidate.hpp"

namespace tiltrim {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

// A point's loops opened: x' = A x + B u, closed by u = F x, and dF by each gain. In nominal units.
struct Opened {
  MatrixXd A, B, F;
  std::vector<MatrixXd> slopes;
};

VectorXd nominal_sizes(const Signals& signals) {
  VectorXd sizes(std::ssize(signals));
  for (Index i = 0; i < sizes.size(); ++i) sizes[i] = signals[std::size_t(i)].nominal;
  return sizes;
}

Opened opened_at(const Place& place, OperatingPoint at) {
  const Model& model = *place.loops;
  const Index n = std::ssize(model.states), m = std::ssize(model.inputs);
  at.u = VectorXd::Zero(m);
  const VectorXd x = nominal_sizes(model.states);
  std::vector<Index> along, rows;
  VectorXd u(m);
  for (Index i = 0; i < n + m; ++i) along.push_back(i);
  for (Index j = 0; j < m; ++j) {
    const std::string& added = model.inputs[std::size_t(j)].name;
    rows.push_back(n + index_of(model.outputs, added.substr(0, added.rfind("_added")), "output"));
    u[j] = model.outputs[std::size_t(rows.back() - n)].nominal;
  }
  const auto scaled = [&](const MatrixXd& J) -> MatrixXd {
    return u.cwiseInverse().asDiagonal() * J(rows, Eigen::seqN(0, n)) * x.asDiagonal();
  };
  const MatrixXd J = jacobian(model, at, along);
  Opened open;
  open.F = scaled(J);
  // u = F x + (I + D) a for an added a, x' = (A + B F) x + B (I + D) a
  const MatrixXd D = MatrixXd::Identity(m, m) + J(rows, Eigen::lastN(m));
  const MatrixXd BD = J.topRightCorner(n, m);
  const MatrixXd B = dense::solve(MatrixXd(D.transpose()), MatrixXd(BD.transpose())).transpose();
  open.B = x.cwiseInverse().asDiagonal() * B * u.asDiagonal();
  open.A = x.cwiseInverse().asDiagonal() * J.topLeftCorner(n, n) * x.asDiagonal();
  open.A -= open.B * open.F;
  MatrixXd by = MatrixXd::Zero(n + m + at.p.size(), std::ssize(place.gains));
  std::vector<Index> gains;
  for (std::size_t j = 0; j < place.gains.size(); ++j) {
    const std::string& name = signal_of(place.request.model, place.gains[j]).name;
    gains.push_back(variable(model, name));
    by(gains.back(), Index(j)) = 1.0;
  }
  for (const MatrixXd& dJ : jacobian_slopes(model, at, by, steps_along(at, gains), along))
    open.slopes.push_back(scaled(dJ));
  return open;
}

// What remains of F = -K at one point, and its derivatives by the tuned values.
struct Fit {
  MatrixXd J;
  VectorXd left;
};

void append(Fit& fit, const Place& place, const Opened& open, const MatrixXd& K) {
  const Index rows = K.size(), before = fit.left.size(), each = place.shares.size();
  fit.left.conservativeResize(before + rows);
  fit.J.conservativeResize(before + rows, std::ssize(open.slopes) * each);
  fit.left.tail(rows) = (-K - open.F).reshaped();
  for (Index j = 0; j < std::ssize(open.slopes); ++j)
    fit.J.block(before, j * each, rows, each) =
        open.slopes[std::size_t(j)].reshaped() * place.shares.transpose();
}

VectorXd within_bounds(const TuneProblem& problem, VectorXd values) {
  const std::size_t each = problem.variables() / problem.gains.size();
  for (Index i = 0; i < values.size(); ++i) {
    const FreeGain& gain = problem.gains[std::size_t(i) / each];
    values[i] = std::clamp(values[i], gain.lower, gain.upper);
  }
  return values;
}

}  // namespace

std::vector<VectorXd> regulator_starts(const TuneProblem& problem, const VectorXd& at,
                                       const std::vector<double>& efforts,
                                       const TrimOptions& trimming) {
  const RoundToNearest environment;
  constexpr int steps =
      5;  // of Gauss and Newton; one suffices for a law that is linear in its gains
  if (problem.loops.size() != problem.points.size())
    throw std::invalid_argument(
        "regulator starts for models whose loops cannot be opened; expected for each point a model "
        "whose inputs act after the actuators");
  if (at.size() != Index(problem.variables()))
    throw std::invalid_argument(
        fmt::format("{} numbers for a problem that has {}", at.size(), problem.variables()));
  Candidates candidates(problem, trimming);
  std::vector<VectorXd> starts;
  for (const double effort : efforts) {
    if (!(effort > 0) || !std::isfinite(effort))
      throw std::invalid_argument(
          fmt::format("a regulator with an effort of {}; expected a positive number", effort));
    VectorXd values = within_bounds(problem, at);
    bool found = false;
    for (int step = 0; step < steps; ++step) {
      const std::vector<PlaceModes> modes = candidates.at(values, false);
      Fit fit;
      for (std::size_t p = 0; p < modes.size(); ++p) {
        if (!modes[p].valid()) continue;
        const Place& place = candidates.places()[p];
        const Opened open = opened_at(place, modes[p].at);
        const Index n = open.A.rows(), m = open.B.cols();
        if (!open.A.allFinite() || !open.B.allFinite()) continue;
        const Regulator regulator =
            lqr(open.A, open.B, MatrixXd::Identity(n, n), effort * MatrixXd::Identity(m, m));
        if (regulator) append(fit, place, open, regulator.K);
      }
      if (fit.left.size() == 0 || !fit.J.allFinite()) break;
      found = true;
      values = within_bounds(problem, values + dense::least_squares(fit.J, fit.left));
    }
    if (found) starts.push_back(values);
  }
  return starts;
}

}  // namespace tiltrim
