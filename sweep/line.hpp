/// One line of the grid, along its last axis. Internal to sweep/.
#pragma once

#include <complex>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "sweep/neighbour.hpp"

namespace tiltrim {

using Eigenvalues = std::vector<std::complex<double>>;

/// An equilibrium with its eigenvalues in mode order, from which tracking continues.
struct Reference {
  Eigen::MatrixXd A;
  Eigenvalues modes;
};

/// The start of a line, for passes from its first and from its last point: computed along the
/// slower axes before any line is tracked, so that lines are independent of one another.
struct LineStart {
  GridPlace place;  ///< of the first point
  GridTrim first;
  std::optional<OperatingPoint> last;
  std::optional<Reference> reference;    ///< the line's first point in mode order
  std::vector<std::uint8_t> confidence;  ///< confidence of that order
  /// φ of the last axis at all points, if it is known to be that of the line before.
  std::shared_ptr<const std::vector<double>> phi{};
};

/// The points of a line in order, as in SweepMap.
struct LinePoints {
  std::vector<std::int8_t> status, verdict, second_branch;
  std::vector<std::int16_t> reason;
  std::vector<std::string> reasons{""};
  std::vector<double> residual, spectral_abscissa, damping, state, input, eigenvalue_re,
      eigenvalue_im;
  std::vector<std::uint8_t> confidence;
  std::vector<std::uint64_t> second;  ///< positions on the line of the points with a second branch
  std::vector<double> second_state, second_input, second_re, second_im;
  std::vector<std::int8_t> second_verdict;
};

/// φ of the last axis at all points of a line with these other parameters; empty where the
/// structure does not hold.
std::vector<double> phi_along(const Prepared& sweep, OperatingPoint at);

/// Number of lines that are best walked together: Model::model_lanes, or 1 without Model::lanes.
std::size_t lines_together(const Prepared& sweep);

/// Walks up to Model::model_lanes lines. Overwrites every number of `points`; their memory is
/// reused.
void walk_lines(const Prepared& sweep, const std::vector<const LineStart*>& starts,
                const std::vector<LinePoints*>& points);

/// The verdicts of a line, as in LinePoints; `affine` and the shares of its points where one
/// polynomial gave them: the matrices are affine in φ and all points have one equilibrium.
struct JudgedLine {
  std::vector<std::int8_t> verdicts{};
  std::optional<AffineLine> affine{};
  std::vector<double> shares{};
};
/// The verdicts of walk_lines() without its other numbers, of up to Model::model_lanes lines;
/// the memory of `judged` is reused.
void judge_lines(const Prepared& sweep, std::span<const LineStart> starts,
                 std::vector<JudgedLine>& judged);

/// The eigenvalues of B in mode order, confidences (255: certain); `between` as in link().
struct Ordered {
  Eigenvalues modes;
  std::vector<std::uint8_t> confidence;
};
Ordered in_order(const Reference& from, const Eigenvalues& predicted, const Eigen::MatrixXd& B,
                 const Eigenvalues& eigenvalues,
                 const std::function<std::optional<Eigen::MatrixXd>(double)>& between);

/// Trims at fractions of the way from one equilibrium to another, for link().
std::function<std::optional<Eigen::MatrixXd>(double)> trims_between(const Prepared& sweep,
                                                                    const GridPlace& from,
                                                                    const GridPlace& to,
                                                                    const OperatingPoint& near);

/// Eigenvalues of one matrix; empty if they cannot be computed.
Eigenvalues eigenvalues_of(const Eigen::MatrixXd& A);

}  // namespace tiltrim
