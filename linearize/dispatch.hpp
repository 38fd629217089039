/// The kernels across lanes, compiled once for each instruction set, and which of them to run.
/// Internal to linearize/.
#pragma once

#include <cstddef>

namespace tiltrim {

enum class InstructionSet { scalar, baseline, avx2, avx512 };

/// The best that the processor has, or the environment's TILTRIM_SIMD. Throws
/// std::invalid_argument if that names none, or one that is not there.
InstructionSet chosen();

/// Of one kernel, as compiled for each instruction set, the one to run.
template <class Kernel>
Kernel* chosen(Kernel* scalar, Kernel* baseline, Kernel* avx2, Kernel* avx512) {
  Kernel* const kernels[] = {scalar, baseline, avx2, avx512};
  return kernels[static_cast<std::size_t>(chosen())];
}

/// Eigenvalues of matrices first .. last - 1 of a batch: entries, re, im as in MatrixBatch and
/// BatchEigenvalues.
struct EigenvalueTask {
  const double* entries;
  std::size_t n, count, first, last;
  int max_iterations;  ///< QR steps for each eigenvalue
  double *re, *im;
  unsigned char* status;  ///< a LaneStatus; `fallback` is asked for, not yet done
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
#else  // never chosen there
namespace lanes_avx2 = lanes_baseline;
namespace lanes_avx512 = lanes_baseline;
#endif

}  // namespace tiltrim
