/// SIMD kernels of Routh's test, compiled once for each instruction set.
/// Internal to linearize/.
#pragma once

#include <cstddef>

#include "runtime/instruction_set.hpp"

namespace tiltrim {

/// A kernel's result for one matrix or point; a Verdict in one byte.
enum class RouthVerdict : unsigned char { stable, unstable, undecided };

/// Matrices first .. last - 1 of a batch, entries as in MatrixBatch.
struct MatrixTask {
  const double* entries;
  std::size_t n, count, first, last;
  double entry_error;     ///< relative, for every entry
  bool balanced;          ///< scale and balance first; otherwise norms must be near one
  RouthVerdict* verdict;  ///< of matrix first, first + 1, ...
};

/// Polynomials sⁿ + Σ cₖ sⁿ⁻ᵏ, cₖ = pₖ + b qₖ within p_errorₖ + |b| q_errorₖ, at each b: k = 1 ..
/// n.
struct LineTask {
  const double *p, *q, *p_error, *q_error;
  std::size_t n;
  const double* b;
  std::size_t count;
  RouthVerdict* verdict;
};

template <InstructionSet>
void routh_of_matrices(const MatrixTask& task);
template <InstructionSet>
void routh_of_line(const LineTask& task);

}  // namespace tiltrim
