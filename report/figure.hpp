/// A figure described once: gnuplot draws it for page and print, a page's script reads it off.
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
  std::vector<std::pair<double, std::string>> ticks;  ///< empty: gnuplot's own
  std::string key;  ///< of the track's column along this axis; empty: none
};

struct PlotCurve {
  enum class Kind {
    line,   ///< x, y; NaN breaks it
    points  ///< x, y
  };
  Kind kind = Kind::line;
  std::string title;  ///< in the key; empty: not there
  int colour = 0;     ///< of the palette, see figure_colours()
  int dash = 1;  ///< of a line: 1 solid, 2 dashed, 3 dotted, 4 dash-dot, ...; of points their shape
  double width = 1.5;  ///< of the line, or size of the points
  std::vector<double> x, y;
  std::string x_key, y_key;  ///< columns of the figure's track, where a page reads it off
};

/// Filled rectangles of one colour, behind the curves.
struct Boxes {
  std::string title;  ///< in the key; empty: not there
  int colour = 0;
  bool outlined = false;
  std::vector<std::array<double, 4>> corners;  ///< x from, x to, y from, y to
};

/// Words at a place of the panel.
struct FigureLabel {
  double x = 0.0, y = 0.0;
  std::string text;
  bool right = false;  ///< they end there
  bool below = false;  ///< else above
};

struct Panel {
  FigureAxis x, y;
  std::vector<Boxes> boxes;
  std::vector<PlotCurve> curves;
  std::vector<FigureLabel> labels;
  double height = 14.0;  ///< of the axes, in heights of the font
  std::string map;       ///< the page's map that is read off here; empty: none
};

struct Figure {
  std::string name;           ///< of its files: letters, digits, '_', '-'
  std::string caption;        ///< one sentence, any characters
  std::string alternative;    ///< what it shows, in words, for those who do not see it
  std::string track;          ///< whose columns its curves are; empty: none
  std::vector<Panel> panels;  ///< below one another
};

/// Fills and lines, "#rrggbb" on white and on a dark page. docs/report.md says how they were
/// chosen.
struct FigureColour {
  const char *light, *dark;
};
const std::vector<FigureColour>& figure_colours();
/// Positions among them: ink, six for curves from 1 on, grid, limit, then the fills of maps from
/// the most stable to the most unstable, undecided, without trim.
namespace colour {
inline constexpr int ink = 0, first = 1, curves = 6, grid = 7, limit = 8;
inline constexpr int stable = 9, levels = 3, unstable = stable + levels, undecided = 15, none = 16;
}  // namespace colour

/// One line of text as a string of gnuplot's that stands for itself.
std::string gnuplot_text(const std::string& text);
/// 1, 2 or 5 times a power of ten: the least step that goes at most `count` times into `reach` > 0.
double round_step(double reach, int count);

/// Where figures go.
enum class Device {
  page,    ///< SVG, 55 heights of the font wide
  column,  ///< SVG, PDF and PNG (300 dots per inch), 88 mm wide with 8 point letters
};

/// Rectangle of a panel's axes as shares of the figure's width and height, from the left and from
/// the top.
struct PlotArea {
  double left, right, top, bottom;
};
PlotArea plot_area(const Figure& figure, std::size_t panel, Device device);
/// Width and height in heights of the font.
std::array<double, 2> figure_size(const Figure& figure, Device device);

/// Width and height of the page's SVG in its own units.
std::array<double, 2> page_pixels(const Figure& figure);

/// A gnuplot script that draws all figures as NAME.svg (and .pdf, .png) in its folder.
std::string gnuplot_script(const std::vector<Figure>& figures, Device device);

/// What gnuplot wrote for the page, ready to stand in HTML: no ids, no definitions of its own,
/// `alternative` as its name. Throws std::runtime_error if it is not the SVG expected.
std::string inline_svg(const Figure& figure, const std::string& drawn);
/// The shapes of points that all inline figures refer to; once on a page.
std::string svg_shapes(const std::string& drawn);

}  // namespace tiltrim
