/// @file
/// Diagnosis: why a trim problem has no solution, and which changes would give it one.
#pragma once

#include <string>
#include <vector>

#include "trim/trim.hpp"

namespace tiltrim {

/// A variable that could be set differently, and its search range.
struct DecisionVariable {
  std::string signal;  ///< a state, input or parameter
  Range range;         ///< finite
};

/// The kinds of change.
enum class RemedyKind {
  limit,              ///< one side of one limit is relaxed, everything else is kept
  equation,           ///< one held rate is released
  decision_variable,  ///< a variable that is not free in the trim is changed
};

/// The smallest change of one limit, equation or variable that gives an equilibrium.
struct Remedy {
  RemedyKind kind = RemedyKind::limit;  ///< what changes
  std::string signal;  ///< limit: its signal; equation: the rate; decision variable: its name
  bool upper = false;  ///< upper side of a limit
  double from = 0.0;   ///< the bound, rate or value requested
  double to = 0.0;     ///< the nearest value with an equilibrium; valid if helps()
  Range searched{};    ///< limit, decision variable: where `to` was searched for
  /// The equilibrium at `to`: converged: the nearest; not_optimal: not proved to be the nearest;
  /// infeasible: proved that nothing in the range helps; not_found: nothing found.
  TrimResult trim{};

  /// An equilibrium was found.
  bool helps() const { return is_equilibrium(trim.status); }
};

/// Why there is no solution.
struct Diagnosis {
  /// A limit that prevents a smaller residual at the closest point.
  struct Holding {
    ActiveLimit limit;  ///< which
    double pull = 0.0;  ///< d(½‖scaled residual‖²)/d(bound over its nominal size), never positive
  };

  OperatingPoint closest;        ///< the least-squares point within the limits
  std::vector<Holding> holding;  ///< largest multiplier first
  std::vector<Remedy> remedies;  ///< limits, equations, decision variables: one at a time
  bool interrupted = false;      ///< some were not examined
  bool out_of_time = false;      ///< some were not completed in the time allowed for each
};

/// Searches for changes that give `spec` a solution, with `closest` the best point of a failed
/// trim(): each limit, each held rate and each decision variable one at a time, by the nearest
/// equilibrium. Throws std::invalid_argument on invalid arguments, as trim() does.
[[nodiscard]] Diagnosis diagnose(const Model& model, const TrimSpec& spec,
                                 const OperatingPoint& guess, const OperatingPoint& closest,
                                 const std::vector<DecisionVariable>& variables,
                                 const TrimOptions& options = {});

}  // namespace tiltrim
