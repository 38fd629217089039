#include "runtime/instruction_set.hpp"

#include <fmt/core.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cstddef>
#include <cstdlib>
#include <stdexcept>
#include <string_view>
#include <vector>

namespace tiltrim {

namespace {

constexpr const char* set_names[] = {"scalar", "baseline", "avx2", "avx512"};

// The instruction sets supported by this processor, the best one last.
std::vector<std::string_view> available() {
  std::vector<std::string_view> sets = {"scalar", "baseline"};
#ifdef TILTRIM_X86
  const bool avx2 = __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma");
  if (avx2) sets.push_back("avx2");
  if (avx2 && __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512dq") &&
      __builtin_cpu_supports("avx512vl") && __builtin_cpu_supports("avx512bw"))
    sets.push_back("avx512");
#endif
  return sets;
}

}  // namespace

const char* name_of(InstructionSet set) { return set_names[static_cast<std::size_t>(set)]; }

InstructionSet chosen() {
  static const std::vector<std::string_view> sets = available();
  const char* asked = std::getenv("TILTRIM_SIMD");
  const std::string_view name = asked && *asked ? std::string_view(asked) : sets.back();
  if (std::ranges::find(sets, name) == sets.end())
    throw std::invalid_argument(
        fmt::format("TILTRIM_SIMD is '{}'; this processor has: {}", name, fmt::join(sets, ", ")));
  return static_cast<InstructionSet>(std::ranges::find(set_names, name) -
                                     std::ranges::begin(set_names));
}

}  // namespace tiltrim
