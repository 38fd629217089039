/// @file
/// Trim: find an equilibrium of a model and verify it, or explain why none was found.
#pragma once

#include <functional>
#include <limits>
#include <map>
#include <stop_token>
#include <string>
#include <vector>

#include "model/model.hpp"

namespace tiltrim {

/// The trim problem, with the names of the model's signals.
struct TrimSpec {
  std::vector<std::string> free{};  ///< states, inputs or parameters to solve for
  /// States whose rates are held at zero. Empty: all not named in rates, implied or moving.
  std::vector<std::string> steady{};
  std::map<std::string, double> rates{};  ///< states whose rates are held at a value [unit/s]
  std::map<std::string, Range> bounds{};  ///< on any variable or output; equal bounds fix it
  std::vector<std::string> implied{};     ///< rates that must vanish as a consequence; verified
  std::vector<std::string> moving{};      ///< states with unconstrained rates, such as positions
  std::vector<CostTerm> effort{};         ///< empty: every free input over its nominal size
};

/// A trim problem ready to solve: the arguments of trim().
struct TrimProblem {
  Model model;           ///< first argument of trim()
  TrimSpec spec;         ///< second argument
  OperatingPoint guess;  ///< third argument
};

/// Status of a trim. Every status comes from tiltrim's own evaluation of the point.
enum class TrimStatus {
  converged,       ///< verified equilibrium within all bounds
  singular,        ///< verified rates, but the Jacobian is singular: a fold or a free direction
  not_optimal,     ///< verified equilibrium, but not verified as an optimum of the objective
  not_implied,     ///< the equations hold, but an implied rate does not vanish
  infeasible,      ///< proved: no point within the bounds satisfies the equations
  not_found,       ///< no equilibrium found in the stated number of starts; existence not excluded
  not_finite,      ///< the model returns no finite numbers at the guess or any start
  model_threw,     ///< the model threw an exception; `message` contains its text
  not_repeatable,  ///< the model returns different values for the same point
  interrupted,     ///< stopped by the caller
  time_limit,      ///< the time limit passed before anything was verified
};

/// The status as in JSON: "converged", "not_found", ...
std::string to_string(TrimStatus status);

/// A verified equilibrium, with or without a remark.
constexpr bool is_equilibrium(TrimStatus status) { return status <= TrimStatus::not_optimal; }

/// A bound that the point lies on.
struct ActiveLimit {
  std::string signal;  ///< its variable or output
  bool upper = false;  ///< true: upper bound, false: lower bound
  double value = 0.0;  ///< value of the bound
};

/// How equilibria are searched for.
enum class TrimMethod {
  ipopt,   ///< Ipopt from the guess, refined by Newton, then Newton from further starts
  newton,  ///< Newton only, from the guess and the further starts; needs as many equations as
           ///< unknowns
};

/// Options of trim().
struct TrimOptions {
  TrimMethod method = TrimMethod::ipopt;  ///< solver for the guess
  double tolerance = 1e-10;               ///< on every held rate over its nominal size [1/s]
  double step_tolerance = 1e-9;           ///< on the last Newton step over nominal sizes
  int starts = 32;                        ///< further starts over the bounds (a Halton set)
  /// Every start is tried: the answer is the equilibrium of least effort. False: the first one that
  /// is verified, from the guess if it leads to one; with as many equations as unknowns.
  bool others = true;
  int max_iterations = 100;  ///< of each solver from each start
  int max_boxes = 20'000;    ///< of the proof that no equilibrium exists; 0: no proof
  bool closest = true;       ///< if no equilibrium is found, search for the closest point
  /// s of wall-clock time; a model call is not interrupted.
  double time_limit = std::numeric_limits<double>::infinity();
  std::stop_token stop{};                                ///< checked between solver steps
  std::function<void(const OperatingPoint&)> observe{};  ///< every Newton iterate from the guess
};

/// The result of trim(). `point` is the best point found, whatever the status.
struct TrimResult {
  TrimStatus status = TrimStatus::not_found;  ///< outcome
  OperatingPoint point;                       ///< the best point found
  Eigen::VectorXd rates;                      ///< all state rates at the point
  Eigen::VectorXd outputs;                    ///< all outputs at the point
  double residual = 0.0;  ///< largest |rate - held value| / nominal over the held rates [1/s]
  double step = 0.0;      ///< last Newton step, largest over nominal sizes
  /// Reciprocal condition number (2-norm) of the scaled Jacobian of the equations; if that is below
  /// 1e-8, of the Jacobian with its rows limited to unit length, which removes stiffness.
  double rcond = 0.0;
  double effort = 0.0;                     ///< value of the cost
  std::vector<ActiveLimit> limits_active;  ///< bounds that the point lies on
  std::vector<OperatingPoint> others;      ///< further verified equilibria, by ascending cost
  int starts = 0;                          ///< starts tried
  long evaluations = 0;                    ///< calls of the model's f and derivatives
  std::string message;                     ///< empty when converged without remark
  std::string thrown;                      ///< message of the model's first exception, or empty

  /// True if a verified equilibrium was found without remark.
  explicit operator bool() const { return status == TrimStatus::converged; }
};

/// Solves `spec` on `model` from `guess`. Throws std::invalid_argument on invalid arguments: a name
/// the model does not have, bounds that are reversed or NaN, no equation at all, more equations
/// than unknowns, a guess of the wrong size, a tolerance or time limit that is not positive, a
/// count below zero.
[[nodiscard]] TrimResult trim(const Model& model, const TrimSpec& spec, const OperatingPoint& guess,
                              const TrimOptions& options = {});

/// Whether interval arithmetic over at most options.max_boxes boxes excludes every point within the
/// limits, without any search (docs/trim.md). False: there may be an equilibrium, or the model has
/// no enclosure, or an unknown no bounds. Throws as trim().
[[nodiscard]] bool proved_infeasible(const Model& model, const TrimSpec& spec,
                                     const OperatingPoint& guess, const TrimOptions& options = {});

/// The closest point of a problem that the caller has proved to have no solution: trim() without
/// search and proof. `infeasible`, unless stopped or out of time. Throws as trim().
[[nodiscard]] TrimResult closest_point(const Model& model, const TrimSpec& spec,
                                       const OperatingPoint& guess,
                                       const TrimOptions& options = {});

}  // namespace tiltrim
