#include "study/flown.hpp"

#include <algorithm>
#include <cmath>
#include <memory>
#include <numbers>
#include <stdexcept>

#include "study/problems.hpp"
#include "vehicles/tiltrotor/numbers.hpp"

namespace tiltrim {

namespace {

constexpr double lost = 10.0;      // figures of flights that end early start here
constexpr double early = 90.0;     // and grow by up to this, the earlier the end
constexpr double far_off = 100.0;  // cap for a single sample

// The largest ratio to its tolerance of the final deviations and of the attitude throughout.
double missed(const FlightPlan& plan, const MonteCarloTable& allowed, const FlightResult& flown,
              const FlightPoint& end) {
  double theta = 0.0;
  for (const FlightState& x : flown.states) theta = std::max(theta, std::abs(x.theta));
  const double attitude = theta / allowed.theta_within;
  if (plan.lands) return attitude;
  return std::max({attitude, std::abs(end.V - end.command.V) / allowed.V_within,
                   std::abs(end.gamma - end.command.gamma) / allowed.gamma_within});
}

// √(mean of ((V - Vd)/1 m/s)² + ((γ - γd)/0.1 rad)²)
double tracked(const Flight& flight, const FlightResult& flown) {
  constexpr double speed = 1.0, angle = 0.1;  // m/s, rad: scale of the errors
  double sum = 0.0;
  for (std::size_t k = 0; k < flown.t.size(); ++k) {
    const FlightPoint at = flight_point(flight, flown.modes[k], flown.t[k], flown.states[k]);
    const double V = (at.V - at.command.V) / speed;
    const double gamma = std::remainder(at.gamma - at.command.gamma, 2 * std::numbers::pi) / angle;
    sum += std::min(V * V + gamma * gamma, far_off * far_off);
  }
  return std::sqrt(sum / double(flown.t.size()));
}

// "flight" and "tracking".
std::vector<double> figures(const FlightPlan& plan, const MonteCarloTable& allowed,
                            const Eigen::VectorXd& p) {
  Flight flight = plan.flight;
  flight.vehicle = vehicle_from(flight.vehicle, p).vehicle;
  const FlightResult flown = fly(flight, plan.start, plan.options);
  const bool whole = flown.status == (plan.lands ? FlightStatus::landed : FlightStatus::flown);
  if (!whole) {
    const double end = lost + early * (1 - flown.t.back() / plan.options.duration);
    return {end, end};
  }
  const FlightPoint end =
      flight_point(flight, flown.modes.back(), flown.t.back(), flown.states.back());
  return {std::min(missed(plan, allowed, flown, end), lost),
          std::min(tracked(flight, flown), lost)};
}

}  // namespace

decltype(TuneProblem::figures) flight_figures(const Study& study) {
  FlightPlan plan = flight_plan(study);
  if (!is_equilibrium(plan.start_status))
    throw std::invalid_argument("the flight of [simulate] has no trim to start from: " +
                                plan.message);
  if (!plan.flight.gains.eta.empty())
    throw std::invalid_argument(
        "flight and tracking need gains that do not depend on the tilt; expected no "
        "schedule_eta_deg");
  plan.options.integrate.tolerance = std::max(plan.options.integrate.tolerance, 1e-7);
  plan.options.integrate.sample = std::max(plan.options.integrate.sample, 0.25);
  plan.options.integrate.max_steps = 100'000;  // a candidate this stiff is rejected
  plan.options.integrate.max_events = 3'000;   // and one that chatters this long
  const MonteCarloTable allowed = study.montecarlo.value_or(MonteCarloTable{});
  return figures_together({"flight", "tracking"}, [plan, allowed](const Eigen::VectorXd& p) {
    return figures(plan, allowed, p);
  });
}

}  // namespace tiltrim
