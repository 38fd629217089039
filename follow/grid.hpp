/// Sheets of trims over a grid of two parameters. Internal to follow/.
#pragma once

#include <deque>

#include "follow/border.hpp"
#include "follow/envelope.hpp"

namespace tiltrim {

/// (z, x, y) of the trims found at each grid point, x fastest; and of trims just beyond a limit,
/// from which a sheet may return inside.
struct Sheets {
  std::vector<std::vector<Eigen::VectorXd>> trims, beyond;
  bool more = false;  ///< some were left out: a grid point has most_sheets already
};

/// All in scaled unknowns: `fixed` is the problem at a point of the plane, `moving` over the plane.
/// A copy evaluates problems of its own and shares the sheets.
struct Grid {
  const EnvelopeAxis &x, &y;
  const EnvelopeOptions& options;
  mutable Problem fixed;
  Problem moving;
  Plane plane;
  Sheets& sheets;

  Grid(const Model& model, const TrimSpec& spec, const TrimSpec& over, const OperatingPoint& guess,
       const EnvelopeAxis& along, const EnvelopeAxis& up, const EnvelopeOptions& o, Sheets& found);
  Grid(const Grid& other);
  Grid& operator=(const Grid&) = delete;

  Eigen::Index n() const { return fixed.n(); }
  std::size_t node(int i, int j) const {
    return std::size_t(j) * std::size_t(x.count) + std::size_t(i);
  }
  Eigen::Vector2d place(int i, int j) const;                     ///< of a grid point, scaled
  void put(const Eigen::Vector2d& p) const;                      ///< sets the parameters of `fixed`
  bool within(const Eigen::VectorXd& z, const Values& v) const;  ///< inside the limits
};

/// Calls work(own, k) for k = 0 .. count - 1, on several threads if the options allow it, each with
/// its own copy of the grid.
void for_all(const Grid& grid, std::size_t count,
             const std::function<void(const Grid& own, std::size_t k)>& work);

enum class Settled { trim, outside, lost };
/// Plain Newton from a neighbouring trim; the caller has set the parameters.
Settled settle(const Grid& grid, Eigen::VectorXd& z, int cap);

/// The end of a sheet between two grid points, to be examined further.
struct Edge {
  Eigen::VectorXd from;
  int at_i, at_j, i, j;
};

struct Front {
  int i, j;
  bool within;
  Eigen::VectorXd y;
};

/// Adds a trim at a grid point to the front, unless it is known or one too many.
bool add(Grid& grid, int i, int j, const Eigen::VectorXd& z, bool within, std::deque<Front>& front);
/// Starting points for trims at a point of the plane: the trims at the grid points around it.
std::vector<Eigen::VectorXd> around(const Grid& grid, const Eigen::Vector2d& p);
/// Newton from many starts at a few grid points.
void seed(Grid& grid, std::deque<Front>& front);
/// Extends every trim of the front to its neighbours until no new trim is found; returns the edges
/// where sheets end.
std::vector<Edge> spread(Grid& grid, std::deque<Front>& front);

}  // namespace tiltrim
