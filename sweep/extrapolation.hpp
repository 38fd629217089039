/// Unknowns of a point on a line from those near it. Internal to sweep/.
#pragma once

#include <array>

#include "model/lookup.hpp"
#include "sweep/line_modes.hpp"

namespace tiltrim {

/// The polynomial through up to four adjacent points, at point k.
struct Extrapolation {
  const LineTracker& w;
  std::array<std::size_t, 4> near;
  std::size_t count;
  std::array<double, 4> weight{};

  Extrapolation(const LineTracker& walk, std::size_t k, std::array<std::size_t, 4> points,
                int known)
      : w(walk), near(points), count(std::size_t(known)) {
    const std::vector<double>& v = w.coordinates();
    for (std::size_t a = 0; a < count; ++a) {
      weight[a] = 1.0;
      for (std::size_t b = 0; b < count; ++b)
        if (b != a) weight[a] *= (v[k] - v[near[b]]) / (v[near[a]] - v[near[b]]);
    }
  }
  double unknown(std::size_t i) const {
    double value = 0.0;
    for (std::size_t a = 0; a < count; ++a)
      value += weight[a] * w.unknowns[near[a] * w.n_unknowns() + i];
    return value;
  }
};

/// Its unknowns, in `at`.
inline void extrapolate(const LineTracker& w, std::size_t k, std::array<std::size_t, 4> near,
                        int count, OperatingPoint& at) {
  const Extrapolation curve(w, k, near, count);
  for (std::size_t i = 0; i < w.n_unknowns(); ++i)
    set_value(at, w.sweep.problem.unknowns[i], curve.unknown(i));
}

}  // namespace tiltrim
