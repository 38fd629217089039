/// Parts shared by the figures of a report. Internal to report/.
#pragma once

#include <map>

#include "model/degrees.hpp"
#include "report/study_report.hpp"

namespace tiltrim::figures {

/// The range of all finite values with a margin at both ends.
Range around(const std::vector<double>& values, double share = 0.05);
/// "h [m]", "V [m/s]", "theta [°]".
std::string with_unit(const std::string& what, const std::string& unit);
FigureAxis axis_of(const SweepAxis& axis);
int curve_colour(std::size_t k);
/// The k-th curve of a panel, with its colour and dash and no points yet.
PlotCurve nth_curve(std::size_t k, const std::string& title);
/// A thin dashed line at y = `at`.
PlotCurve level_line(const Range& x, double at);
/// The track's column, or null.
const Track::Column* column(const Track& track, const std::string& key);

/// Limits of the signals of a line, by column of its track and in that column's unit.
struct LineLimits {
  bool tiltrotor = false;
  std::map<std::string, Range> of{};
};
/// Figures along one axis: trims, root loci, modes.
void add_line(const SweepMap& map, std::size_t condition, const std::string& id,
              const LineLimits& limits, ReportFigures& all);
/// The study's own values along two axes, in their units; none along the corridor.
struct OwnPoint {
  std::optional<double> x{}, y{};
};
/// Figures over two axes.
void add_map(const SweepMap& map, std::size_t condition, const std::string& id, const OwnPoint& own,
             ReportFigures& all);
void add_participation(const ConditionReport& condition, const std::string& id, ReportFigures& all);
/// Bode plots and disk margins.
void add_loops(const LoopsAnswer& loops, const std::string& id, ReportFigures& all);
/// What is proved along the first parameter of a theorem.
void add_proof(const Theorem& theorem, const ProveTable& table, const std::string& id,
               ReportFigures& all);
void add_flight(const FlightReport& flight, const Vehicle& vehicle, ReportFigures& all);

}  // namespace tiltrim::figures
