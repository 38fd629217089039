/// One line of the grid, along its last axis. Internal to sweep/.
#pragma once

#include <complex>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "sweep/neighbour.hpp"

namespace tiltrim {

using Eigenvalues = std::vector<std::complex<double>>;

/// An equilibrium with its eigenvalues in the order of the modes, to go on from.
struct Reference {
  Eigen::MatrixXd A;
  Eigenvalues modes;
};

/// What a line starts from, walked from its first point and from its last: settled along the slower
/// axes before any line is walked, so that lines do not depend on one another.
struct LineStart {
  GridPlace place;  ///< of the first point
  GridTrim first;
  std::optional<OperatingPoint> last;
  std::optional<Reference> reference;    ///< the line's first point in the order of the modes
  std::vector<std::uint8_t> confidence;  ///< of that order
};

/// The line's points in order, as in SweepMap.
struct LinePoints {
  std::vector<std::int8_t> status, verdict, second_branch;
  std::vector<std::int16_t> reason;
  std::vector<std::string> reasons{""};
  std::vector<double> residual, spectral_abscissa, damping, state, input, eigenvalue_re,
      eigenvalue_im;
  std::vector<std::uint8_t> confidence;
  std::vector<std::uint64_t> second;  ///< positions in the line of the second branch's points
  std::vector<double> second_state, second_input, second_re, second_im;
  std::vector<std::int8_t> second_verdict;
};

/// Every number of `points` is written anew; their memory is used again.
void walk_line(const Prepared& sweep, const LineStart& start, LinePoints& points);

/// The eigenvalues of B in the order of the modes, and how sure that is, 255 for certain;
/// `between` as in link().
struct Ordered {
  Eigenvalues modes;
  std::vector<std::uint8_t> confidence;
};
Ordered in_order(const Reference& from, const Eigenvalues& predicted, const Eigen::MatrixXd& B,
                 const Eigenvalues& eigenvalues,
                 const std::function<std::optional<Eigen::MatrixXd>(double)>& between);

/// Trims at shares of the way from one equilibrium to another, for link().
std::function<std::optional<Eigen::MatrixXd>(double)> trims_between(const Prepared& sweep,
                                                                    const GridPlace& from,
                                                                    const GridPlace& to,
                                                                    const OperatingPoint& near);

/// Eigenvalues of one matrix; empty if there are none to be had.
Eigenvalues eigenvalues_of(const Eigen::MatrixXd& A);

}  // namespace tiltrim
