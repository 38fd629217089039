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
  constexpr double rounding = 1e-12;
  const double size = std::max(std::abs(lower), std::abs(upper));
  const double room = upper - lower > rounding * std::max(1.0, size) ? share * (upper - lower)
                                                                     : 1e-3 * std::max(1.0, size);
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

PlotCurve nth_curve(std::size_t k, const std::string& title) {
  PlotCurve curve;
  curve.title = title;
  curve.colour = curve_colour(k);
  curve.dash = 1 + int(k) % 5;
  curve.width = 2;
  return curve;
}

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

namespace {

LineLimits limits_of(const Study& study, const std::string& condition) {
  LineLimits limits{bool(study.vehicle.polar), {}};
  const auto add = [&](const std::string& name, const Range& r, bool angle) {
    const double unit = angle ? degrees : 1.0;
    limits.of[name + (angle ? "_deg" : "")] = {r.lower * unit, r.upper * unit};
  };
  const Limits& l = study.vehicle.limits;
  if (limits.tiltrotor) {
    add("theta0", l.theta0, false);
    add("a1s", l.a1s, true);
    add("delta_e", l.delta_e, true);
    add("theta", l.theta, true);
  }
  for (const Condition& c : study.conditions) {
    if (c.name != condition || !c.user()) continue;
    const Model& model = c.user()->model->model;
    for (const Signals& signals : {model.states, model.inputs})
      for (const Signal& s : signals)
        if (const auto range = c.user()->values.find(s.name); range != c.user()->values.end())
          if (range->second.lower < range->second.upper)
            add(s.name, range->second, s.unit == "rad");
  }
  return limits;
}

// The condition's value of the signal that the axis sets.
std::optional<double> own_value(const StudyReport& report, const std::string& condition,
                                const SweepAxis& axis) {
  const SweepAxis::Column& column = axis.columns.front();
  const auto c = std::ranges::find_if(report.conditions, [&](const ConditionReport& r) {
    return r.answer.condition.name == condition;
  });
  if (c == report.conditions.end() || column.signal.empty()) return {};
  const double unit = column.unit == "degrees" ? degrees : 1.0;
  const auto of = [&](const Signals& signals, const Eigen::VectorXd& values) {
    const auto k = find(signals, column.signal);
    return k >= 0 && k < values.size() ? std::optional(values[k] * unit) : std::nullopt;
  };
  const OperatingPoint& at = c->answer.trim.point;
  const Model& model = c->answer.model;
  if (const auto own = of(model.parameters, at.p)) return own;
  if (const auto own = of(model.inputs, at.u)) return own;
  return of(model.states, at.x);
}

}  // namespace

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
        add_line(m.map, c, id, limits_of(report.study, m.map.conditions[c]), all);
      else
        add_map(m.map, c, id,
                {own_value(report, m.map.conditions[c], m.map.axes[0]),
                 own_value(report, m.map.conditions[c], m.map.axes[1])},
                all);
    }
  const auto first = [](const auto& list) { return std::min(most_drawn, list.size()); };
  for (std::size_t i = 0; i < first(report.conditions); ++i) {
    const ConditionReport& c = report.conditions[i];
    if (c.modes && !c.modes->modes.empty())
      add_participation(c, file_name_of("", i, c.answer.condition.name), all);
  }
  for (std::size_t i = 0; i < first(report.loops); ++i)
    add_loops(report.loops[i], file_name_of("", i, report.loops[i].trimmed.condition.name), all);
  for (std::size_t i = 0; i < first(report.theorems); ++i)
    add_proof(report.theorems[i], *report.study.prove, file_name_of("", i, report.theorems[i].name),
              all);
  if (report.motion && report.motion->motion && !report.motion->motion->t.empty())
    all.figures.push_back(motion_figure(*report.motion));
  if (report.flight) add_flight(*report.flight, report.study.vehicle, all);
  return all;
}

}  // namespace tiltrim
