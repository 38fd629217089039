/// Sheets of trims over a grid of two parameters. Internal to follow/.
#pragma once

#include <deque>

#include "follow/border.hpp"
#include "follow/envelope.hpp"

namespace tiltrim {

/// Everything in scaled unknowns: `fixed` at a point of the plane, `moving` over it.
struct Grid {
  const EnvelopeAxis &x, &y;
  const EnvelopeOptions& options;
  mutable Problem fixed;
  Problem moving;
  Plane plane;
  /// (z, x, y) of the trims found at each grid point, x fastest; and of those just beyond a limit,
  /// over which a sheet may come back within.
  std::vector<std::vector<Eigen::VectorXd>> trims, beyond;

  Grid(const Model& model, const TrimSpec& spec, const TrimSpec& over, const OperatingPoint& guess,
       const EnvelopeAxis& along, const EnvelopeAxis& up, const EnvelopeOptions& o);
  Grid(const Grid&) = delete;
  Grid& operator=(const Grid&) = delete;

  Eigen::Index n() const { return fixed.n(); }
  std::size_t node(int i, int j) const {
    return std::size_t(j) * std::size_t(x.count) + std::size_t(i);
  }
  Eigen::Vector2d place(int i, int j) const;                     ///< of a grid point, scaled
  void put(const Eigen::Vector2d& p) const;                      ///< sets the parameters of `fixed`
  bool within(const Eigen::VectorXd& z, const Values& v) const;  ///< the limits
};

enum class GridTrim { trim, outside, lost };
/// Plain Newton from a neighbour's trim, the parameters put by the caller.
GridTrim settle(const Grid& grid, Eigen::VectorXd& z, int cap);

/// Where a sheet stopped between two grid points: to be looked at more closely.
struct Edge {
  Eigen::VectorXd from;
  int at_i, at_j, i, j;
};

struct Front {
  int i, j;
  bool within;
  Eigen::VectorXd y;
};

/// A trim at a grid point, unless it is known: it goes to the front.
bool add(Grid& grid, int i, int j, const Eigen::VectorXd& z, bool within, std::deque<Front>& front);
/// Where trims over a point of the plane may be found: those of the grid points around it.
std::vector<Eigen::VectorXd> around(const Grid& grid, const Eigen::Vector2d& p);
/// Newton from many starts at a few grid points.
void seed(Grid& grid, std::deque<Front>& front);
/// Spreads every trim of the front to its neighbours until none is new; what stops on the way is an
/// edge.
std::vector<Edge> spread(Grid& grid, std::deque<Front>& front);

}  // namespace tiltrim
