#include "model/spacing.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>

namespace tiltrim {

namespace {

// A power of ten that is at most this, and more than a hundredth of it.
double power_of_ten_below(double size) {
  constexpr int lowest = -330, highest = 308;
  static const auto powers = [] {
    std::array<double, highest - lowest + 1> all;
    for (int k = lowest; k <= highest; ++k) all[std::size_t(k - lowest)] = std::pow(10.0, k);
    return all;
  }();
  constexpr double log10_of_2 = 0.30102999566398114;
  return powers[std::size_t(int(std::floor(std::ilogb(size) * log10_of_2)) - lowest)];
}

}  // namespace

double spacing(const std::array<double, 5>& samples) {
  constexpr double epsilon = std::numeric_limits<double>::epsilon();
  constexpr double few = 4 * epsilon, wide = 64 * epsilon;
  constexpr double whole = 1e-6;                   // of a spacing of decimals that were subtracted
  constexpr double to_integer = 6755399441055744;  // 3 2⁵¹: what is added to it is rounded
  const auto [low, high] = std::ranges::minmax(samples);
  const double motion = high - low, size = std::max(std::abs(low), std::abs(high));
  if (!(motion > 0 && std::isfinite(motion))) return 0;
  const auto multiples_of = [&](double grid, double within) {
    const double per_unit = 1 / grid;
    return std::ranges::all_of(samples, [&](double y) {
      const double off = y - (y * per_unit + to_integer - to_integer) * grid;
      return std::abs(off) <= within + few * std::abs(y);
    });
  };
  double widest = 0;
  for (double grid = std::ldexp(wide, std::ilogb(size) + 1); multiples_of(grid, 0) && grid < motion;
       grid *= 2)
    widest = grid;
  constexpr int digits = 9;
  const double least = std::max(widest, wide * size);
  double grid = power_of_ten_below(motion);
  for (int k = 0; k < digits && grid > least; ++k, grid /= 10)
    if (multiples_of(grid, whole * grid)) return grid;
  return widest;
}

}  // namespace tiltrim
