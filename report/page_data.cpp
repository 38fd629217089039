#include "report/page_data.hpp"

#include <fmt/core.h>

#include <cmath>
#include <cstdlib>

#include "report/figure_parts.hpp"
#include "report/json.hpp"

namespace tiltrim {

using json::ordered_json;

namespace {

// Ten digits; the page displays six.
ordered_json number(double value) {
  if (!std::isfinite(value)) return nullptr;
  return std::strtod(fmt::format("{:.10g}", value).c_str(), nullptr);
}

ordered_json numbers(const std::vector<double>& values) {
  ordered_json list = ordered_json::array();
  for (const double v : values) list.push_back(number(v));
  return list;
}

ordered_json axis_json(const FigureAxis& axis) {
  return {{"lower", axis.range.lower},
          {"upper", axis.range.upper},
          {"log", axis.logarithmic},
          {"key", axis.key}};
}

ordered_json panel_json(const Figure& figure, std::size_t k) {
  const Panel& panel = figure.panels[k];
  const PlotArea at = plot_area(figure, k, Device::page);
  const auto [width, height] = page_pixels(figure);
  ordered_json curves = ordered_json::array();
  for (const PlotCurve& c : panel.curves)
    if (!c.y_key.empty())
      curves.push_back({{"x", c.x_key}, {"y", c.y_key}, {"title", c.title}, {"colour", c.colour}});
  return {{"area", {at.left * width, at.right * width, at.top * height, at.bottom * height}},
          {"x", axis_json(panel.x)},
          {"y", axis_json(panel.y)},
          {"curves", curves},
          {"map", panel.map}};
}

ordered_json column_json(const SweepAxis::Column& c, const std::string& name) {
  return {{"name", name}, {"unit", c.unit}, {"values", numbers(c.values)}};
}

// Escapes so that "</script>" and "<!--" cannot occur.
std::string in_script(const ordered_json& data) {
  std::string text;
  for (const char c : data.dump(-1, ' ', false, ordered_json::error_handler_t::replace))
    text += c == '<' ? std::string("\\u003c") : std::string(1, c);
  return text;
}

}  // namespace

std::string script_data(const ReportFigures& all) {
  ordered_json data{{"tracks", ordered_json::array()},
                    {"grids", ordered_json::array()},
                    {"figures", ordered_json::array()}};
  for (const Track& t : all.tracks) {
    ordered_json columns = ordered_json::array();
    for (const Track::Column& c : t.columns)
      columns.push_back(
          {{"key", c.key}, {"title", c.title}, {"unit", c.unit}, {"values", numbers(c.values)}});
    data["tracks"].push_back({{"name", t.name}, {"modes", t.modes}, {"columns", columns}});
  }
  for (const MapGrid& g : all.grids)
    data["grids"].push_back({{"name", g.name},
                             {"x", column_json(g.x, g.x_name)},
                             {"y", column_json(g.y, g.y_name)},
                             {"verdict", g.verdict},
                             {"abscissa", numbers(g.abscissa)}});
  for (const Figure& f : all.figures) {
    ordered_json panels = ordered_json::array();
    for (std::size_t k = 0; k < f.panels.size(); ++k) panels.push_back(panel_json(f, k));
    data["figures"].push_back({{"name", f.name}, {"track", f.track}, {"panels", panels}});
  }
  return in_script(data);
}

}  // namespace tiltrim
