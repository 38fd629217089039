/// @file
/// Trim formulations of the tiltrotor as problems for trim().
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "trim/trim.hpp"
#include "vehicles/tiltrotor/vehicle.hpp"

namespace tiltrim {

/// Formulation 1, (15): the closed loop at V, gamma, eta. Unknowns are theta and the two integrals;
/// theta0, a1s and delta_e follow from the control law and are bounded. Body axes below
/// 0.5 m/s.
TrimProblem closed_loop_problem(const Vehicle& vehicle, const Command& command);
/// The same in given axes.
TrimProblem closed_loop_problem(const Vehicle& vehicle, const Command& command, Axes axes);

/// trim() of formulation 1. If no equilibrium is found, tests whether the bare airframe could hold
/// the condition with any inputs within the limits; if this is proved impossible, the status is
/// infeasible.
[[nodiscard]] TrimResult trim_closed_loop(const Vehicle& vehicle, const Command& command,
                                          const TrimOptions& options = {});
/// The same for an existing closed_loop_problem().
[[nodiscard]] TrimResult trim_closed_loop(const TrimProblem& problem, const Vehicle& vehicle,
                                          const Command& command, const TrimOptions& options = {});

/// Formulation 2: the bare airframe. Each of V, gamma, theta, q, eta, theta0, a1s, delta_e, and
/// alpha in place of theta, is a Range: zero width fixes it. Defaults: V and eta are required;
/// gamma and q are 0; the others are free within the vehicle's limits.
struct AirframeCondition {
  std::map<std::string, Range> values{};  ///< SI, rad
  std::map<std::string, double> rates{};  ///< V, gamma, theta, q: held rates, 0 if not listed
  std::vector<CostTerm> effort{};         ///< empty: theta0² + (a1s/0.35)² + (delta_e/0.53)²
};
/// The airframe's problem, in body axes below 0.5 m/s. Throws std::invalid_argument for
/// other names and if V or eta is missing.
TrimProblem airframe_problem(const Vehicle& vehicle, const AirframeCondition& condition);
/// The same in given axes.
TrimProblem airframe_problem(const Vehicle& vehicle, const AirframeCondition& condition, Axes axes);

}  // namespace tiltrim
