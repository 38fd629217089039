/// A preprocessed sweep request, and the places of its grid. Internal to sweep/, tune/ and study/.
#pragma once

#include <string>
#include <vector>

#include "sweep/sweep.hpp"
#include "trim/problem.hpp"

namespace tiltrim {

/// A preprocessed request: indices instead of names.
struct Prepared {
  Prepared(const SweepRequest& request, const std::vector<SweepAxis>& axes,
           const TrimOptions& trimming);

  const SweepRequest& request;
  const std::vector<SweepAxis>& axes;
  TrimOptions trimming;
  Problem problem;                     ///< its structure; each caller of its functions has a copy
  std::vector<Eigen::Index> along;     ///< variables to differentiate by: states, other unknowns
  std::vector<Eigen::Index> unknowns;  ///< positions in `along`
  std::vector<std::vector<Eigen::Index>> moved;  ///< [axis][column]: variable, or -1
  std::vector<const Model::Affine*> affine;      ///< [axis]: its structure, if it sets no others
  std::vector<Eigen::Index> inputs;  ///< stored with the state: input i, or inputs + output i

  bool output_equations = false;  ///< some equation involves an output

  const Model& model() const { return request.model; }
  Eigen::Index states() const { return std::ssize(request.model.states); }
};

/// A position in the grid: along each axis from 0 to size - 1, integer at grid points.
using GridPlace = std::vector<double>;

/// The coordinate of an axis at a position, in the axis's unit.
double coordinate(const SweepAxis& axis, double position);
/// SI values of its columns; between two grid points as SweepAxis::between defines.
std::vector<double> values_at(const SweepAxis& axis, double position);
/// Sets the variables of the axis to these.
void move_to(const Prepared& sweep, std::size_t axis, double position, OperatingPoint& at);
/// The guess with the values of all axes set.
OperatingPoint numbers_at(const Prepared& sweep, const GridPlace& place);

/// The spec without equal bounds on variables that an axis sets: the guess already contains them.
/// Throws std::invalid_argument if one of these variables is free.
TrimSpec free_of(TrimSpec spec, const Model& model, const std::vector<SweepAxis>& axes);

}  // namespace tiltrim
