/// The tiltrotor's parameters by name and by position.
#pragma once

#include <cstddef>
#include <string_view>

#include "model/model.hpp"
#include "vehicles/tiltrotor/vehicle.hpp"

namespace tiltrim {

/// The contents of a closed loop's parameter vector.
struct VehicleAndCommand {
  Vehicle vehicle;  ///< with these aircraft parameters and gains
  Command command;  ///< commanded flight condition
};
/// The vehicle's parameters as the parameter vector of airframe().
Eigen::VectorXd airframe_parameters(const Vehicle& vehicle);
/// The parameter vector of closed_loop(): the command, then the vehicle's parameters.
Eigen::VectorXd closed_loop_parameters(const Vehicle& vehicle, const Command& command);
/// The inverse of closed_loop_parameters(); data that are not parameters are copied from `like`.
VehicleAndCommand vehicle_from(const Vehicle& like, const Eigen::VectorXd& parameters);
/// Names, units and nominal sizes of these, in order: "aircraft.mass", ...; "gains.k_V", ...
Signals aircraft_signals();
Signals gain_signals();  ///< of the gains
/// The accepted range of a vehicle parameter.
struct AcceptedNumber {
  double lower, upper;   ///< SI, or in degrees
  bool degrees = false;  ///< an angle given in degrees in files
};
/// The range for a name. Throws std::invalid_argument with the valid names.
AcceptedNumber accepted_number(std::string_view name);
/// The parameter at a position of aircraft_signals(), for reading and writing.
double& aircraft_value(Aircraft& aircraft, std::size_t position);
/// The same for gain_signals().
double& gain_value(Gains& gains, std::size_t position);

}  // namespace tiltrim
