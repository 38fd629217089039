/// Conversion between a map and the bytes of a NetCDF-4 file. Internal to sweep/.
#pragma once

#include <cstddef>
#include <filesystem>
#include <optional>
#include <span>
#include <utility>

#include "sweep/map_dataset.hpp"
#include "sweep/map_fields.hpp"
#include "sweep/verdict_map.hpp"

namespace tiltrim::filing {

/// The bytes and their number; `file` is used in messages.
std::pair<Image, std::size_t> image_of(const SweepMap& map, const std::filesystem::path& file);
std::pair<Image, std::size_t> image_of(const VerdictMap& map, const std::filesystem::path& file);

/// What a file contains: a map, which is map.grid, or verdicts alone.
struct Contents {
  bool verdicts = false;
  VerdictMap map;
  Lists lists;
};
/// Everything in the bytes, unchecked. Throws std::runtime_error "path: reason" if they are not a
/// map file; HDF5 may crash, loop or overwrite memory on damaged ones.
Contents contents_in(std::span<std::byte> image, const std::filesystem::path& file);
/// The same in a child process with limits on memory and time, with checks: a crash throws, too.
Contents checked_contents_in(std::span<std::byte> image, const std::filesystem::path& file);
/// What the child has sent, at most `most` bytes, checked; empty if the child ended before that.
std::optional<Contents> contents_from(int pipe, std::size_t most,
                                      const std::filesystem::path& file);

/// Creates the file's dimensions, global attributes, study and axes.
void add_head(Dataset& set, Puts& puts, const SweepMap& map, const char* title);
/// The verdicts of a file without other numbers of points, or of a part.
void get_verdicts(Dataset& set, VerdictMap& map);
/// Throws std::runtime_error "what is wrong" unless the verdicts are those of the grid or the part.
void check_verdicts(const VerdictMap& map);

}  // namespace tiltrim::filing
