#include "report/figure.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <stdexcept>

#include "report/sheet.hpp"

namespace tiltrim {

namespace {

// In font heights.
constexpr double least_left = 5.6, right = 1.4, under = 4.2, under_bare = 2.4, above = 0.9,
                 below_key = 0.5;
constexpr double key_sample = 4.5;            // width of the line sample in the key
constexpr double x_room = 4.0, y_room = 1.7;  // of a tick

constexpr double page_font = 13;  // in user units of the page's SVG

double width_of(Device device) { return device == Device::page ? 55.0 : 31.18; }

// Line height of gnuplot's terminals, and a figure's proportions in a column.
double key_row(Device device) { return device == Device::page ? 1.5 : 1.2; }
double axes_height(const Panel& panel, Device device) {
  return panel.height * (device == Device::page ? 1.0 : 0.75);
}

// gnuplot labels the multiples of this step.
double tick_step(const FigureAxis& a, double length, double room) {
  return round_step(a.range.upper - a.range.lower, std::max(2, int(length / room)));
}

double widest_tick(const Panel& panel, Device device) {
  const FigureAxis& a = panel.y;
  double widest = 0.0;
  for (const auto& [at, words] : a.ticks) widest = std::max(widest, text_width(words));
  if (!a.ticks.empty() || a.logarithmic) return widest;
  const double step = tick_step(a, axes_height(panel, device), y_room);
  for (double k = std::ceil(a.range.lower / step); k * step <= a.range.upper; ++k)
    widest = std::max(widest, text_width(fmt::format("{:.6g}", k * step)));
  return widest;
}

// Width of the vertical axes' ticks and labels.
double left_of(const Figure& figure, Device device) {
  double left = least_left;
  for (const Panel& p : figure.panels)
    left = std::max(left, widest_tick(p, device) + (p.y.label.empty() ? 1.5 : 3.2));
  return left;
}

// Rows and columns of the key above a panel.
struct KeyGrid {
  int columns = 1, rows = 0;
  double width = 0;  // of a column
};

KeyGrid key_grid(const Panel& panel, Device device) {
  int entries = 0;
  double longest = 0;
  const auto add = [&](const std::string& title) {
    if (title.empty()) return;
    ++entries;
    longest = std::max(longest, text_width(title));
  };
  for (const Boxes& b : panel.boxes) add(b.title);
  for (const PlotCurve& c : panel.curves) add(c.title);
  const double room = width_of(device) - least_left - right;
  const int columns = std::max(1, int(room / (longest + key_sample)));
  return {columns, (entries + columns - 1) / columns, longest + key_sample};
}

double height_above(const Panel& panel, Device device) {
  const int rows = key_grid(panel, device).rows;
  return above + (rows > 0 ? rows * key_row(device) + below_key : 0.0);
}

double height_below(const Panel& panel) { return panel.x.label.empty() ? under_bare : under; }

double height_of(const Panel& panel, Device device) {
  return height_above(panel, device) + axes_height(panel, device) + height_below(panel);
}

// ---- The script ---------------------------------------------------------------------------------

std::string colour_of(int colour) {
  return fmt::format("lc rgb '{}'", figure_colours().at(std::size_t(colour)).light);
}

std::string titled(const std::string& title) {
  return title.empty() ? "notitle" : "title " + gnuplot_text(title);
}

std::string data_block(const std::string& name, const PlotCurve& curve) {
  std::string block = fmt::format("${} << EOD\n", name);
  for (std::size_t i = 0; i < curve.x.size(); ++i)
    block += std::isfinite(curve.x[i]) && std::isfinite(curve.y[i])
                 ? fmt::format("{:.7g} {:.7g}\n", curve.x[i], curve.y[i])
                 : "\n";
  return block + "EOD\n";
}

std::string data_block(const std::string& name, const Boxes& boxes) {
  std::string block = fmt::format("${} << EOD\n", name);
  for (const auto& [x0, x1, y0, y1] : boxes.corners)
    block += fmt::format("{:.7g} {:.7g} {:.7g} {:.7g} {:.7g} {:.7g}\n", x0, y0, x0, x1, y0, y1);
  return block + "EOD\n";
}

// `length` of the axis and `room` for a tick, in font heights.
std::string axis_of(const char* axis, const FigureAxis& a, double length, double room) {
  // The scale comes first: a range that includes zero is invalid on a logarithmic axis.
  std::string script = fmt::format(
      "unset logscale {0}\nset {0}range [{1:.9g}:{2:.9g}]\n{4}set {0}label {3} offset {5}\n", axis,
      a.range.lower, a.range.upper, gnuplot_text(a.label),
      a.logarithmic ? fmt::format("set logscale {}\n", axis) : "", *axis == 'x' ? "0,0.5" : "0,0");
  const bool own = a.ticks.empty() && !a.logarithmic;
  if (own) return script + fmt::format("set {}tics {:.9g}\n", axis, tick_step(a, length, room));
  if (a.ticks.empty()) return script + fmt::format("set {}tics autofreq\n", axis);
  std::string ticks;
  for (const auto& [at, words] : a.ticks)
    ticks += fmt::format("{}{} {:.9g}", ticks.empty() ? "" : ", ", gnuplot_text(words), at);
  return script + fmt::format("set {}tics ({})\n", axis, ticks);
}

bool drawn(const PlotCurve& curve) {
  for (std::size_t i = 0; i < curve.x.size(); ++i)
    if (std::isfinite(curve.x[i]) && std::isfinite(curve.y[i])) return true;
  return false;
}

std::string style_of(const PlotCurve& curve) {
  return curve.kind == PlotCurve::Kind::line
             ? fmt::format("with lines lw {:.2g} dt {}", curve.width, curve.dash)
             : fmt::format("with points pt {} ps {:.2g}", curve.dash, curve.width);
}

std::string panel_of(const Figure& figure, std::size_t k, Device device) {
  const Panel& panel = figure.panels[k];
  const PlotArea at = plot_area(figure, k, device);
  std::string script = fmt::format(
      "set lmargin at screen {:.6f}\nset rmargin at screen {:.6f}\n"
      "set tmargin at screen {:.6f}\nset bmargin at screen {:.6f}\n",
      at.left, at.right, 1 - at.top, 1 - at.bottom);
  const auto [width, height] = figure_size(figure, device);
  const double across = (at.right - at.left) * width, up = (at.bottom - at.top) * height;
  script += axis_of("x", panel.x, across, x_room) + axis_of("y", panel.y, up, y_room);
  script += panel.map.empty() ? "set tics back\n" : "set tics front\n";  // not under the shades
  const KeyGrid key = key_grid(panel, device);
  const double row = key_row(device) / height;
  const double key_left = std::clamp(1 - key.width / width, 0.0, at.left);
  script += fmt::format(
      "set key at screen {:.6f}, screen {:.6f} top left Left reverse vertical maxrows {} samplen "
      "3\n"
      "unset label\n",
      key_left, 1 - at.top + (key.rows + 0.4) * row, std::max(1, key.rows));
  for (const PlacedLabel& l : placed_labels(panel, across, up))
    script += fmt::format("set label {} at screen {:.6f}, screen {:.6f} {} front tc rgb '{}'\n",
                          gnuplot_text(l.text), at.left + l.x / width, 1 - at.bottom + l.y / height,
                          l.right ? "right" : "left", figure_colours()[colour::limit].light);
  std::string blocks, plots;
  const auto add = [&](const std::string& block, const std::string& plot) {
    blocks += block;
    plots += (plots.empty() ? "" : ", \\\n  ") + plot;
  };
  for (const Boxes& b : panel.boxes) {
    if (b.corners.empty()) continue;
    const std::string name = fmt::format("b{}", blocks.size());
    add(data_block(name, b),
        fmt::format(
            "${} using 1:2:3:4:5:6 with boxxyerror fs solid {} {} {}", name,
            b.outlined ? fmt::format("border rgb '{}'", figure_colours()[0].light) : "noborder",
            colour_of(b.colour), titled(b.title)));
  }
  for (const PlotCurve& c : panel.curves) {
    if (!drawn(c)) continue;
    const std::string name = fmt::format("c{}", blocks.size());
    add(data_block(name, c), fmt::format("${} using 1:2 {} {} {}", name, style_of(c),
                                         colour_of(c.colour), titled(c.title)));
  }
  return script + blocks + "plot " + (plots.empty() ? "NaN notitle" : plots) + "\n";
}

struct Output {
  const char* extension;
  std::string terminal;
  double key_spacing = 1.0;  // gives keys the height of key_row()
};

// 88 mm is the column width of most journals.
std::vector<Output> outputs(const Figure& figure, Device device) {
  const auto [w, h] = figure_size(figure, device);
  if (device == Device::page) {
    const auto [width, height] = page_pixels(figure);
    return {{"svg",
             fmt::format("svg size {:.0f},{:.0f} font 'sans-serif,{}'", width, height, page_font)}};
  }
  constexpr double font = 8, inch = 72, dots = 300, pixels = 96;  // points
  const double width = w * font, height = h * font;
  return {
      {"svg",
       fmt::format(
           "svg size {:.0f},{:.0f} background rgb 'white' font 'sans-serif,{:.2f}' linewidth 0.8",
           width * pixels / inch, height * pixels / inch, font * pixels / inch),
       0.8},
      {"pdf", fmt::format("pdfcairo size {:.4f}in,{:.4f}in font 'sans-serif,{}' linewidth 0.7",
                          width / inch, height / inch, font)},
      {"png", fmt::format("pngcairo size {:.0f},{:.0f} font 'sans-serif,{:.2f}' linewidth "
                          "{:.2f} pointscale {:.2f}",
                          width * dots / inch, height * dots / inch, font * dots / pixels,
                          0.7 * dots / inch, 0.7 * dots / inch)}};
}

}  // namespace

const std::vector<FigureColour>& figure_colours() {
  static const std::vector<FigureColour> colours{
      {"#1b1f24", "#e6e9ed"},                                                  // ink
      {"#1c1cc4", "#848bf4"}, {"#b88a00", "#f0c03f"}, {"#8f2400", "#f7643b"},  // curves
      {"#008ab8", "#18a0c0"}, {"#ff3366", "#f893a8"}, {"#b266ff", "#eaa5ff"},
      {"#d9dde2", "#343b44"}, {"#4c535c", "#bec6cf"},                          // grid, limit
      {"#7fb2e5", "#1d5a94"}, {"#a9cdf0", "#27466a"}, {"#d3e6f8", "#263441"},  // stable
      {"#fbe0c8", "#4a3624"}, {"#f3b889", "#7d4a1c"}, {"#e58a4a", "#b3621c"},  // unstable
      {"#f0e05a", "#565010"}, {"#c4c8ce", "#4a4f57"}};                         // undecided, no trim
  return colours;
}

std::string gnuplot_text(const std::string& text) {
  std::string quoted = "'";
  for (const char c : text)
    quoted += c == '\'' ? "''" : std::string(1, static_cast<unsigned char>(c) < ' ' ? ' ' : c);
  return quoted + "'";
}

double round_step(double reach, int count) {
  const double raw = reach / count, power = std::pow(10, std::floor(std::log10(raw)));
  for (const double step : {1.0, 2.0, 5.0})
    if (step * power >= raw) return step * power;
  return 10 * power;
}

std::array<double, 2> figure_size(const Figure& figure, Device device) {
  double height = 0;
  for (const Panel& p : figure.panels) height += height_of(p, device);
  return {width_of(device), height};
}

std::array<double, 2> page_pixels(const Figure& figure) {
  const auto [w, h] = figure_size(figure, Device::page);
  return {std::round(w * page_font), std::round(h * page_font)};
}

PlotArea plot_area(const Figure& figure, std::size_t panel, Device device) {
  const auto [w, h] = figure_size(figure, device);
  double top = height_above(figure.panels.at(panel), device);
  for (std::size_t k = 0; k < panel; ++k) top += height_of(figure.panels[k], device);
  return {left_of(figure, device) / w, 1 - right / w, top / h,
          (top + axes_height(figure.panels[panel], device)) / h};
}

std::string gnuplot_script(const std::vector<Figure>& figures, Device device) {
  std::string script = fmt::format(
      "set encoding utf8\nset termoption noenhanced\nset clip two\nset border 3 lc rgb '{0}'\n"
      "set grid lc rgb '{1}' lt 1 lw 0.7\nset tics nomirror format '%h' textcolor rgb '{0}'\n"
      "set xlabel textcolor rgb '{0}'\nset ylabel textcolor rgb '{0}'\nset key textcolor rgb "
      "'{0}'\n",
      figure_colours()[colour::ink].light, figure_colours()[colour::grid].light);
  for (const Figure& f : figures)
    for (const Output& out : outputs(f, device)) {
      script += fmt::format(
          "\nset terminal {} noenhanced\nset output '{}.{}'\nset multiplot\nset key spacing {}\n",
          out.terminal, f.name, out.extension, out.key_spacing);
      for (std::size_t k = 0; k < f.panels.size(); ++k) script += panel_of(f, k, device);
      script += "unset multiplot\n";
    }
  return script + "set output\n";
}

// ---- SVG in a page ------------------------------------------------------------------------------

namespace {

// The text between two marks, inclusive; npos, npos if there is none from `from` on.
std::pair<std::size_t, std::size_t> between(const std::string& text, const std::string& begin,
                                            const std::string& end, std::size_t from = 0) {
  const std::size_t a = text.find(begin, from);
  const std::size_t b = a == std::string::npos ? a : text.find(end, a + begin.size());
  return b == std::string::npos ? std::pair{b, b} : std::pair{a, b + end.size()};
}

void drop_all(std::string& text, const std::string& begin, const std::string& end) {
  std::string kept;
  std::size_t at = 0;
  for (;;) {
    const auto [a, b] = between(text, begin, end, at);
    if (a == std::string::npos) break;
    kept.append(text, at, a - at);
    at = b;
  }
  text = kept + text.substr(at);
}

void replace_all(std::string& text, const std::string& what, const std::string& by) {
  std::string replaced;
  std::size_t at = 0, next;
  while ((next = text.find(what, at)) != std::string::npos) {
    replaced.append(text, at, next - at).append(by);
    at = next + what.size();
  }
  text = replaced + text.substr(at);
}

// "#1b1f24" as gnuplot writes it.
std::string rgb(const std::string& colour, const char* format) {
  const auto part = [&](std::size_t at) { return std::stoi(colour.substr(at, 2), nullptr, 16); };
  const int red = part(1), green = part(3), blue = part(5);
  return fmt::format(fmt::runtime(format), red, green, blue);
}

}  // namespace

std::string svg_shapes(const std::string& drawn) {
  const auto [a, b] = between(drawn, "<defs>", "</defs>");
  if (a == std::string::npos) throw std::runtime_error("gnuplot wrote an SVG without shapes");
  std::string shapes = drawn.substr(a, b - a);
  drop_all(shapes, "<filter", "</filter>");
  replace_all(shapes, "xlink:href", "href");
  return "<svg class=\"shapes\" width=\"0\" height=\"0\" aria-hidden=\"true\">" + shapes + "</svg>";
}

std::string inline_svg(const Figure& figure, const std::string& drawn) {
  const std::size_t begin = drawn.find("<g id=\"gnuplot_canvas\">");
  const std::size_t end = drawn.rfind("</svg>");
  const auto [a, b] = between(drawn, "viewBox=\"", "\"");
  if (begin == std::string::npos || end == std::string::npos || end < begin ||
      a == std::string::npos)
    throw std::runtime_error(fmt::format("gnuplot wrote no SVG for the figure {}", figure.name));
  std::string body = drawn.substr(begin, end - begin);
  drop_all(body, "<defs>", "</defs>");
  drop_all(body, "<title>", "</title>");
  drop_all(body, " id=\"", "\"");
  drop_all(body, " font-family=\"", "\"");
  replace_all(body, "xlink:href", "href");
  replace_all(body, " stroke-linecap=\"butt\" stroke-linejoin=\"miter\"", "");
  replace_all(body, " fill=\"none\" color=\"black\" stroke=\"currentColor\"", " class=\"l\"");
  replace_all(body, " fill=\"none\" color=\"white\" stroke=\"currentColor\"", " class=\"l\"");
  replace_all(body, "<tspan >", "<tspan>");
  // gnuplot writes text colours without the blanks it puts in line colours.
  for (const FigureColour& c : figure_colours())
    replace_all(body, rgb(c.light, "rgb({},{},{})"), rgb(c.light, "rgb({:3}, {:3}, {:3})"));
  drop_all(body, "<rect x=\"0\" y=\"0\"", "/>");
  return fmt::format(
      "<svg class=\"figure\" role=\"img\" aria-label=\"{}\" {} data-figure=\"{}\">{}</svg>",
      html_escaped(figure.alternative), drawn.substr(a, b - a), html_escaped(figure.name), body);
}

}  // namespace tiltrim
