/// What walking lines and judging them by verdicts alone share. Internal to sweep/.
#pragma once

#include <optional>
#include <vector>

#include "linearize/batch.hpp"
#include "sweep/line_modes.hpp"

namespace tiltrim {

/// Scaled: unknowns farther apart are another equilibrium.
inline constexpr double other_branch = 1e-6;

/// A thread's memory for one line, reused for the next.
struct Room {
  std::vector<char> valid;       ///< there is an equilibrium
  std::vector<char> exact;       ///< its matrix is the model's own derivatives
  std::vector<double> unknowns;  ///< of each point
  std::vector<double> shares;    ///< multiples of an affine line's slope
  MatrixBatch A;
  BatchEigenvalues eigenvalues;
  std::vector<Verdict> verdicts;
};

/// One for each line that is walked together with others.
std::vector<Room>& rooms_of_thread();

/// A line along an axis before tracking, from its first point on.
LineTracker begin_line(const Prepared& sweep, const GridPlace& place, std::size_t axis,
                       LinePoints& points, Room& room, bool judged);
/// Stores the trim of point k, found or not, and its matrix.
void keep_trim(LineTracker& w, std::size_t k, const GridTrim& e);

/// The structure of the line along its axis, if it has one.
std::optional<AffineLine> structure_of(const Prepared& sweep, const LineStart& start);

/// The equilibria and matrices of all points of some lines of these structures; those along which
/// every point has a trim of its own are walked side by side, if possible, and `judged` on the way
/// if no more than their verdicts is asked for.
std::vector<LineTracker> track_lines(const Prepared& sweep,
                                     const std::vector<const LineStart*>& starts,
                                     const std::vector<std::optional<AffineLine>>& structures,
                                     const std::vector<LinePoints*>& points,
                                     std::vector<Room>& rooms, bool judged = false);

/// Eigenvalues, verdicts and modes of a tracked line.
void finish_line(LineTracker& w, const LineStart& start, Room& room);

}  // namespace tiltrim
