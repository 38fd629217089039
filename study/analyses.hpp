/// @file
/// A study's condition: its branch, all its equilibria, its sensitivities, its envelope.
#pragma once

#include "follow/all.hpp"
#include "follow/envelope.hpp"
#include "follow/follow.hpp"
#include "follow/sensitivity.hpp"
#include "study/answer.hpp"
#include "study/study.hpp"

namespace tiltrim {

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

}  // namespace tiltrim
