/// @file
/// How fast the tilt may move before eigenvalues at frozen tilts say nothing of the flight.
#pragma once

#include <Eigen/Core>
#include <functional>
#include <numbers>
#include <stop_token>
#include <string>
#include <vector>

#include "flight/fly.hpp"
#include "trim/trim.hpp"

namespace tiltrim {

/// The closed loop along the corridor (16), frozen at a tilt.
struct FrozenLoop {
  double eta = 0.0;       ///< rad
  Command command;        ///< of the corridor there
  FlightState trim;       ///< at it
  Eigen::MatrixXd A;      ///< of V_err, gamma_err, theta, q, x1, x2 over their nominal sizes
  double abscissa = 0.0;  ///< 1/s
};

/// Along a stretch without a switch, all frozen loops stable: rates up to which they decide.
struct SlowTilt {
  double from = 0.0, to = 0.0;  ///< tilts, rad, falling
  bool stable = false;          ///< all frozen loops are; else nothing follows from them
  /// rad/s: at slower tilt V = eᵀP(η)e with AᵀP + PA = -I falls along every unforced linear motion
  /// about the moving trim [57]; checked on a grid four times finer than P's own.
  double certified = 0.0;
  double certificate = 0.0;  ///< largest eigenvalue of AᵀP + PA + η'P' on that grid; below zero
  double decided_at = 0.0;   ///< tilt, rad, at which the rate is decided
};

/// At one tilt rate: how much the unforced linear motions about the moving trim grow. That the trim
/// moves drives them too; nonlinear flights have it.
struct Growth {
  double rate = 0.0;   ///< rad/s
  double worst = 0.0;  ///< largest ‖Φ(t, s)‖ over the transition, nominal sizes
  double whole = 0.0;  ///< ‖Φ‖ from its beginning to its end
};

/// A flight at one tilt rate with one disturbance.
struct TiltFlight {
  double rate = 0.0;        ///< rad/s
  std::string disturbed{};  ///< "θ +0.1 rad"
  bool holds = false;       ///< it stayed near the trims and came to that at the end
  FlightStatus status = FlightStatus::flown;  ///< how it ended
  std::string message{};                      ///< how it ended otherwise
  double left = 0.0;  ///< rad: the tilt at which it strayed from the trims or was lost
};

/// How the search ended.
enum class TiltRateStatus {
  found,        ///< between `holds` and `fails`
  always,       ///< even the fastest rate tried holds
  never,        ///< not even the slowest does: `cause` says why
  no_trim,      ///< some frozen loop has none
  interrupted,  ///< the caller asked to stop
};
std::string to_string(TiltRateStatus status);  ///< as JSON spells it

/// What tilt_rate_limit() answers.
struct TiltRateLimit {
  TiltRateStatus status = TiltRateStatus::found;  ///< how the search ended
  std::string message;                            ///< the cause, in words
  std::vector<FrozenLoop> loops;                  ///< over the tilt, falling
  bool frozen_stable = false;                     ///< every frozen loop is stable
  std::vector<SlowTilt> stretches;                ///< between switches
  std::vector<Growth> growth;                     ///< at the rates flown, rising
  double holds = 0.0, fails = 0.0;  ///< rad/s: the conclusion holds at one, fails at the other
  double disturbance = 1.0;         ///< of the options', as far as the frozen loop brings it back
  std::vector<TiltFlight> flights;  ///< all that were flown
  TiltFlight worst;                 ///< the slowest that failed
};

/// How tilt_rate_limit() goes about it.
struct TiltRateOptions {
  double from = std::numbers::pi / 2, to = 0.0;  ///< tilts, rad, falling
  double slowest = 0.0005, fastest = 3.0;        ///< rad/s
  double relative = 0.01;                        ///< between `holds` and `fails`
  int loops = 181;                               ///< frozen ones
  double settles = 60.0;                         ///< s after the transition
  double speed = 3.0;                            ///< m/s: on the way V stays this near the command
  /// rad: and the path angle; and the attitude this near the trim of the tilt.
  double angle = 0.5;
  double theta = 0.05, gamma = 0.05;  ///< rad: the trim is disturbed by each, up and down
  double V = 0.2, q = 0.05;           ///< m/s, rad/s: and by each of these
  int threads = 0;                    ///< 0: as many as the machine has; the answer is the same
  TrimOptions trimming{.starts = 8, .max_boxes = 2000, .closest = false};  ///< of frozen loops
  std::stop_token stop{};                            ///< asked between flights
  std::function<void(const TiltFlight&)> observe{};  ///< after each flight
};

/// The largest constant tilt rate at which the frozen loops' conclusion holds in nonlinear flight:
/// every disturbed trim of the first tilt stays near the moving trims and comes to that of the
/// last. Rates are doubled from the slowest until one fails, then bisected: faster ones may hold
/// again. Beside it stands what linear theory certifies. Throws std::invalid_argument as fly(), and
/// for tilts that do not fall.
[[nodiscard]] TiltRateLimit tilt_rate_limit(const Flight& flight,
                                            const TiltRateOptions& options = {});

}  // namespace tiltrim
