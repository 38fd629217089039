/// The SIMD kernels, compiled once for each instruction set, and their selection at run time.
/// Internal to linearize/.
#pragma once

#include <cstddef>

namespace tiltrim {

enum class InstructionSet { scalar, baseline, avx2, avx512 };

/// The best instruction set of the processor, or that of the environment variable TILTRIM_SIMD.
/// Throws std::invalid_argument if that names an unknown or unsupported one.
InstructionSet chosen();

/// Selects the version of a kernel to run.
template <class Kernel>
Kernel* chosen(Kernel* scalar, Kernel* baseline, Kernel* avx2, Kernel* avx512) {
  Kernel* const kernels[] = {scalar, baseline, avx2, avx512};
  return kernels[static_cast<std::size_t>(chosen())];
}

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
