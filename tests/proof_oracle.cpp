#include "tests/proof_oracle.hpp"

#include <fmt/core.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

#include "linearize/linearize.hpp"
#include "model/lookup.hpp"
#include "vehicles/tiltrotor/along.hpp"
#include "vehicles/tiltrotor/corridor.hpp"
#include "vehicles/tiltrotor/formulations.hpp"
#include "vehicles/tiltrotor/numbers.hpp"

using namespace tiltrim;
using namespace tiltrim::checking;

namespace {

double value_of(const Ball& b) { return arf_get_d(arb_midref(b.get()), ARF_RND_NEAR); }

VehicleAndCommand vehicle_at_point(const Statement& s, const Study& study,
                                   const std::vector<double>& point) {
  Eigen::VectorXd p(Eigen::Index(names().size()));
  for (std::size_t i = 0; i < names().size(); ++i)
    p[Eigen::Index(i)] = value_of((s.numbers.*(names()[i].member)).value());
  VehicleAndCommand at = vehicle_from(study.vehicle, p);
  for (std::size_t k = 0; k < point.size(); ++k)
    if (!s.parameters[k].member) at.command = tiltrim::corridor(point[k]);
  if (!study.schedule.eta.empty()) at.vehicle.gains = gains_at(study.schedule, at.command.eta);
  p = closed_loop_parameters(at.vehicle, at.command);
  for (std::size_t k = 0; k < point.size(); ++k)
    for (std::size_t i = 0; i < names().size(); ++i)
      if (s.parameters[k].member == names()[i].member) p[Eigen::Index(i)] = point[k];
  return vehicle_from(study.vehicle, p);
}

// The state with these theta, theta0 and deflection: the commands are linear in each integral.
Eigen::VectorXd held_by(const Model& model, const OperatingPoint& at,
                        const std::array<double, 3>& z) {
  Eigen::VectorXd x = Eigen::VectorXd::Zero(6);
  x[2] = z[0];
  const auto outputs = [&] { return model.h(x, at.u, at.p); };
  const auto solve = [&](Eigen::Index integral, double wanted, const auto& command) {
    x[integral] = 0;
    const double none = command(outputs());
    x[integral] = 1;
    x[integral] = (wanted - none) / (command(outputs()) - none);
  };
  solve(4, z[1], [](const Eigen::VectorXd& y) { return y[0]; });
  solve(5, z[2], [](const Eigen::VectorXd& y) { return y[1] + y[2]; });
  return x;
}

// Whether a point of a leaf with a tube has a trim there with that verdict; empty if so.
std::string judged(const checking::Theorem& t, const Leaf& leaf, const VehicleAndCommand& at,
                   const std::vector<double>& point) {
  TrimProblem problem =
      without_integral_bounds(closed_loop_problem(at.vehicle, at.command, Axes::wind));
  std::string why = "no trim in the tube";
  for (const checking::Record& record : leaf.records) {
    std::array<double, 3> start = record.z;
    for (std::size_t k = 0; k < point.size(); ++k) {
      const checking::Bounds& of = leaf.box[k];
      const double d = (2 * point[k] - of.lower - of.upper) / (of.upper - of.lower);
      for (std::size_t i = 0; i < 3; ++i) start[i] += record.S[i][k] * d;
    }
    problem.guess.x << 0, 0, start[0], 0, start[1], start[2];
    if (t.statement.actuators) problem.guess.x = held_by(problem.model, problem.guess, start);
    TrimOptions options;
    options.method = TrimMethod::newton;
    options.starts = 0;
    const TrimResult trimmed = trim(problem.model, problem.spec, problem.guess, options);
    if (!trimmed) continue;
    std::array<double, 3> there{trimmed.point.x[2], trimmed.point.x[4], trimmed.point.x[5]};
    const Eigen::VectorXd& y = trimmed.outputs;
    if (t.statement.actuators) there = {trimmed.point.x[2], y[0], y[1] + y[2]};
    bool inside = true;
    for (std::size_t i = 0; i < 3; ++i)  // the trim's own tolerance beside the radius
      inside =
          inside && std::abs(there[i] - start[i]) <= record.Z[i] + 1e-8 * (1 + std::abs(start[i]));
    if (!inside) continue;
    const Eigen::VectorXcd lambda = linearize(problem.model, trimmed.point).A.eigenvalues();
    const double rightmost = lambda.real().maxCoeff();
    const double damping = (-lambda.real().array() / lambda.cwiseAbs().array()).minCoeff();
    const bool stable = rightmost < -t.statement.margin &&
                        (t.statement.damping == 0 || damping > t.statement.damping);
    if (stable == (leaf.claim == Claim::stable)) return {};
    why =
        fmt::format("rightmost eigenvalue {:.9g}, least damping ratio {:.9g}", rightmost, damping);
  }
  return why;
}

}  // namespace

OracleFindings oracle(const checking::Theorem& t, const Study& study, std::size_t count,
                      std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::vector<double> volumes;
  for (const Leaf& leaf : t.leaves) {
    double volume = leaf.claim == Claim::undecided ? 0 : 1;
    for (std::size_t k = 0; k < leaf.box.size(); ++k)
      volume *= leaf.box[k].upper - leaf.box[k].lower;
    volumes.push_back(volume);
  }
  std::discrete_distribution<std::size_t> leaves(volumes.begin(), volumes.end());
  OracleFindings found;
  for (std::size_t i = 0; i < count; ++i) {
    const Leaf& leaf = t.leaves[leaves(random)];
    std::vector<double> point;
    for (const checking::Bounds& of : leaf.box)
      point.push_back(std::uniform_real_distribution<double>(of.lower, of.upper)(random));
    constexpr std::size_t rarely = 100;
    if (leaf.claim == Claim::no_trim && i % rarely != 0) continue;
    const VehicleAndCommand at = vehicle_at_point(t.statement, study, point);
    std::string why;
    if (leaf.claim == Claim::no_trim)
      why = trim_closed_loop(at.vehicle, at.command) ? "a trim" : "";
    else
      why = judged(t, leaf, at, point);
    ++(leaf.claim == Claim::stable     ? found.stable
       : leaf.claim == Claim::unstable ? found.unstable
                                       : found.no_trim);
    if (why.empty()) continue;
    if (++found.contradictions > 1) continue;
    found.first = fmt::format("line {}: {}, at", leaf.line, why);
    for (const double x : point) found.first += fmt::format(" {:.17g}", x);
  }
  return found;
}
