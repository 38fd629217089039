#include "vehicles/tiltrotor/vehicle.hpp"

#include <algorithm>
#include <cmath>

#include "model/lookup.hpp"
#include "vehicles/tiltrotor/command.hpp"
#include "vehicles/tiltrotor/corridor.hpp"
#include "vehicles/tiltrotor/numbers.hpp"
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
  return physics::scheduled(schedule, eta);
}

double authority(const Aircraft& aircraft, double eta) { return authority_at(eta, aircraft); }

Command corridor(double h) { return physics::corridor_at(h); }

}  // namespace tiltrim
