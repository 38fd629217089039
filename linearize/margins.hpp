/// @file
/// Classical margins of a loop broken at one place: gain, phase, delay, disk, peak of sensitivity.
#pragma once

#include <Eigen/Core>
#include <complex>
#include <limits>
#include <vector>

#include "linearize/modes.hpp"

namespace tiltrim {

/// L(s) = c (sI - A)⁻¹ b + d, what comes back to the place where the loop is broken, with its sign
/// turned: 1 + L = 0 is the closed loop (negative feedback). A is n x n [1/s], b and c have n
/// entries; n = 0 is a static gain d.
struct LoopTransfer {
  Eigen::MatrixXd A;     ///< 1/s
  Eigen::VectorXd b;     ///< from the place where it is broken
  Eigen::RowVectorXd c;  ///< back to it
  double d = 0.0;        ///< straight through
};

/// L(iω) at a frequency ω in rad/s, which may be infinite; infinite itself at a pole. Throws
/// std::invalid_argument if sizes do not fit or something is not a number.
[[nodiscard]] std::complex<double> response(const LoopTransfer& loop, double frequency);

/// The loop opened, from the closed one: with all loops closed, what is added at the place comes
/// out behind it as S(s) = 1 + c (sI - A)⁻¹ b + d; then L = 1/S - 1. Throws std::invalid_argument
/// if 1 + d = 0 (no such loop has an answer), if sizes do not fit or something is not finite.
[[nodiscard]] LoopTransfer opened(const Eigen::MatrixXd& A_closed, const Eigen::VectorXd& b,
                                  const Eigen::RowVectorXd& c, double d = 0.0);

/// A frequency at which one change alone puts an eigenvalue of the closed loop on the axis.
struct Crossing {
  double frequency;  ///< rad/s, may be 0 or infinite
  double change;     ///< k > 0 with 1 + k L = 0, or the lag φ [rad] with 1 + exp(-iφ) L = 0
};

/// How far the loop is from instability, each change taken alone. Frequencies "at" are in rad/s,
/// infinite where the margin is met at no finite frequency. The defaults are those of a loop that
/// is not stable: it has no margin.
struct Margins {
  static constexpr double none = std::numeric_limits<double>::infinity();  ///< no margin met

  Verdict closed_loop = Verdict::undecided;     ///< modes() of A - b c/(1 + d)
  double gain_up = 1.0, gain_up_at = none;      ///< least destabilising factor > 1; inf: none
  double gain_down = 1.0, gain_down_at = none;  ///< largest destabilising factor < 1; 0: none
  double phase = 0.0, phase_at = none;          ///< rad, least lag or lead; inf: |L| is never 1
  double delay = 0.0, delay_at = none;          ///< s, least delay; inf: none; 0 for |d| >= 1
  double disk = 0.0, disk_at = none;            ///< symmetric disk margin, 2/‖S - T‖∞ [43]
  double sensitivity_peak = none, sensitivity_peak_at = none;  ///< max |S|, S = 1/(1 + L)

  std::vector<Crossing> phase_crossings;  ///< all with L < 0 real; change: the factor, 1e-9 to 1e9
  std::vector<Crossing> gain_crossovers;  ///< all with |L| = 1; change: the lag, in [-π, π]
  /// Largest |1 + change L(iω)| over all of these, on the loop as it was given: zero to rounding.
  double residual = 0.0;
  /// False: an iteration met its cap and something may be missed, or the residual exceeds 1e-6.
  bool complete = true;

  /// The closed loop is.
  bool stable() const { return closed_loop == Verdict::stable; }
  /// What the disk guarantees: every factor from this to disk_gain_up(), every lag or lead less
  /// than disk_phase(), and both together as far as (1 + z)/(1 - z), |z| < disk/2, reaches.
  double disk_gain_down() const;
  double disk_gain_up() const;  ///< see disk_gain_down()
  double disk_phase() const;    ///< rad; see disk_gain_down()
};

/// How margins() goes about it.
struct MarginsOptions {
  int max_levels = 30;  ///< of each search for a peak; two or three do
};

/// Margins of the loop. An eigenvalue on the axis, or one that rounding does not tell from it,
/// leaves no margin. Throws std::invalid_argument if sizes do not fit, something is not finite, or
/// 1 + d = 0.
[[nodiscard]] Margins margins(const LoopTransfer& loop, const MarginsOptions& options = {});

/// L along the axis: magnitude as it is, phase in rad without jumps of 2π however coarse the grid,
/// the first in (-3π/2, π/2] (to a little rounding).
struct Bode {
  std::vector<double> frequency, magnitude, phase;  ///< rad/s, 1, rad; rising in frequency
};

/// `points` frequencies from `from` to `to` [rad/s], both included, evenly spaced in their
/// logarithm. Throws std::invalid_argument unless 0 < from < to and points >= 2.
[[nodiscard]] Bode bode(const LoopTransfer& loop, double from, double to, int points);

}  // namespace tiltrim
