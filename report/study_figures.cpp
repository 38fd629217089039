#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "report/figure_parts.hpp"

namespace tiltrim {

namespace figures {

namespace {

bool logarithmic(const std::vector<double>& values) {
  if (values.size() < 3 || !(values.front() > 0) || !(values.back() > 0)) return false;
  const double steps = double(values.size() - 1);
  const double ratio = std::pow(values.back() / values.front(), 1 / steps);
  return std::abs(values[1] / values[0] - ratio) < 1e-6 * ratio && std::abs(ratio - 1) > 1e-3;
}

}  // namespace

Range around(const std::vector<double>& values, double share) {
  double lower = std::numeric_limits<double>::infinity(), upper = -lower;
  for (const double v : values)
    if (std::isfinite(v)) lower = std::min(lower, v), upper = std::max(upper, v);
  if (!(lower <= upper)) return {0, 1};
  const double room = std::max(share * (upper - lower), 1e-3 * std::max(1.0, std::abs(upper)));
  return {lower - room, upper + room};
}

std::string with_unit(const std::string& what, const std::string& unit) {
  const std::string shown = unit == "degrees" ? "°" : unit;
  return shown.empty() ? what : fmt::format("{} [{}]", what, shown);
}

FigureAxis axis_of(const SweepAxis& axis) {
  const SweepAxis::Column& own = axis.columns.front();
  const auto [lower, upper] = std::ranges::minmax(own.values);
  const Range range = lower < upper ? Range{lower, upper} : around(own.values);
  return {with_unit(axis.name, own.unit), range, logarithmic(own.values), {}, "parameter"};
}

int curve_colour(std::size_t k) { return colour::first + int(k) % colour::curves; }
int curve_dash(std::size_t k) { return 1 + int(k) % 5; }

const Track::Column* column(const Track& track, const std::string& key) {
  const auto found = std::ranges::find(track.columns, key, &Track::Column::key);
  return found == track.columns.end() ? nullptr : &*found;
}

PlotCurve level_line(const Range& x, double at) {
  PlotCurve line;
  line.colour = colour::limit;
  line.dash = 2;
  line.width = 1.2;
  line.x = {x.lower, x.upper};
  line.y = {at, at};
  return line;
}

}  // namespace figures

std::string file_name_of(const std::string& what, std::size_t number, const std::string& name) {
  std::string safe;
  for (const char c : name)
    safe += (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '-'
                ? c
                : '_';
  constexpr std::size_t longest = 40;
  return fmt::format("{}{}_{}", what, number + 1, safe.substr(0, longest));
}

ReportFigures report_figures(const StudyReport& report) {
  using namespace figures;
  ReportFigures all;
  std::size_t number = 0;
  for (const StudyReport::Map& m : report.maps)
    for (std::size_t c = 0; c < m.map.conditions.size(); ++c, ++number) {
      const std::string id = file_name_of("", number, m.map.conditions[c]);
      if (m.map.axes.size() == 1)
        add_line(m.map, c, id, report.study.vehicle, all);
      else
        add_map(m.map, c, id, all);
    }
  const auto first = [](const auto& list) { return std::min(most_drawn, list.size()); };
  for (std::size_t i = 0; i < first(report.conditions); ++i) {
    const ConditionReport& c = report.conditions[i];
    if (c.modes && !c.modes->modes.empty())
      add_participation(c, file_name_of("", i, c.answer.condition.name), all);
  }
  for (std::size_t i = 0; i < first(report.loops); ++i)
    add_loops(report.loops[i], file_name_of("", i, report.loops[i].trimmed.condition.name), all);
  if (report.motion && report.motion->motion && !report.motion->motion->t.empty())
    all.figures.push_back(motion_figure(*report.motion));
  if (report.flight) add_flight(*report.flight, report.study.vehicle, all);
  return all;
}

}  // namespace tiltrim
