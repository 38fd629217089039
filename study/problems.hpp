/// @file
/// A study's conditions as they are swept, its [tune] as a problem, its flight, and the motion of a
/// model of the user's own.
#pragma once

#include <optional>

#include "flight/fly.hpp"
#include "flight/monte_carlo.hpp"
#include "simulate/simulate.hpp"
#include "study/analyses.hpp"
#include "study/study.hpp"
#include "sweep/sweep.hpp"
#include "tune/tune.hpp"

namespace tiltrim {

/// The study's conditions as requests. Throws std::invalid_argument, naming the condition, where
/// one cannot be swept: formulation table, or a number that it does not have.
[[nodiscard]] std::vector<SweepRequest> sweep_requests(const Study& study,
                                                       const std::vector<Condition>& conditions,
                                                       const std::vector<SweepAxis>& axes);

/// The study's [tune] as a problem. Throws std::invalid_argument where there is no [tune] or it
/// asks for what its conditions do not have.
[[nodiscard]] TuneProblem tune_problem(const Study& study);
/// The study's choice of algorithms, seed and budget; the start is its own numbers. Throws as
/// tune_problem().
[[nodiscard]] TuneOptions tune_options(const Study& study);

/// [simulate] of the study, or its defaults. Throws std::invalid_argument where its parts do not
/// fit each other.
[[nodiscard]] FlightPlan flight_plan(const Study& study, const TrimOptions& options = {});

/// The study's aircraft, schedule, wind and disturbances alone.
[[nodiscard]] Flight flight_of(const Study& study, const SimulateTable& table);

/// monte_carlo() of the study's [montecarlo]. Throws std::invalid_argument without one, and as it.
[[nodiscard]] MonteCarlo monte_carlo(const Study& study, const MonteCarloOptions& options = {});

/// Flight `number` of it, to be looked at. Throws std::invalid_argument if there is none.
[[nodiscard]] FlightPlan flight_plan_of(const Study& study, long number);

/// A condition's motion.
struct MotionAnswer {
  UserMotion asked;                  ///< as asked, or the default
  Answer start;                      ///< the condition, trimmed
  std::optional<Simulation> motion;  ///< none without a trim to start from
  FlightTable table;                 ///< of it: time, states, inputs, parameters changed, outputs

  /// To the end of its time.
  bool answered() const { return motion && *motion; }
};

/// [simulate] of a study with [model], or its defaults. Throws std::invalid_argument where the
/// study has no [model].
[[nodiscard]] MotionAnswer user_motion(const Study& study, const TrimOptions& trimming = {});

/// Linear against nonlinear motion from an offset of states, by name, at a condition's trim. Throws
/// std::invalid_argument for names that are no states and an offset of nothing.
[[nodiscard]] Response user_response(const Condition& condition,
                                     const std::map<std::string, double>& offset,
                                     const ResponseOptions& options = {});

}  // namespace tiltrim
