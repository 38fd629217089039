/// Pieces that the figures of a report have in common. Internal to report/.
#pragma once

#include "model/degrees.hpp"
#include "report/study_report.hpp"

namespace tiltrim::figures {

/// Around all finite values, a little room at both ends.
Range around(const std::vector<double>& values, double share = 0.05);
/// "h [m]", "V [m/s]", "theta [°]".
std::string with_unit(const std::string& what, const std::string& unit);
FigureAxis axis_of(const SweepAxis& axis);
/// Colour and dash of the k-th curve.
int curve_colour(std::size_t k);
int curve_dash(std::size_t k);
/// A thin dashed line at y = `at`.
PlotCurve level_line(const Range& x, double at);
/// None where the track has no such column.
const Track::Column* column(const Track& track, const std::string& key);

/// Along one axis: trims, root loci, modes.
void add_line(const SweepMap& map, std::size_t condition, const std::string& id,
              const Vehicle& vehicle, ReportFigures& all);
/// Over two.
void add_map(const SweepMap& map, std::size_t condition, const std::string& id, ReportFigures& all);
void add_participation(const ConditionReport& condition, const std::string& id, ReportFigures& all);
/// Bode plots, and what the disk margins allow.
void add_loops(const LoopsAnswer& loops, const std::string& id, ReportFigures& all);
void add_flight(const FlightReport& flight, const Vehicle& vehicle, ReportFigures& all);

}  // namespace tiltrim::figures
