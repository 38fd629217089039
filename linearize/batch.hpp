/// @file
/// Eigenvalues and stability verdicts of many small matrices at once, across SIMD lanes.
#pragma once

#include <Eigen/Core>
#include <cstdint>
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

}  // namespace tiltrim
