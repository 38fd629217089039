/// A linear model in coordinates made of the roles' signals. Internal to qualities/.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "qualities/qualities.hpp"

namespace tiltrim {

/// z = T x: the signal of each role replaces the state that it depends on most. Positions in z, -1
/// without the role.
struct RoleCoordinates {
  Eigen::MatrixXd T, inverse;
  Eigen::Index pitch = -1, pitch_rate = -1, attack = -1, speed = -1, height = -1;
};
RoleCoordinates role_coordinates(const LinearModel& linear, const Roles& roles);

/// Participation of the roles in each mode.
std::vector<Qualities::ModeShares> shares_of(const Modes& modes, const RoleCoordinates& at);

/// Normal acceleration over angle of attack [g/rad] after a step of the stick at constant speed:
/// the quasi-steady states other than speed, attitude and height. `why` if not known.
Bounded acceleration_sensitivity(const LinearModel& linear, const RoleCoordinates& at,
                                 const QualitiesOptions& options, double airspeed,
                                 std::string& why);

/// True airspeed at the operating point; NaN if neither given nor a state.
double airspeed_of(const LinearModel& linear, const QualitiesOptions& options);

}  // namespace tiltrim
