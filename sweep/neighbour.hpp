/// A trim moved from point to point of the grid by Newton. Internal to sweep/ and tune/.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "sweep/prepared.hpp"

namespace tiltrim {

/// A verified equilibrium, or why there is none.
struct GridTrim {
  TrimStatus status = TrimStatus::not_found;
  std::string message;
  OperatingPoint at;
  Eigen::VectorXd outputs;
  Eigen::MatrixXd slopes;  ///< ∂[f; h]/∂along
  double residual = 0.0;   ///< scaled

  bool valid() const { return is_equilibrium(status); }
  Eigen::MatrixXd A(const Prepared& sweep) const {
    return slopes.topLeftCorner(sweep.states(), sweep.states());
  }
};

/// Newton from the unknowns that `e.at` has, its other numbers given. Without damping: what
/// does not come to rest within limits is not this neighbour's. False: no equilibrium reached, and
/// `e.message` says in short why.
bool settle(const Prepared& sweep, GridTrim& e);

/// The same at the numbers of `place`, or at those given, from the unknowns of `from`; if that
/// fails, from unknowns that give the outputs of `from` there.
std::optional<GridTrim> settle(const Prepared& sweep, const GridPlace& place,
                               const OperatingPoint& from);
std::optional<GridTrim> settle(const Prepared& sweep, const OperatingPoint& numbers,
                               const OperatingPoint& from);

/// From nothing: the request's own trim, one at a time in this process (Ipopt's MUMPS keeps
/// global state).
GridTrim from_nothing(const Prepared& sweep, const GridPlace& place);
GridTrim from_nothing(const Prepared& sweep, const OperatingPoint& numbers);

/// Derivatives and outputs at an equilibrium known before.
GridTrim equilibrium_at(const Prepared& sweep, const OperatingPoint& at);

/// Largest difference of the unknowns over their nominal sizes.
double apart(const Prepared& sweep, const OperatingPoint& a, const OperatingPoint& b);

/// The control effort at a point, by which the point's own equilibrium is chosen.
double effort_at(const Prepared& sweep, const OperatingPoint& at);

/// Value i of those kept beside the state.
double input_at(const Prepared& sweep, const GridTrim& e, std::size_t i);

/// A line along an axis on which ∂f/∂x is affine in φ: from two points of it, all others.
struct AffineLine {
  const Model::Affine* structure = nullptr;
  double phi = 0.0;              ///< at the first point
  Eigen::MatrixXd first, slope;  ///< A = first + (φ - phi) slope
  double inverse = 0.0;          ///< bound of a Newton step over its residual, both scaled
  bool steady = false;           ///< every point has the unknowns of the first
  double residual = 0.0;         ///< scaled, the largest met

  /// φ - phi at these numbers; nothing where the structure does not hold.
  std::optional<double> share(const Eigen::VectorXd& p) const {
    const auto there = structure->phi(p);
    return there ? std::optional(*there - phi) : std::nullopt;
  }
};

/// The structure of the line through `start` along `axis`, if it has one: the equilibria at its
/// ends and in its middle are settled and differentiated, their outputs agree, and the middle's A
/// is the one that the ends give it.
std::optional<AffineLine> affine_line(const Prepared& sweep, const GridPlace& place,
                                      std::size_t axis, const GridTrim& start);

/// Newton with the line's Jacobian: true if the equilibrium is there, with the outputs kept.
bool settle(const Prepared& sweep, const AffineLine& line, GridTrim& e);

}  // namespace tiltrim
