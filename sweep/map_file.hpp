/// @file
/// Maps as files: NetCDF-4 for sweeps of any size.
#pragma once

#include <filesystem>

#include "sweep/map.hpp"

namespace tiltrim {

/// Writes the map beside `file`, syncs and renames: the file is the old one or the new one. The
/// same map gives the same bytes. Throws std::runtime_error "path: why" (a full disk, no right).
void write_netcdf(const SweepMap& map, const std::filesystem::path& file);

/// Reads what write_netcdf() wrote; throws std::runtime_error "path: why" for anything else.
[[nodiscard]] SweepMap read_netcdf(const std::filesystem::path& file);

}  // namespace tiltrim
