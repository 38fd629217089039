/// Lanes: as many doubles as a register holds, processed together. A source that includes this is
/// compiled once for each instruction set, with everything in namespace TILTRIM_LANES; it must not
/// include inline functions that the linker could merge into the rest of the program.
/// Internal to tiltrim.
#pragma once

#include <experimental/simd>
#ifdef __FMA__
#include <immintrin.h>
#endif

#ifndef TILTRIM_LANES
#error "compiled once for each instruction set: see cmake/tiltrim_lanes.cmake"
#endif

namespace tiltrim::TILTRIM_LANES {

#ifdef TILTRIM_LANES_SCALAR
using Lanes = std::experimental::simd<double, std::experimental::simd_abi::scalar>;
#else
using Lanes = std::experimental::native_simd<double>;
#endif
using LaneMask = Lanes::mask_type;
inline constexpr std::size_t lane_count = Lanes::size();

/// a b + c, rounded once wherever the processor can, so that every instruction set gives the same
/// bits. Not std::experimental::fma: without the instruction it calls the library for each lane,
/// and with it g++ 12 sometimes processes the lanes one by one.
[[gnu::always_inline]] inline Lanes multiply_add(const Lanes& a, const Lanes& b, const Lanes& c) {
#if defined __AVX512F__ && !defined TILTRIM_LANES_SCALAR
  return Lanes(_mm512_fmadd_pd(__m512d(a), __m512d(b), __m512d(c)));
#elif defined __FMA__ && !defined TILTRIM_LANES_SCALAR
  return Lanes(_mm256_fmadd_pd(__m256d(a), __m256d(b), __m256d(c)));
#elif defined __x86_64__
  // For processors without the instruction, which round twice here: rounding once in software would
  // take several hundred times as long.
  if (!__builtin_cpu_supports("fma")) return a * b + c;
#ifdef TILTRIM_LANES_SCALAR
  double sum = a[0];
  asm("vfmadd213sd %2, %1, %0" : "+x"(sum) : "x"(double(b[0])), "x"(double(c[0])));
#else
  using Register [[gnu::vector_size(sizeof(Lanes))]] = double;
  auto sum = __builtin_bit_cast(Register, a);
  asm("vfmadd213pd %2, %1, %0"
      : "+x"(sum)
      : "x"(__builtin_bit_cast(Register, b)), "x"(__builtin_bit_cast(Register, c)));
#endif
  return __builtin_bit_cast(Lanes, sum);
#else
  return Lanes([&](auto i) { return __builtin_fma(a[i], b[i], c[i]); });
#endif
}

/// a where the mask is set, otherwise b.
[[gnu::always_inline]] inline Lanes choose(const LaneMask& mask, const Lanes& a, Lanes b) {
  where(mask, b) = a;
  return b;
}

/// Several registers interleaved: while one waits for a square root, the others work. `Pack` has
/// the arithmetic operators that an algorithm needs, `PackMask` the logical ones.
template <int groups>
struct PackMask {
  LaneMask of[groups];

  [[gnu::always_inline]] friend PackMask operator&&(PackMask a, const PackMask& b) {
    for (int g = 0; g < groups; ++g) a.of[g] = a.of[g] && b.of[g];
    return a;
  }
  [[gnu::always_inline]] friend PackMask operator||(PackMask a, const PackMask& b) {
    for (int g = 0; g < groups; ++g) a.of[g] = a.of[g] || b.of[g];
    return a;
  }
  [[gnu::always_inline]] friend PackMask operator!(PackMask a) {
    for (int g = 0; g < groups; ++g) a.of[g] = !a.of[g];
    return a;
  }
  [[gnu::always_inline]] friend bool any_of(const PackMask& a) {
    LaneMask any = a.of[0];
    for (int g = 1; g < groups; ++g) any = any || a.of[g];
    return std::experimental::any_of(any);
  }
};

template <int groups>
struct Pack {
  Lanes of[groups];

  Pack() = default;
  [[gnu::always_inline]] Pack(double value) {
    for (int g = 0; g < groups; ++g) of[g] = value;
  }
  [[gnu::always_inline]] void load(const double* from) {
    for (int g = 0; g < groups; ++g)
      of[g].copy_from(from + g * lane_count, std::experimental::element_aligned);
  }
  [[gnu::always_inline]] void store(double* to) const {
    for (int g = 0; g < groups; ++g)
      of[g].copy_to(to + g * lane_count, std::experimental::element_aligned);
  }
  [[gnu::always_inline]] friend Pack operator+(Pack a, const Pack& b) {
    for (int g = 0; g < groups; ++g) a.of[g] += b.of[g];
    return a;
  }
  [[gnu::always_inline]] friend Pack operator-(Pack a, const Pack& b) {
    for (int g = 0; g < groups; ++g) a.of[g] -= b.of[g];
    return a;
  }
  [[gnu::always_inline]] friend Pack operator*(Pack a, const Pack& b) {
    for (int g = 0; g < groups; ++g) a.of[g] *= b.of[g];
    return a;
  }
  [[gnu::always_inline]] friend Pack operator/(Pack a, const Pack& b) {
    for (int g = 0; g < groups; ++g) a.of[g] /= b.of[g];
    return a;
  }
  [[gnu::always_inline]] Pack operator-() const {
    Pack a;
    for (int g = 0; g < groups; ++g) a.of[g] = -of[g];
    return a;
  }
  [[gnu::always_inline]] friend Pack multiply_add(const Pack& a, const Pack& b, const Pack& c) {
    Pack r;
    for (int g = 0; g < groups; ++g) r.of[g] = multiply_add(a.of[g], b.of[g], c.of[g]);
    return r;
  }
  [[gnu::always_inline]] friend Pack abs(Pack a) {
    for (int g = 0; g < groups; ++g) a.of[g] = std::experimental::abs(a.of[g]);
    return a;
  }
  [[gnu::always_inline]] friend Pack sqrt(Pack a) {
    for (int g = 0; g < groups; ++g) a.of[g] = std::experimental::sqrt(a.of[g]);
    return a;
  }
  [[gnu::always_inline]] friend Pack max(Pack a, const Pack& b) {
    for (int g = 0; g < groups; ++g) a.of[g] = std::experimental::max(a.of[g], b.of[g]);
    return a;
  }
  [[gnu::always_inline]] friend PackMask<groups> operator<(const Pack& a, const Pack& b) {
    PackMask<groups> m;
    for (int g = 0; g < groups; ++g) m.of[g] = a.of[g] < b.of[g];
    return m;
  }
  [[gnu::always_inline]] friend PackMask<groups> operator<=(const Pack& a, const Pack& b) {
    PackMask<groups> m;
    for (int g = 0; g < groups; ++g) m.of[g] = a.of[g] <= b.of[g];
    return m;
  }
  [[gnu::always_inline]] friend PackMask<groups> operator==(const Pack& a, const Pack& b) {
    PackMask<groups> m;
    for (int g = 0; g < groups; ++g) m.of[g] = a.of[g] == b.of[g];
    return m;
  }
};

/// a where the mask is set, otherwise b.
template <int groups>
[[gnu::always_inline]] inline Pack<groups> choose(const PackMask<groups>& mask,
                                                  const Pack<groups>& a, Pack<groups> b) {
  for (int g = 0; g < groups; ++g) where(mask.of[g], b.of[g]) = a.of[g];
  return b;
}

}  // namespace tiltrim::TILTRIM_LANES
