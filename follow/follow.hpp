/// @file
/// Continuation of a branch of trims in a parameter, through folds and limits, with its events.
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

/// Options of follow().
struct FollowOptions {
  double max_step = 0.5;         ///< length of a step, with every unknown over its nominal size
  int max_points = 5000;         ///< on the branch
  bool stability = true;         ///< eigenvalues along the branch, real and Hopf crossings
  double tolerance = 1e-10;      ///< on every held rate over its nominal size [1/s]
  double step_tolerance = 1e-9;  ///< on the last Newton step over nominal sizes
  std::stop_token stop{};        ///< checked between points
  /// Called after each point with the parameter's value and the number of points.
  std::function<void(double parameter, std::size_t points)> observe{};
};

/// A verified trim on the branch.
struct BranchPoint {
  double parameter = 0.0;          ///< its value, in its unit
  OperatingPoint point;            ///< the trim
  Eigen::VectorXd rates, outputs;  ///< all of them, at the point
  double residual = 0.0;           ///< as in TrimResult, evaluated at the point
  double step = 0.0;               ///< size of a further Newton step, over nominal sizes
  /// Number of eigenvalues with positive real part; empty if stability was not requested or the
  /// point is not an equilibrium: a rate depends on a state whose own rate is held at a value.
  std::optional<int> unstable{};
  /// If a cost selects the trim: it is a minimum, not only a stationary point, as after a fold.
  bool least = true;
};

/// The kinds of event on a branch.
enum class EventKind {
  fold,          ///< the branch reverses its direction in the parameter
  limit,         ///< a limit becomes active
  limit_left,    ///< a held limit becomes inactive
  zero,          ///< a real eigenvalue crosses zero, but not at a fold
  hopf,          ///< a complex pair crosses the imaginary axis
  branch_point,  ///< another branch crosses this one
  end,           ///< the last point; `which` gives the reason
};
std::string to_string(EventKind kind);  ///< as in JSON

/// Located on the branch as accurately as the derivatives allow.
struct BranchEvent {
  EventKind kind = EventKind::end;  ///< type of event
  BranchPoint at;                   ///< its location
  double error = 0.0;               ///< error bound of its parameter; infinite: unknown
  std::size_t after = 0;            ///< number of points of the branch before it
  std::string which;                ///< limit: "delta_e lower"; hopf, zero: mode name; end: reason
  std::optional<Modes> modes{};     ///< if it is an equilibrium with a linear model
  /// The eigenvalue on the imaginary axis: for zero and hopf, and for a fold or branch point with
  /// a zero eigenvalue.
  std::optional<std::complex<double>> eigenvalue{};
};

/// Why a branch ends.
enum class BranchEnd {
  reached,      ///< the parameter reached its target
  limit,        ///< at a limit, and no free unknown is left to continue along it within the limits
  closed,       ///< the branch is a closed loop, followed completely
  switched,     ///< the model switches there: the branch is discontinuous
  not_implied,  ///< the equations hold, but an implied rate does not vanish
  stuck,        ///< no next point at any step size: the equations jump, or derivatives are wrong
  not_finite,   ///< the model returns no finite numbers ahead
  singular,     ///< the null space has more than one dimension: a continuum of trims
  points,       ///< max_points
  no_start,     ///< there is no trim at the start
  interrupted,  ///< stopped by the caller
};
std::string to_string(BranchEnd end);  ///< as in JSON

/// Points, events and end of a branch. Without a start there is one event, the end, and its point
/// is not a trim.
struct Branch {
  std::vector<BranchPoint> points;      ///< from the start; events are not included
  std::vector<BranchEvent> events;      ///< in order; the last is the end
  BranchEnd end = BranchEnd::no_start;  ///< why it ends
  std::string message;                  ///< the end as text
  std::string no_stability;             ///< why no point has eigenvalues; otherwise empty
  long evaluations = 0;                 ///< of the model's f and derivatives
};

/// Follows the trims of `spec` from the trim at `start` while `parameter` (a state, input or
/// parameter of the model that is not free) goes from its value there to `to`; in between it may
/// reverse. Pseudo-arclength continuation, with exact derivatives if the model has them. If there
/// are more unknowns than equations, the branch is that of least cost, and continues along any
/// limit that it meets. Throws std::invalid_argument on invalid arguments.
[[nodiscard]] Branch follow(const Model& model, const TrimSpec& spec, const OperatingPoint& start,
                            const std::string& parameter, double to,
                            const FollowOptions& options = {});

}  // namespace tiltrim
