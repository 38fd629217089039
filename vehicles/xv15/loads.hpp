/// Loads of the XV-15's components without a trim, its rotor in hover.
#pragma once

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "vehicles/xv15/xv15.hpp"

namespace tiltrim::xv15 {

/// Force [N] and moment [N m] in body axes about the center of gravity.
struct Load {
  double X = 0.0;  ///< N, forward
  double Z = 0.0;  ///< N, down
  double M = 0.0;  ///< N m, nose up
};

/// The loads of all components at a state, without a trim.
struct Loads {
  std::vector<std::pair<std::string, Load>> components;  ///< by name
  Load total;                                            ///< their sum
  double induced_velocity = 0.0;                         ///< m/s
  double thrust = 0.0;                                   ///< of each rotor, N
  double collective = 0.0;                               ///< at 0.75 R, rad
  double wing_alpha = 0.0;                               ///< rad
};

/// What is known of the rotors.
struct RotorState {
  std::optional<double> collective;        ///< rad; not given: the least whose thrust balances all
                                           ///< forces along the masts at the pitch of the point
  std::optional<double> induced_velocity;  ///< m/s; not given: by momentum theory
};

/// `at`: as for model(); its collective is not used. Throws std::domain_error outside the tables,
/// and where no collective gives that thrust.
[[nodiscard]] Loads loads(const Data& data, const OperatingPoint& at, const RotorState& rotor);

/// Hover performance of a rotor alone.
struct Hover {
  double CT;               ///< thrust over rho A (Omega R)^2
  double CP;               ///< power over rho A (Omega R)^3
  double figure_of_merit;  ///< CT^1.5 / (sqrt(2) CP)
};
/// By blade elements and momentum theory; `collective` [rad] at 0.75 R, `tip_speed` in m/s. Throws
/// std::domain_error outside the tables.
[[nodiscard]] Hover hover(const Data& data, double collective, double tip_speed);

/// The stick [in] that holds this elevator [rad, trailing edge down].
[[nodiscard]] double stick_for(const Data& data, double elevator);

}  // namespace tiltrim::xv15
