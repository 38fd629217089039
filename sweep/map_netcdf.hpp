/// Conversion between a map and the bytes of a NetCDF-4 file. Internal to sweep/.
#pragma once

#include <cstddef>
#include <cstdlib>
#include <filesystem>
#include <memory>
#include <optional>
#include <span>
#include <utility>

#include "sweep/map.hpp"
#include "sweep/map_fields.hpp"

namespace tiltrim::filing {

using Image = std::unique_ptr<std::byte, decltype(&std::free)>;

/// The bytes and their number; `file` is used in messages.
std::pair<Image, std::size_t> image_of(const SweepMap& map, const std::filesystem::path& file);
/// Everything in the bytes, unchecked. Throws std::runtime_error "path: reason" if they are not a
/// map file; HDF5 may crash, loop or overwrite memory on damaged ones.
void parts_in(std::span<std::byte> image, const std::filesystem::path& file, SweepMap& map,
              Lists& lists);
/// The same in a child process with limits on memory and time, with checks: a crash throws, too.
SweepMap map_in(std::span<std::byte> image, const std::filesystem::path& file);
/// What the child has sent, at most `most` bytes, checked; empty if the child ended before that.
std::optional<SweepMap> map_from(int pipe, std::size_t most, const std::filesystem::path& file);

}  // namespace tiltrim::filing
