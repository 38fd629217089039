/// @file
/// A study's flight: aircraft, schedule, weather, and the trim that it starts from.
#pragma once

#include "flight/monte_carlo.hpp"
#include "flight/plan.hpp"
#include "study/study.hpp"

namespace tiltrim {

/// [simulate] of the study, or its defaults. Throws std::invalid_argument where its parts do not
/// fit each other.
[[nodiscard]] FlightPlan flight_plan(const Study& study, const TrimOptions& options = {});

/// The study's aircraft, schedule, wind and disturbances alone.
[[nodiscard]] Flight flight_of(const Study& study, const SimulateTable& table);

/// monte_carlo() of the study's [montecarlo]. Throws std::invalid_argument without one, and as it.
[[nodiscard]] MonteCarlo monte_carlo(const Study& study, const MonteCarloOptions& options = {});

/// Flight `number` of it, to be looked at. Throws std::invalid_argument if there is none.
[[nodiscard]] FlightPlan flight_plan_of(const Study& study, long number);

}  // namespace tiltrim
