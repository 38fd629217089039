/// Eigenvalues and stability verdicts of many small matrices at once, in SIMD lanes; stability over
/// two gains at a fixed trim, and the crossings of a line through the gains with the boundary.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "linearize/modes.hpp"

namespace tiltrim {

/// Largest matrix in a batch.
inline constexpr Eigen::Index largest_batch_matrix = 16;

/// How the eigenvalues of one matrix of a batch were computed.
enum class LaneStatus : std::uint8_t {
  converged,      ///< by the SIMD kernel
  fallback,       ///< by eigenvalues(): iteration limit reached, or badly conditioned
  not_converged,  ///< by neither; its eigenvalues are NaN
  not_finite,     ///< the matrix has a non-finite entry; its eigenvalues are NaN
};
std::string to_string(LaneStatus status);  ///< "converged", "fallback", ...

/// Matrices of one size, entry by entry: entry (i, j) of matrix k is entries[(i n + j) count + k].
struct MatrixBatch {
  Eigen::Index n = 0, count = 0;  ///< rows of each, number of matrices
  std::vector<double> entries;    ///< n * n * count values

  MatrixBatch() = default;
  /// `matrices` zero matrices of `size` rows.
  MatrixBatch(Eigen::Index size, Eigen::Index matrices)
      : n(size), count(matrices), entries(std::size_t(size * size * matrices)) {}
  /// Entry (i, j) of matrix k.
  double& operator()(Eigen::Index i, Eigen::Index j, Eigen::Index k) {
    return entries[std::size_t((i * n + j) * count + k)];
  }
  /// The same, read-only.
  double operator()(Eigen::Index i, Eigen::Index j, Eigen::Index k) const {
    return entries[std::size_t((i * n + j) * count + k)];
  }
  void set(Eigen::Index k, const Eigen::MatrixXd& A);  ///< sets matrix k to A, n x n
  Eigen::MatrixXd matrix(Eigen::Index k) const;        ///< matrix k, n x n
};

/// Eigenvalue i of matrix k: re[i count + k], im[i count + k]. A pair is adjacent, positive
/// imaginary part first; otherwise the order is that of the kernel. Results for a matrix are
/// bitwise independent of the other matrices.
struct BatchEigenvalues {
  std::vector<double> re, im;      ///< n * count values each, 1/s
  std::vector<LaneStatus> status;  ///< one per matrix
};

/// Options of eigenvalues() of a batch.
struct BatchOptions {
  int max_iterations = 40;       ///< QR steps per eigenvalue, in lanes
  int fallback_iterations = 40;  ///< the same for the fallback
};

/// Balancing, Hessenberg form and shifted QR with deflation, eigenvalues only.
/// Throws std::invalid_argument for n outside 0 .. largest_batch_matrix or entries of wrong size.
void eigenvalues(const MatrixBatch& A, BatchEigenvalues& answer, const BatchOptions& options = {});

/// Stability, without eigenvalues if possible: characteristic polynomial and Routh's test with
/// running error bounds; undecided lanes are decided by the eigenvalues or, within their bounds, by
/// modes(). A verdict holds for every matrix whose entries differ from the given ones by at most
/// the relative entry_error. Matrices with a non-finite entry are undecided. Throws as
/// eigenvalues() does, and for an entry_error that is negative or NaN.
void verdicts(const MatrixBatch& A, std::vector<Verdict>& answer, double entry_error = 0.0);

/// The instruction set of the kernels: "scalar", "baseline", "avx2" or "avx512": the best of the
/// processor, or that of the environment variable TILTRIM_SIMD if available.
std::string instruction_set();

/// The rounding on which results depend, besides the program and its libraries: "fma" if the
/// processor has fused multiply-add, used by the kernels and the C library, otherwise "no fma".
std::string rounding();

/// A(a, b) = A0 + a A1 + b A2 with A1 and A2 of rank one (or zero): then det(sI - A) is bi-affine
/// in a and b. 16 states at most.
struct AffineFamily {
  Eigen::MatrixXd A0, A1, A2;  ///< each n x n
};

/// Options of stability_map().
struct StabilityMapOptions {
  /// A verdict holds for every matrix whose entries differ from A(a, b) by at most this share of
  /// |A0| + max |a| |A1| + max |b| |A2|.
  double entry_error = 0.0;
  bool by_modes = true;  ///< false: leaves the points that Routh's test does not decide undecided
};

/// Verdicts at every (a[i], b[j]), with index i b.size() + j: coefficients by the affine
/// polynomial, Routh's test within error bounds, and modes() for undecided points. Throws
/// std::invalid_argument if A1 or A2 is not of rank one (to 1e-10 of its size; the remainder counts
/// as an error), if sizes do not match, if a value is not finite, or for an entry_error that is
/// negative or NaN.
[[nodiscard]] std::vector<Verdict> stability_map(const AffineFamily& family,
                                                 const std::vector<double>& a,
                                                 const std::vector<double>& b,
                                                 const StabilityMapOptions& options = {});
/// The same, written to the caller's array of a.size() b.size() verdicts.
void stability_map(const AffineFamily& family, std::span<const double> a, std::span<const double> b,
                   std::span<Verdict> answer, const StabilityMapOptions& options = {});

/// A value of t at which A0 + t A1 has an eigenvalue on the imaginary axis.
struct LineCrossing {
  double t = 0.0;          ///< position on the line
  double frequency = 0.0;  ///< rad/s; 0: a real eigenvalue
  double error = 0.0;      ///< error bound of t
};

/// The result of line_crossings().
struct LineCrossings {
  std::vector<LineCrossing> crossings;  ///< by ascending t
  bool complete = true;                 ///< no crossing is missing
};
/// All crossings of the line A0 + t A1 (A1 of rank one) with the stability boundary for t in [from,
/// to], by ascending t: with p(s) = p0(s) + t p1(s) they are the positive real roots of Im(p0(iω)
/// conj p1(iω)) = 0, a polynomial in ω² (D-decomposition). `complete` is false if rounding leaves
/// doubt whether there are more: where two crossings coincide, where a pair touches the axis
/// without crossing it, where an eigenvalue is on the axis for every t. Throws
/// std::invalid_argument as stability_map() does, and unless from < to.
[[nodiscard]] LineCrossings line_crossings(const Eigen::MatrixXd& A0, const Eigen::MatrixXd& A1,
                                           double from, double to);

}  // namespace tiltrim
