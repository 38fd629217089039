/// @file
/// Stability over two gains at a fixed trim, and where a line through it crosses the boundary.
#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

#include "linearize/modes.hpp"

namespace tiltrim {

/// A(a, b) = A0 + a A1 + b A2 with A1 and A2 of rank one (or zero): then det(sI - A) is bi-affine
/// in a and b. 16 states at most.
struct AffineFamily {
  Eigen::MatrixXd A0, A1, A2;  ///< n x n each
};

/// Verdicts at every (a[i], b[j]), number i b.size() + j: coefficients by the affine polynomial,
/// Routh's test within bounds of their errors, and what that leaves undecided by modes(). Throws
/// std::invalid_argument if A1 or A2 is not of rank one (to 1e-10 of its size; what is left over
/// counts as an error), sizes do not fit, or something is not finite.
[[nodiscard]] std::vector<Verdict> stability_map(const AffineFamily& family,
                                                 const std::vector<double>& a,
                                                 const std::vector<double>& b);
/// The same into the caller's a.size() b.size() verdicts.
void stability_map(const AffineFamily& family, std::span<const double> a, std::span<const double> b,
                   std::span<Verdict> answer);

/// A value of t at which A0 + t A1 has an eigenvalue on the imaginary axis.
struct LineCrossing {
  double t = 0.0;          ///< where, of the line
  double frequency = 0.0;  ///< rad/s; 0: a real eigenvalue
  double error = 0.0;      ///< of t
};

/// What line_crossings() answers.
struct LineCrossings {
  std::vector<LineCrossing> crossings;  ///< by rising t
  bool complete = true;                 ///< none is missing
};
/// Every crossing of the line A0 + t A1 (A1 of rank one) with the stability boundary for t in
/// [from, to], by rising t: all of them, since with p(s) = p0(s) + t p1(s) they are the positive
/// real roots of Im(p0(iω) conj p1(iω)) = 0, a polynomial in ω² (D-decomposition). `complete` is
/// false where rounding leaves doubt whether there are more: where two meet, where a pair touches
/// the axis without crossing it, where an eigenvalue stays on it for every t. Throws
/// std::invalid_argument as stability_map() does, and unless from < to.
[[nodiscard]] LineCrossings line_crossings(const Eigen::MatrixXd& A0, const Eigen::MatrixXd& A1,
                                           double from, double to);

}  // namespace tiltrim
