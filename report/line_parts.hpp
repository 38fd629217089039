/// Parts shared by the figures along one axis. Internal to report/.
#pragma once

#include "report/figure_parts.hpp"

namespace tiltrim::figures {

/// One condition of a map over one axis.
struct Line {
  const SweepMap& map;
  std::size_t condition;
  std::string id;
  std::vector<bool> after{};  ///< points after which the line is interrupted
  std::size_t points() const { return map.axes[0].size(); }
  std::size_t first() const { return condition * points(); }
  const std::vector<double>& along() const { return map.axes[0].columns.front().values; }
};

/// Intervals whose verdict is not "stable", over the full height of the panel.
std::vector<Boxes> stretches(const Line& line, const Range& y, bool titled);
/// "h from 0 to 120 m".
std::string range_in_words(const Line& line);
/// "theta from 1.2 to 3.4°".
std::string described(const Track::Column& column);
/// " m", "°", or nothing.
std::string unit_words(const std::string& unit);

/// Root loci: all modes, the slow ones; real parts and damping ratios.
void add_loci(const Line& line, const Track& track, ReportFigures& all);

}  // namespace tiltrim::figures
