/// A line of the map's grid, between whose points is looked, and all that happens on it. Internal
/// to sweep/.
#pragma once

#include <optional>
#include <vector>

#include "sweep/boundary.hpp"

namespace tiltrim {

inline constexpr double finest = 1e-10;  ///< of a step: where crossings are told apart no more

/// One line of the map along an axis.
struct GridLine {
  const Prepared& sweep;
  const SweepMap& map;
  int condition;
  std::size_t axis;
  GridPlace place;  ///< of its first point

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

/// The equilibrium that the map has at the line's point k.
OperatingPoint operating_point(const GridLine& line, std::size_t k);
/// The same, settled again.
std::optional<GridTrim> settled_at(const GridLine& line, std::size_t k);
std::optional<Sample> grid_sample(const GridLine& line, std::size_t k);
/// `line` must outlive the answer.
MatrixLine matrices_of(const GridLine& line);

/// All that happens on the line, found by halving the steps of the grid.
void search_events(const GridLine& line, std::vector<LineEvent>& events, std::vector<Sample>& seen);
/// The same along an axis in whose φ the matrices are affine. False if the line has no such
/// structure.
bool solve_events(const GridLine& line, std::vector<LineEvent>& events);

}  // namespace tiltrim
