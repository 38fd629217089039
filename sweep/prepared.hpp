/// A sweep's request made ready, and the places of its grid. Internal to sweep/ and tune/.
#pragma once

#include <string>
#include <vector>

#include "sweep/sweep.hpp"
#include "trim/problem.hpp"

namespace tiltrim {

/// A request made ready: positions instead of names.
struct Prepared {
  Prepared(const SweepRequest& request, const std::vector<SweepAxis>& axes,
           const TrimOptions& trimming);

  const SweepRequest& request;
  const std::vector<SweepAxis>& axes;
  TrimOptions trimming;
  Problem problem;                     ///< its structure; each caller of its functions has a copy
  std::vector<Eigen::Index> along;     ///< variables to differentiate along: states, other unknowns
  std::vector<Eigen::Index> unknowns;  ///< positions in `along`
  std::vector<std::vector<Eigen::Index>> moved;  ///< [axis][column]: variable, -1: none
  std::vector<const Model::Affine*> affine;      ///< [axis]: its structure, if that is all it moves
  std::vector<Eigen::Index> inputs;  ///< kept beside the state: input i, or inputs + output i

  bool output_equations = false;  ///< some equation is an output's

  const Model& model() const { return request.model; }
  Eigen::Index states() const { return std::ssize(request.model.states); }
};

/// A place in the grid: along each axis a position from 0 to size - 1, whole at the grid's points.
using GridPlace = std::vector<double>;

/// The coordinate of the axis itself at a position, in its own unit.
double coordinate(const SweepAxis& axis, double position);
/// Sets the variables that the axis moves: between two points of the grid as SweepAxis::between
/// says.
void move_to(const Prepared& sweep, std::size_t axis, double position, OperatingPoint& at);
/// The guess with all axes' numbers set.
OperatingPoint numbers_at(const Prepared& sweep, const GridPlace& place);

/// The spec without bounds that have equal ends on variables that an axis moves: they say only what
/// the guess has said. Throws std::invalid_argument if one of the variables is free.
TrimSpec free_of(TrimSpec spec, const Model& model, const std::vector<SweepAxis>& axes);

}  // namespace tiltrim
