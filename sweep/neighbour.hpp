/// Newton from one grid point's trim to the next. Internal to sweep/ and tune/.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "sweep/prepared.hpp"

namespace tiltrim {

/// A Newton step at round-off, in nominal sizes.
inline constexpr double step_at_rest = 1e-12;

/// A verified equilibrium, or the reason why there is none.
struct GridTrim {
  TrimStatus status = TrimStatus::not_found;
  std::string message;
  OperatingPoint at;
  Eigen::VectorXd outputs;
  Eigen::MatrixXd slopes;  ///< ∂[f; h]/∂along
  bool exact = false;      ///< no difference stands in `slopes`
  double residual = 0.0;   ///< scaled

  bool valid() const { return is_equilibrium(status); }
  Eigen::MatrixXd A(const Prepared& sweep) const {
    return slopes.topLeftCorner(sweep.states(), sweep.states());
  }
};

/// Newton from the unknowns of `e.at`, with its other values given. Undamped: if it does not
/// converge within the limits, the neighbour's equilibrium does not continue here. False: no
/// equilibrium, and `e.message` gives a short reason.
bool settle(const Prepared& sweep, GridTrim& e);

/// The same at the parameters of `place`, or at those given, starting from the unknowns of `from`;
/// if that fails, from unknowns that give the outputs of `from` there.
std::optional<GridTrim> settle(const Prepared& sweep, const GridPlace& place,
                               const OperatingPoint& from);
std::optional<GridTrim> settle(const Prepared& sweep, const OperatingPoint& numbers,
                               const OperatingPoint& from);

/// A full trim without a starting point, one at a time in this process (Ipopt's MUMPS keeps
/// global state).
GridTrim from_nothing(const Prepared& sweep, const GridPlace& place);
GridTrim from_nothing(const Prepared& sweep, const OperatingPoint& numbers);

/// Derivatives and outputs at a known equilibrium.
GridTrim equilibrium_at(const Prepared& sweep, const OperatingPoint& at);

/// Largest difference of the unknowns over their nominal sizes.
double apart(const Prepared& sweep, const OperatingPoint& a, const OperatingPoint& b);

/// The cost at a point, by which one of several equilibria is chosen.
double effort_at(const Prepared& sweep, const OperatingPoint& at);

/// Value i of those stored with the state.
double input_at(const Prepared& sweep, const GridTrim& e, std::size_t i);

/// A line along an axis on which ∂f/∂x is affine in φ: two points determine all others.
struct AffineLine {
  const Model::Affine* structure = nullptr;
  double phi = 0.0;              ///< at the first point
  Eigen::MatrixXd first, slope;  ///< A = first + (φ - phi) slope
  double inverse = 0.0;          ///< bound of the ratio of Newton step to residual, both scaled
  bool steady = false;           ///< every point has the same unknowns
  double residual = 0.0;         ///< scaled, the largest found

  /// φ - phi at these parameters; empty where the structure does not hold.
  std::optional<double> share(const Eigen::VectorXd& p) const {
    const auto there = structure->phi(p);
    return there ? std::optional(*there - phi) : std::nullopt;
  }
};

/// The structure of the line through `start` along `axis`, if it has one: the equilibria at its
/// ends and in its middle are computed and differentiated, their outputs must agree, and A in the
/// middle must equal the interpolation of the ends.
std::optional<AffineLine> affine_line(const Prepared& sweep, const GridPlace& place,
                                      std::size_t axis, const GridTrim& start);

/// Newton with the line's Jacobian: true if an equilibrium with the same outputs is found.
bool settle(const Prepared& sweep, const AffineLine& line, GridTrim& e);

}  // namespace tiltrim
