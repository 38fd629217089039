/// A map as the bytes of a NetCDF-4 file, and back. Internal to sweep/.
#pragma once

#include <cstddef>
#include <cstdlib>
#include <filesystem>
#include <memory>
#include <span>
#include <utility>

#include "sweep/map.hpp"

namespace tiltrim::filing {

using Image = std::unique_ptr<std::byte, decltype(&std::free)>;

/// The bytes, and how many; `file` stands in messages.
std::pair<Image, std::size_t> image_of(const SweepMap& map, const std::filesystem::path& file);
/// Throws std::runtime_error "path: why" for bytes that are no such file.
SweepMap map_in(std::span<std::byte> image, const std::filesystem::path& file);

}  // namespace tiltrim::filing
