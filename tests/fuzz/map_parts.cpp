// What the child process that reads a map sends, which a forged map may have taken over.
#include <sys/mman.h>
#include <unistd.h>

#include <stdexcept>

#include "sweep/difference.hpp"
#include "sweep/map_netcdf.hpp"
#include "tests/fuzz/input.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const int file = ::memfd_create("parts", 0);
  if (file < 0 || ::write(file, data, size) != ssize_t(size) || ::lseek(file, 0, SEEK_SET) != 0)
    std::abort();
  try {
    constexpr std::size_t most = 1 << 20;
    const auto map = tiltrim::filing::contents_from(file, most, "map.nc");
    if (map && !map->verdicts) (void)tiltrim::difference(map->map.grid, map->map.grid);
    if (map && map->verdicts) (void)tiltrim::counts_of(map->map);
  } catch (const std::runtime_error&) {
  }
  ::close(file);
  return 0;
}
