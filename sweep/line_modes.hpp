/// A line of the grid while it is walked, and the order of its modes. Internal to sweep/.
#pragma once

#include <limits>
#include <vector>

#include "linearize/batch.hpp"
#include "sweep/line.hpp"

namespace tiltrim {

inline constexpr double not_a_number = std::numeric_limits<double>::quiet_NaN();

/// A line while it is walked.
struct LineTracker {
  const Prepared& sweep;
  GridPlace place;
  std::size_t axis, count;
  OperatingPoint base;  ///< the line's numbers, but for the axis's own
  LinePoints& points;
  std::vector<char>& valid;
  std::vector<double>& unknowns;
  MatrixBatch& A;

  std::size_t n_unknowns() const { return sweep.unknowns.size(); }
  const std::vector<double>& coordinates() const { return sweep.axes[axis].columns.front().values; }
  OperatingPoint at(std::size_t k) const {
    OperatingPoint point = base;
    move_to(sweep, axis, double(k), point);
    for (std::size_t i = 0; i < n_unknowns(); ++i)
      set_value(point, sweep.problem.unknowns[i], unknowns[k * n_unknowns() + i]);
    return point;
  }
};

/// Carries the order of the modes along the line from its first equilibrium, and keeps each point's
/// eigenvalues in that order; `all` has them in none.
void follow_modes(LineTracker& w, const LineStart& start, const BatchEigenvalues& all);

}  // namespace tiltrim
