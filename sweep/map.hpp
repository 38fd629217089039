/// A map of eigenvalues over a grid: every point, its status, and what lies between the points.
#pragma once

#include <complex>
#include <cstdint>
#include <string>
#include <vector>

#include "linearize/modes.hpp"
#include "model/study.hpp"
#include "trim/trim.hpp"

namespace tiltrim {

/// A second branch of equilibria at some points: the grid walked from its other end meets another
/// equilibrium there. Entry k of each list belongs to points[k].
struct SecondBranch {
  std::vector<std::uint64_t> points;  ///< numbers of the points, rising
  std::vector<double> state, input;   ///< [k * states + i]
  std::vector<double> eigenvalue_re, eigenvalue_im;
  std::vector<std::int8_t> verdict;
};

enum class CrossingKind : std::int8_t {
  zero,   ///< a real eigenvalue crosses zero
  hopf,   ///< a complex pair crosses the imaginary axis
  jump,   ///< the model or the equilibrium jumps there: eigenvalues cross at once
  touch,  ///< eigenvalues come nearer the axis than can be decided, and do not change sides
  end,    ///< the equilibrium begins or ends there: a limit, a fold
};
std::string to_string(CrossingKind kind);

/// Where the number of unstable eigenvalues changes along an axis of the grid.
struct AxisCrossing {
  int condition = 0, axis = 0;
  std::vector<double> at;  ///< one coordinate for each axis, in the study's units
  double error = 0.0;      ///< of the located coordinate, in its unit
  CrossingKind kind = CrossingKind::zero;
  int unstable_before = 0, unstable_after = 0;  ///< unstable eigenvalues; -1: no equilibrium
  double frequency = 0.0;                       ///< rad/s; 0 for a real one
  int mode = -1;                                ///< which crosses; -1 where that is not known
  std::string mode_name{};
};

/// What is known of a whole interval along an axis, its ends apart.
enum class IntervalVerdict : std::int8_t { stable, unstable, no_trim, undecided };
std::string to_string(IntervalVerdict verdict);

struct AxisInterval {
  int condition = 0, axis = 0;
  std::vector<double> at;       ///< the line's coordinates; that of the axis itself is `from`
  double from = 0.0, to = 0.0;  ///< in the study's unit
  IntervalVerdict verdict = IntervalVerdict::undecided;
  int unstable = 0;          ///< eigenvalues right of the axis
  double abscissa = 0.0;     ///< largest real part met in it, 1/s
  double abscissa_at = 0.0;  ///< where
};

/// Points are numbered over (condition, first axis, ..., last axis), the last fastest. Numbers of a
/// point without an equilibrium are NaN.
struct SweepMap {
  std::string study;            ///< the whole text of the study file
  std::string program;          ///< "tiltrim 0.1.0"
  std::string instruction_set;  ///< that the eigenvalues were computed with
  std::vector<std::string> conditions;
  std::vector<SweepAxis> axes;
  Signals states, inputs;  ///< inputs: those of the model, or a closed loop's control outputs
  std::vector<std::vector<std::string>> mode_names;  ///< [condition][mode]

  std::vector<std::int8_t> status;                   ///< TrimStatus; -1: not reached (interrupted)
  std::vector<std::int8_t> verdict;                  ///< Verdict; -1: no equilibrium
  std::vector<std::int16_t> reason;                  ///< position in reasons
  std::vector<std::string> reasons;                  ///< distinct messages; the first is empty
  std::vector<double> residual;                      ///< scaled, 1/s
  std::vector<double> spectral_abscissa;             ///< 1/s
  std::vector<double> damping;                       ///< least damping ratio
  std::vector<double> state, input;                  ///< [point * states + i]
  std::vector<double> eigenvalue_re, eigenvalue_im;  ///< [point * modes + mode], 1/s
  std::vector<std::uint8_t> confidence;    ///< of the link to the point before, 255 is certain
  std::vector<std::int8_t> second_branch;  ///< 1: a second equilibrium was met; see second
  SecondBranch second;
  std::vector<AxisCrossing> crossings;
  std::vector<AxisInterval> intervals;

  std::size_t modes() const { return states.size(); }
  std::size_t points_per_condition() const;
  std::size_t points() const { return conditions.size() * points_per_condition(); }
  /// Positions along the axes of a point, the condition first.
  std::vector<std::size_t> position(std::size_t point) const;
};

}  // namespace tiltrim
