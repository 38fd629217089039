/// Maps of verdicts alone, one byte a point, computed by parts. Internal to tiltrim.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <string>
#include <variant>
#include <vector>

#include "sweep/sweep.hpp"

namespace tiltrim {

/// A share of the work: part 1 .. of. Parts of one map are computed separately and merged.
struct SweepPart {
  std::uint64_t number = 1;  ///< from 1
  std::uint64_t of = 1;      ///< parts of the map
};

/// Verdicts of every point as in SweepMap::verdict, or of the lines of one part. Lines run along
/// the last axis.
struct VerdictMap {
  SweepMap grid;                     ///< axes, conditions, crossings; no arrays over points
  std::string work;                  ///< identity of everything that determines the verdicts
  SweepPart part;                    ///< the whole map, or a part of it
  std::vector<std::uint8_t> runs;    ///< the verdicts, line by line, by runs
  std::vector<std::int8_t> located;  ///< of each line: 1 if grid.crossings has all its crossings
};

/// Number of points with each verdict: stable, unstable, undecided, without an equilibrium.
using VerdictCounts = std::array<std::uint64_t, 4>;

/// The verdicts of sweep() at every point of the same grid, without its other numbers. On lines
/// along which the matrices are affine and the equilibrium is the same they come from one
/// polynomial, and crossings along the last axis are located if options.crossings is set and
/// rounding leaves no doubt. Memory: a block of lines, the runs, and the unknowns at the
/// ends of one row of lines along each slower axis. Bitwise identical for any number of threads and
/// ranks, after resuming, and from parts. Throws as sweep() does, and std::invalid_argument for a
/// part that does not exist or has no lines; SweepInterrupted has no map.
[[nodiscard]] VerdictMap sweep_verdicts(const std::vector<SweepRequest>& conditions,
                                        const std::vector<SweepAxis>& axes,
                                        const SweepOptions& options = {},
                                        const SweepPart& part = {});

/// One map of all its parts, in any order; `names` are used in messages. Throws
/// std::invalid_argument, with the names, if a part is missing, given twice, or of another work.
[[nodiscard]] VerdictMap merged(std::vector<VerdictMap> parts,
                                const std::vector<std::string>& names);

/// Per condition.
[[nodiscard]] std::vector<VerdictCounts> counts_of(const VerdictMap& map);

/// As write_netcdf() of a SweepMap. A part is written as such, for merged().
void write_netcdf(const VerdictMap& map, const std::filesystem::path& file);

/// Reads a part, or a whole map, that write_netcdf() wrote. Throws std::runtime_error "path:
/// reason" for any other file.
[[nodiscard]] VerdictMap read_verdict_map(const std::filesystem::path& file);

/// Reads a whole map of either kind. Throws std::runtime_error "path: reason" for any other file.
[[nodiscard]] std::variant<SweepMap, VerdictMap> read_map(const std::filesystem::path& file);

}  // namespace tiltrim
