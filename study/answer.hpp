/// @file
/// A study's condition, trimmed by its own formulation.
#pragma once

#include <optional>
#include <string>

#include "study/study.hpp"
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

}  // namespace tiltrim
