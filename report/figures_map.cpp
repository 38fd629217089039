// Figures over two axes: shades of the largest real part, and its zero contour.
#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "report/figure_parts.hpp"

namespace tiltrim::figures {

namespace {

// Cell boundaries: midpoints, geometric on a logarithmic axis.
std::vector<double> borders(const std::vector<double>& at, bool log) {
  std::vector<double> edges{at.front()};
  for (std::size_t i = 1; i < at.size(); ++i)
    edges.push_back(log ? std::sqrt(at[i - 1] * at[i]) : 0.5 * (at[i - 1] + at[i]));
  edges.push_back(at.back());
  return edges;
}

// Levels between the shades of one sign: rounded fractions of the extreme that most points reach.
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
  // Index in the palette.
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

// The grid with more points between its own. The largest real part is bilinear in a cell whose four
// corners have a verdict; in other cells, and where the model or the trim jumps, the nearest corner
// counts.
MapGrid finer(const MapGrid& grid, const std::vector<bool>& jumps, bool log_x, bool log_y) {
  constexpr std::size_t most = 400;  // points along an axis
  const std::size_t nx = grid.x.values.size(), ny = grid.y.values.size();
  if (nx < 2 || ny < 2) return grid;
  const std::size_t kx = std::max<std::size_t>(1, most / nx),
                    ky = std::max<std::size_t>(1, most / ny);
  const auto between = [](const std::vector<double>& at, std::size_t times, bool log) {
    std::vector<double> all;
    for (std::size_t i = 0; i + 1 < at.size(); ++i)
      for (std::size_t k = 0; k < times; ++k) {
        const double t = double(k) / double(times);
        all.push_back(log ? at[i] * std::pow(at[i + 1] / at[i], t)
                          : at[i] + t * (at[i + 1] - at[i]));
      }
    all.push_back(at.back());
    return all;
  };
  MapGrid fine = grid;
  fine.x.values = between(grid.x.values, kx, log_x);
  fine.y.values = between(grid.y.values, ky, log_y);
  fine.verdict.clear();
  fine.abscissa.clear();
  for (std::size_t a = 0; a < fine.x.values.size(); ++a)
    for (std::size_t b = 0; b < fine.y.values.size(); ++b) {
      const std::size_t i = std::min(a / kx, nx - 2), j = std::min(b / ky, ny - 2);
      const double s = double(a - i * kx) / double(kx), t = double(b - j * ky) / double(ky);
      const std::array<std::size_t, 4> corners{i * ny + j, i * ny + j + 1, (i + 1) * ny + j,
                                               (i + 1) * ny + j + 1};
      const std::array<double, 4> weights{(1 - s) * (1 - t), (1 - s) * t, s * (1 - t), s * t};
      const auto decided = [&](std::size_t c) {
        return grid.verdict[c] == int(Verdict::stable) || grid.verdict[c] == int(Verdict::unstable);
      };
      double abscissa = 0;
      for (std::size_t c = 0; c < 4; ++c) abscissa += weights[c] * grid.abscissa[corners[c]];
      const std::size_t nearest = corners[(s < 0.5 ? 0 : 2) + (t < 0.5 ? 0 : 1)];
      const bool smooth = std::ranges::all_of(corners, decided) && !jumps[corners[0]];
      fine.abscissa.push_back(smooth ? abscissa : grid.abscissa[nearest]);
      fine.verdict.push_back(!smooth ? grid.verdict[nearest]
                                     : int(abscissa < 0 ? Verdict::stable : Verdict::unstable));
    }
  return fine;
}

// The cells, by their lower corner, in which the model or the trim jumps.
std::vector<bool> jumps_in(const SweepMap& map, std::size_t condition, const MapGrid& grid) {
  const auto cell = [](const std::vector<double>& at, double value) {
    std::size_t i = 0;
    while (i + 2 < at.size() && (at[i + 1] <= value) == (at.front() <= at.back())) ++i;
    return i;
  };
  std::vector<bool> jumps(grid.verdict.size(), false);
  for (const AxisCrossing& c : map.crossings) {
    if (c.condition != int(condition) ||
        (c.kind != CrossingKind::jump && c.kind != CrossingKind::end))
      continue;
    const std::size_t ny = grid.y.values.size();
    const std::size_t i = cell(grid.x.values, c.at[0]), j = cell(grid.y.values, c.at[1]);
    jumps[i * ny + j] = true;
    if (c.axis == 0 && j > 0) jumps[i * ny + j - 1] = true;  // on the border of two cells
    if (c.axis == 1 && i > 0) jumps[(i - 1) * ny + j] = true;
  }
  return jumps;
}

// Merges neighbours of one shade along y into one rectangle.
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
      // Slightly wider than the cell, to hide seams.
      constexpr double seam = 0.5;  // of a cell, of which there are hundreds
      const double right = std::min(x.back(), x[i + 1] + seam * (x[i + 1] - x[i]));
      boxes[std::size_t(shade(begin) - colour::stable)].corners.push_back(
          {x[i], right, y[begin], y[j]});
      begin = j;
    }
  }
  std::erase_if(boxes, [](const Boxes& b) { return b.corners.empty(); });
  if (!boxes.empty() && boxes[0].colour < colour::undecided && !boxes[0].title.starts_with("Re"))
    boxes[0].title = "Re λ " + boxes[0].title;
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

// Marks the study's own point; a line if only one of the axes has it.
void add_own(const OwnPoint& own, Panel& panel) {
  const Range &x = panel.x.range, &y = panel.y.range;
  const auto inside = [](std::optional<double> v, const Range& r) {
    return v && *v >= r.lower && *v <= r.upper;
  };
  if ((own.x && !inside(own.x, x)) || (own.y && !inside(own.y, y)) || (!own.x && !own.y)) return;
  PlotCurve mark;
  mark.title = "this study";
  mark.colour = colour::ink;
  mark.x = {own.x.value_or(x.lower), own.x.value_or(x.upper)};
  mark.y = {own.y.value_or(y.lower), own.y.value_or(y.upper)};
  mark.dash = 4;
  mark.width = 1.2;
  if (own.x && own.y) {
    mark.kind = PlotCurve::Kind::points;
    mark.dash = 3;
    mark.width = 1.2;
  }
  panel.curves.push_back(mark);
}

Figure map_figure(const SweepMap& map, std::size_t condition, const MapGrid& grid,
                  const std::string& name, const OwnPoint& own) {
  Panel panel{axis_of(map.axes[0]), axis_of(map.axes[1]), {}, {}, {}, 26.0, grid.name};
  panel.x.key = map.axes[0].name;
  panel.y.key = map.axes[1].name;
  const Shades shades{shade_steps(grid.abscissa, -1), shade_steps(grid.abscissa, 1)};
  const bool log_x = panel.x.logarithmic, log_y = panel.y.logarithmic;
  panel.boxes =
      cells(finer(grid, jumps_in(map, condition, grid), log_x, log_y), shades, log_x, log_y);
  const auto add = [&](auto which, const char* title, int shape, double size) {
    PlotCurve located;
    located.kind = PlotCurve::Kind::points;
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
  add_own(own, panel);
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

}  // namespace

void add_map(const SweepMap& map, std::size_t condition, const std::string& id, const OwnPoint& own,
             ReportFigures& all) {
  all.grids.push_back(grid_of(map, condition, id));
  all.figures.push_back(map_figure(map, condition, all.grids.back(), "stability_" + id, own));
}

}  // namespace tiltrim::figures
