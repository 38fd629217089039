/// A grid line of the map, and the events on it, also between its points. Internal to sweep/.
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "sweep/boundary.hpp"

namespace tiltrim {

inline constexpr double finest = 1e-10;  ///< of a step: closer crossings are not separated

/// One line of the map along an axis.
struct GridLine {
  const Prepared& sweep;
  const SweepMap& map;
  int condition;
  std::size_t axis;
  GridPlace place;  ///< of the first point

  std::size_t size() const { return sweep.axes[axis].size(); }
  std::size_t point(std::size_t k) const {
    std::size_t number = std::size_t(condition);
    for (std::size_t a = 0; a < sweep.axes.size(); ++a)
      number = number * sweep.axes[a].size() + (a == axis ? k : std::size_t(place[a]));
    return number;
  }
  GridPlace at(double t) const {
    GridPlace there = place;
    there[axis] = t;
    return there;
  }
  bool valid(std::size_t k) const { return map.verdict[point(k)] >= 0; }
};

/// The map's equilibrium at point k of the line.
OperatingPoint operating_point(const GridLine& line, std::size_t k);
/// The same, converged again.
std::optional<GridTrim> settled_at(const GridLine& line, std::size_t k);
std::optional<Sample> grid_sample(const GridLine& line, std::size_t k);
/// `line` must outlive the result.
MatrixLine matrices_of(const GridLine& line);

/// A part of a line along which some eigenvalues stay on the axis within their error bounds.
struct Riding {
  double from, to;
};

struct Halves;
/// All events on the line, by bisection of the grid steps that its `halves` do not show to be
/// clear.
void search_events(const GridLine& line, const Halves& halves, std::vector<LineEvent>& events,
                   std::vector<Sample>& seen, std::vector<Riding>& riding);
/// The same along an axis with matrices affine in its φ. False without this structure.
bool solve_events(const GridLine& line, std::vector<LineEvent>& events);

/// The events of a line of affine matrices with these multiples of the slope at its points. False
/// if φ is not monotone, or if rounding leaves doubt and `bisect` is false.
bool affine_events(const GridLine& line, const AffineLine& affine, std::span<const double> shares,
                   bool bisect, std::vector<LineEvent>& events);

}  // namespace tiltrim
