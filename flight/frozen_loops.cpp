#include "flight/frozen_loops.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <optional>

#include "dense/dense.hpp"
#include "flight/closed_loop_sweep.hpp"
#include "flight/flight.hpp"
#include "linearize/linearize.hpp"
#include "linearize/modes.hpp"
#include "model/degrees.hpp"
#include "model/lookup.hpp"
#include "sweep/sweep.hpp"
#include "vehicles/tiltrotor/corridor.hpp"
#include "vehicles/tiltrotor/numbers.hpp"

namespace tiltrim {

using Eigen::Index;
using Eigen::MatrixXd;

namespace {

constexpr int finer = 4;     // check points per grid point of the certificate
constexpr int halvings = 5;  // of the grid, until the certificate holds between its points

// ---- Frozen loops ------------------------------------------------------------------------------

Command command_at(double eta) {
  Command command = corridor(corridor_height(eta));
  command.eta = eta;
  return command;
}

// An axis through the corridor's points at these tilts, with scheduled gains.
SweepAxis axis_of(const Flight& flight, const std::vector<double>& tilts) {
  SweepAxis axis{"eta", {}};
  const auto column = [&](const std::string& name, const auto& value) {
    SweepAxis::Column c{name, "", name, {}, {}};
    for (const double eta : tilts) c.si.push_back(value(eta));
    c.values = c.si;
    axis.columns.push_back(std::move(c));
  };
  column("eta", [](double eta) { return eta; });
  column("V", [](double eta) { return command_at(eta).V; });
  column("gamma", [](double eta) { return command_at(eta).gamma; });
  if (flight.gains.eta.empty()) return axis;
  const Signals gains = gain_signals();
  for (std::size_t j = 0; j < gains.size(); ++j)
    column(gains[j].name, [&](double eta) {
      Gains k = gains_at(flight, eta);
      return gain_value(k, j);
    });
  return axis;
}

}  // namespace

std::vector<FrozenLoop> frozen_loops(const Flight& flight, std::vector<double> tilts,
                                     const TiltRateOptions& options, std::string& why) {
  const Command first = command_at(tilts.front());
  std::ranges::reverse(tilts);  // an axis rises
  const std::vector<SweepAxis> axes{axis_of(flight, tilts)};
  SweepOptions sweeping;
  sweeping.crossings = false;
  sweeping.threads = options.threads;
  sweeping.trimming = options.trimming;
  sweeping.stop = options.stop;
  SweepMap map;
  try {
    map = sweep({closed_loop_request(flight.vehicle, "corridor", first, axes)}, axes, sweeping);
  } catch (const SweepInterrupted&) {
    return {};
  }
  const Model model = closed_loop(flight.vehicle);
  const Eigen::VectorXd sizes = nominals(model.states);
  std::vector<FrozenLoop> loops;
  for (std::size_t k = tilts.size(); k-- > 0;) {
    const double eta = tilts[k];
    if (!is_equilibrium(TrimStatus(map.status[k]))) {
      why = fmt::format("no trim at a tilt of {:.4g}°: {}", eta * degrees,
                        map.reasons[std::size_t(map.reason[k])]);
      return {};
    }
    FrozenLoop loop;
    loop.eta = eta;
    loop.command = command_at(eta);
    Vehicle vehicle = flight.vehicle;
    vehicle.gains = gains_at(flight, eta);
    const Eigen::VectorXd x = Eigen::Map<const Eigen::VectorXd>(map.state.data() + k * 6, 6);
    const LinearModel linear =
        linearize(model, {x, Eigen::VectorXd(), closed_loop_parameters(vehicle, loop.command)});
    if (!linear) {
      why = fmt::format("no linear model at a tilt of {:.4g}°: {}", eta * degrees, linear.message);
      return {};
    }
    loop.trim.theta = x[2];
    loop.trim.x1 = x[4];
    loop.trim.x2 = x[5];
    loop.A = sizes.cwiseInverse().asDiagonal() * linear.A * sizes.asDiagonal();
    loop.abscissa = map.spectral_abscissa[k];
    loops.push_back(std::move(loop));
  }
  return loops;
}
namespace {

std::vector<double> between(double from, double to, int count) {
  std::vector<double> all;
  for (int k = 0; k < count; ++k) all.push_back(from + (to - from) * k / (count - 1));
  return all;
}
}  // namespace

// Between the ends, the handover and the tilts at which scheduled gains have kinks.
std::vector<std::vector<double>> stretches_of(const Flight& flight, const TiltRateOptions& o) {
  const double off = flight.vehicle.aircraft.cyclic_off;
  const bool switches = !(flight.vehicle.aircraft.cyclic_blend > 0) && off > o.to && off < o.from;
  std::vector<double> ends{o.from, o.to};
  for (const double knot : flight.gains.eta)
    if (knot > o.to && knot < o.from && !(switches && std::abs(knot - off) <= 2 * hair))
      ends.push_back(knot);
  if (switches) ends.insert(ends.end(), {off + hair, off - hair});
  std::ranges::sort(ends, std::greater<>());
  std::vector<std::vector<double>> stretches;
  for (std::size_t k = 0; k + 1 < ends.size(); ++k) {
    const double share = (ends[k] - ends[k + 1]) / (o.from - o.to);
    if (ends[k] - ends[k + 1] <= 3 * hair) continue;  // the handover itself, to rounding
    stretches.push_back(between(ends[k], ends[k + 1], std::max(3, int(o.loops * share))));
  }
  return stretches;
}

// ---- Linear theory -----------------------------------------------------------------------------

namespace {

// AᵀP + PA = -I, written out for the entries of P.
MatrixXd lyapunov(const MatrixXd& A) {
  const Index n = A.rows();
  MatrixXd sum = MatrixXd::Zero(n * n, n * n);
  for (Index i = 0; i < n; ++i)
    for (Index j = 0; j < n; ++j)
      for (Index k = 0; k < n; ++k) {
        sum(i * n + j, k * n + j) += A(k, i);
        sum(i * n + j, i * n + k) += A(k, j);
      }
  const MatrixXd I = -MatrixXd::Identity(n, n);
  const Eigen::VectorXd p = dense::solve(sum, I.reshaped());
  const MatrixXd P = p.reshaped(n, n);
  return (P + P.transpose()) / 2;
}

double largest(const MatrixXd& symmetric) {
  return dense::symmetric_eigenvalues(symmetric).maxCoeff();
}

// V' = eᵀ(AᵀP + PA + η' P')e with η' = -rate: the largest rate at which V falls at every point.
SlowTilt certified(const std::vector<FrozenLoop>& coarse, const std::vector<FrozenLoop>& fine) {
  SlowTilt answer;
  answer.from = coarse.front().eta;
  answer.to = coarse.back().eta;
  answer.stable = std::ranges::all_of(fine, [](const FrozenLoop& l) { return l.abscissa < 0; });
  if (!answer.stable) return answer;
  std::vector<MatrixXd> P;
  for (const FrozenLoop& loop : coarse) P.push_back(lyapunov(loop.A));
  struct Point {
    MatrixXd falls, slope;  // -(AᵀP + PA), -dP/dη
    double eta;
  };
  std::vector<Point> points;
  std::size_t k = 0;
  for (const FrozenLoop& loop : fine) {
    while (k + 2 < coarse.size() && loop.eta < coarse[k + 1].eta) ++k;
    const double width = coarse[k].eta - coarse[k + 1].eta;
    const double share = (coarse[k].eta - loop.eta) / width;
    const MatrixXd here = (1 - share) * P[k] + share * P[k + 1];
    const MatrixXd AP = loop.A.transpose() * here;
    points.push_back({-(AP + AP.transpose()), (P[k + 1] - P[k]) / width, loop.eta});
  }
  double rate = std::numeric_limits<double>::infinity();
  for (const Point& p : points) {
    const std::optional<MatrixXd> root = dense::cholesky(p.falls);
    double here = 0.0;  // between two frozen loops the interpolated P need not decrease
    if (root) {
      const MatrixXd half = dense::solve_lower(*root, p.slope);
      const double worst = largest(dense::solve_lower(*root, half.transpose()));
      here = worst > 0 ? 1 / worst : std::numeric_limits<double>::infinity();
    }
    if (here >= rate) continue;
    rate = here;
    answer.decided_at = p.eta;
  }
  constexpr double reserve = 0.99;
  answer.certified = reserve * rate;
  answer.certificate = -std::numeric_limits<double>::infinity();
  for (const Point& p : points)
    answer.certificate =
        std::max(answer.certificate, largest(answer.certified * p.slope - p.falls));
  if (!(answer.certificate < 0)) answer.certified = 0.0;
  return answer;
}
}  // namespace

// ‖Φ(t, s)‖ over the transition at a rate: products of matrix exponentials, one per frozen loop.
Growth growth(const std::vector<FrozenLoop>& loops, double rate) {
  Growth answer{rate, 1.0, 1.0};
  const Index n = loops.front().A.rows();
  std::vector<MatrixXd> since;  // from each earlier point to the current one
  for (std::size_t k = 0; k + 1 < loops.size(); ++k) {
    const double dt = (loops[k].eta - loops[k + 1].eta) / rate;
    const MatrixXd step = dense::exponential((loops[k].A + loops[k + 1].A) / 2 * dt);
    since.emplace_back(MatrixXd::Identity(n, n));
    for (MatrixXd& phi : since) {
      phi = step * phi;
      answer.worst = std::max(answer.worst, dense::spectral_norm(phi));
    }
  }
  answer.whole = dense::spectral_norm(since.front());
  return answer;
}

SlowTilt slow_tilt(const Flight& flight, const std::vector<double>& tilts,
                   const TiltRateOptions& options) {
  SlowTilt answer{tilts.front(), tilts.back()};
  int nodes = int(tilts.size());
  for (int k = 0; k <= halvings && answer.certified == 0; ++k, nodes = 2 * nodes - 1) {
    std::string why;
    const auto fine = frozen_loops(
        flight, between(tilts.front(), tilts.back(), (nodes - 1) * finer + 1), options, why);
    if (fine.empty()) break;  // no trim between two tilts that have one
    std::vector<FrozenLoop> coarse;
    for (std::size_t i = 0; i < fine.size(); i += finer) coarse.push_back(fine[i]);
    answer = certified(coarse, fine);
    if (!answer.stable) break;
  }
  return answer;
}

}  // namespace tiltrim
