/// @file
/// Diagnosis: why a trim problem has no answer, and what would have to give.
#pragma once

#include <string>
#include <vector>

#include "trim/trim.hpp"

namespace tiltrim {

/// A variable that might be chosen otherwise, and how far to look.
struct DecisionVariable {
  std::string signal;  ///< a state, input or parameter
  Range range;         ///< finite
};

/// What gives.
enum class RemedyKind {
  limit,     ///< one side of one limit gives way, everything else is kept
  equation,  ///< one held rate may be what it has to be
  lever,     ///< a variable that the trim does not move is moved
};

/// The least that one thing alone would have to give.
struct Remedy {
  RemedyKind kind = RemedyKind::limit;  ///< what gives
  std::string signal;  ///< limit: of the bound; equation: of the rate; lever: the variable
  bool upper = false;  ///< which side of a limit
  double from = 0.0;   ///< the bound, rate or value asked for
  double to = 0.0;     ///< the nearest with which there is an equilibrium; if helps()
  Range searched{};    ///< limit, lever: where `to` was looked for
  /// The equilibrium at `to`: converged is the nearest, not_optimal one not shown to be the
  /// nearest. infeasible: shown that nothing searched helps; not_found: nothing found.
  TrimResult trim{};

  /// An equilibrium was found there.
  bool helps() const { return is_equilibrium(trim.status); }
};

/// A limit that keeps the closest point from coming closer.
struct Holding {
  ActiveLimit limit;  ///< which
  double pull = 0.0;  ///< d(½‖scaled residual‖²)/d(bound over its nominal size), at most zero
};

/// Why there is no answer.
struct Diagnosis {
  OperatingPoint closest;        ///< the least-squares point within the limits
  std::vector<Holding> holding;  ///< strongest pull first
  std::vector<Remedy> remedies;  ///< limits, equations, levers: each alone
  bool interrupted = false;      ///< others were not examined
  bool out_of_time = false;      ///< some were not examined in the time allowed for each
};

/// Looks for what would have to give for `spec` to have an answer, `closest` being the best point
/// of a trim() that found none: each limit, each held rate and each lever alone, by the nearest
/// equilibrium that it then has. Throws std::invalid_argument on the caller's mistakes, as trim().
[[nodiscard]] Diagnosis diagnose(const Model& model, const TrimSpec& spec,
                                 const OperatingPoint& guess, const OperatingPoint& closest,
                                 const std::vector<DecisionVariable>& levers,
                                 const TrimOptions& options = {});

/// One lever alone: the value nearest the guess's own at which there is an equilibrium.
[[nodiscard]] Remedy nearest(const Model& model, const TrimSpec& spec, const OperatingPoint& guess,
                             const DecisionVariable& lever, const TrimOptions& options = {});

/// "theta0 up to 1.31 instead of 1": one remedy in words, its numbers times `factor` in `unit`.
std::string in_words(const Remedy& remedy, double factor = 1.0, const std::string& unit = "");

}  // namespace tiltrim
