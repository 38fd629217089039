/// @file
/// Trim: find an equilibrium of a model, verify it, and say why where there is none.
#pragma once

#include <functional>
#include <map>
#include <stop_token>
#include <string>
#include <vector>

#include "model/model.hpp"
#include "model/time_limit.hpp"

namespace tiltrim {

/// The trim problem in the user's words. Names are the model's signals.
struct TrimSpec {
  std::vector<std::string> free{};  ///< states, inputs or parameters the solver may move
  /// States whose rates are held at zero. Empty: all that rates, implied and moving do not name.
  std::vector<std::string> steady{};
  std::map<std::string, double> rates{};  ///< states whose rates are held at a value [unit/s]
  std::map<std::string, Range> bounds{};  ///< on any variable or output; equal ends: held there
  std::vector<std::string> implied{};     ///< rates that must vanish as a consequence; verified
  std::vector<std::string> moving{};      ///< states whose rates may be anything: a position
  std::vector<CostTerm> effort{};         ///< empty: every free input over its nominal size
};

/// The states whose rates the trim holds at nothing.
std::vector<std::string> moving_states(const Model& model, const TrimSpec& spec);

/// A trim problem ready to solve: a model, what is asked, where to start.
struct TrimProblem {
  Model model;           ///< trim()'s first argument
  TrimSpec spec;         ///< its second
  OperatingPoint guess;  ///< its third
};

/// How a trim ended. Every status is the verdict of our own evaluation of the point.
enum class TrimStatus {
  converged,       ///< verified equilibrium within all bounds
  singular,        ///< verified rates, but the Jacobian is singular: a fold or a free direction
  not_optimal,     ///< verified equilibrium, but the objective's optimum is not verified
  not_implied,     ///< the equations hold, an implied rate does not vanish
  infeasible,      ///< shown: no point within the bounds satisfies the equations
  not_found,       ///< no equilibrium found in the stated number of starts; none excluded
  not_finite,      ///< the model gives no finite numbers at the guess or any start
  model_threw,     ///< the model threw an exception; its words are in the message
  not_repeatable,  ///< the model gives two answers at one point
  interrupted,     ///< the caller asked to stop
  time_limit,      ///< the time allowed was over before anything was verified
};

/// The status as the JSON contract spells it: "converged", "not_found", ...
std::string to_string(TrimStatus status);

/// A verified equilibrium, with or without a remark.
constexpr bool is_equilibrium(TrimStatus status) { return status <= TrimStatus::not_optimal; }

/// A bound that the point lies on.
struct ActiveLimit {
  std::string signal;  ///< its variable or output
  bool upper = false;  ///< which end
  double value = 0.0;  ///< of the bound
};

/// How equilibria are looked for.
enum class TrimMethod {
  ipopt,   ///< Ipopt from the guess, polished by Newton, then Newton from further starts
  newton,  ///< Newton only, from the guess and the further starts; needs as many equations as
           ///< unknowns
};

/// How trim() goes about it.
struct TrimOptions {
  TrimMethod method = TrimMethod::ipopt;  ///< from the guess
  double tolerance = 1e-10;               ///< on every held rate over its nominal size [1/s]
  double step_tolerance = 1e-9;           ///< on the last Newton step over nominal sizes
  int starts = 32;                        ///< further starts over the bounds (a Halton set)
  int max_iterations = 100;               ///< of each solver from each start
  int max_boxes = 200'000;        ///< of the proof that there is no equilibrium; 0: no proof
  bool closest = true;            ///< where there is no answer, look for the closest point
  double time_limit = unlimited;  ///< s of wall clock; a call of the model is not cut short
  std::stop_token stop{};         ///< asked between solver steps
  std::function<void(const OperatingPoint&)> observe{};  ///< every Newton iterate from the guess
};

/// What trim() answers. `point` is the best point seen whatever the status.
struct TrimResult {
  TrimStatus status = TrimStatus::not_found;  ///< the verdict
  OperatingPoint point;                       ///< the best seen
  Eigen::VectorXd rates;                      ///< all state rates at the point
  Eigen::VectorXd outputs;                    ///< all outputs at the point
  double residual = 0.0;  ///< largest |rate - held value| / nominal over the held rates [1/s]
  double step = 0.0;      ///< last Newton step, largest over nominal sizes
  /// Reciprocal condition (2-norm) of the scaled Jacobian of the equations; where that is below
  /// 1e-8, of the same with its rows no longer than one, which stiffness does not spoil.
  double rcond = 0.0;
  double effort = 0.0;                     ///< the objective
  std::vector<ActiveLimit> limits_active;  ///< bounds that the point lies on
  std::vector<OperatingPoint> others;      ///< further verified equilibria, by rising effort
  int starts = 0;                          ///< starts tried
  long evaluations = 0;                    ///< calls of the model's f and derivatives
  std::string message;                     ///< empty when converged without remark
  std::string thrown;                      ///< the model's first exception; empty: none

  /// A verified equilibrium.
  explicit operator bool() const { return status == TrimStatus::converged; }
};

/// Solves `spec` on `model` from `guess`. Throws std::invalid_argument on the caller's mistakes: a
/// name the model does not have, bounds that are reversed or NaN, no equation at all, more
/// equations than unknowns, a guess of the wrong size, a time limit that is not above zero.
[[nodiscard]] TrimResult trim(const Model& model, const TrimSpec& spec, const OperatingPoint& guess,
                              const TrimOptions& options = {});

}  // namespace tiltrim
