// Logs of sweeps: the bytes as a file, and as records whose checksums hold.
#include "runtime/log.hpp"

#include <stdexcept>

#include "sweep/record.hpp"
#include "tests/fuzz/input.hpp"

using namespace tiltrim;

namespace {

constexpr LineSizes sizes{.conditions = 1, .axes = 1, .points = 3, .states = 2, .inputs = 1};

void read_lines(const Bytes& record) {
  try {
    (void)points_from(record, sizes);
  } catch (const std::runtime_error&) {
  }
  try {
    (void)verdicts_from(record, sizes);
  } catch (const std::runtime_error&) {
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const auto bytes = bytes_of(data, size);
  read_lines({bytes.begin(), bytes.end()});
  const std::filesystem::path file = "sweep.log";
  try {
    as_file(file, {});
    Log(file, "identity\n").append(1, bytes);  // then the same without its first half, unsealed
    std::filesystem::resize_file(file, std::filesystem::file_size(file) - size / 2);
    {
      const Log log(file, "identity\n");
      for (const Log::Record& record : log.recovered()) read_lines(record.bytes);
    }
    as_file(file, bytes);
    const Log log(file, "identity\n");
  } catch (const LogError&) {
  }
  return 0;
}
