// Matrices: the first byte says as CSV, JSON or MATLAB's, and whether as bounds.
#include <array>
#include <stdexcept>

#include "cli/matrix_file.hpp"
#include "tests/fuzz/input.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size == 0) return 0;
  constexpr std::array names{"matrix.csv", "matrix.json", "matrix.mat"};
  const auto file = as_file(names[data[0] % 3], bytes_of(data + 1, size - 1));
  try {
    (void)tiltrim::cli::read_matrix(file, "A", data[0] / 3 % 2 == 1);
  } catch (const std::runtime_error&) {
  }
  return 0;
}
