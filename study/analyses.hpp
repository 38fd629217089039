/// Analyses of a condition: its trim, the reason if no trim exists, its branch, all its equilibria,
/// its sensitivities, its envelope, its loops broken at each actuator.
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
#include "vehicles/tiltrotor/table_trim.hpp"

namespace tiltrim {

/// A condition and its trim.
struct Answer {
  Condition condition;             ///< as given
  Model model;                     ///< the model that was trimmed; table: rows 1 and 2 of (15)
  TrimResult trim;                 ///< of that model
  std::optional<TableTrim> table;  ///< formulation table only

  /// True for a verified equilibrium within bounds, with or without a remark.
  bool has_equilibrium() const { return is_equilibrium(trim.status); }
};

/// A condition of a study with [model] as a problem: fixed variables in the guess, the others free.
TrimProblem user_problem(const UserCondition& condition);

/// The condition as a problem for trim(). Throws std::invalid_argument if the condition does not
/// apply to the vehicle, and for formulation table, which has its own equations.
[[nodiscard]] TrimProblem problem_of(const Vehicle& vehicle, const Condition& condition);

/// Trims the condition. Throws std::invalid_argument if it does not apply to the vehicle (for
/// example, with fewer free variables than equations).
[[nodiscard]] Answer answer(const Vehicle& vehicle, const Condition& condition,
                            const TrimOptions& options = {});

/// Vertical forces on the aircraft [N], up positive.
struct VerticalForces {
  double thrust, wing, weight;  ///< N; weight is positive
};

/// Why a condition has no equilibrium.
struct Explanation {
  Model airframe;  ///< tested with any inputs within the limits
  /// Empty if the bare airframe has an equilibrium: then the control law has none.
  std::optional<Diagnosis> diagnosis;
  std::vector<std::string> words;  ///< one finding each, the most important first
};

/// Explains a trim that found no equilibrium: forces, the conflicting limits and equations, how far
/// each would have to be relaxed alone, the nearest feasible V, gamma and eta. Empty for
/// formulation table.
[[nodiscard]] std::optional<Explanation> explain(const Vehicle& vehicle, const Condition& condition,
                                                 const TrimOptions& options = {});

/// The condition as a problem for continuation: a closed loop in body axes if its speed falls below
/// body_axes_below, without the bounds that only spread the starting points. Throws
/// std::invalid_argument at rest, and for formulation table.
[[nodiscard]] TrimProblem problem_along(const Vehicle& vehicle, const Condition& condition,
                                        double slowest);

/// Throws std::invalid_argument, with the study's key, unless the condition's model has the
/// variable and its trims depend on it.
void check_moves(const Condition& condition, const Model& model, const std::string& signal,
                 const std::string& key);

/// A condition's branch.
struct BranchAnswer {
  Answer start;         ///< the trimmed condition, in the equations that are followed
  Key parameter;        ///< continuation parameter
  double to = 0.0;      ///< SI
  Branch branch;        ///< in SI
  double from() const;  ///< the condition's own value, in the study's unit

  /// True if the branch ended for a physical reason or at its target, not because the search
  /// failed.
  bool answered() const;
};

/// Trims the condition and follows its branch from the condition's own value of the parameter to
/// `to` (SI). A closed loop whose speed falls below body_axes_below is followed in body axes.
/// Throws std::invalid_argument if the condition does not have the parameter, or has no branch
/// (formulation table).
[[nodiscard]] BranchAnswer follow(const Vehicle& vehicle, const Condition& condition,
                                  const Key& parameter, double to,
                                  const FollowOptions& options = {},
                                  const TrimOptions& trimming = {});

/// A condition's sensitivities.
struct SensitivityAnswer {
  Answer trimmed;               ///< the condition's trim
  Sensitivities sensitivities;  ///< at the trim
};

/// Trims the condition and computes its sensitivities to these parameters of the study; empty: to
/// its model's parameters, for a closed loop V, gamma, eta, all aircraft parameters and all gains.
/// Throws like follow().
[[nodiscard]] SensitivityAnswer sensitivities(const Vehicle& vehicle, const Condition& condition,
                                              const std::vector<Key>& keys = {},
                                              const TrimOptions& trimming = {});

/// All equilibria of a condition: branches in V, gamma and eta if the condition fixes them. Throws
/// std::invalid_argument for formulation table.
[[nodiscard]] AllEquilibria all_equilibria(const Vehicle& vehicle, const Condition& condition,
                                           const TrimOptions& options);

/// The closed loop's envelope over V and an angle; the other angle is the condition's own. Over
/// tilt it has two parts, below the handover and from it on, with different pitch controls.
struct EnvelopeAnswer {
  Condition condition;          ///< as given
  EnvelopeTable table;          ///< as given
  Model model;                  ///< the model that was trimmed
  std::vector<Envelope> parts;  ///< one, or two over tilt

  bool has(EnvelopeStatus status) const;  ///< any part
  bool answered() const;                  ///< every part was completed
};

/// The study's [envelope], or the conversion corridor; `over` ("eta_deg", "gamma_deg") and `count`
/// replace its own. Throws std::invalid_argument for `over` of a study with [model], StudyError for
/// such a study without [envelope].
[[nodiscard]] EnvelopeTable envelope_table(const Study& study, const std::string& over = {},
                                           std::optional<int> count = {});

/// EnvelopeOptions::rows for reading: every ten degrees of tilt or path angle and the ends; of a
/// user's model every tenth of the range.
[[nodiscard]] std::vector<double> envelope_rows(const EnvelopeTable& table, bool user_model);

/// Throws std::invalid_argument for a condition that is not a closed loop.
[[nodiscard]] EnvelopeAnswer envelope(const Vehicle& vehicle, const Condition& condition,
                                      const EnvelopeTable& table,
                                      const EnvelopeOptions& options = {});

/// Where the tiltrotor's loops are broken: theta0, a1s, delta_e. A user-defined model names its
/// own.
std::vector<std::string> actuators();

/// The loop broken at one actuator, at the output of the law, all other loops closed.
struct ActuatorLoop {
  std::string actuator;  ///< theta0, a1s or delta_e
  bool in_use = false;   ///< false: not commanded by the law here, or without effect; L = 0
  LoopTransfer loop;     ///< from the actuator's input to the law's command, sign reversed
  Margins margins;       ///< of a loop in use, like the following
  Bode bode;             ///< of a loop in use
};

/// Options of actuator_loops().
struct LoopsOptions {
  std::vector<std::string> actuators{};  ///< empty: all
  /// Of the Bode data, rad/s; not given: a tenth of the slowest closed-loop eigenvalue.
  std::optional<double> from{};
  std::optional<double> to{};  ///< likewise; not given: ten times the fastest
  int points = 200;            ///< of the Bode data
};

/// `linear`, `modes` and `loops` are valid for an equilibrium; `loops` in the actuators' order.
struct LoopsAnswer {
  Answer trimmed;                   ///< the condition's trim
  LinearModel linear;               ///< of closed_loop_with_inputs()
  Modes modes;                      ///< of the closed loop
  std::vector<ActuatorLoop> loops;  ///< empty without an equilibrium

  /// True for a trim without remark, a decided closed-loop verdict and all margins found.
  bool answered() const;
};

/// Trims the condition, linearizes it and breaks its loops. Throws std::invalid_argument for a
/// condition without loops, an unknown actuator, and unless 0 < from < to and points >= 2.
[[nodiscard]] LoopsAnswer actuator_loops(const Vehicle& vehicle, const Condition& condition,
                                         const LoopsOptions& options = {},
                                         const TrimOptions& trimming = {});

}  // namespace tiltrim
