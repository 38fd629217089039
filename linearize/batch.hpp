/// @file
/// Eigenvalues and stability verdicts of many small matrices at once, across SIMD lanes; stability
/// over two gains at a fixed trim, and where a line through them crosses the boundary.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "linearize/modes.hpp"

namespace tiltrim {

/// Largest matrix the batch takes.
inline constexpr Eigen::Index largest_batch_matrix = 16;

/// How one matrix of a batch was answered.
enum class LaneStatus : std::uint8_t {
  converged,      ///< by the kernel across lanes
  fallback,       ///< by eigenvalues(): the lane met its cap or is badly conditioned
  not_converged,  ///< neither; its eigenvalues are NaN
  not_finite,     ///< the matrix has an entry that is not; its eigenvalues are NaN
};
std::string to_string(LaneStatus status);  ///< "converged", "fallback", ...

/// Matrices of one size, entry by entry: entry (i, j) of matrix k is entries[(i n + j) count + k].
struct MatrixBatch {
  Eigen::Index n = 0, count = 0;  ///< rows of each, and how many there are
  std::vector<double> entries;    ///< n n count of them

  MatrixBatch() = default;
  /// So many, all zero, of so many rows.
  MatrixBatch(Eigen::Index size, Eigen::Index matrices)
      : n(size), count(matrices), entries(std::size_t(size * size * matrices)) {}
  /// Entry (i, j) of matrix k.
  double& operator()(Eigen::Index i, Eigen::Index j, Eigen::Index k) {
    return entries[std::size_t((i * n + j) * count + k)];
  }
  /// The same, to read.
  double operator()(Eigen::Index i, Eigen::Index j, Eigen::Index k) const {
    return entries[std::size_t((i * n + j) * count + k)];
  }
  void set(Eigen::Index k, const Eigen::MatrixXd& A);  ///< matrix k becomes A, n x n
  Eigen::MatrixXd matrix(Eigen::Index k) const;        ///< matrix k, n x n
};

/// Eigenvalue i of matrix k: re[i count + k], im[i count + k]. A pair stands together, the
/// positive imaginary part first; the order is otherwise the kernel's, and a matrix has the same
/// bits whatever its neighbours.
struct BatchEigenvalues {
  std::vector<double> re, im;      ///< n count of each, 1/s
  std::vector<LaneStatus> status;  ///< one per matrix
};

/// How eigenvalues() of a batch goes about it.
struct BatchOptions {
  int max_iterations = 40;       ///< QR steps for each eigenvalue, across lanes
  int fallback_iterations = 40;  ///< and of the fallback
};

/// Balancing, Hessenberg form and shifted QR with deflation, eigenvalues alone.
/// Throws std::invalid_argument for n outside 0 .. largest_batch_matrix or entries of wrong size.
void eigenvalues(const MatrixBatch& A, BatchEigenvalues& answer, const BatchOptions& options = {});

/// Stable or not, without eigenvalues where that is certain: characteristic polynomial and Routh's
/// test with running bounds of their errors; undecided lanes go to the eigenvalues and, within
/// their bounds, to modes(). A verdict holds for every matrix whose entries are within entry_error,
/// relative, of those given. Matrices with an entry that is not finite are undecided. Throws as
/// eigenvalues() does, and for an entry_error that is negative or not a number.
void verdicts(const MatrixBatch& A, std::vector<Verdict>& answer, double entry_error = 0.0);

/// The instruction set that the kernels use: "scalar", "baseline", "avx2" or "avx512": the best
/// that the processor has, or the environment's TILTRIM_SIMD if it has that.
std::string instruction_set();

/// What the bits of a result depend on beside the program and its libraries: "fma" where the
/// processor has a fused multiply-add, which the kernels and the C library use, else "no fma".
std::string rounding();

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
