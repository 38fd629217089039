// Figures along one axis: trims with their limits, root loci, modes.
#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "report/figure_parts.hpp"

namespace tiltrim::figures {

namespace {

constexpr double nan = std::numeric_limits<double>::quiet_NaN();

// One condition of a map over one axis.
struct Line {
  const SweepMap& map;
  std::size_t condition;
  std::string id;
  std::vector<bool> after{};  // points after which the line is interrupted
  std::size_t points() const { return map.axes[0].size(); }
  std::size_t first() const { return condition * points(); }
  const std::vector<double>& along() const { return map.axes[0].columns.front().values; }
};

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
    for (std::size_t i = 0; i + 1 < line.points(); ++i)
      if (jumps(c.values, i, range.upper - range.lower)) after[i] = true;
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

// Intervals whose verdict is not "stable", over the full height of the panel.
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

// Limits in the unit of the track's column; infinite if there are none.
Range limits_of(const Vehicle& vehicle, const std::string& key) {
  const auto in_degrees = [](const Range& r) {
    return Range{r.lower * degrees, r.upper * degrees};
  };
  if (!vehicle.polar) return {};
  if (key == "theta0") return vehicle.limits.theta0;
  if (key == "a1s_deg") return in_degrees(vehicle.limits.a1s);
  if (key == "delta_e_deg") return in_degrees(vehicle.limits.delta_e);
  if (key == "theta_deg") return in_degrees(vehicle.limits.theta);
  return {};
}

std::string symbol_of(const Track::Column& c) {
  for (const auto& [name, symbol] : {std::pair{"theta", "θ"}, {"theta0", "θ₀"}, {"delta_e", "δe"}})
    if (c.title == name) return symbol;
  return c.title;
}

Panel trim_panel(const Line& line, const Track& track, const Track::Column& shown,
                 const Vehicle& vehicle, bool first) {
  Panel panel{axis_of(line.map.axes[0]), {}, {}, {}, {}, 8.5, ""};
  const Range limits = limits_of(vehicle, shown.key);
  std::vector<double> seen = shown.values;
  seen.insert(seen.end(), {limits.lower, limits.upper});
  panel.y = {with_unit(symbol_of(shown), shown.unit), around(seen, 0.08), false, {}, shown.key};
  panel.boxes = stretches(line, panel.y.range, first);
  for (const double limit : {limits.lower, limits.upper}) {
    if (!std::isfinite(limit)) continue;
    panel.curves.push_back(level_line(panel.x.range, limit));
    const bool lower = limit == limits.lower;
    panel.labels.push_back(
        {panel.x.range.upper, limit, lower ? "lower limit" : "upper limit", true, !lower});
  }
  PlotCurve curve = curve_along(line.after, track.columns.front().values, shown.values);
  curve.colour = colour::first;
  curve.width = 2;
  curve.x_key = "parameter";
  curve.y_key = shown.key;
  panel.curves.push_back(curve);
  return panel;
}

std::string described(const Track::Column& c) {
  const auto finite = [](double v) { return std::isfinite(v); };
  double lower = std::numeric_limits<double>::infinity(), upper = -lower;
  for (const double v : c.values)
    if (finite(v)) lower = std::min(lower, v), upper = std::max(upper, v);
  if (!(lower <= upper)) return c.title + " nowhere";
  const std::string unit = c.unit == "degrees" ? "°" : c.unit.empty() ? "" : " " + c.unit;
  return fmt::format("{} from {:.4g} to {:.4g}{}", c.title, lower, upper, unit);
}

std::string range_in_words(const Line& line) {
  const SweepAxis::Column& own = line.map.axes[0].columns.front();
  return fmt::format("{} from {:.6g} to {:.6g}{}", line.map.axes[0].name, own.values.front(),
                     own.values.back(), own.unit.empty() ? "" : " " + own.unit);
}

Figure trim_figure(const Line& line, const Track& track, const Vehicle& vehicle) {
  Figure figure{"trim_" + line.id,
                fmt::format("Trim over {} with the limits of the controls", range_in_words(line)),
                "Trim curves over " + range_in_words(line) + ": ",
                track.name,
                {}};
  const auto add = [&](const std::string& key) {
    const Track::Column* shown = column(track, key);
    if (!shown) return;
    figure.alternative += (figure.panels.empty() ? "" : "; ") + described(*shown);
    if (!figure.panels.empty()) figure.panels.back().x.label.clear();
    figure.panels.push_back(trim_panel(line, track, *shown, vehicle, figure.panels.empty()));
  };
  const auto key_of = [](const Signal& s) { return s.name + (s.unit == "rad" ? "_deg" : ""); };
  constexpr std::size_t most = 8;  // panels of a user-defined model
  if (vehicle.polar) {
    add("theta_deg");
  } else {
    for (const Signal& s : line.map.states)
      if (figure.panels.size() < most) add(key_of(s));
  }
  for (const Signal& s : line.map.inputs)
    if (s.name != "eta" || !vehicle.polar)
      if (figure.panels.size() < most) add(key_of(s));
  return figure;
}

// ---- Root loci

struct Window {
  Range re;
  double im;
};

// Around the slower half of the eigenvalues at each point, including the imaginary axis.
Window slow_window(const Line& line) {
  const std::size_t n = line.map.modes();
  double reach = 0.0;
  for (std::size_t i = 0; i < line.points(); ++i) {
    std::vector<double> sizes;
    for (std::size_t m = 0; m < n; ++m) {
      const std::size_t at = (line.first() + i) * n + m;
      sizes.push_back(std::hypot(line.map.eigenvalue_re[at], line.map.eigenvalue_im[at]));
    }
    if (!std::isfinite(sizes.front())) continue;
    std::ranges::sort(sizes);
    reach = std::max(reach, sizes[(n - 1) / 2]);
  }
  reach = std::max(reach, 1e-3);
  return {{-1.1 * reach, 0.45 * reach}, 1.1 * reach};
}

Window whole_window(const Line& line) {
  std::vector<double> re, im;
  for (std::size_t m = 0; m < line.map.modes(); ++m) {
    const std::vector<double> a = values_of(line, line.map.eigenvalue_re, line.map.modes(), m);
    const std::vector<double> b = values_of(line, line.map.eigenvalue_im, line.map.modes(), m);
    re.insert(re.end(), a.begin(), a.end());
    im.insert(im.end(), b.begin(), b.end());
  }
  re.push_back(0.0);
  Range range = around(re, 0.08);
  const double upper = around(im, 0.1).upper;
  range.upper = std::max(range.upper, 0.08 * (range.upper - range.lower));
  return {range, std::max(upper, 0.05 * (range.upper - range.lower))};
}

// Lines of constant damping ratio are rays, lines of constant frequency arcs about the origin.
void add_damping_grid(Panel& panel, const Window& w) {
  const auto thin = [&](PlotCurve curve) {
    curve.colour = colour::limit;
    curve.dash = 3;
    curve.width = 0.8;
    panel.curves.push_back(curve);
  };
  const double left = -w.re.lower;
  double last = -left;
  for (const double zeta : {0.9, 0.7, 0.5, 0.3, 0.1}) {
    const double slope = std::sqrt(1 - zeta * zeta) / zeta;
    const double re = std::min(left, w.im / slope);
    PlotCurve ray;
    ray.x = {0, -re};
    ray.y = {0, re * slope};
    thin(ray);
    const bool at_side = re == left;
    constexpr double apart = 0.08;  // in units of the panel's width
    if (!at_side && -re < last + apart * (left + w.re.upper)) continue;
    if (!at_side) last = -re;
    panel.labels.push_back({-re, re * slope, fmt::format("ζ {:.1f}", zeta), !at_side, !at_side});
  }
  const double step = round_step(std::max(left, w.im), 5);
  for (double radius = step; radius < std::hypot(left, w.im); radius += step) {
    PlotCurve arc;
    for (int k = 0; k <= 48; ++k) {
      const double angle = std::numbers::pi / 2 * (1 + k / 48.0);
      const double re = radius * std::cos(angle), im = radius * std::sin(angle);
      const bool inside = re >= w.re.lower && im <= w.im;
      arc.x.push_back(inside ? re : nan);
      arc.y.push_back(inside ? im : nan);
    }
    thin(arc);
    if (radius < left) panel.labels.push_back({-radius, 0, fmt::format("{:.3g}", radius), false});
  }
  PlotCurve axis;
  axis.colour = colour::ink;
  axis.width = 1.2;
  axis.x = {0, 0};
  axis.y = {0, w.im};
  panel.curves.push_back(axis);
}

Figure locus_figure(const Line& line, const Track& track, bool slow) {
  const Window w = slow ? slow_window(line) : whole_window(line);
  Figure figure{(slow ? "locus_slow_" : "locus_") + line.id,
                fmt::format("Root locus over {}{}; the upper half plane, circles at the start",
                            range_in_words(line), slow ? ", the slow modes" : ", every mode"),
                "",
                track.name,
                {}};
  Panel panel{{"Re λ [1/s]", w.re, false, {}, "re"},
              {"Im λ [rad/s]", {0, w.im}, false, {}, "im"},
              {},
              {},
              {},
              24.0,
              ""};
  if (w.re.upper > 0)
    panel.boxes.push_back(
        {"right of the axis", colour::unstable, false, {{0, w.re.upper, 0, w.im}}});
  add_damping_grid(panel, w);
  std::string words;
  for (std::size_t m = 0; m < track.modes.size(); ++m) {
    const Track::Column& re = *column(track, fmt::format("re_{}", m));
    std::vector<double> im = column(track, fmt::format("im_{}", m))->values;
    for (double& v : im) v = std::abs(v);
    PlotCurve curve = curve_along(line.after, re.values, im);
    curve.title = fmt::format("{} {}", m + 1, track.modes[m]);
    curve.colour = curve_colour(m);
    curve.dash = curve_dash(m);
    curve.width = 2;
    curve.x_key = re.key;
    curve.y_key = fmt::format("im_{}", m);
    panel.curves.push_back(curve);
    PlotCurve start;
    start.kind = PlotCurve::Kind::points;
    start.colour = curve.colour;
    start.dash = 6;
    start.width = 0.6;
    start.x = {re.values.front()};
    start.y = {im.front()};
    panel.curves.push_back(start);
    words += fmt::format("{}mode {} ({}): Re λ {}", words.empty() ? "" : "; ", m + 1,
                         track.modes[m], described({"", "", "1/s", re.values}).substr(1));
  }
  figure.panels.push_back(panel);
  figure.alternative = "Root locus over " + range_in_words(line) + ". " + words;
  return figure;
}

Figure modes_figure(const Line& line, const Track& track) {
  Figure figure{
      "modes_" + line.id,
      fmt::format("Real parts (the slow modes) and damping ratios over {}", range_in_words(line)),
      "",
      track.name,
      {}};
  const Window w = slow_window(line);
  Panel real{
      axis_of(line.map.axes[0]), {"Re λ [1/s]", w.re, false, {}, "re"}, {}, {}, {}, 14.0, ""};
  Panel damping{axis_of(line.map.axes[0]),
                {"damping ratio ζ", {-1.05, 1.05}, false, {}, "zeta"},
                {},
                {},
                {},
                10.0,
                ""};
  real.boxes = stretches(line, real.y.range, true);
  damping.boxes = stretches(line, damping.y.range, false);
  real.curves.push_back(level_line(real.x.range, 0));
  damping.curves.push_back(level_line(real.x.range, 0));
  for (std::size_t m = 0; m < track.modes.size(); ++m) {
    const std::vector<double>& re = column(track, fmt::format("re_{}", m))->values;
    const std::vector<double>& im = column(track, fmt::format("im_{}", m))->values;
    std::vector<double> zeta(re.size());
    for (std::size_t i = 0; i < re.size(); ++i) zeta[i] = -re[i] / std::hypot(re[i], im[i]);
    const auto add = [&](Panel& panel, const std::vector<double>& y, const std::string& key,
                         bool titled) {
      PlotCurve curve = curve_along(line.after, track.columns.front().values, y);
      if (titled) curve.title = fmt::format("{} {}", m + 1, track.modes[m]);
      curve.colour = curve_colour(m);
      curve.dash = curve_dash(m);
      curve.width = 2;
      curve.x_key = "parameter";
      curve.y_key = key;
      panel.curves.push_back(curve);
    };
    add(real, re, fmt::format("re_{}", m), true);
    add(damping, zeta, fmt::format("zeta_{}", m), false);
  }
  real.x.label.clear();
  figure.panels = {real, damping};
  figure.alternative = "Real parts and damping ratios of the modes over " + range_in_words(line) +
                       "; the stretches that are not stable are shaded and listed in the table.";
  return figure;
}

}  // namespace

void add_line(const SweepMap& map, std::size_t condition, const std::string& id,
              const Vehicle& vehicle, ReportFigures& all) {
  Line line{map, condition, id};
  const Track track = track_of(line);
  line.after = breaks(line, track);
  all.figures.push_back(trim_figure(line, track, vehicle));
  all.figures.push_back(locus_figure(line, track, false));
  all.figures.push_back(locus_figure(line, track, true));
  all.figures.push_back(modes_figure(line, track));
  all.tracks.push_back(track);
}

}  // namespace tiltrim::figures
