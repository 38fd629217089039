/// @file
/// Follow: a branch of trims along a parameter, through folds and limits, with its events.
#pragma once

#include <complex>
#include <functional>
#include <optional>
#include <stop_token>
#include <string>
#include <vector>

#include "linearize/modes.hpp"
#include "trim/trim.hpp"

namespace tiltrim {

/// How follow() goes about it.
struct FollowOptions {
  double max_step = 0.5;         ///< length of a step, every unknown over its nominal size
  int max_points = 5000;         ///< of the branch
  bool stability = true;         ///< eigenvalues along the branch, real and Hopf crossings
  double tolerance = 1e-10;      ///< on every held rate over its nominal size [1/s]
  double step_tolerance = 1e-9;  ///< on the last Newton step over nominal sizes
  std::stop_token stop{};        ///< asked between points
  /// After each point: where the parameter is, how many points there are.
  std::function<void(double parameter, std::size_t points)> observe{};
};

/// A verified trim on the branch.
struct BranchPoint {
  double parameter = 0.0;          ///< its value, in its unit
  OperatingPoint point;            ///< the trim
  Eigen::VectorXd rates, outputs;  ///< all, at the point
  double residual = 0.0;           ///< as in TrimResult, evaluated at the point
  double step = 0.0;               ///< what Newton would still move it, over nominal sizes
  /// Eigenvalues with positive real part; empty where stability was not asked or the point is no
  /// equilibrium (rates held at a value).
  std::optional<int> unstable{};
  /// Where an effort decides: the trim is a least one, not merely a stationary one, as beyond a
  /// fold.
  bool least = true;
};

/// What happens on a branch.
enum class EventKind {
  fold,          ///< the branch turns back in its parameter
  limit,         ///< a limit becomes active
  limit_left,    ///< a limit that held the optimum lets go
  zero,          ///< a real eigenvalue crosses zero, and there is no fold
  hopf,          ///< a complex pair crosses the axis
  branch_point,  ///< another branch crosses this one
  end,           ///< the last point; `which` says why
};
std::string to_string(EventKind kind);  ///< as JSON spells it

/// Located on the branch as well as the derivatives allow.
struct BranchEvent {
  EventKind kind = EventKind::end;  ///< what happens
  BranchPoint at;                   ///< where
  double error = 0.0;               ///< how far its parameter may be off; infinite: not determined
  std::size_t after = 0;            ///< points of the branch that lie before it
  std::string which;             ///< limit: "delta_e lower"; hopf, zero: the mode's name; end: why
  std::optional<Modes> modes{};  ///< where there is an equilibrium and a linear model
  /// On the axis: of zero and hopf, and of a fold or branch point with a zero eigenvalue.
  std::optional<std::complex<double>> eigenvalue{};
};

/// Why a branch goes no further.
enum class BranchEnd {
  reached,      ///< the parameter came to where it was to go
  limit,        ///< a limit, and no free unknown is left to go on along it within the limits
  closed,       ///< the branch is a loop, wholly followed
  switched,     ///< the model switches there: the branch does not go on continuously
  not_implied,  ///< the equations hold, a rate that should follow from them does not vanish
  stuck,        ///< no next point however short the step: the equations jump, or their slopes lie
  not_finite,   ///< the model gives no finite numbers ahead
  singular,     ///< the equations leave more than one direction: a continuum of trims
  points,       ///< max_points
  no_start,     ///< there is no trim to start from
  interrupted,  ///< the caller asked to stop
};
std::string to_string(BranchEnd end);  ///< as JSON spells it

/// Points, events and end of a branch. Without a start there is one event, the end, and its point
/// is no trim.
struct Branch {
  std::vector<BranchPoint> points;      ///< from the start on; events are not among them
  std::vector<BranchEvent> events;      ///< along the way; the last is the end
  BranchEnd end = BranchEnd::no_start;  ///< why it goes no further
  std::string message;                  ///< the end in words
  std::string no_stability;             ///< why no point's eigenvalues are counted, if so
  long evaluations = 0;                 ///< of the model's f and derivatives
};

/// Follows the trims of `spec` from the trim at `start` while `parameter` (a state, input or
/// parameter of the model that the trim does not move) goes from its value there to `to`, and as it
/// likes in between: pseudo-arclength continuation with exact derivatives where the model has them.
/// Where there are more unknowns than equations the branch is that of least effort, and goes on
/// along a limit that it meets. Throws std::invalid_argument on the caller's mistakes.
[[nodiscard]] Branch follow(const Model& model, const TrimSpec& spec, const OperatingPoint& start,
                            const std::string& parameter, double to,
                            const FollowOptions& options = {});

}  // namespace tiltrim
