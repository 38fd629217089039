// Polars: what is read is evaluated all round.
#include "vehicles/tiltrotor/polar.hpp"

#include <stdexcept>

#include "tests/fuzz/input.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  try {
    const tiltrim::Polar polar = tiltrim::load_polar(as_file("polar.csv", bytes_of(data, size)));
    for (double alpha = -7.0; alpha < 7.0; alpha += 0.37) (void)polar.slope_at(alpha);
    (void)polar.range(-0.3, 0.4);
    (void)polar.range(3.0, 3.3);
  } catch (const std::runtime_error&) {
  }
  return 0;
}
