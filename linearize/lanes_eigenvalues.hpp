/// The SIMD kernel of eigenvalues, compiled once for each instruction set.
/// Internal to linearize/.
#pragma once

#include <cstddef>

#include "runtime/instruction_set.hpp"

namespace tiltrim {

/// Eigenvalues of matrices first .. last - 1 of a batch: entries, re and im as in MatrixBatch and
/// BatchEigenvalues.
struct EigenvalueTask {
  const double* entries;
  std::size_t n, count, first, last;
  int max_iterations;  ///< QR steps per eigenvalue
  double *re, *im;
  unsigned char* status;  ///< a LaneStatus; `fallback` is requested here, performed by the caller
};

template <InstructionSet>
void eigenvalues(const EigenvalueTask& task);

}  // namespace tiltrim
