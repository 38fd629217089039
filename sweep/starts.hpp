/// Starting points of the lines of a condition, computed along the slower axes before any line is
/// tracked. Internal to sweep/.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "sweep/line.hpp"

namespace tiltrim {

/// Numbering of the lines along the last axis, and of their neighbours along the slower axes.
struct Lines {
  const std::vector<SweepAxis>& axes;

  std::size_t count() const {
    std::size_t all = 1;
    for (std::size_t a = 0; a + 1 < axes.size(); ++a) all *= axes[a].size();
    return all;
  }
  GridPlace place(std::size_t line) const {
    GridPlace place(axes.size(), 0.0);
    for (std::size_t a = axes.size() - 1; a-- > 0; line /= axes[a].size())
      place[a] = double(line % axes[a].size());
    return place;
  }
  /// The line before (or after), along the fastest slower axis that has one.
  std::optional<std::size_t> next_to(std::size_t line, bool before) const {
    std::size_t stride = 1;
    for (std::size_t a = axes.size() - 1; a-- > 0; stride *= axes[a].size()) {
      const std::size_t at = line / stride % axes[a].size();
      if (before && at > 0) return line - stride;
      if (!before && at + 1 < axes[a].size()) return line + stride;
    }
    return {};
  }
};

/// The equilibrium at the first point of a line from the last one known along the slower axes,
/// which it replaces.
GridTrim first_point(const Prepared& sweep, const GridPlace& place,
                     std::optional<OperatingPoint>& known);
/// The start at the last point of a line from that of the next line; empty if there is none.
std::optional<OperatingPoint> last_point(const Prepared& sweep, GridPlace place,
                                         const std::optional<OperatingPoint>& after);

/// The first points of all lines, each from the previous line; and the names of the modes, from the
/// first equilibrium.
void start_first_points(const Prepared& sweep, const Lines& lines, std::vector<LineStart>& starts,
                        std::vector<std::string>& mode_names);
/// The last points, each from the next line.
void start_last_points(const Prepared& sweep, const Lines& lines, std::vector<LineStart>& starts);

/// Mode names of a condition whose lines all begin without an equilibrium, from its first one.
void name_late(const Prepared& sweep, std::size_t condition, SweepMap& map);

}  // namespace tiltrim
