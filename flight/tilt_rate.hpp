/// The largest tilt rate at which eigenvalues at frozen tilts predict the flight.
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

/// The closed loop along the corridor (16), frozen at one tilt.
struct FrozenLoop {
  double eta = 0.0;       ///< rad
  Command command;        ///< of the corridor at this tilt
  FlightState trim;       ///< at this command
  Eigen::MatrixXd A;      ///< of V_err, gamma_err, theta, q, x1, x2 scaled by their nominal values
  double abscissa = 0.0;  ///< 1/s
};

/// Tilt rates at which frozen eigenvalues guarantee stability, over an interval without a handover.
struct SlowTilt {
  double from = 0.0, to = 0.0;  ///< tilts, rad, falling
  bool stable = false;          ///< all frozen loops are stable; if not, nothing can be concluded
  /// rad/s: at lower tilt rates V = eᵀP(η)e with AᵀP + PA = -I falls along every unforced linear
  /// motion about the moving trim [57]; checked on a grid four times finer than that of P.
  double certified = 0.0;
  double certificate = 0.0;  ///< largest eigenvalue of AᵀP + PA + η'P' on that grid; negative
  double decided_at = 0.0;   ///< tilt that determines the rate, rad
};

/// Growth of the unforced linear motion about the moving trim at one tilt rate. The motion of the
/// trim is a forcing term, included only in the nonlinear flights.
struct Growth {
  double rate = 0.0;   ///< rad/s
  double worst = 0.0;  ///< largest ‖Φ(t, s)‖ over the transition, nominal sizes
  double whole = 0.0;  ///< ‖Φ‖ over the whole transition
};

/// A flight at one tilt rate with one disturbance.
struct TiltFlight {
  double rate = 0.0;        ///< rad/s
  std::string disturbed{};  ///< "θ +0.1 rad"
  bool holds = false;       ///< it stayed near the moving trims and settled at the last
  FlightStatus status = FlightStatus::flown;  ///< how it ended
  std::string message{};                      ///< why it failed
  double left = 0.0;  ///< rad: the tilt at which it left the trims or was lost
};

/// Outcome of the search.
enum class TiltRateStatus {
  found,        ///< between `holds` and `fails`
  always,       ///< even the fastest rate tried holds
  never,        ///< even the slowest rate fails: `message` gives the cause
  no_trim,      ///< a frozen loop has no trim
  interrupted,  ///< the caller asked to stop
};
std::string to_string(TiltRateStatus status);  ///< as JSON spells it

/// Result of tilt_rate_limit().
struct TiltRateLimit {
  TiltRateStatus status = TiltRateStatus::found;  ///< outcome of the search
  std::string message;                            ///< the cause, in words
  std::vector<FrozenLoop> loops;                  ///< over the tilt, falling
  bool frozen_stable = false;                     ///< every frozen loop is stable
  std::vector<SlowTilt> stretches;                ///< between handovers and kinks of the gains
  std::vector<Growth> growth;                     ///< at the rates flown, rising
  double holds = 0.0, fails = 0.0;  ///< rad/s: the prediction holds at one and fails at the other
  double disturbance = 1.0;         ///< fraction of the options' that the frozen loop recovers from
  std::vector<TiltFlight> flights;  ///< all flights
  TiltFlight worst;                 ///< the slowest flight that failed
};

/// Options of tilt_rate_limit().
struct TiltRateOptions {
  double from = std::numbers::pi / 2, to = 0.0;  ///< tilts, rad, falling
  double slowest = 0.0005, fastest = 3.0;        ///< rad/s
  double relative = 0.01;                        ///< relative width at which bisection stops
  int loops = 181;                               ///< number of frozen tilts
  double settles = 60.0;                         ///< s allowed to settle after the transition
  double speed = 3.0;  ///< m/s: largest distance of V from its command on the way
  /// rad: the same of the path angle; of the attitude, from the trim at the tilt
  double angle = 0.5;
  double theta = 0.05, gamma = 0.05;  ///< rad: size of the trim's disturbances, both signs
  double V = 0.2, q = 0.05;           ///< m/s, rad/s: the same
  int threads = 0;                    ///< 0: one per processor; the result does not depend on it
  TrimOptions trimming{.starts = 8, .max_boxes = 2000, .closest = false};  ///< of the frozen loops
  std::stop_token stop{};                            ///< checked between flights
  std::function<void(const TiltFlight&)> observe{};  ///< after each flight
};

/// The largest constant tilt rate at which the prediction of the frozen loops holds in nonlinear
/// flight: from every disturbed trim at the first tilt, the flight stays near the moving trims and
/// settles at the last. The rate is doubled from the slowest until it fails, then bisected; faster
/// rates may hold again. The result includes the rate that linear theory certifies. Throws
/// std::invalid_argument like fly(), and for tilts that do not fall.
[[nodiscard]] TiltRateLimit tilt_rate_limit(const Flight& flight,
                                            const TiltRateOptions& options = {});

}  // namespace tiltrim
