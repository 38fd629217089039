/// @file
/// A study's condition: its trim, why there is none in the words of flight mechanics, its branch,
/// all its equilibria, its sensitivities, its envelope, its loops broken at each actuator.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "follow/envelope.hpp"
#include "follow/follow.hpp"
#include "follow/sensitivity.hpp"
#include "linearize/margins.hpp"
#include "study/study.hpp"
#include "trim/diagnosis.hpp"
#include "vehicles/tiltrotor/formulations.hpp"

namespace tiltrim {

/// A condition and its trim.
struct Answer {
  Condition condition;             ///< as asked
  Model model;                     ///< the one that was trimmed; table: rows 1 and 2 of (15)
  TrimResult trim;                 ///< of that model
  std::optional<TableTrim> table;  ///< formulation table only

  /// An equilibrium whose equations and bounds are verified, with or without a remark.
  bool has_equilibrium() const { return is_equilibrium(trim.status); }
};

/// A condition of a study with [model]: what is fixed stands in the guess, the rest is free.
TrimProblem user_problem(const UserCondition& condition);

/// The condition as a problem for trim(). Throws std::invalid_argument where it cannot be asked of
/// the vehicle, and for formulation table, whose equations are the table's own.
[[nodiscard]] TrimProblem problem_of(const Vehicle& vehicle, const Condition& condition);

/// Throws std::invalid_argument where the condition cannot be asked of the vehicle (as when fewer
/// variables are free than equations hold).
[[nodiscard]] Answer answer(const Vehicle& vehicle, const Condition& condition,
                            const TrimOptions& options = {});

/// Vertical forces on the aircraft [N], up positive.
struct VerticalForces {
  double thrust, wing, weight;  ///< N; weight is positive
};

/// Why a condition has no equilibrium.
struct Explanation {
  Model airframe;  ///< asked whether any inputs within the limits could hold the condition
  /// Absent where the airframe alone has an equilibrium: then it is the control law that has none.
  std::optional<Diagnosis> diagnosis;
  std::vector<std::string> words;  ///< one finding each, the most telling first
};

/// Explains a trim of the condition that found no equilibrium: forces, the limits and equations in
/// conflict, what each would have to give alone, the nearest V, gamma and eta that can be flown.
/// Nothing for formulation table.
[[nodiscard]] std::optional<Explanation> explain(const Vehicle& vehicle, const Condition& condition,
                                                 const TrimOptions& options = {});

/// The condition's trim as it can be followed: a closed loop in body axes if it is to fly slower
/// than body_axes_below, and without the bounds that only its starts are spread over. Throws
/// std::invalid_argument at rest, and for formulation table.
[[nodiscard]] TrimProblem problem_along(const Vehicle& vehicle, const Condition& condition,
                                        double slowest);

/// A condition's branch.
struct BranchAnswer {
  Answer start;         ///< the condition trimmed, in the equations that are followed
  Key parameter;        ///< along which
  double to = 0.0;      ///< SI
  Branch branch;        ///< in SI
  double from() const;  ///< the condition's own value, in the study's unit

  /// The branch ended by what the question or the flight mechanics say, not by the search.
  bool answered() const;
};

/// Trims the condition and follows its branch from the condition's own value of the parameter
/// towards `to` (SI). A closed loop whose speed is to fall below body_axes_below is followed in
/// body axes. Throws std::invalid_argument where the condition does not have the parameter, or has
/// no branch (formulation table).
[[nodiscard]] BranchAnswer follow(const Vehicle& vehicle, const Condition& condition,
                                  const Key& parameter, double to,
                                  const FollowOptions& options = {},
                                  const TrimOptions& trimming = {});

/// A condition's sensitivities.
struct SensitivityAnswer {
  Answer trimmed;               ///< the condition's trim
  Sensitivities sensitivities;  ///< at it
};

/// Trims the condition and gives its sensitivities to these of the study's numbers; empty: to its
/// model's parameters: for a closed loop V, gamma, eta, all of the aircraft and all gains. Throws
/// as follow().
[[nodiscard]] SensitivityAnswer sensitivities(const Vehicle& vehicle, const Condition& condition,
                                              const std::vector<Key>& keys = {},
                                              const TrimOptions& trimming = {});

/// Of a study's condition: branches in V, gamma and eta, where the condition holds them. Throws
/// std::invalid_argument for formulation table.
[[nodiscard]] AllEquilibria all_equilibria(const Vehicle& vehicle, const Condition& condition,
                                           const TrimOptions& options);

/// The closed loop's envelope over V and an angle, the other angle being the condition's own. Over
/// tilt it comes in two parts, below and from the hand-over on, which have other pitch controls.
struct EnvelopeAnswer {
  Condition condition;          ///< as asked
  EnvelopeTable table;          ///< as asked
  Model model;                  ///< that was trimmed
  std::vector<Envelope> parts;  ///< one, or two over tilt

  bool answered() const;  ///< every part was gone over
};

/// Throws std::invalid_argument for a condition that is not a closed loop.
[[nodiscard]] EnvelopeAnswer envelope(const Vehicle& vehicle, const Condition& condition,
                                      const EnvelopeTable& table,
                                      const EnvelopeOptions& options = {});

/// What the tiltrotor's law commands, and where its loops are broken: theta0, a1s, delta_e. A model
/// of the user's own says its own places.
std::vector<std::string> actuators();

/// The loop broken at one actuator, behind the law, all others closed.
struct ActuatorLoop {
  std::string actuator;  ///< theta0, a1s or delta_e
  bool in_use = false;   ///< false: the law does not command it here, or it moves nothing; L = 0
  LoopTransfer loop;  ///< from what arrives at the actuator to what the law commands, sign turned
  Margins margins;    ///< of a loop in use, as is what follows
  Bode bode;          ///< of the same
};

/// How actuator_loops() goes about it.
struct LoopsOptions {
  std::vector<std::string> actuators{};  ///< empty: all
  /// Of the Bode data, rad/s; not given: ten times slower than every eigenvalue of the closed loop.
  std::optional<double> from{};
  std::optional<double> to{};  ///< the same; not given: ten times faster
  int points = 200;            ///< of the Bode data
};

/// `linear`, `modes` and `loops` where there is an equilibrium; `loops` in the actuators' order.
struct LoopsAnswer {
  Answer trimmed;                   ///< the condition's trim
  LinearModel linear;               ///< of closed_loop_with_inputs()
  Modes modes;                      ///< of the closed loop
  std::vector<ActuatorLoop> loops;  ///< empty without an equilibrium

  /// A trim without remark, a closed loop that is stable or not, and every margin found.
  bool answered() const;
};

/// Trims the condition, linearizes it and breaks its loops. Throws std::invalid_argument for a
/// condition without a loop to break, for an actuator that is none, and unless 0 < from < to and
/// points >= 2.
[[nodiscard]] LoopsAnswer actuator_loops(const Vehicle& vehicle, const Condition& condition,
                                         const LoopsOptions& options = {},
                                         const TrimOptions& trimming = {});

}  // namespace tiltrim
