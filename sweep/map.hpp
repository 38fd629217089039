/// @file
/// A map of eigenvalues over a grid: every point, its status, and what lies between the points.
#pragma once

#include <complex>
#include <cstdint>
#include <string>
#include <vector>

#include "linearize/modes.hpp"
#include "sweep/axis.hpp"
#include "trim/trim.hpp"

namespace tiltrim {

/// A second branch of equilibria at some points: the grid walked from its other end meets another
/// equilibrium there. Entry k of each list belongs to points[k].
struct SecondBranch {
  std::vector<std::uint64_t> points;                 ///< numbers of the points, rising
  std::vector<double> state, input;                  ///< [k * states + i]
  std::vector<double> eigenvalue_re, eigenvalue_im;  ///< [k * modes + mode], 1/s
  std::vector<std::int8_t> verdict;                  ///< Verdict
};

/// What happens at a crossing.
enum class CrossingKind : std::int8_t {
  zero,   ///< a real eigenvalue crosses zero
  hopf,   ///< a complex pair crosses the imaginary axis
  jump,   ///< the model or the equilibrium jumps there: eigenvalues cross at once
  touch,  ///< eigenvalues come nearer the axis than can be decided, and do not change sides
  end,    ///< the equilibrium begins or ends there: a limit, a fold
};
std::string to_string(CrossingKind kind);  ///< as JSON spells it

/// Where the number of unstable eigenvalues changes along an axis of the grid.
struct AxisCrossing {
  int condition = 0, axis = 0;             ///< positions in the map's
  std::vector<double> at;                  ///< one coordinate for each axis, in the study's units
  double error = 0.0;                      ///< of the located coordinate, in its unit
  CrossingKind kind = CrossingKind::zero;  ///< what happens
  int unstable_before = 0, unstable_after = 0;  ///< unstable eigenvalues; -1: no equilibrium
  double frequency = 0.0;                       ///< rad/s; 0 for a real one
  int mode = -1;                                ///< which crosses; -1 where that is not known
  std::string mode_name{};                      ///< empty where that is not known
};

/// What is known of a whole interval along an axis, its ends apart.
enum class IntervalVerdict : std::int8_t {
  stable,     ///< throughout
  unstable,   ///< throughout, with the same number of unstable eigenvalues
  no_trim,    ///< no equilibrium was found in it
  undecided,  ///< none of these is known
};
std::string to_string(IntervalVerdict verdict);  ///< as JSON spells it

/// A stretch of an axis of which one thing is known.
struct AxisInterval {
  int condition = 0, axis = 0;  ///< positions in the map's
  std::vector<double> at;       ///< the line's coordinates; that of the axis itself is `from`
  double from = 0.0, to = 0.0;  ///< in the study's unit
  IntervalVerdict verdict = IntervalVerdict::undecided;  ///< what is known
  int unstable = 0;                                      ///< eigenvalues right of the axis
  double abscissa = 0.0;                                 ///< largest real part met in it, 1/s
  double abscissa_at = 0.0;                              ///< where
};

/// Points are numbered over (condition, first axis, ..., last axis), the last fastest. Numbers of a
/// point without an equilibrium are NaN.
struct SweepMap {
  std::string study;                    ///< the whole text of the study file
  std::string program;                  ///< "tiltrim 0.1.0"
  std::string instruction_set;          ///< rounding(): what of the processor the bits depend on
  std::vector<std::string> conditions;  ///< their names
  std::vector<SweepAxis> axes;          ///< the first slowest
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
  SecondBranch second;                     ///< where there is one
  std::vector<AxisCrossing> crossings;     ///< located
  std::vector<AxisInterval> intervals;     ///< between the points too

  /// Of each point: as many as states.
  std::size_t modes() const { return states.size(); }
  std::size_t points_per_condition() const;  ///< of the grid
  /// All.
  std::size_t points() const { return conditions.size() * points_per_condition(); }
  /// Positions along the axes of a point, the condition first.
  std::vector<std::size_t> position(std::size_t point) const;
};

}  // namespace tiltrim
