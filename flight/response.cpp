#include "flight/flight.hpp"
#include "flight/fly.hpp"
#include "linearize/linearize.hpp"
#include "runtime/rounding.hpp"
#include "simulate/comparison.hpp"
#include "vehicles/tiltrotor/corridor.hpp"
#include "vehicles/tiltrotor/numbers.hpp"

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

}  // namespace

Response response(const Flight& flight, const Command& command,
                  const std::map<std::string, double>& offset, const ResponseOptions& options) {
  const RoundToNearest environment;
  Response answer;
  answer.states = flight_signals(Axes::wind);
  answer.states.resize(states);
  answer.offset = offset_of(answer.states, offset);

  Flight steady = flight;
  steady.schedule = held(command);
  steady.axes = Axes::wind;
  steady.wind = {};
  steady.disturbance = {};
  steady.kink_times.clear();
  steady.rates = {};
  steady.vehicle.gains = gains_at(steady, command.eta);
  steady.gains = {};
  constexpr double high = 1e6;  // m: no ground
  const TrimmedStart trim = trimmed_start(steady, command, high, options.trimming);
  answer.message = trim.message;
  if (!trim) return answer;
  VectorXd x(states);
  x << 0, 0, trim.start.state.theta, trim.start.state.q, trim.start.state.x1, trim.start.state.x2;
  const Model model = closed_loop(steady.vehicle);
  const LinearModel linear =
      linearize(model, {x, VectorXd(), closed_loop_parameters(steady.vehicle, command)});
  answer.message = linear.message;
  if (!linear) return answer;
  // V_err and gamma_err are commanded minus actual: opposite sign.
  VectorXd sign = VectorXd::Ones(states);
  sign.head(2).setConstant(-1);
  const MatrixXd A = sign.asDiagonal() * linear.A * sign.asDiagonal();
  const auto moved_by = [&](const VectorXd& by) -> comparing::Nonlinear {
    // Wind axes are singular there; fly() reports this for the requested offset.
    if (by != answer.offset && !(trim.start.state.along + by[0] > 0)) return {};
    FlyOptions flying;
    flying.duration = options.duration;
    flying.integrate.tolerance = options.tolerance;
    flying.integrate.sample = options.sample;
    const FlightResult flown = fly(steady, {moved(trim.start.state, by), false}, flying);
    comparing::Nonlinear motion{flown.t, MatrixXd(states, std::ssize(flown.t)), bool(flown),
                                flown.message};
    for (std::size_t i = 0; i < flown.t.size(); ++i)
      motion.x.col(Index(i)) = wind_axes(flown.states[i]) - wind_axes(trim.start.state);
    return motion;
  };
  comparing::compare(moved_by, A, options, answer);
  return answer;
}

}  // namespace tiltrim
