// Gains whose control law is nearest to linear-quadratic regulators.
#include <fmt/core.h>

#include <cmath>
#include <functional>
#include <optional>
#include <stdexcept>
#include <vector>

#include "dense/dense.hpp"
#include "design/design.hpp"
#include "model/differentiate.hpp"
#include "model/lookup.hpp"
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

Opened opened_at(const Place& place, OperatingPoint at) {
  const Model& model = *place.loops;
  const Index n = std::ssize(model.states), m = std::ssize(model.inputs);
  at.u = VectorXd::Zero(m);
  const VectorXd x = nominals(model.states);
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

void check_loops_and_start(const TuneProblem& problem, const VectorXd& at) {
  if (problem.loops.size() != problem.points.size())
    throw std::invalid_argument(
        "regulator starts for models whose loops cannot be opened; expected for each point a model "
        "whose inputs act after the actuators");
  if (at.size() != Index(problem.variables()))
    throw std::invalid_argument(
        fmt::format("{} numbers for a problem that has {}", at.size(), problem.variables()));
}

// The tuned values nearest to the state feedback u = -K x that `feedback` has for each point; empty
// K: the point does not count. No values if none counts.
std::optional<VectorXd> nearest_to(
    Candidates& candidates, VectorXd values,
    const std::function<MatrixXd(const MatrixXd& A, const MatrixXd& B)>& feedback) {
  constexpr int steps =
      5;  // of Gauss and Newton; one suffices for a law that is linear in its gains
  bool found = false;
  for (int step = 0; step < steps; ++step) {
    const std::vector<PlaceModes> modes = candidates.at(values, false);
    Fit fit;
    for (std::size_t p = 0; p < modes.size(); ++p) {
      if (!modes[p].valid()) continue;
      const Place& place = candidates.places()[p];
      const Opened open = opened_at(place, modes[p].at);
      if (!open.A.allFinite() || !open.B.allFinite()) continue;
      if (const MatrixXd K = feedback(open.A, open.B); K.size() > 0) append(fit, place, open, K);
    }
    if (fit.left.size() == 0 || !fit.J.allFinite()) break;
    found = true;
    values = within_bounds(candidates.problem(), values + dense::least_squares(fit.J, fit.left));
  }
  if (!found) return {};
  return values;
}

}  // namespace

std::vector<VectorXd> regulator_starts(const TuneProblem& problem, const VectorXd& at,
                                       const std::vector<double>& efforts,
                                       const TrimOptions& trimming) {
  const RoundToNearest environment;
  check_loops_and_start(problem, at);
  Candidates candidates(problem, trimming);
  std::vector<VectorXd> starts;
  for (const double effort : efforts) {
    if (!(effort > 0) || !std::isfinite(effort))
      throw std::invalid_argument(
          fmt::format("a regulator with an effort of {}; expected a positive number", effort));
    const auto start = nearest_to(
        candidates, within_bounds(problem, at), [&](const MatrixXd& A, const MatrixXd& B) {
          const Index n = A.rows(), m = B.cols();
          const Regulator regulator =
              lqr(A, B, MatrixXd::Identity(n, n), effort * MatrixXd::Identity(m, m));
          return regulator ? regulator.K : MatrixXd();
        });
    if (start) starts.push_back(*start);
  }
  return starts;
}

std::vector<VectorXd> placed_starts(const TuneProblem& problem, const VectorXd& at,
                                    const std::vector<double>& decays,
                                    const TrimOptions& trimming) {
  const RoundToNearest environment;
  check_loops_and_start(problem, at);
  Candidates candidates(problem, trimming);
  std::vector<VectorXd> starts;
  for (const double decay : decays) {
    if (!(decay > 0) || !std::isfinite(decay))
      throw std::invalid_argument(
          fmt::format("poles placed at a decay of {}; expected a positive number", decay));
    const auto start = nearest_to(
        candidates, within_bounds(problem, at), [&](const MatrixXd& A, const MatrixXd& B) {
          const Index n = A.rows();
          const Eigen::VectorXcd poles = -VectorXd::LinSpaced(n, decay, 2 * decay);
          const Placement placement = place(A, B, poles);
          return placement ? placement.K : MatrixXd();
        });
    if (start) starts.push_back(*start);
  }
  return starts;
}

}  // namespace tiltrim
