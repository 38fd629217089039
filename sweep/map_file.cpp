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
#include "sweep/verdict_map.hpp"

namespace tiltrim {

// The file is built in memory and written by tiltrim: HDF5 fails on a full disk without reporting
// it, and returns wrong numbers or crashes on a damaged file. A checksum of the whole file follows
// the NetCDF part, where NetCDF readers do not look.

namespace {

using namespace filing;

constexpr std::string_view seal = "tiltmap\n";  // then the checksum, at the end of the file

// Throws unless there is memory for a copy of the map of this size: the NetCDF and HDF5 libraries
// do not survive running out of it.
void check_memory(std::size_t bytes, const std::filesystem::path& file) {
  constexpr std::size_t others = std::size_t(16) << 20;  // caches, data not per point
  bytes += others;
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

Contents read_contents(const std::filesystem::path& file) {
  try {
    std::vector<std::byte> bytes = read_whole(file);
    return checked_contents_in(unsealed(bytes, file), file);
  } catch (const std::bad_alloc&) {
    refuse(file, ENOMEM);
  }
}

void write_sealed(std::span<const std::byte> content, const std::filesystem::path& file) {
  std::array<std::byte, seal.size() + sizeof(std::uint64_t)> behind{};
  std::memcpy(behind.data(), seal.data(), seal.size());
  const std::uint64_t sum = checksum(std::span(behind).first(seal.size()), checksum(content));
  std::memcpy(behind.data() + seal.size(), &sum, sizeof sum);
  write_whole(file, {content, behind});
}

}  // namespace

void write_netcdf(const SweepMap& map, const std::filesystem::path& file) {
  std::size_t size_of_points = 0;
  each_over_points(map, [&](const Field&, const auto& array) {
    size_of_points += array.size() * sizeof(array[0]);
  });
  check_memory(size_of_points, file);
  const auto [image, size] = image_of(map, file);
  write_sealed({image.get(), size}, file);
}

void write_netcdf(const VerdictMap& map, const std::filesystem::path& file) {
  check_memory(2 * map.runs.size(), file);
  const auto [image, size] = image_of(map, file);
  write_sealed({image.get(), size}, file);
}

std::variant<SweepMap, VerdictMap> read_map(const std::filesystem::path& file) {
  Contents contents = read_contents(file);
  if (contents.map.part.of > 1)
    refuse(file, "is a part of a map of verdicts, for tiltrim merge; expected a whole map");
  if (contents.verdicts) return std::move(contents.map);
  return std::move(contents.map.grid);
}

SweepMap read_netcdf(const std::filesystem::path& file) {
  auto map = read_map(file);
  if (std::holds_alternative<VerdictMap>(map))
    refuse(file,
           "is a map of verdicts alone, without equilibria and eigenvalues; expected a map of a "
           "study without detail = \"verdict\"");
  return std::get<SweepMap>(std::move(map));
}

VerdictMap read_verdict_map(const std::filesystem::path& file) {
  Contents contents = read_contents(file);
  if (!contents.verdicts)
    refuse(file,
           "is a map with equilibria and eigenvalues; expected one of a study with detail = "
           "\"verdict\"");
  return std::move(contents.map);
}

}  // namespace tiltrim
