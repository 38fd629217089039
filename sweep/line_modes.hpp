/// A grid line during tracking, and the order of its modes. Internal to sweep/.
#pragma once

#include <limits>
#include <vector>

#include "linearize/batch.hpp"
#include "model/lookup.hpp"
#include "sweep/line.hpp"

namespace tiltrim {

inline constexpr double not_a_number = std::numeric_limits<double>::quiet_NaN();

/// State of a line during tracking.
struct LineTracker {
  const Prepared& sweep;
  GridPlace place;
  std::size_t axis, count;
  OperatingPoint base;  ///< the line's parameters, except the axis's own
  LinePoints& points;
  std::vector<char>&valid, &exact;
  std::vector<double>& unknowns;
  MatrixBatch& A;
  bool judged;  ///< for verdicts alone: the walk judges each matrix and does not keep it in A

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

/// Propagates the mode order along the line from its first equilibrium, and stores each point's
/// eigenvalues in that order; `all` has them unordered.
void follow_modes(LineTracker& w, const LineStart& start, const BatchEigenvalues& all);

/// True if the matrix alone decides, however close to the axis.
bool by_matrix(bool exact, TrimStatus status);
/// Closer to the axis than errors of differences reach, linearize() and its bounds decide where A
/// is of differences, and where the trim is singular: it leaves a state open and A with it.
void judge_near_axis(LineTracker& w);

}  // namespace tiltrim
