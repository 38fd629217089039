/// Lines along which the matrices are affine in φ, and their verdicts by one polynomial. Internal
/// to sweep/.
#pragma once

#include <vector>

#include "linearize/batch.hpp"
#include "sweep/line.hpp"

namespace tiltrim {

/// The matrices of the points with these multiples of the line's slope.
void fill_matrices(const AffineLine& line, const std::vector<double>& shares, MatrixBatch& A);

/// The multiples of the slope at all points; empty where the structure does not hold.
std::vector<double> shares_along(const Prepared& sweep, const LineStart& start,
                                 const AffineLine& line);

/// The verdicts of verdicts() on the matrices with these multiples of the slope, most of them by
/// one polynomial for the whole line. False if the slope is not of rank one.
bool judge_by_polynomial(const AffineLine& line, const std::vector<double>& shares,
                         std::vector<Verdict>& answer);

}  // namespace tiltrim
