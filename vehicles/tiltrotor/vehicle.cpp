#include "vehicles/tiltrotor/vehicle.hpp"

#include <algorithm>
#include <cmath>

#include "vehicles/tiltrotor/parameters.hpp"
#include "vehicles/tiltrotor/physics.hpp"

namespace tiltrim {

using namespace physics;

static Signals prefixed(std::string_view prefix, const auto& fields) {
  Signals signals;
  for (const auto& f : fields) signals.push_back({std::string(prefix) + f.name, f.unit, f.nominal});
  return signals;
}

Signals aircraft_signals() { return prefixed("aircraft.", aircraft_fields<double>()); }
Signals gain_signals() { return prefixed("gains.", gain_fields<double>()); }

AcceptedNumber accepted_number(std::string_view name) {
  const Signals aircraft = aircraft_signals();
  if (const auto at = find(aircraft, name); at >= 0)
    return aircraft_fields<double>().at(std::size_t(at)).accepted;
  return gain_fields<double>().at(std::size_t(index_of(gain_signals(), name, "gain"))).accepted;
}

double& aircraft_value(Aircraft& aircraft, std::size_t position) {
  return aircraft.*(aircraft_fields<double>().at(position).member);
}

double& gain_value(Gains& gains, std::size_t position) {
  return gains.*(gain_fields<double>().at(position).member);
}

static void append(std::vector<double>& p, const auto& numbers, const auto& fields) {
  for (const auto& f : fields) p.push_back(numbers.*(f.member));
}

static Eigen::VectorXd as_vector(const std::vector<double>& p) {
  return Eigen::Map<const Eigen::VectorXd>(p.data(), std::ssize(p));
}

Eigen::VectorXd airframe_parameters(const Vehicle& vehicle) {
  std::vector<double> p;
  append(p, vehicle.aircraft, aircraft_fields<double>());
  return as_vector(p);
}

Eigen::VectorXd closed_loop_parameters(const Vehicle& vehicle, const Command& command) {
  std::vector<double> p;
  append(p, command, command_fields<double>());
  append(p, vehicle.aircraft, aircraft_fields<double>());
  append(p, vehicle.gains, gain_fields<double>());
  return as_vector(p);
}

VehicleAndCommand vehicle_from(const Vehicle& like, const Eigen::VectorXd& parameters) {
  VehicleAndCommand answer{like, {}};
  const double* p = parameters.data();
  for (const auto& f : command_fields<double>()) answer.command.*(f.member) = *p++;
  for (const auto& f : aircraft_fields<double>()) answer.vehicle.aircraft.*(f.member) = *p++;
  for (const auto& f : gain_fields<double>()) answer.vehicle.gains.*(f.member) = *p++;
  return answer;
}

Gains gains_at(const GainSchedule& schedule, double eta) {
  const std::vector<double>& at = schedule.eta;
  const double here = std::clamp(eta, at.front(), at.back());
  const auto after = std::size_t(std::ranges::upper_bound(at, here) - at.begin());
  const std::size_t k = std::clamp<std::size_t>(after, 1, at.size() - 1);
  const double share = (here - at[k - 1]) / (at[k] - at[k - 1]);
  Gains lower = schedule.gains[k - 1], upper = schedule.gains[k], gains = lower;
  for (std::size_t j = 0; j < gain_fields<double>().size(); ++j)
    gain_value(gains, j) = (1 - share) * gain_value(lower, j) + share * gain_value(upper, j);
  return gains;
}

double authority(const Aircraft& aircraft, double eta) { return authority_at(eta, aircraft); }

Command corridor(double h) {
  constexpr double top = 120.0;                             // m, end of the transition
  constexpr double climb_speed = 2.0, cruise_speed = 15.0;  // m/s
  const double at = std::clamp(h, 0.0, top);
  const double angle =
      std::numbers::pi * (at * at * at / 1728000.0 - at * at / 9600.0 + 0.5);  // (16)
  const double t = std::clamp((h - 20.0) / 100.0, 0.0, 1.0);
  const double V = climb_speed + (cruise_speed - climb_speed) * (3 * t * t - 2 * t * t * t);
  return {V, angle, angle};
}

}  // namespace tiltrim
