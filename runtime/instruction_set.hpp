/// The instruction sets for which SIMD kernels are compiled, and their selection at run time.
/// Internal to tiltrim.
#pragma once

#include <cstddef>

namespace tiltrim {

enum class InstructionSet { scalar, baseline, avx2, avx512 };
const char* name_of(InstructionSet set);  ///< "scalar", "baseline", ...

/// The best instruction set of the processor, or that of the environment variable TILTRIM_SIMD.
/// Throws std::invalid_argument if that names an unknown or unsupported one.
InstructionSet chosen();

/// Selects the version of a kernel to run.
template <class Kernel>
Kernel* chosen(Kernel* scalar, Kernel* baseline, Kernel* avx2, Kernel* avx512) {
  Kernel* const kernels[] = {scalar, baseline, avx2, avx512};
  return kernels[static_cast<std::size_t>(chosen())];
}

}  // namespace tiltrim
