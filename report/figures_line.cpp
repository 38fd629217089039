// Figures along one axis: trims with their limits.
#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "report/line_parts.hpp"

namespace tiltrim::figures {

namespace {

constexpr double nan = std::numeric_limits<double>::quiet_NaN();

std::vector<double> values_of(const Line& line, const std::vector<double>& all, std::size_t width,
                              std::size_t k, double factor = 1.0) {
  std::vector<double> values(line.points());
  for (std::size_t i = 0; i < values.size(); ++i)
    values[i] = factor * all[(line.first() + i) * width + k];
  return values;
}

Track track_of(const Line& line) {
  const SweepMap& map = line.map;
  const SweepAxis::Column& own = map.axes[0].columns.front();
  Track track{"along_" + line.id, "along " + map.axes[0].name, {}, map.mode_names[line.condition]};
  track.columns.push_back({"parameter", map.axes[0].name, own.unit, own.values});
  for (std::size_t c = 1; c < map.axes[0].columns.size(); ++c) {
    const SweepAxis::Column& with = map.axes[0].columns[c];
    track.columns.push_back({with.name, with.name, with.unit, with.values});
  }
  const auto add = [&](const Signals& signals, const std::vector<double>& all) {
    for (std::size_t k = 0; k < signals.size(); ++k) {
      const bool angle = signals[k].unit == "rad";
      const std::string name = signals[k].name + (angle ? "_deg" : "");
      track.columns.push_back({name, signals[k].name, angle ? "degrees" : signals[k].unit,
                               values_of(line, all, signals.size(), k, angle ? degrees : 1.0)});
    }
  };
  add(map.states, map.state);
  add(map.inputs, map.input);
  for (std::size_t m = 0; m < map.modes(); ++m) {
    track.columns.push_back({fmt::format("re_{}", m), track.modes[m], "1/s",
                             values_of(line, map.eigenvalue_re, map.modes(), m)});
    track.columns.push_back({fmt::format("im_{}", m), track.modes[m], "rad/s",
                             values_of(line, map.eigenvalue_im, map.modes(), m)});
  }
  return track;
}

// A visible step much larger than its neighbours.
bool jumps(const std::vector<double>& values, std::size_t i, double range) {
  constexpr double times = 8, shows = 0.02;  // a square root's first ratio is 2.4
  const auto step = [&](std::size_t k) {
    const bool there = k + 1 < values.size();
    return there ? std::abs(values[k + 1] - values[k]) : 0.0;
  };
  const double before = i > 0 ? step(i - 1) : 0.0;
  return step(i) > shows * range && step(i) > times * std::max(before, step(i + 1));
}

// Points after which the line is not continuous: reported by the sweep, or the trim jumps.
std::vector<bool> breaks(const Line& line, const Track& track) {
  std::vector<bool> after(line.points(), false);
  for (const AxisCrossing& c : line.map.crossings) {
    if (c.condition != int(line.condition) || c.kind != CrossingKind::jump) continue;
    for (std::size_t i = 0; i + 1 < line.points(); ++i)
      if ((line.along()[i] <= c.at[0]) != (line.along()[i + 1] <= c.at[0])) after[i] = true;
  }
  for (const Track::Column& c : track.columns) {
    const Range range = around(c.values, 0.0);
    constexpr double shown = 2e-3;  // smaller changes are rounding
    const double reach =
        std::max(range.upper - range.lower, shown * std::max(1.0, std::abs(range.upper)));
    for (std::size_t i = 0; i + 1 < line.points(); ++i)
      if (jumps(c.values, i, reach)) after[i] = true;
  }
  return after;
}

// x and y with a gap at each break.
PlotCurve curve_along(const std::vector<bool>& after, const std::vector<double>& x,
                      const std::vector<double>& y) {
  PlotCurve curve;
  for (std::size_t i = 0; i < x.size(); ++i) {
    curve.x.push_back(x[i]);
    curve.y.push_back(y[i]);
    if (!after[i]) continue;
    curve.x.push_back(nan);
    curve.y.push_back(nan);
  }
  return curve;
}

}  // namespace

std::vector<Boxes> stretches(const Line& line, const Range& y, bool titled) {
  std::vector<Boxes> boxes;
  const auto add = [&](IntervalVerdict verdict, int colour, const char* title) {
    Boxes of{titled ? title : "", colour, false, {}};
    for (const AxisInterval& i : line.map.intervals)
      if (i.condition == int(line.condition) && i.verdict == verdict)
        of.corners.push_back({std::min(i.from, i.to), std::max(i.from, i.to), y.lower, y.upper});
    if (!of.corners.empty()) boxes.push_back(of);
  };
  add(IntervalVerdict::unstable, colour::unstable, "unstable");
  add(IntervalVerdict::undecided, colour::undecided, "undecided");
  add(IntervalVerdict::no_trim, colour::none, "without trim");
  return boxes;
}

std::string unit_words(const std::string& unit) {
  return unit == "degrees" ? "°" : unit.empty() || unit == "1" ? "" : " " + unit;
}

std::string described(const Track::Column& c) {
  double lower = std::numeric_limits<double>::infinity(), upper = -lower;
  for (const double v : c.values)
    if (std::isfinite(v)) lower = std::min(lower, v), upper = std::max(upper, v);
  if (!(lower <= upper)) return c.title + " nowhere";
  return fmt::format("{} from {:.4g} to {:.4g}{}", c.title, lower, upper, unit_words(c.unit));
}

std::string range_in_words(const Line& line) {
  const SweepAxis::Column& own = line.map.axes[0].columns.front();
  return fmt::format("{} from {:.6g} to {:.6g}{}", line.map.axes[0].name, own.values.front(),
                     own.values.back(), unit_words(own.unit));
}

namespace {

std::string symbol_of(const Track::Column& c) {
  for (const auto& [name, symbol] : {std::pair{"theta", "θ"}, {"theta0", "θ₀"}, {"delta_e", "δe"}})
    if (c.title == name) return symbol;
  return c.title;
}

Panel trim_panel(const Line& line, const Track& track, const Track::Column& shown,
                 const Range& limits, bool first) {
  Panel panel{axis_of(line.map.axes[0]), {}, {}, {}, {}, 8.5, ""};
  std::vector<double> seen = shown.values;
  seen.insert(seen.end(), {limits.lower, limits.upper});
  panel.y = {with_unit(symbol_of(shown), shown.unit), around(seen, 0.08), false, {}, shown.key};
  panel.height = std::max(panel.height, text_width(panel.y.label));
  panel.boxes = stretches(line, panel.y.range, first);
  const Range& x = panel.x.range;
  for (const double limit : {limits.lower, limits.upper}) {
    if (!std::isfinite(limit)) continue;
    panel.curves.push_back(level_line(x, limit));
    panel.labels.push_back({{{x.upper, limit}, {x.lower, limit}},
                            limit == limits.lower ? "lower limit" : "upper limit"});
  }
  PlotCurve curve = curve_along(line.after, track.columns.front().values, shown.values);
  curve.colour = colour::first;
  curve.width = 2;
  curve.x_key = "parameter";
  curve.y_key = shown.key;
  panel.curves.push_back(curve);
  return panel;
}

// The signals with a curve: those that vary, and of those that do not, their values in words.
struct Shown {
  std::vector<const Track::Column*> columns;
  std::string constant;
};

Shown shown_signals(const Line& line, const Track& track, bool tiltrotor) {
  Shown shown;
  const auto add = [&](const Signal& s) {
    const double unit = s.unit == "rad" ? degrees : 1.0;
    const Track::Column* c = column(track, s.name + (unit == degrees ? "_deg" : ""));
    if (!c || s.name == line.map.axes[0].columns.front().signal) return;
    double size = s.nominal * unit, lower = std::numeric_limits<double>::infinity(), upper = -lower;
    for (const double v : c->values)
      if (std::isfinite(v)) lower = std::min(lower, v), upper = std::max(upper, v);
    size = std::max({size, std::abs(lower), std::abs(upper)});
    constexpr double precision = 1e-9;  // of a trim, relative
    if (lower <= upper && upper - lower <= precision * size)
      shown.constant +=
          fmt::format("{}{} = {:.4g}{}", shown.constant.empty() ? "" : ", ", symbol_of(*c),
                      std::abs(lower) <= precision * size ? 0 : lower, unit_words(c->unit));
    else
      shown.columns.push_back(c);
  };
  for (const Signal& s : line.map.states)
    if (!tiltrotor || s.name == "theta") add(s);
  for (const Signal& s : line.map.inputs)
    if (!tiltrotor || s.name != "eta") add(s);
  constexpr std::size_t most = 8;
  if (shown.columns.size() > most) shown.columns.resize(most);
  return shown;
}

Figure trim_figure(const Line& line, const Track& track, const Shown& shown,
                   const LineLimits& limits) {
  Figure figure{"trim_" + line.id,
                "Trim over " + range_in_words(line),
                "Trim curves over " + range_in_words(line) + ": ",
                track.name,
                {}};
  bool limited = false;
  for (const Track::Column* c : shown.columns) {
    const auto limit = limits.of.find(c->key);
    const Range range = limit == limits.of.end() ? Range{} : limit->second;
    limited = limited || std::isfinite(range.lower) || std::isfinite(range.upper);
    figure.alternative += (figure.panels.empty() ? "" : "; ") + described(*c);
    if (!figure.panels.empty()) figure.panels.back().x.label.clear();
    figure.panels.push_back(trim_panel(line, track, *c, range, figure.panels.empty()));
  }
  if (limited) figure.caption += "; dashed: limits";
  if (!shown.constant.empty()) figure.caption += ". Constant: " + shown.constant;
  return figure;
}

}  // namespace

void add_line(const SweepMap& map, std::size_t condition, const std::string& id,
              const LineLimits& limits, ReportFigures& all) {
  Line line{map, condition, id};
  const auto verdicts = map.verdict.begin() + std::ptrdiff_t(line.first());
  if (std::all_of(verdicts, verdicts + std::ptrdiff_t(line.points()), [](int v) { return v < 0; }))
    return;  // without a trim there is nothing to draw
  const Track track = track_of(line);
  line.after = breaks(line, track);
  const Shown shown = shown_signals(line, track, limits.tiltrotor);
  if (shown.columns.empty())
    all.constant["trim_" + id] =
        "The same trim over " + range_in_words(line) + ": " + shown.constant;
  else
    all.figures.push_back(trim_figure(line, track, shown, limits));
  add_loci(line, track, all);
  all.tracks.push_back(track);
}

}  // namespace tiltrim::figures
