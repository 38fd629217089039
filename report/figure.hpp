/// A figure described once: gnuplot draws it for page and print, and the page's script reads it.
#pragma once

#include <array>
#include <cstddef>
#include <string>
#include <utility>
#include <vector>

#include "model/model.hpp"

namespace tiltrim {

struct FigureAxis {
  std::string label;  ///< "height h [m]"
  Range range;        ///< finite; above 0 if logarithmic
  bool logarithmic = false;
  std::vector<std::pair<double, std::string>> ticks;  ///< empty: gnuplot's default
  std::string key;  ///< the track's column along this axis; empty: none
};

struct PlotCurve {
  enum class Kind {
    line,   ///< x, y; NaN breaks it
    points  ///< x, y
  };
  Kind kind = Kind::line;
  std::string title;   ///< in the key; empty: not listed
  int colour = 0;      ///< index in the palette, see figure_colours()
  int dash = 1;        ///< line: 1 solid, 2 dashed, 3 dotted, 4 dash-dot, ...; points: their shape
  double width = 1.5;  ///< line width or point size
  std::vector<double> x, y;
  std::string x_key, y_key;  ///< columns of the figure's track, for reading on the page
};

/// Filled rectangles of one colour, drawn below the curves.
struct Boxes {
  std::string title;  ///< in the key; empty: not listed
  int colour = 0;
  bool outlined = false;
  std::vector<std::array<double, 4>> corners;  ///< x from, x to, y from, y to
};

/// A text label in the panel, next to one of several points: the first at which it covers neither
/// a curve nor another label.
struct FigureLabel {
  std::vector<std::array<double, 2>> at;  ///< preferred first
  std::string text;
  bool needed = true;     ///< written even where it covers something; else left out
  bool leftward = false;  ///< only to the left of its point
};

struct Panel {
  FigureAxis x, y;
  std::vector<Boxes> boxes;
  std::vector<PlotCurve> curves;
  std::vector<FigureLabel> labels;
  double height = 14.0;  ///< of the axes, in units of the font height
  std::string map;       ///< the page's map read on this panel; empty: none
};

struct Figure {
  std::string name;           ///< base name of its files: letters, digits, '_', '-'
  std::string caption;        ///< one sentence
  std::string alternative;    ///< a description for readers who cannot see it
  std::string track;          ///< the track its curves show; empty: none
  std::vector<Panel> panels;  ///< from top to bottom
};

/// Colours of fills and lines, "#rrggbb" on a light and a dark page; docs/report.md explains the
/// choice.
struct FigureColour {
  const char *light, *dark;
};
const std::vector<FigureColour>& figure_colours();
/// Indices into the palette: ink, six curves from 1 on, grid, limit, then fills of maps from most
/// stable to most unstable, undecided, without trim.
namespace colour {
inline constexpr int ink = 0, first = 1, curves = 6, grid = 7, limit = 8;
inline constexpr int stable = 9, levels = 3, unstable = stable + levels, undecided = 15, none = 16;
}  // namespace colour

/// A line of text as a literal gnuplot string.
std::string gnuplot_text(const std::string& text);
/// 1, 2 or 5 times a power of ten: the smallest step with at most `count` steps in `reach` > 0.
double round_step(double reach, int count);

/// Output medium of figures.
enum class Device {
  page,    ///< SVG, 55 font heights wide
  column,  ///< SVG, PDF and PNG (300 dpi), 88 mm wide with 8 pt font
};

/// Rectangle of a panel's axes as fractions of the figure's width and height, from the top left.
struct PlotArea {
  double left, right, top, bottom;
};
PlotArea plot_area(const Figure& figure, std::size_t panel, Device device);
/// Width and height in font heights.
std::array<double, 2> figure_size(const Figure& figure, Device device);

/// Width and height of the page's SVG in its user units.
std::array<double, 2> page_pixels(const Figure& figure);

/// A label's place: its left or right end at `x`, its middle at `y`, in font heights from the lower
/// left corner of the axes.
struct PlacedLabel {
  double x, y;
  bool right;  ///< right-aligned
  std::string text;
};
/// The panel's labels, for axes of this width and height in font heights.
std::vector<PlacedLabel> placed_labels(const Panel& panel, double width, double height);
/// Width of a text in font heights, estimated.
double text_width(const std::string& text);

/// A gnuplot script that draws all figures as NAME.svg (and .pdf, .png) in its folder.
std::string gnuplot_script(const std::vector<Figure>& figures, Device device);

/// gnuplot's SVG for the page, ready to be inlined in HTML: no ids or definitions, with
/// `alternative` as its label. Throws std::runtime_error if it is not the expected SVG.
std::string inline_svg(const Figure& figure, const std::string& drawn);
/// The point shapes that all inline figures refer to; included once per page.
std::string svg_shapes(const std::string& drawn);

}  // namespace tiltrim
