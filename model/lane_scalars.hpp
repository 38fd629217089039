/// The scalars of the physics in SIMD lanes: numbers and dual numbers of several points at once.
/// Compiled once for each instruction set (cmake/tiltrim_lanes.cmake). No product is fused with a
/// sum, so that every instruction set gives the same bits; values and derivatives follow the
/// formulas of double and Dual. Internal to vehicles/.
#pragma once

#include <cstddef>

#include "model/scalar.hpp"
#include "runtime/lanes.hpp"

namespace tiltrim::TILTRIM_LANES {

/// One number of `lane_count` points.
using Number = Pack<1>;
using NumberMask = PackMask<1>;

/// Sine and cosine, within an ulp of the C library's; NaN beyond 1e5 rad. The argument less a
/// multiple of π/2, in two parts, goes into the polynomials of fdlibm.                         [9]
struct SineCosine {
  Number sin, cos;
};

[[gnu::always_inline]] inline SineCosine sine_cosine(const Number& x) {
  constexpr double half_turns = 6.36619772367581382433e-01;  // 2/π
  constexpr double high = 1.57079632673412561417e+00, middle = 6.07710050630396597660e-11,
                   low = 2.02226624879595063154e-21;  // π/2, the first two of 33 bits
  constexpr double to_integer = 0x1.8p52, largest = 1e5;
  const Number k = (x * half_turns + to_integer) - to_integer;
  const Number coarse = x - k * high, step = k * middle;
  const Number finer = coarse - step, rest = k * low - ((coarse - finer) - step);
  const Number y = finer - rest, tail = (finer - y) - rest;
  const Number z = y * y;

  const Number r = 8.33333333332248946124e-03 +
                   z * (-1.98412698298579493134e-04 +
                        z * (2.75573137070700676789e-06 +
                             z * (-2.50507602534068634195e-08 + z * 1.58969099521155010221e-10)));
  const Number v = z * y;
  const Number sine = y - ((z * (0.5 * tail - v * r) - tail) - v * -1.66666666666666324348e-01);

  const Number c =
      z * (4.16666666666666019037e-02 +
           z * (-1.38888888888741095749e-03 +
                z * (2.48015872894767294178e-05 +
                     z * (-2.75573143513906633035e-07 +
                          z * (2.08757232129817482790e-09 + z * -1.13596475577881948265e-11)))));
  const Number half = 0.5 * z, w = 1.0 - half;
  const Number cosine = w + (((1.0 - w) - half) + (z * c - y * tail));

  const Number quarter = k * 0.25;
  const Number m = k - 4.0 * ((quarter + to_integer) - to_integer);  // -2, -1, 0, 1 or 2
  const NumberMask odd = abs(m) == Number(1.0), back = abs(m) == Number(2.0);
  const Number s = choose(odd, cosine, sine), co = choose(odd, sine, cosine);
  const NumberMask known = abs(x) <= Number(largest);
  const Number nan = __builtin_nan("");
  return {choose(known, choose(back || m == Number(-1.0), -s, s), nan),
          choose(known, choose(back || m == Number(1.0), -co, co), nan)};
}

[[gnu::always_inline]] inline physics::SinCos<Number> sin_cos(const Number& angle) {
  const SineCosine at = sine_cosine(angle);
  return {angle, at.sin, at.cos};
}

/// A number with its derivatives along `dual_width` directions; formulas as in DualOf. Where all is
/// inlined the compiler knows `along`, and leaves out the arithmetic of slopes that are zero.
struct LaneDual {
  Number value;
  Number slopes[dual_width];
  unsigned along;  // bit k: slope k may differ from zero

  static constexpr unsigned all = (1U << dual_width) - 1;

  LaneDual() = default;
  [[gnu::always_inline]] LaneDual(const LaneDual& a) { *this = a; }
  [[gnu::always_inline]] explicit LaneDual(const Number& v)
      : LaneDual(v, 0, [](int) { return Number(0.0); }) {}

  /// The slopes are `slope(k)`, or zero.
  template <class Slope>
  [[gnu::always_inline]] LaneDual(const Number& v, unsigned directions, const Slope& slope) {
    set(v, directions, slope);
  }

  // Number by number: the compiler loses `along` where it copies a block of memory.
  [[gnu::always_inline]] LaneDual& operator=(const LaneDual& a) {
    set(a.value, a.along, [&](int k) { return a.slopes[k]; });
    return *this;
  }

  template <class Slope>
  [[gnu::always_inline]] void set(const Number& v, unsigned directions, const Slope& slope) {
    value = v;
    along = directions;
#pragma GCC unroll 8
    for (int k = 0; k < dual_width; ++k) slopes[k] = has(k) ? slope(k) : Number(0.0);
  }

  [[gnu::always_inline]] bool has(int k) const { return (along >> k & 1) != 0; }

  [[gnu::always_inline]] friend LaneDual operator+(const LaneDual& a, const LaneDual& b) {
    return {a.value + b.value, a.along | b.along, [&](int k) {
              return !b.has(k) ? a.slopes[k] : !a.has(k) ? b.slopes[k] : a.slopes[k] + b.slopes[k];
            }};
  }
  [[gnu::always_inline]] friend LaneDual operator-(const LaneDual& a, const LaneDual& b) {
    return {a.value - b.value, a.along | b.along, [&](int k) {
              return !b.has(k) ? a.slopes[k] : !a.has(k) ? -b.slopes[k] : a.slopes[k] - b.slopes[k];
            }};
  }
  [[gnu::always_inline]] friend LaneDual operator*(const LaneDual& a, const LaneDual& b) {
    return {a.value * b.value, a.along | b.along, [&](int k) {
              return !b.has(k)   ? b.value * a.slopes[k]
                     : !a.has(k) ? a.value * b.slopes[k]
                                 : b.value * a.slopes[k] + a.value * b.slopes[k];
            }};
  }
  [[gnu::always_inline]] friend LaneDual operator/(const LaneDual& a, const LaneDual& b) {
    const Number ratio = a.value / b.value, inverse = 1.0 / b.value;
    return {ratio, a.along | b.along, [&](int k) {
              return (b.has(k) ? a.slopes[k] - ratio * b.slopes[k] : a.slopes[k]) * inverse;
            }};
  }
  [[gnu::always_inline]] friend LaneDual operator-(const LaneDual& a) {
    return {-a.value, a.along, [&](int k) { return -a.slopes[k]; }};
  }
  [[gnu::always_inline]] friend LaneDual operator+(const LaneDual& a, const Number& b) {
    return {a.value + b, a.along, [&](int k) { return a.slopes[k]; }};
  }
  [[gnu::always_inline]] friend LaneDual operator+(const Number& a, const LaneDual& b) {
    return {a + b.value, b.along, [&](int k) { return b.slopes[k]; }};
  }
  [[gnu::always_inline]] friend LaneDual operator-(const LaneDual& a, const Number& b) {
    return {a.value - b, a.along, [&](int k) { return a.slopes[k]; }};
  }
  [[gnu::always_inline]] friend LaneDual operator-(const Number& a, const LaneDual& b) {
    return {a - b.value, b.along, [&](int k) { return -b.slopes[k]; }};
  }
  [[gnu::always_inline]] friend LaneDual operator*(const LaneDual& a, const Number& b) {
    return {a.value * b, a.along, [&](int k) { return a.slopes[k] * b; }};
  }
  [[gnu::always_inline]] friend LaneDual operator*(const Number& a, const LaneDual& b) {
    return {a * b.value, b.along, [&](int k) { return a * b.slopes[k]; }};
  }
  [[gnu::always_inline]] friend LaneDual operator/(const LaneDual& a, const Number& b) {
    const Number inverse = 1.0 / b;
    return {a.value / b, a.along, [&](int k) { return a.slopes[k] * inverse; }};
  }
  [[gnu::always_inline]] friend LaneDual operator/(const Number& a, const LaneDual& b) {
    const Number ratio = a / b.value, factor = -ratio / b.value;
    return {ratio, b.along, [&](int k) { return b.slopes[k] * factor; }};
  }

  [[gnu::always_inline]] friend LaneDual abs(const LaneDual& a) {
    const NumberMask below = a.value < Number(0.0);
    return {choose(below, -a.value, a.value), a.along,
            [&](int k) { return choose(below, -a.slopes[k], a.slopes[k]); }};
  }
  [[gnu::always_inline]] friend LaneDual sqrt(const LaneDual& a) {
    const Number root = sqrt(a.value), slope = 1.0 / (2.0 * root);
    return {root, a.along, [&](int k) { return slope * a.slopes[k]; }};
  }
};

[[gnu::always_inline]] inline physics::SinCos<LaneDual> sin_cos_of(const LaneDual& angle,
                                                                   const Number& sin,
                                                                   const Number& cos) {
  return {angle,
          {sin, angle.along, [&](int k) { return cos * angle.slopes[k]; }},
          {cos, angle.along, [&](int k) { return -sin * angle.slopes[k]; }}};
}

[[gnu::always_inline]] inline physics::SinCos<LaneDual> sin_cos(const LaneDual& angle) {
  const SineCosine at = sine_cosine(angle.value);
  return sin_cos_of(angle, at.sin, at.cos);
}

[[gnu::always_inline]] inline physics::SinCos<LaneDual> operator+(
    const physics::SinCos<LaneDual>& a, const physics::SinCos<LaneDual>& b) {
  return sin_cos_of(a.angle + b.angle, a.sin.value * b.cos.value + a.cos.value * b.sin.value,
                    a.cos.value * b.cos.value - a.sin.value * b.sin.value);
}

}  // namespace tiltrim::TILTRIM_LANES
