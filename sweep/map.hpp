/// @file
/// A map of eigenvalues over a grid: its axes, every point and its status, what lies between the
/// points, the map as a file, and what changed between two maps.
#pragma once

#include <complex>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "linearize/modes.hpp"
#include "trim/trim.hpp"

namespace tiltrim {

/// One axis of a sweep's grid: a number of the model, and those that move with it.
struct SweepAxis {
  /// A number that the axis moves.
  struct Column {
    std::string name;            ///< as the caller writes it: "eta_deg", "gains.K_Lp"
    std::string unit;            ///< of these values
    std::string signal;          ///< of the model that it sets; empty: it only names the points
    std::vector<double> values;  ///< in that unit, one for each point
    std::vector<double> si;      ///< the same in SI, radians
  };
  std::string name;             ///< the dimension: the first key's last part, "K_Lp"
  std::vector<Column> columns;  ///< the axis's own key first
  /// What the columns are between two points of the grid, from what they would be on straight lines
  /// (SI, one value for each column); empty: that.
  std::function<void(std::vector<double>& columns)> between{};
  /// Points along it.
  std::size_t size() const { return columns.front().values.size(); }
};

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

/// Writes the map beside `file`, syncs and renames: the file is the old one or the new one. The
/// same map gives the same bytes. Throws std::runtime_error "path: why" (a full disk, no right).
void write_netcdf(const SweepMap& map, const std::filesystem::path& file);

/// Reads what write_netcdf() wrote; throws std::runtime_error "path: why" for anything else.
[[nodiscard]] SweepMap read_netcdf(const std::filesystem::path& file);

/// A point at which two maps differ.
struct PointDifference {
  std::size_t point;                       ///< number in both maps
  TrimStatus status_before, status_after;  ///< of its trim
  int verdict_before, verdict_after;       ///< Verdict, or -1 without an equilibrium
  double abscissa_before, abscissa_after;  ///< largest real part, 1/s; NaN without one
};

/// All that is another.
struct MapDifference {
  std::vector<PointDifference> changed;          ///< status or verdict is another
  double largest_abscissa_change = 0.0;          ///< over points with an equilibrium in both, 1/s
  std::size_t largest_at = 0;                    ///< the point where
  std::size_t compared = 0;                      ///< points
  std::vector<AxisCrossing> appeared, vanished;  ///< crossings in one map alone
  /// A crossing that is elsewhere.
  struct Moved {
    AxisCrossing before, after;  ///< in the two maps
  };
  /// Crossings in both, of the same kind and on the same line, the nearest being taken for the
  /// same, where the place or the numbers of unstable eigenvalues are others.
  std::vector<Moved> moved;
};

/// Point by point and crossing by crossing. A map without any change gives empty lists and 0.
/// Throws std::invalid_argument, saying what is another, unless both have the same conditions, axes
/// and states.
[[nodiscard]] MapDifference difference(const SweepMap& before, const SweepMap& after);

}  // namespace tiltrim
