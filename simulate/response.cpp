#include "simulate/response.hpp"

#include <fmt/core.h>

#include <array>
#include <cmath>
#include <stdexcept>
#include <unsupported/Eigen/MatrixFunctions>

#include "linearize/linearize.hpp"
#include "simulate/plan.hpp"
#include "simulate/schedule.hpp"

namespace tiltrim {

namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr Index states = 6;

VectorXd wind_axes(const FlightState& x) {
  VectorXd v(states);
  v << x.along, x.across, x.theta, x.q, x.x1, x.x2;
  return v;
}

FlightState moved(const FlightState& from, const VectorXd& by) {
  FlightState x = from;
  x.along += by[0];
  x.across += by[1];
  x.theta += by[2];
  x.q += by[3];
  x.x1 += by[4];
  x.x2 += by[5];
  return x;
}

VectorXd offset_of(const Signals& signals, const std::map<std::string, double>& offset) {
  VectorXd by = VectorXd::Zero(states);
  for (const auto& [name, value] : offset) by[index_of(signals, name, "state")] = value;
  if (by.isZero(0))
    throw std::invalid_argument("an offset of nothing; expected a state and its change");
  return by;
}

// ẋ = A x, sampled: x(t + dt) = exp(A dt) x(t).
MatrixXd linear_motion(const MatrixXd& A, const VectorXd& offset, double dt, Index samples) {
  const MatrixXd step = (A * dt).exp();
  MatrixXd x(states, samples);
  x.col(0) = offset;
  for (Index k = 1; k < samples; ++k) x.col(k) = step * x.col(k - 1);
  return x;
}

struct Motions {
  std::vector<double> t;
  MatrixXd linear, nonlinear;
  double apart = 0.0;
  FlightResult flown;
};

class Comparison {
 public:
  Comparison(const Flight& flight, const FlightStart& trim, const MatrixXd& A,
             const VectorXd& sizes, const ResponseOptions& options)
      : flight_(flight), trim_(trim), A_(A), sizes_(sizes), options_(options) {}

  Motions from(const VectorXd& offset) const {
    FlyOptions flying;
    flying.duration = options_.duration;
    flying.integrate.tolerance = options_.tolerance;
    flying.integrate.sample = options_.sample;
    Motions m;
    m.flown = fly(flight_, {moved(trim_.state, offset), false}, flying);
    const auto samples = Index(std::lround(options_.duration / options_.sample)) + 1;
    m.linear = linear_motion(A_, offset, options_.sample, samples);
    m.nonlinear = MatrixXd::Zero(states, samples);
    // Samples on the grid alone: at events there are two more.
    Index k = 0;
    for (std::size_t i = 0; i < m.flown.t.size() && k < samples; ++i) {
      if (std::abs(m.flown.t[i] - double(k) * options_.sample) > 1e-9 * options_.sample) continue;
      m.t.push_back(m.flown.t[i]);
      m.nonlinear.col(k++) = wind_axes(m.flown.states[i]) - wind_axes(trim_.state);
    }
    m.linear.conservativeResize(Eigen::NoChange, k);
    m.nonlinear.conservativeResize(Eigen::NoChange, k);
    const auto scaled = [&](const MatrixXd& x) {
      return (sizes_.cwiseInverse().asDiagonal() * x).cwiseAbs().maxCoeff();
    };
    m.apart = scaled(m.linear - m.nonlinear) / scaled(m.linear);
    return m;
  }

  // A nonlinear motion that ends early is as far apart as can be.
  bool together(const VectorXd& offset) const {
    if (!(trim_.state.along + offset[0] > 0)) return false;  // wind axes end there
    const Motions m = from(offset);
    return m.flown && m.apart <= options_.tolerated;
  }

 private:
  const Flight& flight_;
  const FlightStart& trim_;
  const MatrixXd& A_;
  const VectorXd& sizes_;
  const ResponseOptions& options_;
};

// The offset's multiple from which on the two are further apart than tolerated.
double reach(const Comparison& comparison, const VectorXd& offset, const ResponseOptions& options) {
  double near = 0.0, far = options.most;
  if (comparison.together(far * offset)) return far;
  for (double scale = 1.0; near == 0 && scale > 1e-6; scale /= 8)
    if (comparison.together(scale * offset))
      near = scale;
    else
      far = scale;
  constexpr double close = 1.001;
  for (int k = 0; k < 60 && near > 0 && far > close * near; ++k) {
    const double middle = std::sqrt(near * far);
    (comparison.together(middle * offset) ? near : far) = middle;
  }
  return near;
}

}  // namespace

std::string to_string(ResponseStatus status) {
  constexpr std::array names{"responded", "no_trim", "cut_short"};
  return names[std::size_t(status)];
}

Response response(const Flight& flight, const Command& command,
                  const std::map<std::string, double>& offset, const ResponseOptions& options) {
  Response answer;
  answer.states = flight_signals(Axes::wind);
  answer.states.resize(states);
  answer.command = command;
  answer.offset = offset_of(answer.states, offset);

  Flight still = flight;
  still.schedule = held(command);
  still.axes = Axes::wind;
  still.wind = {};
  still.disturbance = {};
  still.kink_times.clear();
  still.rates = {};
  still.vehicle.gains = gains_at(still, command.eta);
  still.gains = {};
  constexpr double high = 1e6;  // m: no ground
  const TrimmedStart trim = trimmed_start(still, command, high, options.trimming);
  answer.message = trim.message;
  if (!trim) return answer;
  VectorXd x(states);
  x << 0, 0, trim.start.state.theta, trim.start.state.q, trim.start.state.x1, trim.start.state.x2;
  const Model model = closed_loop(still.vehicle);
  const LinearModel linear =
      linearize(model, {x, VectorXd(), closed_loop_parameters(still.vehicle, command)});
  answer.message = linear.message;
  if (!linear) return answer;
  // V_err and gamma_err are commanded less actual: the other sign.
  VectorXd sign = VectorXd::Ones(states);
  sign.head(2).setConstant(-1);
  const MatrixXd A = sign.asDiagonal() * linear.A * sign.asDiagonal();
  const VectorXd sizes = nominals(answer.states);
  const Comparison comparison(still, trim.start, A, sizes, options);
  Motions motions = comparison.from(answer.offset);
  answer.status = motions.flown ? ResponseStatus::responded : ResponseStatus::cut_short;
  answer.message = motions.flown.message;
  answer.t = std::move(motions.t);
  answer.linear = std::move(motions.linear);
  answer.nonlinear = std::move(motions.nonlinear);
  answer.apart = motions.apart;
  answer.reach = reach(comparison, answer.offset, options);
  return answer;
}

}  // namespace tiltrim
