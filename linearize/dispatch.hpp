/// The SIMD kernels, compiled once for each instruction set.
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

namespace lanes_scalar {
void eigenvalues(const EigenvalueTask& task);
}
namespace lanes_baseline {
void eigenvalues(const EigenvalueTask& task);
}
#ifdef TILTRIM_X86
namespace lanes_avx2 {
void eigenvalues(const EigenvalueTask& task);
}
namespace lanes_avx512 {
void eigenvalues(const EigenvalueTask& task);
}
#else  // never selected there
namespace lanes_avx2 = lanes_baseline;
namespace lanes_avx512 = lanes_baseline;
#endif

}  // namespace tiltrim
