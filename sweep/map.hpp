/// @file
/// A map of eigenvalues over a grid: its axes, every point and its status, the crossings between
/// points, its file format, and the difference of two maps.
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

/// One axis of a sweep's grid: a variable of the model, and those that change with it.
struct SweepAxis {
  /// A variable set by the axis.
  struct Column {
    std::string name;            ///< as written by the user: "eta_deg", "gains.K_Lp"
    std::string unit;            ///< unit of `values`
    std::string signal;          ///< model signal that it sets; empty: a label only
    std::vector<double> values;  ///< in that unit, one per point
    std::vector<double> si;      ///< the same in SI, radians
  };
  std::string name;             ///< the dimension: the first key's last part, "K_Lp"
  std::vector<Column> columns;  ///< the axis's own key first
  /// Values of the columns between two grid points, given their linear interpolation (SI, one
  /// value per column); empty: linear interpolation.
  std::function<void(std::vector<double>& columns)> between{};
  /// Number of points.
  std::size_t size() const { return columns.front().values.size(); }
};

/// The kinds of crossing.
enum class CrossingKind : std::int8_t {
  zero,   ///< a real eigenvalue crosses zero
  hopf,   ///< a complex pair crosses the imaginary axis
  jump,   ///< the model or the equilibrium jumps, and eigenvalues change sides
  touch,  ///< eigenvalues touch the axis to within rounding, without changing sides
  end,    ///< the equilibrium begins or ends: a limit or a fold
};
std::string to_string(CrossingKind kind);  ///< as in JSON

/// Where the number of unstable eigenvalues changes along an axis of the grid.
struct AxisCrossing {
  int condition = 0, axis = 0;             ///< positions in the map
  std::vector<double> at;                  ///< one coordinate per axis, in the study's units
  double error = 0.0;                      ///< error bound of the located coordinate, in its unit
  CrossingKind kind = CrossingKind::zero;  ///< type of crossing
  int unstable_before = 0, unstable_after = 0;  ///< unstable eigenvalues; -1: no equilibrium
  double frequency = 0.0;                       ///< rad/s; 0 for a real eigenvalue
  int mode = -1;                                ///< the mode that crosses; -1 if unknown
  std::string mode_name{};                      ///< empty if unknown
};

/// Verdict on a whole interval along an axis, excluding its ends.
enum class IntervalVerdict : std::int8_t {
  stable,     ///< in the whole interval
  unstable,   ///< in the whole interval, with a constant number of unstable eigenvalues
  no_trim,    ///< no equilibrium was found in it
  undecided,  ///< unknown
};
std::string to_string(IntervalVerdict verdict);  ///< as in JSON

/// An interval of an axis with a common verdict.
struct AxisInterval {
  int condition = 0, axis = 0;  ///< positions in the map
  std::vector<double> at;       ///< the line's coordinates; on the axis itself equal to `from`
  double from = 0.0, to = 0.0;  ///< in the study's unit
  IntervalVerdict verdict = IntervalVerdict::undecided;  ///< verdict
  int unstable = 0;                                      ///< eigenvalues right of the axis
  double abscissa = 0.0;                                 ///< largest real part found in it, 1/s
  double abscissa_at = 0.0;                              ///< its coordinate
};

/// Points are numbered over (condition, first axis, ..., last axis), the last fastest. Values of a
/// point without an equilibrium are NaN.
struct SweepMap {
  /// A second branch of equilibria at some points: sweeping from the other end finds another
  /// equilibrium there. Entry k of each list belongs to points[k].
  struct SecondBranch {
    std::vector<std::uint64_t> points;                 ///< numbers of the points, ascending
    std::vector<double> state, input;                  ///< [k * states + i]
    std::vector<double> eigenvalue_re, eigenvalue_im;  ///< [k * modes + mode], 1/s
    std::vector<std::int8_t> verdict;                  ///< Verdict
  };

  std::string study;            ///< complete text of the study file
  std::string program;          ///< "tiltrim 0.1.0"
  std::string instruction_set;  ///< the processor feature that affects results
  std::string polar;            ///< checksum of the study's polar; empty: it has none, or unknown
  std::vector<std::string> conditions;  ///< their names
  std::vector<SweepAxis> axes;          ///< the slowest first
  Signals states, inputs;  ///< inputs: those of the model, or control outputs of a closed loop
  std::vector<std::vector<std::string>> mode_names;  ///< [condition][mode]

  std::vector<std::int8_t> status;                   ///< TrimStatus; -1: not reached (interrupted)
  std::vector<std::int8_t> verdict;                  ///< Verdict; -1: no equilibrium
  std::vector<std::int16_t> reason;                  ///< index into reasons
  std::vector<std::string> reasons;                  ///< distinct messages; the first is empty
  std::vector<double> residual;                      ///< scaled, 1/s
  std::vector<double> spectral_abscissa;             ///< 1/s
  std::vector<double> damping;                       ///< smallest damping ratio
  std::vector<double> state, input;                  ///< [point * states + i]
  std::vector<double> eigenvalue_re, eigenvalue_im;  ///< [point * modes + mode], 1/s
  std::vector<std::uint8_t> confidence;    ///< of the link to the previous point, 255 is certain
  std::vector<std::int8_t> second_branch;  ///< 1: a second equilibrium was found; see second
  SecondBranch second;                     ///< at the points that have one
  std::vector<AxisCrossing> crossings;     ///< located
  std::vector<AxisInterval> intervals;     ///< also between the points

  /// Modes per point: the number of states.
  std::size_t modes() const { return states.size(); }
  std::size_t points_per_condition() const;  ///< of the grid
  /// All points.
  std::size_t points() const { return conditions.size() * points_per_condition(); }
  /// Indices of a point along the axes, the condition first.
  std::vector<std::size_t> position(std::size_t point) const;
};

/// Writes the map to a file next to `file`, syncs and renames it: `file` is always complete. Equal
/// maps give identical bytes. Throws std::runtime_error "path: reason" (full disk, no permission).
void write_netcdf(const SweepMap& map, const std::filesystem::path& file);

/// Reads a file of write_netcdf(); throws std::runtime_error "path: reason" for any other file.
[[nodiscard]] SweepMap read_netcdf(const std::filesystem::path& file);

}  // namespace tiltrim
