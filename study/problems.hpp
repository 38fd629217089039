/// A study's conditions as sweep requests, its [tune] and [prove] as problems, its flight, and the
/// motion of a user-defined model.
#pragma once

#include <functional>
#include <optional>
#include <string>

#include "flight/fly.hpp"
#include "flight/monte_carlo.hpp"
#include "prove/prove.hpp"
#include "simulate/simulate.hpp"
#include "study/analyses.hpp"
#include "study/study.hpp"
#include "sweep/sweep.hpp"
#include "tune/tune.hpp"

namespace tiltrim {

/// The study's conditions as requests. Throws StudyError, naming the condition's place, for one
/// that cannot be swept: formulation table, or an axis that it does not have.
[[nodiscard]] std::vector<SweepRequest> sweep_requests(const Study& study,
                                                       const std::vector<Condition>& conditions,
                                                       const std::vector<SweepAxis>& axes);

/// The study's [tune] as a problem. Throws std::invalid_argument if the study has no [tune], or if
/// [tune] requires what its conditions do not have.
[[nodiscard]] TuneProblem tune_problem(const Study& study);
/// The study's algorithms, seed and budget; the search starts at the study's own values. Throws
/// like tune_problem().
[[nodiscard]] TuneOptions tune_options(const Study& study);

/// The study's [prove] for a condition of its closed loop or of its [model]. Throws
/// StudyError, naming the condition's place, if a proof cannot be about it: more unknowns than
/// equations, an unknown parameter, a rate that is implied, an output held at a value.
[[nodiscard]] ProveProblem prove_problem(const Study& study, const Condition& condition);

/// The answer to a study's [tune].
struct TuningReport {
  TuneProblem problem;  ///< as the study defines it
  std::shared_ptr<const UserModel>
      user_model{};                        ///< of a study with [model] or a published vehicle
  TuneOptions options{};                   ///< as given; `global` is the one that found `result`
  TuneResult result{};                     ///< the best of these optima
  std::string second_algorithm{};          ///< that found the other; empty: none
  std::optional<TuneResult> second{};      ///< the other
  std::optional<Robustness> robustness{};  ///< of `result`
  /// One point of the front: the limit and the optimum.
  struct FrontPoint {
    double limit;       ///< value of the limit
    TuneResult result;  ///< optimum with it
  };
  bool interrupted = false;         ///< later parts were not computed
  Requirement front_limit{};        ///< the limit that is varied
  std::vector<FrontPoint> front{};  ///< in order of the limit
};

/// tune() of the study's [tune], the same by its second algorithm, then front and robustness, with
/// options such as tune_options(). `observe` replaces that of the options and receives the search's
/// name too: "crs2", "front, 2 of 5", "robustness". Throws like tune_problem() and tune().
[[nodiscard]] TuningReport tune_study(
    const Study& study, const TuneOptions& options,
    const std::function<void(const std::string& what, const TuneProgress&)>& observe = {});

/// The study's [simulate], or its defaults. Throws std::invalid_argument if its parts are
/// inconsistent.
[[nodiscard]] FlightPlan flight_plan(const Study& study, const TrimOptions& options = {});

/// The study's aircraft, schedule, wind and disturbances only.
[[nodiscard]] Flight flight_of(const Study& study, const SimulateTable& table);

/// monte_carlo() of the study's [montecarlo]. Throws std::invalid_argument without that table, and
/// like monte_carlo().
[[nodiscard]] MonteCarlo monte_carlo(const Study& study, const MonteCarloOptions& options = {});

/// Flight `number` for inspection. Throws std::invalid_argument if there is no such flight.
[[nodiscard]] FlightPlan flight_plan_of(const Study& study, long number);

/// A condition's motion.
struct MotionAnswer {
  UserMotion asked;                  ///< as given, or the default
  Answer start;                      ///< the condition, trimmed
  std::optional<Simulation> motion;  ///< empty without a trim to start from
  FlightTable table;                 ///< time, states, inputs, varied parameters, outputs

  /// True if the motion reached the end of its duration.
  bool answered() const { return motion && *motion; }
};

/// The study's [simulate] with [model], or its defaults. Throws std::invalid_argument if the study
/// has no [model].
[[nodiscard]] MotionAnswer user_motion(const Study& study, const TrimOptions& trimming = {});

/// Linear and nonlinear motion from an offset of states, by name, at a condition's trim. Throws
/// std::invalid_argument for names that are not states and for a zero offset.
[[nodiscard]] Response user_response(const Condition& condition,
                                     const std::map<std::string, double>& offset,
                                     const ResponseOptions& options = {});

}  // namespace tiltrim
