#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "report/study_report.hpp"

namespace tiltrim {

using Eigen::Index;

namespace {

constexpr double degrees = 180 / std::numbers::pi;
constexpr double nan = std::numeric_limits<double>::quiet_NaN();

// Around all finite values, a little room at both ends.
Range around(const std::vector<double>& values, double share = 0.05) {
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

bool logarithmic(const std::vector<double>& values) {
  if (values.size() < 3 || !(values.front() > 0) || !(values.back() > 0)) return false;
  const double steps = double(values.size() - 1);
  const double ratio = std::pow(values.back() / values.front(), 1 / steps);
  return std::abs(values[1] / values[0] - ratio) < 1e-6 * ratio && std::abs(ratio - 1) > 1e-3;
}

FigureAxis axis_of(const SweepAxis& axis) {
  const SweepAxis::Column& own = axis.columns.front();
  const auto [lower, upper] = std::ranges::minmax(own.values);
  return {with_unit(axis.name, own.unit), {lower, upper}, logarithmic(own.values), {}, "parameter"};
}

int curve_colour(std::size_t k) { return colour::first + int(k) % colour::curves; }
int curve_dash(std::size_t k) { return 1 + int(k) % 5; }

// ---- Along one axis
// ------------------------------------------------------------------------------

// One condition of a map over one axis.
struct Line {
  const SweepMap& map;
  std::size_t condition;
  std::string id;
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

const Track::Column* column(const Track& track, const std::string& key) {
  const auto found = std::ranges::find(track.columns, key, &Track::Column::key);
  return found == track.columns.end() ? nullptr : &*found;
}

// Points after which the line does not go on continuously.
std::vector<bool> breaks(const Line& line) {
  std::vector<bool> after(line.points(), false);
  for (const AxisCrossing& c : line.map.crossings) {
    if (c.condition != int(line.condition) || c.kind != CrossingKind::jump) continue;
    for (std::size_t i = 0; i + 1 < line.points(); ++i)
      if ((line.along()[i] <= c.at[0]) != (line.along()[i + 1] <= c.at[0])) after[i] = true;
  }
  return after;
}

// x and y with a gap at each break, as they are drawn.
Curve curve_along(const Line& line, const std::vector<double>& x, const std::vector<double>& y) {
  const std::vector<bool> after = breaks(line);
  Curve curve;
  for (std::size_t i = 0; i < x.size(); ++i) {
    curve.x.push_back(x[i]);
    curve.y.push_back(y[i]);
    if (!after[i]) continue;
    curve.x.push_back(nan);
    curve.y.push_back(nan);
  }
  return curve;
}

// Stretches along which the verdict is not "stable", over the panel's whole height.
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

Curve level_line(const Range& x, double at) {
  Curve line;
  line.colour = colour::limit;
  line.dash = 2;
  line.width = 1.2;
  line.x = {x.lower, x.upper};
  line.y = {at, at};
  return line;
}

// Limits in the unit of the track's column; infinite where there are none.
Range limits_of(const Vehicle& vehicle, const std::string& key) {
  const auto in_degrees = [](const Range& r) {
    return Range{r.lower * degrees, r.upper * degrees};
  };
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
  Curve curve = curve_along(line, track.columns.front().values, shown.values);
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
  add("theta_deg");
  for (const Signal& s : line.map.inputs)
    if (s.name != "eta") add(s.name + (s.unit == "rad" ? "_deg" : ""));
  return figure;
}

// ---- Root loci
// -----------------------------------------------------------------------------------

struct Window {
  Range re;
  double im;
};

// Around the slower half of the eigenvalues at each point, the axis included.
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

// Lines of one damping ratio are rays, of one frequency arcs about the origin.
void add_damping_grid(Panel& panel, const Window& w) {
  const auto thin = [&](Curve curve) {
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
    Curve ray;
    ray.x = {0, -re};
    ray.y = {0, re * slope};
    thin(ray);
    const bool at_side = re == left;
    constexpr double apart = 0.08;  // of the panel's width
    if (!at_side && -re < last + apart * (left + w.re.upper)) continue;
    if (!at_side) last = -re;
    panel.labels.push_back({-re, re * slope, fmt::format("ζ {:.1f}", zeta), !at_side, !at_side});
  }
  const double step = round_step(std::max(left, w.im), 5);
  for (double radius = step; radius < std::hypot(left, w.im); radius += step) {
    Curve arc;
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
  Curve axis;
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
    Curve curve = curve_along(line, re.values, im);
    curve.title = fmt::format("{} {}", m + 1, track.modes[m]);
    curve.colour = curve_colour(m);
    curve.dash = curve_dash(m);
    curve.width = 2;
    curve.x_key = re.key;
    curve.y_key = fmt::format("im_{}", m);
    panel.curves.push_back(curve);
    Curve start;
    start.kind = Curve::Kind::points;
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
      Curve curve = curve_along(line, track.columns.front().values, y);
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

// ---- Maps
// ----------------------------------------------------------------------------------------

// Cell borders: half way between the points, in logarithms on a logarithmic axis.
std::vector<double> borders(const std::vector<double>& at, bool log) {
  std::vector<double> edges{at.front()};
  for (std::size_t i = 1; i < at.size(); ++i)
    edges.push_back(log ? std::sqrt(at[i - 1] * at[i]) : 0.5 * (at[i - 1] + at[i]));
  edges.push_back(at.back());
  return edges;
}

// Borders between the shades of one sign: rounded shares of the largest that most points have.
std::array<double, 2> shade_steps(const std::vector<double>& abscissa, double sign) {
  std::vector<double> sizes;
  for (const double a : abscissa)
    if (a * sign > 0) sizes.push_back(a * sign);
  if (sizes.empty()) return {1, 2};
  std::ranges::sort(sizes);
  const double step = round_step(std::max(sizes[sizes.size() * 9 / 10], 1e-9), 3);
  return {step, 2 * step};
}

struct Shades {
  std::array<double, 2> stable, unstable;
  // Position among the colours.
  int of(int verdict, double abscissa) const {
    if (verdict < 0) return colour::none;
    if (static_cast<Verdict>(verdict) == Verdict::undecided) return colour::undecided;
    if (static_cast<Verdict>(verdict) == Verdict::stable)
      return -abscissa >= stable[1]   ? colour::stable
             : -abscissa >= stable[0] ? colour::stable + 1
                                      : colour::stable + 2;
    return abscissa >= unstable[1]   ? colour::unstable + 2
           : abscissa >= unstable[0] ? colour::unstable + 1
                                     : colour::unstable;
  }
  std::string name(int colour) const {
    switch (colour - colour::stable) {
      case 0:
        return fmt::format("Re λ ≤ -{:.3g}", stable[1]);
      case 1:
        return fmt::format("-{:.3g} to -{:.3g}", stable[1], stable[0]);
      case 2:
        return fmt::format("-{:.3g} to 0", stable[0]);
      case 3:
        return fmt::format("0 to {:.3g}", unstable[0]);
      case 4:
        return fmt::format("{:.3g} to {:.3g}", unstable[0], unstable[1]);
      case 5:
        return fmt::format("≥ {:.3g}", unstable[1]);
      case 6:
        return "undecided";
      default:
        return "without trim";
    }
  }
};

// Neighbours of one shade along y are one rectangle.
std::vector<Boxes> cells(const MapGrid& grid, const Shades& shades, bool log_x, bool log_y) {
  std::vector<Boxes> boxes;
  for (int c = colour::stable; c <= colour::none; ++c)
    boxes.push_back({shades.name(c), c, false, {}});
  const std::vector<double> x = borders(grid.x.values, log_x), y = borders(grid.y.values, log_y);
  const std::size_t rows = grid.y.values.size();
  for (std::size_t i = 0; i < grid.x.values.size(); ++i) {
    std::size_t begin = 0;
    const auto shade = [&](std::size_t j) {
      return shades.of(grid.verdict[i * rows + j], grid.abscissa[i * rows + j]);
    };
    for (std::size_t j = 1; j <= rows; ++j) {
      if (j < rows && shade(j) == shade(begin)) continue;
      // A little wider than the cell: no seam shows between two.
      constexpr double seam = 0.05;
      const double right = std::min(x.back(), x[i + 1] + seam * (x[i + 1] - x[i]));
      boxes[std::size_t(shade(begin) - colour::stable)].corners.push_back(
          {x[i], right, y[begin], y[j]});
      begin = j;
    }
  }
  std::erase_if(boxes, [](const Boxes& b) { return b.corners.empty(); });
  return boxes;
}

MapGrid grid_of(const SweepMap& map, std::size_t condition, const std::string& id) {
  const std::size_t n = map.points_per_condition();
  const auto part = [&](const auto& all) {
    return std::vector(all.begin() + std::ptrdiff_t(condition * n),
                       all.begin() + std::ptrdiff_t((condition + 1) * n));
  };
  MapGrid grid{"map_" + id,
               map.axes[0].name,
               map.axes[1].name,
               map.axes[0].columns.front(),
               map.axes[1].columns.front(),
               {},
               part(map.spectral_abscissa)};
  for (const std::int8_t v : part(map.verdict)) grid.verdict.push_back(v);
  return grid;
}

std::string counted(const MapGrid& grid) {
  std::array<std::size_t, 4> count{};
  for (const int v : grid.verdict) ++count[std::size_t(v < 0 ? 3 : v)];
  return fmt::format("{} points stable, {} unstable, {} undecided, {} without trim", count[0],
                     count[1], count[2], count[3]);
}

Figure map_figure(const SweepMap& map, std::size_t condition, const MapGrid& grid,
                  const std::string& name) {
  Panel panel{axis_of(map.axes[0]), axis_of(map.axes[1]), {}, {}, {}, 26.0, grid.name};
  panel.x.key = map.axes[0].name;
  panel.y.key = map.axes[1].name;
  const Shades shades{shade_steps(grid.abscissa, -1), shade_steps(grid.abscissa, 1)};
  panel.boxes = cells(grid, shades, panel.x.logarithmic, panel.y.logarithmic);
  const auto add = [&](auto which, const char* title, int shape, double size) {
    Curve located;
    located.kind = Curve::Kind::points;
    located.title = title;
    located.colour = colour::ink;
    located.dash = shape;
    located.width = size;
    for (const AxisCrossing& c : map.crossings)
      if (c.condition == int(condition) && which(c.kind)) {
        located.x.push_back(c.at[0]);
        located.y.push_back(c.at[1]);
      }
    if (!located.x.empty()) panel.curves.push_back(located);
  };
  add(
      [](CrossingKind k) {
        return k == CrossingKind::hopf || k == CrossingKind::zero || k == CrossingKind::touch;
      },
      "boundary, located", 7, 0.3);
  add([](CrossingKind k) { return k == CrossingKind::jump || k == CrossingKind::end; },
      "the model jumps, or trims end", 1, 0.5);
  Figure figure{
      name,
      fmt::format(
          "Largest real part of the eigenvalues [1/s] over {} and {} ({}), and where it is zero",
          grid.x_name, grid.y_name, map.conditions[condition]),
      fmt::format("Stability map over {} and {} for {}: {}.", grid.x_name, grid.y_name,
                  map.conditions[condition], counted(grid)),
      "",
      {}};
  figure.panels.push_back(panel);
  return figure;
}

// ---- Conditions
// ----------------------------------------------------------------------------------

Figure participation_figure(const ConditionReport& c, const std::string& id) {
  Figure figure{"participation_" + id,
                fmt::format("Shares of the states in each mode: {}", c.answer.condition.name),
                "Shares of the states in each mode. ",
                "",
                {}};
  std::vector<const Mode*> shown;
  for (const Mode& m : c.modes->modes)
    if (m.eigenvalue.imag() >= 0) shown.push_back(&m);
  const std::size_t n = shown.size();
  Panel panel{{"share of each state", {0, 1}, false, {}, ""},
              {"", {0.4, double(n) + 0.6}, false, {}, ""},
              {},
              {},
              {},
              2.2 * double(n) + 1,
              ""};
  for (Index k = 0; k < Index(c.linear->states.size()); ++k)
    panel.boxes.push_back(
        {c.linear->states[std::size_t(k)].name, curve_colour(std::size_t(k)), true, {}});
  for (std::size_t i = 0; i < n; ++i) {
    const Mode& m = *shown[i];
    const double y = double(n - i);
    panel.y.ticks.emplace_back(
        y,
        fmt::format("{:.3g}{}", m.eigenvalue.real(),
                    m.eigenvalue.imag() > 0 ? fmt::format(" ± {:.3g}i", m.eigenvalue.imag()) : ""));
    double from = 0.0;
    for (Index k = 0; k < m.participation.size(); ++k) {
      panel.boxes[std::size_t(k)].corners.push_back(
          {from, from + m.participation[k], y - 0.35, y + 0.35});
      from += m.participation[k];
    }
    figure.alternative += fmt::format("{}: {:.4g}, {}. ", i + 1, m.eigenvalue.real(), m.name);
  }
  figure.panels.push_back(panel);
  return figure;
}

Track bode_track(const LoopsAnswer& c, const std::string& id) {
  Track track{"bode_" + id, "frequency, " + c.trimmed.condition.name, {}, {}};
  for (const ActuatorLoop& l : c.loops) {
    if (!l.in_use) continue;
    if (track.columns.empty())
      track.columns.push_back({"parameter", "frequency", "rad/s", l.bode.frequency});
    Track::Column magnitude{l.actuator + "_dB", "|L| of " + l.actuator, "dB", {}},
        phase{l.actuator + "_phase_deg", "phase of " + l.actuator, "degrees", {}};
    for (const double v : l.bode.magnitude) magnitude.values.push_back(20 * std::log10(v));
    for (const double v : l.bode.phase) phase.values.push_back(v * degrees);
    track.columns.insert(track.columns.end(), {magnitude, phase});
  }
  return track;
}

Figure bode_figure(const LoopsAnswer& c, const Track& track, const std::string& id) {
  const std::vector<double>& frequency = track.columns.front().values;
  FigureAxis x{"ω [rad/s]", {frequency.front(), frequency.back()}, true, {}, "parameter"};
  std::vector<double> gains, phases;
  Panel gain{x, {"|L| [dB]", {}, false, {}, "gain"}, {}, {}, {}, 12.0, ""},
      phase{x, {"phase of L [°]", {}, false, {}, "phase"}, {}, {}, {}, 12.0, ""};
  std::string words;
  std::size_t k = 0;
  for (const ActuatorLoop& l : c.loops) {
    if (!l.in_use) continue;
    const auto add = [&](Panel& panel, const std::string& key, const std::string& title,
                         std::vector<double>& all) {
      const Track::Column& y = *column(track, key);
      Curve curve;
      curve.title = title;
      curve.colour = curve_colour(k);
      curve.dash = curve_dash(k);
      curve.width = 2;
      curve.x = frequency;
      curve.y = y.values;
      curve.x_key = "parameter";
      curve.y_key = key;
      panel.curves.push_back(curve);
      all.insert(all.end(), y.values.begin(), y.values.end());
    };
    add(gain, l.actuator + "_dB", l.actuator, gains);
    add(phase, l.actuator + "_phase_deg", "", phases);
    words += fmt::format("{}{}", words.empty() ? "" : ", ", l.actuator);
    ++k;
  }
  gains.push_back(0);
  phases.push_back(-180);
  gain.y.range = around(gains);
  phase.y.range = around(phases);
  gain.x.label.clear();
  gain.curves.push_back(level_line(x.range, 0));
  phase.curves.push_back(level_line(x.range, -180));
  return {
      "bode_" + id,
      fmt::format("Bode plot of each loop broken at its actuator: {}", c.trimmed.condition.name),
      fmt::format("Bode plot of the loops of {}: {}. Their margins are in the table.",
                  c.trimmed.condition.name, words),
      track.name,
      {gain, phase}};
}

// Gain and phase together that the disk margin allows: (1 + z)/(1 - z), |z| < disk/2.        [43]
Figure disk_figure(const LoopsAnswer& c, const std::string& id) {
  Panel panel{{"change of phase [°]", {}, false, {}, ""},
              {"change of gain [dB]", {}, false, {}, ""},
              {},
              {},
              {},
              16.0,
              ""};
  std::vector<double> xs{0}, ys{0};
  std::string words;
  std::size_t k = 0;
  for (const ActuatorLoop& l : c.loops) {
    if (!l.in_use) continue;
    const std::size_t at = k++;
    if (!l.margins.stable() || !std::isfinite(l.margins.disk)) continue;
    Curve border;
    border.title = fmt::format("{}: disk {:.3f}", l.actuator, l.margins.disk);
    border.colour = curve_colour(at);
    border.dash = curve_dash(at);
    border.width = 2;
    const double radius = std::min(l.margins.disk / 2, 0.98);
    for (int i = 0; i <= 720; ++i) {
      const std::complex<double> z = std::polar(radius, 2 * std::numbers::pi * i / 720.0);
      const std::complex<double> change = (1.0 + z) / (1.0 - z);
      border.x.push_back(std::arg(change) * degrees);
      border.y.push_back(20 * std::log10(std::abs(change)));
    }
    xs.insert(xs.end(), border.x.begin(), border.x.end());
    ys.insert(ys.end(), border.y.begin(), border.y.end());
    words += fmt::format("{}{} {:.3f}", words.empty() ? "" : ", ", l.actuator, l.margins.disk);
    panel.curves.push_back(border);
  }
  panel.x.range = around(xs, 0.1);
  panel.y.range = around(ys, 0.1);
  panel.curves.push_back(level_line(panel.x.range, 0));
  return {"disk_" + id,
          fmt::format("Gain and phase that each loop bears together, by its disk margin: {}",
                      c.trimmed.condition.name),
          fmt::format("Disk margins of {}: {}.", c.trimmed.condition.name, words),
          "",
          {panel}};
}

// ---- The flight
// ----------------------------------------------------------------------------------

Track flight_track(const FlightReport& flight) {
  Track track{"flight", "the flight", {}, {}};
  for (const FlightColumn& c : flight.table.columns)
    track.columns.push_back({c.name == "time" ? "parameter" : c.name, c.name, c.unit, c.values});
  return track;
}

struct FlightCurve {
  const char *key, *title;
};

Panel flight_panel(const Track& track, const std::string& x_key, const std::string& x_label,
                   const std::string& label, const std::vector<FlightCurve>& curves,
                   double height) {
  const std::vector<double>& x = column(track, x_key)->values;
  Panel panel{{x_label, around(x, 0.0), false, {}, x_key},
              {label, {}, false, {}, ""},
              {},
              {},
              {},
              height,
              ""};
  std::vector<double> all;
  std::size_t k = 0;
  for (const FlightCurve& c : curves) {
    const Track::Column* y = column(track, c.key);
    if (!y) continue;
    Curve curve;
    curve.title = c.title;
    curve.colour = curve_colour(k);
    curve.dash = curve_dash(k++);
    curve.width = 2;
    curve.x = x;
    curve.y = y->values;
    curve.x_key = x_key;
    curve.y_key = c.key;
    panel.curves.push_back(curve);
    all.insert(all.end(), y->values.begin(), y->values.end());
  }
  panel.y.range = around(all);
  return panel;
}

// Where pitch control changes hands.
void add_hand_overs(const FlightReport& flight, Panel& panel) {
  for (const FlightEvent& e : flight.flown->events) {
    if (e.kind != FlightEventKind::hand_over) continue;
    Curve line = level_line({0, 1}, 0);
    line.x = {e.t, e.t};
    line.y = {panel.y.range.lower, panel.y.range.upper};
    panel.curves.push_back(line);
  }
}

void add_limits(const Range& limits, double factor, Panel& panel) {
  for (const double limit : {limits.lower * factor, limits.upper * factor})
    if (std::isfinite(limit)) {
      panel.y.range = {std::min(panel.y.range.lower, limit), std::max(panel.y.range.upper, limit)};
      panel.curves.push_back(level_line(panel.x.range, limit));
    }
}

void add_flight(const FlightReport& flight, const Vehicle& vehicle, ReportFigures& all) {
  if (!flight.flown || flight.table.rows() < 2) return;
  const Track track = flight_track(flight);
  const std::string time = "time [s]";
  const auto over_time = [&](const char* label, const std::vector<FlightCurve>& curves) {
    return flight_panel(track, "parameter", time, label, curves, 10.0);
  };
  const std::string ended =
      fmt::format("{} s, {} m high at most", track.columns.front().values.back(),
                  std::ranges::max(column(track, "height")->values));
  const auto add = [&](const char* name, const std::string& caption, std::vector<Panel> panels) {
    for (Panel& p : panels)
      if (p.x.key == "parameter") add_hand_overs(flight, p);
    all.figures.push_back({name, caption + ": " + flight.name,
                           caption + " of the flight " + flight.name + ", " + ended + ".",
                           track.name, std::move(panels)});
  };
  Panel collective = over_time("collective", {{"theta0", "θ₀"}});
  collective.x.label.clear();
  add_limits(vehicle.limits.theta0, 1.0, collective);
  Panel pitch = over_time("[°]", {{"a1s_deg", "cyclic a1s"}, {"delta_e_deg", "elevator δe"}});
  add_limits(vehicle.limits.a1s, degrees, pitch);
  add_limits(vehicle.limits.delta_e, degrees, pitch);
  add("flight_angles", "Pitch, flight path, tilt",
      {over_time("[°]", {{"theta_deg", "pitch θ"},
                         {"gamma_deg", "path γ"},
                         {"gamma_commanded_deg", "path commanded"},
                         {"eta_deg", "tilt η"}})});
  add("flight_speeds", "Speeds",
      {over_time("[m/s]", {{"V", "airspeed"},
                           {"V_commanded", "commanded"},
                           {"climb_rate", "vertical"},
                           {"ground_speed", "horizontal"}})});
  add("flight_controls", "Controls with their limits", {collective, pitch});
  add("flight_energy", "Errors of the rates of energy and of its distribution",
      {over_time("", {{"He", "He"}, {"Le", "Le"}})});
  add("flight_path", "Height over distance",
      {flight_panel(track, "distance", "distance [m]", "height [m]", {{"height", ""}}, 10.0)});
  all.tracks.push_back(track);
}

}  // namespace

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
  ReportFigures all;
  std::size_t number = 0;
  for (const StudyReport::Map& m : report.maps) {
    for (std::size_t c = 0; c < m.map.conditions.size(); ++c, ++number) {
      const std::string id = file_name_of("", number, m.map.conditions[c]);
      if (m.map.axes.size() == 2) {
        all.grids.push_back(grid_of(m.map, c, id));
        all.figures.push_back(map_figure(m.map, c, all.grids.back(), "stability_" + id));
        continue;
      }
      const Line line{m.map, c, id};
      const Track track = track_of(line);
      all.figures.push_back(trim_figure(line, track, report.study.vehicle));
      all.figures.push_back(locus_figure(line, track, false));
      all.figures.push_back(locus_figure(line, track, true));
      all.figures.push_back(modes_figure(line, track));
      all.tracks.push_back(track);
    }
  }
  for (std::size_t i = 0; i < std::min(most_drawn, report.conditions.size()); ++i) {
    const ConditionReport& c = report.conditions[i];
    if (c.modes && !c.modes->modes.empty())
      all.figures.push_back(participation_figure(c, file_name_of("", i, c.answer.condition.name)));
  }
  for (std::size_t i = 0; i < std::min(most_drawn, report.loops.size()); ++i) {
    const LoopsAnswer& c = report.loops[i];
    const std::string id = file_name_of("", i, c.trimmed.condition.name);
    const Track track = bode_track(c, id);
    if (track.columns.empty()) continue;
    all.figures.push_back(bode_figure(c, track, id));
    if (c.modes.verdict == Verdict::stable) all.figures.push_back(disk_figure(c, id));
    all.tracks.push_back(track);
  }
  if (report.flight) add_flight(*report.flight, report.study.vehicle, all);
  return all;
}

}  // namespace tiltrim
