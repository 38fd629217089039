/// The instruction sets for which SIMD kernels are compiled, and their selection at run time.
/// Internal to tiltrim.
#pragma once

namespace tiltrim {

enum class InstructionSet { scalar, baseline, avx2, avx512 };
const char* name_of(InstructionSet set);  ///< "scalar", "baseline", ...

/// The best instruction set of the processor, or that of the environment variable TILTRIM_SIMD.
/// Throws std::invalid_argument if that names an unknown or unsupported one.
InstructionSet chosen();

/// The version of a kernel to run: `of` of the chosen instruction set, as in
/// `chosen([]<InstructionSet set>() { return &newton_step<set>; })`.
template <class Versions>
auto chosen(const Versions& of) {
  switch (chosen()) {
    case InstructionSet::scalar:
      return of.template operator()<InstructionSet::scalar>();
#ifdef TILTRIM_X86
    case InstructionSet::avx2:
      return of.template operator()<InstructionSet::avx2>();
    case InstructionSet::avx512:
      return of.template operator()<InstructionSet::avx512>();
#endif
    default:
      return of.template operator()<InstructionSet::baseline>();
  }
}

}  // namespace tiltrim
