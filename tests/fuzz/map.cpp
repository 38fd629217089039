// Maps: a small one, forged; the input says where and how.
#include "sweep/map.hpp"

#include <array>
#include <cstring>
#include <fstream>
#include <iterator>
#include <stdexcept>
#include <vector>

#include "sweep/difference.hpp"
#include "tests/forged_map.hpp"
#include "tests/fuzz/input.hpp"

using namespace tiltrim;

namespace {

// Two points, one of them with a crossing after it, and texts of every kind.
std::string small_map() {
  SweepMap map;
  map.study = "[[condition]]\n";
  map.program = "tiltrim";
  map.conditions = {"level"};
  map.axes = {{"V", {{"V", "m/s", "V", {10, 20}, {10, 20}}, {"eta_deg", "", "", {90, 0}, {1, 0}}}}};
  map.states = {{"q", "rad/s", 1}};
  map.inputs = {{"delta_e", "rad", 0.25}};
  map.mode_names = {{"pitch"}};
  map.reasons = {""};
  map.status = map.verdict = {0, 1};
  map.reason = {0, 0};
  map.second_branch = {0, 1};
  map.confidence = {255, 1};
  map.residual = map.damping = map.spectral_abscissa = {-1, 1};
  map.state = map.input = map.eigenvalue_re = map.eigenvalue_im = {-1, 1};
  map.second = {{1}, {1}, {1}, {1}, {0}, {1}};
  map.crossings = {{0, 0, {15}, 1e-9, CrossingKind::hopf, 0, 1, 3.5, 0, "pitch"}};
  map.intervals = {{0, 0, {10}, 10, 15, IntervalVerdict::stable, 0, -1, 10}};
  write_netcdf(map, "small.nc");
  std::ifstream file("small.nc", std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const std::string whole = small_map();
  static const std::vector<Hdf5Piece> pieces = hdf5_pieces(whole);
  constexpr std::size_t most = 8;
  std::vector<Hdf5Change> changes(std::min(most, size / sizeof(Hdf5Change)));
  if (!changes.empty()) std::memcpy(changes.data(), data, changes.size() * sizeof(Hdf5Change));
  const std::string map = forged(whole, pieces, changes);
  try {
    const SweepMap read = read_netcdf(as_file("map.nc", std::as_bytes(std::span(map))));
    (void)difference(read, read);
  } catch (const std::exception& e) {
    if (!std::string_view(e.what()).starts_with("map.nc: ")) throw;
  }
  return 0;
}
