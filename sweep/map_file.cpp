#include <sys/mman.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdint>
#include <cstring>
#include <new>
#include <span>
#include <string_view>

#include "runtime/checksum.hpp"
#include "runtime/whole_file.hpp"
#include "sweep/map.hpp"
#include "sweep/map_fields.hpp"
#include "sweep/map_netcdf.hpp"

namespace tiltrim {

// The file is built in memory and written by tiltrim: HDF5 fails on a full disk without reporting
// it, and returns wrong numbers or crashes on a damaged file. A checksum of the whole file follows
// the NetCDF part, where NetCDF readers do not look.

namespace {

using namespace filing;

constexpr std::string_view seal = "tiltmap\n";  // then the checksum, at the end of the file

// Throws unless there is memory for a copy of the map: the NetCDF and HDF5 libraries do not survive
// running out of it.
void check_memory(const SweepMap& map, const std::filesystem::path& file) {
  constexpr std::size_t others = std::size_t(16) << 20;  // caches, data not per point
  std::size_t bytes = others;
  each_over_points(
      map, [&](const Field&, const auto& array) { bytes += array.size() * sizeof(array[0]); });
  bytes += bytes / 8;
  void* room = ::mmap(nullptr, bytes, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
  if (room == MAP_FAILED) refuse(file, errno);
  ::munmap(room, bytes);
}

// The NetCDF part of the file, after its checksum has been verified.
std::span<std::byte> unsealed(std::vector<std::byte>& bytes, const std::filesystem::path& file) {
  constexpr std::array<unsigned char, 8> hdf5{0x89, 'H', 'D', 'F', '\r', '\n', 0x1A, '\n'};
  if (bytes.size() < hdf5.size() || std::memcmp(bytes.data(), hdf5.data(), hdf5.size()) != 0)
    refuse(file, "is not a NetCDF-4 file");
  constexpr std::size_t behind = seal.size() + sizeof(std::uint64_t);
  const std::size_t size = bytes.size() - std::min(bytes.size(), behind);
  if (size == 0 || std::memcmp(bytes.data() + size, seal.data(), seal.size()) != 0)
    refuse(file,
           "is not the map that tiltrim wrote: it was truncated, or changed by another program");
  std::uint64_t expected = 0;
  std::memcpy(&expected, bytes.data() + size + seal.size(), sizeof expected);
  if (checksum(std::span(bytes).first(size + seal.size())) != expected)
    refuse(file, "is damaged: its checksum does not match");
  return std::span(bytes).first(size);
}

SweepMap read_map(const std::filesystem::path& file) {
  std::vector<std::byte> bytes = read_whole(file);
  return map_in(unsealed(bytes, file), file);
}

}  // namespace

void write_netcdf(const SweepMap& map, const std::filesystem::path& file) {
  check_memory(map, file);
  const auto [image, size] = image_of(map, file);
  const std::span<const std::byte> content(image.get(), size);
  std::array<std::byte, seal.size() + sizeof(std::uint64_t)> behind{};
  std::memcpy(behind.data(), seal.data(), seal.size());
  const std::uint64_t sum = checksum(std::span(behind).first(seal.size()), checksum(content));
  std::memcpy(behind.data() + seal.size(), &sum, sizeof sum);
  write_whole(file, {content, behind});
}

SweepMap read_netcdf(const std::filesystem::path& file) {
  try {
    return read_map(file);
  } catch (const std::bad_alloc&) {
    refuse(file, ENOMEM);
  }
}

}  // namespace tiltrim
