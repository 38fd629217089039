// Root loci along one axis, and real parts and damping ratios over it.
#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <optional>

#include "report/line_parts.hpp"

namespace tiltrim::figures {

namespace {

// ---- Modes as curves

// A tracked mode over the parameter: the points of the line, and more where it meets another mode.
// NaN interrupts it.
struct ModeCurve {
  std::vector<double> at, re, im;
  void add(double parameter, std::complex<double> value) {
    at.push_back(parameter);
    re.push_back(value.real());
    im.push_back(std::abs(value.imag()));
  }
  void interrupt() { add(gap, gap); }
  static constexpr double gap = std::numeric_limits<double>::quiet_NaN();
};

struct Eigenvalues {
  const Line& line;
  const Track& track;
  std::complex<double> at(std::size_t mode, std::size_t i) const {
    const std::size_t k = (line.first() + i) * line.map.modes() + mode;
    return {line.map.eigenvalue_re[k], line.map.eigenvalue_im[k]};
  }
  // The mode that is complex conjugate to this one at point i; none if it is real.
  std::optional<std::size_t> mate(std::size_t mode, std::size_t i) const {
    constexpr double rounding = 1e-9;
    const std::complex<double> own = at(mode, i);
    if (own.imag() == 0) return {};
    for (std::size_t m = 0; m < line.map.modes(); ++m)
      if (m != mode && std::abs(at(m, i) - std::conj(own)) <= rounding * std::abs(own)) return m;
    return {};
  }
  // The mode that this one meets between points i and i + 1: real at one, its pair at the other.
  std::optional<std::size_t> met(std::size_t mode, std::size_t i) const {
    const std::optional<std::size_t> before = mate(mode, i), after = mate(mode, i + 1);
    if (bool(before) == bool(after)) return {};
    const std::size_t other = before ? *before : *after;
    return mate(other, before ? i + 1 : i) ? std::nullopt : std::optional(other);
  }
};

// Between points i and i + 1, where two modes meet: they are the roots of λ² - sλ + p, whose sum
// and product are smooth there, unlike the roots. s and p are interpolated linearly.
void add_meeting(const Eigenvalues& of, std::size_t mode, std::size_t other, std::size_t i,
                 bool real_only, ModeCurve& curve) {
  const std::complex<double> a = of.at(mode, i), b = of.at(other, i), c = of.at(mode, i + 1),
                             d = of.at(other, i + 1);
  const auto between = [](double from, double to, double t) { return from + t * (to - from); };
  const auto half_sum = [&](double t) { return 0.5 * between((a + b).real(), (c + d).real(), t); };
  const auto discriminant = [&](double t) {
    const double half = half_sum(t);
    return half * half - between((a * b).real(), (c * d).real(), t);
  };
  const bool pair_first = a.imag() != 0;
  double lower = 0, upper = 1;
  for (int k = 0; k < 60; ++k) {
    const double middle = 0.5 * (lower + upper);
    ((discriminant(middle) < 0) == pair_first ? lower : upper) = middle;
  }
  const double sign = (pair_first ? c.real() > d.real() : a.real() > b.real()) ? 1.0 : -1.0;
  const auto add = [&](double t) {
    const double D = discriminant(t), root = std::sqrt(std::abs(D));
    const double h = between(of.line.along()[i], of.line.along()[i + 1], t);
    if (t == lower)
      curve.add(h, half_sum(t));
    else if (D > 0)
      curve.add(h, half_sum(t) + sign * root);
    else if (!real_only)
      curve.add(h, {half_sum(t), root});
  };
  constexpr int steps = 12;  // on each side; the roots grow with the square root of the distance
  for (int k = 1; k <= steps; ++k) add(lower * (1 - std::pow(1 - double(k) / steps, 2)));
  for (int k = 1; k < steps; ++k) add(lower + (1 - lower) * std::pow(double(k) / steps, 2));
}

// Without the stretches on which it is conjugate to mode `drawn`, whose curve shows both there.
ModeCurve curve_of(const Eigenvalues& of, std::size_t mode, std::size_t drawn) {
  ModeCurve curve;
  for (std::size_t i = 0; i < of.line.points(); ++i) {
    if (drawn != mode && of.mate(mode, i) == drawn)
      curve.interrupt();
    else
      curve.add(of.line.along()[i], of.at(mode, i));
    if (i + 1 == of.line.points()) break;
    if (of.line.after[i])
      curve.interrupt();
    else if (const std::optional<std::size_t> other = of.met(mode, i))
      add_meeting(of, mode, *other, i, *other == drawn, curve);
  }
  return curve;
}

// One entry of the key: a mode, or the two of a conjugate pair at the start.
struct Entry {
  std::vector<std::size_t> modes;
  std::string title;
};

std::vector<Entry> entries_of(const Eigenvalues& of) {
  std::size_t start = 0;
  const std::size_t n = of.track.modes.size();
  while (start + 1 < of.line.points() && n > 0 && !std::isfinite(of.at(0, start).real())) ++start;
  std::vector<Entry> entries;
  for (std::size_t m = 0; m < n; ++m) {
    const std::optional<std::size_t> mate = of.mate(m, start);
    if (mate && *mate < m) continue;
    const std::string& name = of.track.modes[m];
    if (mate)
      entries.push_back({{m, *mate}, fmt::format("{}, {} {}", m + 1, *mate + 1, name)});
    else
      entries.push_back({{m}, fmt::format("{} {}", m + 1, name)});
  }
  return entries;
}

// ---- Windows

struct Window {
  Range re;
  double im;
};

// Around the slower half of the eigenvalues at each point, including the imaginary axis.
Window slow_window(const Line& line) {
  const std::size_t n = line.map.modes();
  double reach = 0.0, rightmost = 0.0;
  for (std::size_t i = 0; i < line.points(); ++i) {
    std::vector<double> sizes;
    for (std::size_t m = 0; m < n; ++m) {
      const std::size_t at = (line.first() + i) * n + m;
      if (std::isfinite(line.map.eigenvalue_re[at]))
        rightmost = std::max(rightmost, line.map.eigenvalue_re[at]);
      sizes.push_back(std::hypot(line.map.eigenvalue_re[at], line.map.eigenvalue_im[at]));
    }
    if (!std::isfinite(sizes.front())) continue;
    std::ranges::sort(sizes);
    reach = std::max(reach, sizes[(n - 1) / 2]);
  }
  reach = std::max(reach, 1e-3);
  return {{-1.1 * reach, std::clamp(1.3 * rightmost, 0.1 * reach, 0.45 * reach)}, 1.1 * reach};
}

Window whole_window(const Line& line, const Track& track) {
  std::vector<double> re, im;
  for (std::size_t m = 0; m < line.map.modes(); ++m) {
    const std::vector<double> a = column(track, fmt::format("re_{}", m))->values;
    const std::vector<double> b = column(track, fmt::format("im_{}", m))->values;
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
  const auto thin = [&](PlotCurve curve, const std::string& words) {
    curve.colour = colour::limit;
    curve.dash = 3;
    curve.width = 0.8;
    FigureLabel label{{}, words, false, true};
    for (std::size_t k = curve.x.size(); k-- > 1;)
      if (std::isfinite(curve.x[k])) label.at.push_back({curve.x[k], curve.y[k]});
    panel.labels.push_back(label);
    panel.curves.push_back(curve);
  };
  const double left = -w.re.lower;
  for (const double zeta : {0.9, 0.7, 0.5, 0.3, 0.1}) {
    const double slope = std::sqrt(1 - zeta * zeta) / zeta;
    const double re = std::min(left, w.im / slope);
    PlotCurve ray;
    constexpr int places = 10;  // of the label
    for (int k = 0; k <= places; ++k) {
      ray.x.push_back(-re * k / places);
      ray.y.push_back(re * slope * k / places);
    }
    thin(ray, fmt::format("ζ {:.1f}", zeta));
  }
  const double step = round_step(std::max(left, w.im), 5);
  for (double radius = step; radius < std::hypot(left, w.im); radius += step) {
    PlotCurve arc;
    for (int k = 0; k <= 48; ++k) {
      const double angle = std::numbers::pi / 2 * (1 + k / 48.0);
      const double re = radius * std::cos(angle), im = radius * std::sin(angle);
      const bool inside = re >= w.re.lower && im <= w.im;
      arc.x.push_back(inside ? re : ModeCurve::gap);
      arc.y.push_back(inside ? im : ModeCurve::gap);
    }
    thin(arc, fmt::format("ω {:.3g}", radius));
  }
  PlotCurve axis;
  axis.colour = colour::ink;
  axis.width = 1.2;
  axis.x = {0, 0};
  axis.y = {0, w.im};
  panel.curves.push_back(axis);
}

// ---- Ticks of the parameter

// Round values of the parameter inside its range.
std::vector<double> round_values(const FigureAxis& axis) {
  const auto [lower, upper] = axis.range;
  std::vector<double> values;
  if (!axis.logarithmic) {
    const double step = round_step(upper - lower, 6);
    for (double k = std::ceil(lower / step); k * step <= upper; ++k) values.push_back(k * step);
    return values;
  }
  for (double power = std::pow(10, std::floor(std::log10(lower))); power <= upper; power *= 10)
    for (const double v : {power, 2 * power, 5 * power})
      if (v >= lower && v <= upper) values.push_back(v);
  return values;
}

// Where the curve passes a value of the parameter; none if it does not.
std::optional<std::array<double, 2>> passed(const ModeCurve& curve, double value) {
  for (std::size_t i = 0; i + 1 < curve.at.size(); ++i) {
    const double from = curve.at[i], to = curve.at[i + 1];
    if (!((from <= value && value <= to) || (to <= value && value <= from)) || from == to) continue;
    const double t = (value - from) / (to - from);
    return std::array{curve.re[i] + t * (curve.re[i + 1] - curve.re[i]),
                      curve.im[i] + t * (curve.im[i + 1] - curve.im[i])};
  }
  return {};
}

void add_ticks(const ModeCurve& mode, const SweepAxis& axis, int colour, const Window& w,
               Panel& panel) {
  PlotCurve ticks;
  ticks.kind = PlotCurve::Kind::points;
  ticks.colour = colour;
  ticks.dash = 7;
  ticks.width = 0.4;
  for (const double value : round_values(axis_of(axis))) {
    const auto at = passed(mode, value);
    if (!at || !((*at)[0] >= w.re.lower && (*at)[0] <= w.re.upper && (*at)[1] <= w.im)) continue;
    ticks.x.push_back((*at)[0]);
    ticks.y.push_back((*at)[1]);
    const std::string words = fmt::format("{:.6g}{}", value, unit_words(axis.columns[0].unit));
    const auto same = [&](const FigureLabel& l) {
      const double reach = w.re.upper - w.re.lower, dx = l.at[0][0] - (*at)[0],
                   dy = l.at[0][1] - (*at)[1];
      constexpr double close = 0.01;
      return l.text == words && std::hypot(dx / reach, dy / w.im) < close;
    };
    if (std::ranges::none_of(panel.labels, same)) panel.labels.push_back({{*at}, words, false});
  }
  if (!ticks.x.empty()) panel.curves.push_back(ticks);
}

// ---- Figures

PlotCurve drawn_curve(const std::vector<double>& x, const std::vector<double>& y, std::size_t entry,
                      const std::string& title) {
  PlotCurve curve = nth_curve(entry, title);
  curve.x = x;
  curve.y = y;
  return curve;
}

Figure locus_figure(const Eigenvalues& of, bool slow) {
  const Line& line = of.line;
  const Window w = slow ? slow_window(line) : whole_window(line, of.track);
  Figure figure{(slow ? "locus_slow_" : "locus_") + line.id,
                fmt::format("Root locus over {}{}; the upper half plane, circles at the start, "
                            "dots at round values of {}",
                            range_in_words(line), slow ? ", the slow modes" : ", every mode",
                            line.map.axes[0].name),
                "Root locus over " + range_in_words(line) + ". ",
                of.track.name,
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
        {"unstable: Re λ > 0", colour::unstable, false, {{0, w.re.upper, 0, w.im}}});
  const std::vector<Entry> entries = entries_of(of);
  for (std::size_t k = 0; k < entries.size(); ++k)
    for (const std::size_t m : entries[k].modes) {
      const bool second = m != entries[k].modes.front();
      const ModeCurve mode = curve_of(of, m, entries[k].modes.front());
      PlotCurve curve = drawn_curve(mode.re, mode.im, k, second ? "" : entries[k].title);
      curve.x_key = fmt::format("re_{}", m);
      curve.y_key = fmt::format("im_{}", m);
      panel.curves.push_back(curve);
      PlotCurve start;
      start.kind = PlotCurve::Kind::points;
      start.colour = curve.colour;
      start.dash = 6;
      start.width = 0.6;
      start.x = {mode.re.front()};
      start.y = {mode.im.front()};
      if (!second) panel.curves.push_back(start);
      add_ticks(mode, line.map.axes[0], curve.colour, w, panel);
      if (!second)
        figure.alternative += fmt::format(
            "Mode {}: Re λ {}. ", entries[k].title,
            described({"", "", "1/s", column(of.track, curve.x_key)->values}).substr(1));
    }
  add_damping_grid(panel, w);
  figure.panels.push_back(panel);
  return figure;
}

Figure modes_figure(const Eigenvalues& of) {
  const Line& line = of.line;
  Figure figure{
      "modes_" + line.id,
      fmt::format("Real parts (the slow modes) and damping ratios over {}", range_in_words(line)),
      "Real parts and damping ratios of the modes over " + range_in_words(line) +
          "; the stretches that are not stable are shaded and listed in the table.",
      of.track.name,
      {}};
  const FigureAxis x = axis_of(line.map.axes[0]);
  Panel real{x, {"Re λ [1/s]", slow_window(line).re, false, {}, "re"}, {}, {}, {}, 14.0, ""};
  Panel damping{x, {"damping ratio ζ", {-1.05, 1.05}, false, {}, "zeta"}, {}, {}, {}, 10.0, ""};
  real.boxes = stretches(line, real.y.range, true);
  damping.boxes = stretches(line, damping.y.range, false);
  for (Panel* panel : {&real, &damping}) panel->curves.push_back(level_line(x.range, 0));
  constexpr double rounding = 1e-12;
  double zero = 0.0;  // an eigenvalue no larger has no damping ratio
  for (const auto* parts : {&line.map.eigenvalue_re, &line.map.eigenvalue_im})
    for (const double v : *parts) zero = std::max(zero, rounding * std::abs(v));
  const std::vector<Entry> entries = entries_of(of);
  for (std::size_t k = 0; k < entries.size(); ++k)
    for (const std::size_t m : entries[k].modes) {
      const bool second = m != entries[k].modes.front();
      const ModeCurve mode = curve_of(of, m, entries[k].modes.front());
      std::vector<double> zeta(mode.re.size());
      for (std::size_t i = 0; i < zeta.size(); ++i) {
        const double size = std::hypot(mode.re[i], mode.im[i]);
        zeta[i] = size > zero ? -mode.re[i] / size : ModeCurve::gap;
      }
      const auto add = [&](Panel& panel, const std::vector<double>& y, const char* key,
                           bool titled) {
        PlotCurve curve = drawn_curve(mode.at, y, k, titled && !second ? entries[k].title : "");
        curve.x_key = "parameter";
        curve.y_key = fmt::format("{}_{}", key, m);
        panel.curves.push_back(curve);
      };
      add(real, mode.re, "re", true);
      add(damping, zeta, "zeta", false);
    }
  real.x.label.clear();
  figure.panels = {real, damping};
  return figure;
}

}  // namespace

void add_loci(const Line& line, const Track& track, ReportFigures& all) {
  const Eigenvalues of{line, track};
  all.figures.push_back(locus_figure(of, false));
  all.figures.push_back(locus_figure(of, true));
  all.figures.push_back(modes_figure(of));
}

}  // namespace tiltrim::figures
