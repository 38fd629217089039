/// @file
/// Stability margins of a loop broken at one point: gain, phase, delay, disk, sensitivity peak.
#pragma once

#include <Eigen/Core>
#include <complex>
#include <limits>
#include <string_view>
#include <vector>

#include "linearize/modes.hpp"

namespace tiltrim {

/// L(s) = c (sI - A)⁻¹ b + d, the signal returned to the point where the loop is broken, with its
/// sign reversed: 1 + L = 0 gives the closed-loop poles (negative feedback). A is n x n [1/s], b
/// and c have n entries; n = 0 is a static gain d.
struct LoopTransfer {
  Eigen::MatrixXd A;     ///< 1/s
  Eigen::VectorXd b;     ///< from the break point
  Eigen::RowVectorXd c;  ///< back to the break point
  double d = 0.0;        ///< feedthrough
};

/// L(iω) at a frequency ω in rad/s, which may be infinite; L is infinite at a pole. Throws
/// std::invalid_argument if sizes do not match or a value is NaN.
[[nodiscard]] std::complex<double> response(const LoopTransfer& loop, double frequency);

/// The open loop from the closed one: with all loops closed, a signal added at the break point
/// appears after it as S(s) = 1 + c (sI - A)⁻¹ b + d; then L = 1/S - 1. Throws
/// std::invalid_argument if 1 + d = 0 (no such loop), sizes do not match or a value is not finite.
[[nodiscard]] LoopTransfer opened(const Eigen::MatrixXd& A_closed, const Eigen::VectorXd& b,
                                  const Eigen::RowVectorXd& c, double d = 0.0);
/// The same by signal names: what is added to `input` returns as `output`, what the control law
/// adds to that input. Throws std::invalid_argument also for unknown names.
[[nodiscard]] LoopTransfer opened(const LinearModel& closed, std::string_view input,
                                  std::string_view output);

/// Distance to instability for each change alone. Frequencies "at" are in rad/s, infinite if the
/// margin is not reached at a finite one. The defaults are those of an unstable loop: no margin.
struct Margins {
  /// A frequency at which a single change puts a closed-loop eigenvalue on the imaginary axis.
  struct Crossing {
    double frequency;  ///< rad/s, may be 0 or infinite
    double change;     ///< k > 0 with 1 + k L = 0, or the lag φ [rad] with 1 + exp(-iφ) L = 0
  };

  static constexpr double none = std::numeric_limits<double>::infinity();  ///< no margin reached

  Verdict closed_loop = Verdict::undecided;     ///< from modes() of A - b c/(1 + d)
  double gain_up = 1.0, gain_up_at = none;      ///< smallest destabilizing factor > 1; inf: none
  double gain_down = 1.0, gain_down_at = none;  ///< largest destabilizing factor < 1; 0: no limit
  double phase = 0.0, phase_at = none;          ///< rad, smallest lag or lead; inf: |L| is never 1
  double delay = 0.0, delay_at = none;          ///< s, smallest; inf: no limit; 0 for |d| >= 1
  double disk = 0.0, disk_at = none;            ///< symmetric disk margin, 2/‖S - T‖∞ [43]
  double sensitivity_peak = none, sensitivity_peak_at = none;  ///< max |S|, S = 1/(1 + L)

  std::vector<Crossing> phase_crossings;  ///< all with L < 0 real; change: the factor, 1e-9 to 1e9
  std::vector<Crossing> gain_crossovers;  ///< all with |L| = 1; change: the lag, in [-π, π]
  /// Largest |1 + change L(iω)| over all of these, for the loop as given: zero to rounding.
  double residual = 0.0;
  /// False: an iteration limit was reached (crossings may be missing), the residual is > 1e-6, S at
  /// a peak differs by more than that from 1/(1 + L), or the error bound of a closed-loop
  /// eigenvalue is more than 1e-3 of its distance to the axis (a resonance may be missed).
  bool complete = true;

  /// True if the closed loop is stable.
  bool stable() const { return closed_loop == Verdict::stable; }
  /// Guaranteed by the disk margin: every gain factor from this to disk_gain_up(), every lag or
  /// lead less than disk_phase(), and both together within (1 + z)/(1 - z), |z| < disk/2.
  double disk_gain_down() const;
  double disk_gain_up() const;  ///< see disk_gain_down()
  double disk_phase() const;    ///< rad; see disk_gain_down()
};

/// Margins of the loop. If an eigenvalue is on the axis to rounding, there is no margin. Throws
/// std::invalid_argument if sizes do not match, a value is not finite, or 1 + d = 0.
[[nodiscard]] Margins margins(const LoopTransfer& loop);

/// Frequency response of L: magnitude, not in dB, and phase in rad without jumps of 2π however
/// coarse the grid, the first in (-3π/2, π/2] (to rounding).
struct Bode {
  std::vector<double> frequency, magnitude, phase;  ///< rad/s, 1, rad; by ascending frequency
};

/// `points` frequencies from `from` to `to` [rad/s], both included, with logarithmic spacing.
/// Throws std::invalid_argument unless 0 < from < to and points >= 2.
[[nodiscard]] Bode bode(const LoopTransfer& loop, double from, double to, int points);

}  // namespace tiltrim
