#include "qualities/coordinates.hpp"

#include <fmt/core.h>

#include <cmath>
#include <stdexcept>

#include "dense/dense.hpp"
#include "model/lookup.hpp"

namespace tiltrim {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::RowVectorXd;
using Eigen::VectorXcd;
using Eigen::VectorXd;

namespace {

// The state or output as a combination of states; empty without a name.
RowVectorXd row_of(const LinearModel& linear, const std::string& name) {
  if (name.empty()) return {};
  const Index state = find(linear.states, name);
  if (state >= 0) return RowVectorXd::Unit(linear.A.rows(), state);
  return linear.C.row(index_of(linear.outputs, name, "state or output"));
}

}  // namespace

RoleCoordinates role_coordinates(const LinearModel& linear, const Roles& roles) {
  const Index n = linear.A.rows();
  RoleCoordinates at{MatrixXd::Identity(n, n), {}};
  std::vector<bool> taken(std::size_t(n), false);
  const auto place = [&](const std::string& name, bool state) -> Index {
    const RowVectorXd row = row_of(linear, name);
    if (row.size() == 0 || (find(linear.states, name) >= 0) != state) return -1;
    Index most = -1;
    double largest = 0.0;
    for (Index k = 0; k < n; ++k) {
      const double size = std::abs(row[k]) * linear.states[std::size_t(k)].nominal;
      if (!taken[std::size_t(k)] && size > largest) {
        most = k;
        largest = size;
      }
    }
    if (most < 0)
      throw std::invalid_argument("qualities: '" + name +
                                  "' depends on no state but those that have another role");
    taken[std::size_t(most)] = true;
    at.T.row(most) = row;
    return most;
  };
  const std::string& attack = roles.alpha.empty() ? roles.downward_speed : roles.alpha;
  for (const bool state : {true, false}) {  // states first: they keep their places
    at.pitch_rate = std::max(at.pitch_rate, place(roles.pitch_rate, state));
    at.pitch = std::max(at.pitch, place(roles.pitch, state));
    at.speed = std::max(at.speed, place(roles.speed, state));
    at.height = std::max(at.height, place(roles.height, state));
    at.attack = std::max(at.attack, place(attack, state));
  }
  at.inverse = dense::solve(at.T, MatrixXd(MatrixXd::Identity(n, n)));
  if (!at.inverse.allFinite())
    throw std::invalid_argument("qualities: the roles' signals depend on each other");
  return at;
}

std::vector<Qualities::ModeShares> shares_of(const Modes& modes, const RoleCoordinates& at) {
  std::vector<Qualities::ModeShares> all;
  for (const Mode& mode : modes.modes) {
    // T v and T⁻ᵀ w: the participation of coordinate k is |(T v)ₖ (T⁻ᵀ w)ₖ|
    const VectorXcd right = at.T * mode.right, left = at.inverse.transpose() * mode.left;
    VectorXd share = right.cwiseAbs().cwiseProduct(left.cwiseAbs());
    if (share.sum() > 0) share /= share.sum();
    const auto of = [&](Index k) { return k < 0 ? 0.0 : share[k]; };
    all.push_back({of(at.attack) + of(at.pitch_rate), of(at.speed) + of(at.pitch) + of(at.height)});
  }
  return all;
}

double airspeed_of(const LinearModel& linear, const QualitiesOptions& options) {
  if (!std::isnan(options.airspeed)) return options.airspeed;
  const auto value = [&](const std::string& name) {
    const Index k = find(linear.states, name);
    return k < 0 || linear.point.x.size() <= k ? 0.0 : linear.point.x[k];
  };
  const double speed = std::hypot(value(options.roles.speed), value(options.roles.downward_speed));
  return speed > 0 ? speed : std::numeric_limits<double>::quiet_NaN();
}

namespace {

// M x = -b: the fast states after a unit step of the stick, and an error bound of each.
struct QuasiSteady {
  std::vector<Index> states;
  VectorXd x, error;
};

// Fast states: those that the angle of attack and the pitch rate depend on, with speed, attitude
// and height held.
std::vector<Index> fast_states(const MatrixXd& A, const RoleCoordinates& at) {
  std::vector<bool> in(std::size_t(A.rows()), false);
  std::vector<Index> kept{at.attack, at.pitch_rate};
  for (const Index k : kept) in[std::size_t(k)] = true;
  for (std::size_t next = 0; next < kept.size(); ++next)
    for (Index j = 0; j < A.rows(); ++j) {
      const bool held = j == at.speed || j == at.pitch || j == at.height;
      if (held || in[std::size_t(j)] || A(kept[next], j) == 0) continue;
      in[std::size_t(j)] = true;
      kept.push_back(j);
    }
  return kept;
}

QuasiSteady quasi_steady(const LinearModel& linear, const RoleCoordinates& at, Index stick) {
  const double ulp = 8 * double(linear.A.rows() + 4) * std::numeric_limits<double>::epsilon();
  const MatrixXd sizes = at.T.cwiseAbs(), back = at.inverse.cwiseAbs();
  const MatrixXd A = at.T * linear.A * at.inverse;
  const MatrixXd A_error = sizes * (linear.A_error + ulp * linear.A.cwiseAbs()) * back;
  const VectorXd b = at.T * linear.B.col(stick);
  const VectorXd b_error =
      sizes * (linear.B_error.col(stick) + ulp * linear.B.col(stick).cwiseAbs());
  MatrixXd links = A;  // an exact zero stays one
  for (Index i = 0; i < A.rows(); ++i)
    for (Index j = 0; j < A.cols(); ++j)
      if (std::abs(A(i, j)) <= A_error(i, j)) links(i, j) = 0;
  const std::vector<Index> kept = fast_states(links, at);
  const MatrixXd M = A(kept, kept), M_error = A_error(kept, kept);
  const Index n = M.rows();
  const MatrixXd R = dense::solve(M, MatrixXd(MatrixXd::Identity(n, n)));
  QuasiSteady q{kept, dense::solve(M, VectorXd(-b(kept))), {}};
  // |x - true| <= |R| (|M x + b| + M_error |x| + b_error) + (|I - R M| + |R| M_error) |x - true|
  const MatrixXd size = R.cwiseAbs();
  const MatrixXd shrink =
      (MatrixXd::Identity(n, n) - R * M).cwiseAbs() + size * (M_error + ulp * M.cwiseAbs());
  const VectorXd first =
      size * ((M * q.x + VectorXd(b(kept))).cwiseAbs() + M_error * q.x.cwiseAbs() +
              VectorXd(b_error(kept)) + ulp * (M.cwiseAbs() * q.x.cwiseAbs()));
  const VectorXd e = dense::solve(MatrixXd(MatrixXd::Identity(n, n) - shrink), first);
  const bool bounded = shrink.rowwise().sum().maxCoeff() < 1 && e.allFinite();
  q.error = bounded ? VectorXd(1.01 * e.cwiseAbs())
                    : VectorXd::Constant(n, std::numeric_limits<double>::infinity());
  return q;
}

// (v ± e) scaled, and the quotient of two bounded values.
Bounded quotient(const Bounded& a, const Bounded& b) {
  if (!(std::abs(b.value) > b.error)) return {};
  const double ratio = a.value / b.value;
  return {ratio, (a.error + std::abs(ratio) * b.error) / (std::abs(b.value) - b.error)};
}

// A signal after the step, with the held states at rest.
Bounded signal_after(const QuasiSteady& q, const RowVectorXd& c, const RowVectorXd& c_error,
                     double d, double d_error) {
  Bounded all{d, d_error};
  for (std::size_t k = 0; k < q.states.size(); ++k) {
    all.value += c[q.states[k]] * q.x[Index(k)];
    all.error += std::abs(c[q.states[k]]) * q.error[Index(k)] +
                 c_error[q.states[k]] * (std::abs(q.x[Index(k)]) + q.error[Index(k)]);
  }
  return all;
}

Bounded scaled(const Bounded& a, double factor) {
  return {a.value * factor, a.error * std::abs(factor)};
}

// Standard gravity in the unit of a signal in m/s or ft/s, or per second of these, unless the
// options give another.
double gravity_by(const Signal& signal, const QualitiesOptions& options) {
  constexpr double standard = 9.80665, foot = 0.3048;
  if (!std::isnan(options.gravity)) return options.gravity;
  const std::string& unit = signal.unit;
  if (unit.empty() || unit.starts_with("m/s") || unit.starts_with("m s")) return standard;
  if (unit.starts_with("ft/s") || unit.starts_with("ft s")) return standard / foot;
  throw std::invalid_argument(
      fmt::format("qualities: {} is in {}; expected gravity, in the units of airspeed and s",
                  signal.name, unit));
}

// By the first of these roles that a state has, or by a speed that is an output; SI without one.
double gravity_of(const LinearModel& linear, const QualitiesOptions& options) {
  for (const std::string& name : {options.roles.downward_speed, options.roles.speed})
    if (const Index k = find(linear.states, name); k >= 0)
      return gravity_by(linear.states[std::size_t(k)], options);
  if (const Index k = find(linear.outputs, options.roles.speed); k >= 0)
    return gravity_by(linear.outputs[std::size_t(k)], options);
  return gravity_by({}, options);
}

// In g for a unit stick: the output's own value, or U q/g, since at constant speed and angle of
// attack the path turns at the pitch rate.
Bounded load_after(const LinearModel& linear, const RoleCoordinates& at, const QuasiSteady& q,
                   const QualitiesOptions& options, Index stick, double airspeed) {
  const std::string& name = options.roles.normal_acceleration;
  if (name.empty()) return scaled({q.x[1], q.error[1]}, airspeed / gravity_of(linear, options));
  const Index i = index_of(linear.outputs, name, "output");
  const Bounded load =
      signal_after(q, linear.C.row(i) * at.inverse, linear.C_error.row(i) * at.inverse.cwiseAbs(),
                   linear.D(i, stick), linear.D_error(i, stick));
  const Signal& output = linear.outputs[std::size_t(i)];
  const bool in_g = output.unit.empty() || output.unit == "g";
  return scaled(load, in_g ? 1.0 : 1.0 / gravity_by(output, options));
}

}  // namespace

Bounded acceleration_sensitivity(const LinearModel& linear, const RoleCoordinates& at,
                                 const QualitiesOptions& options, double airspeed,
                                 std::string& why) {
  if (!std::isnan(options.n_per_alpha)) return {options.n_per_alpha, 0.0};
  const Roles& roles = options.roles;
  if (at.attack < 0 || roles.stick.empty()) {
    why = "n/alpha needs the roles alpha (or downward_speed) and stick";
    return {};
  }
  const bool by_speed = roles.alpha.empty() || roles.normal_acceleration.empty();
  if (by_speed && !(airspeed > 0)) {
    why = "n/alpha needs the airspeed";
    return {};
  }
  const Index stick = index_of(linear.inputs, roles.stick, "input");
  const QuasiSteady q = quasi_steady(linear, at, stick);
  const Bounded load = load_after(linear, at, q, options, stick, airspeed);
  const Bounded attack = scaled({q.x[0], q.error[0]}, roles.alpha.empty() ? 1 / airspeed : 1.0);
  const Bounded ratio = quotient(load, attack);
  if (!(ratio.value > ratio.error)) {
    why = "n/alpha is not positive, or not known: no steady pull-up at constant speed";
    return {};
  }
  return ratio;
}

}  // namespace tiltrim
