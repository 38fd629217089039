/// Small matrices, one per lane, balanced and reduced to Hessenberg form. Only for
/// lanes_eigenvalues.cpp, and in its unnamed namespace: the compiler inlines functions more freely
/// if no other source can call them. Internal to linearize/.
#pragma once

#include <cstdint>

#include "runtime/lanes.hpp"

namespace tiltrim::TILTRIM_LANES {

namespace {

using std::experimental::element_aligned;
using Real = Lanes;
using Mask = LaneMask;
constexpr int groups = 2;
constexpr int width = groups * int(lane_count);
constexpr int largest = 16;

// For sums of squares in matrices of size about one: smaller sums lose digits, but are far below
// rounding.
constexpr double least_square = 0x1p-960;

// One matrix per lane; its size is a compile-time constant if N > 0.
template <int N>
struct Matrix {
  static constexpr int rows = N > 0 ? N : largest;
  int size_;
  Real a[rows][rows];

  [[gnu::always_inline]] int n() const { return N > 0 ? N : size_; }
  [[gnu::always_inline]] Real& operator()(int i, int j) { return a[i][j]; }
};

// The state of the lanes.
struct Lane {
  Real low, high;   // the window, rows low .. high
  Real iterations;  // since the last deflation
  Real unit = 1.0;  // power of two factored out of the matrix
  Mask finite;      // the matrix is finite
  Mask hard;        // not converged: use the fallback
};

// --- Powers of two, by manipulation of the exponent bits.

// The compiler's vector type: shifts of std::experimental::simd are wrong with clang 14.
using Bits [[gnu::vector_size(sizeof(Lanes))]] = std::uint64_t;
static_assert(sizeof(Bits) == sizeof(Lanes) && sizeof(std::uint64_t) == sizeof(double));

[[gnu::always_inline]] inline Bits bits(Lanes x) { return __builtin_bit_cast(Bits, x); }
[[gnu::always_inline]] inline Lanes number(Bits x) { return __builtin_bit_cast(Lanes, x); }

constexpr int mantissa = 52;
constexpr std::uint64_t one = std::uint64_t{1023} << mantissa;
constexpr std::uint64_t exponent_bits = std::uint64_t{2047} << mantissa;

// 2^k near √(r/c): half the difference of the logarithms, interpolated between powers of two.
[[gnu::always_inline]] inline Real root_of_ratio(const Real& r, const Real& c) {
  const Bits half = (bits(r) + (2 * one - bits(c))) >> 1;
  return number((half + (std::uint64_t{1} << (mantissa - 1))) & exponent_bits);
}

// The largest power of two not above x > 0, limited so that it and its inverse are normal numbers.
[[gnu::always_inline]] inline Real power_below(const Real& x) {
  const Real p = number(bits(x) & exponent_bits);
  return choose(p < 0x1p-1000, Real(0x1p-1000), choose(Real(0x1p1000) < p, Real(0x1p1000), p));
}

// Factors out a power of two if squares could overflow or underflow; non-finite matrices become
// zero.
template <int N>
[[gnu::noinline]] void scale(Matrix<N>& A, Lane& lane) {
  const int n = A.n();
  Real largest_entry = 0.0;
  for (int i = 0; i < n; ++i)
    for (int j = 0; j < n; ++j) {
      lane.finite = lane.finite && abs(A(i, j)) <= 0x1.fffffffffffffp1023;
      largest_entry = max(largest_entry, abs(A(i, j)));
    }
  largest_entry = choose(lane.finite, largest_entry, Real(1.0));
  const Mask moderate = Real(0x1p-200) < largest_entry && largest_entry < 0x1p200;
  lane.unit = choose(moderate, Real(1.0), power_below(largest_entry));
  const Real inverse = Real(1.0) / lane.unit;
  for (int i = 0; i < n; ++i)
    for (int j = 0; j < n; ++j) A(i, j) = choose(lane.finite, A(i, j) * inverse, Real(0.0));
}

template <int N>
[[gnu::noinline]] void load(const double* entries, std::size_t stride, Matrix<N>& A, Lane& lane) {
  const int n = A.n();
  Real sum = 0.0;
  for (int i = 0; i < n; ++i)
    for (int j = 0; j < n; ++j) {
      A(i, j).copy_from(entries + std::size_t(i * n + j) * stride, element_aligned);
      sum = sum + abs(A(i, j));
    }
  lane.finite = Real(0.0) == Real(0.0);
  lane.hard = !lane.finite;
  if (any_of(!(Real(0x1p-190) < sum && sum < 0x1p190))) scale(A, lane);
}

// --- Balancing.

// The off-diagonal part of row i or column i is zero: a(i, i) is an eigenvalue, and the row and
// column do not affect the others.
template <int N>
[[gnu::noinline]] void isolate(Matrix<N>& A, int i, const Mask& alone) {
  for (int j = 0; j < A.n(); ++j) {
    if (j == i) continue;
    A(i, j) = choose(alone, Real(0.0), A(i, j));
    A(j, i) = choose(alone, Real(0.0), A(j, i));
  }
}

// Scales one state; returns the lanes that were changed, and adds those where it is isolated.
template <int N>
[[gnu::always_inline]] inline Mask balance_one(Matrix<N>& A, int i, Mask& some_alone) {
  constexpr double worth = 4.0, farthest = 0x1p15;  // farthest per sweep: far from overflow
  const int n = A.n();
  Real c = 0.0, r = 0.0;
  for (int j = 0; j < n; ++j) {
    if (j == i) continue;
    c = c + abs(A(j, i));
    r = r + abs(A(i, j));
  }
  const Mask alone = c == 0.0 || r == 0.0;
  some_alone = some_alone || alone;
  Real f = root_of_ratio(r, c);
  const Mask unlike = !(Real(1 / worth) < f && f < worth) && !alone;
  const Mask isolated = alone && !(c == r);
  if (any_of(isolated)) isolate(A, i, alone);
  if (!any_of(unlike)) return isolated;
  f = choose(f < 1 / farthest, Real(1 / farthest), choose(Real(farthest) < f, Real(farthest), f));
  f = choose(unlike, f, Real(1.0));
  const Real inverse = Real(1.0) / f;
  for (int j = 0; j < n; ++j) {
    if (j == i) continue;
    A(j, i) = A(j, i) * f;
    A(i, j) = A(i, j) * inverse;
  }
  return isolated || unlike;
}

// Moves isolated states to the end, so that no reflector mixes them with others.
template <int N>
[[gnu::noinline]] void gather_isolated(Matrix<N>& A, Lane& lane) {
  const int n = A.n();
  Real isolated[Matrix<N>::rows];
  for (int i = 0; i < n; ++i) {
    Real sum = 0.0;
    for (int j = 0; j < n; ++j)
      if (j != i) sum = sum + (abs(A(i, j)) + abs(A(j, i)));
    isolated[i] = choose(sum == 0.0, Real(1.0), Real(0.0));
    lane.high = lane.high - isolated[i];
  }
  for (int end = n - 1; end > 0; --end)
    for (int i = 0; i < end; ++i) {
      const Mask swap = isolated[i + 1] < isolated[i];
      if (!any_of(swap)) continue;
      const auto exchange = [&](Real& a, Real& b) {
        const Real was = a;
        a = choose(swap, b, a);
        b = choose(swap, was, b);
      };
      exchange(isolated[i], isolated[i + 1]);
      for (int j = 0; j < n; ++j) exchange(A(i, j), A(i + 1, j));
      for (int j = 0; j < n; ++j) exchange(A(j, i), A(j, i + 1));
    }
}

// Scales each state by a power of two until its row and column sums are within a factor of 16:
// further steps would cost more than the digit they gain.                                  [8]
template <int N>
[[gnu::noinline]] void balance(Matrix<N>& A, Lane& lane) {
  const int n = A.n(), cap = 10 + n;
  lane.high = double(n - 1);
  Mask changed = lane.finite, alone = !lane.finite;
  for (int sweep = 0; any_of(changed) && sweep < cap; ++sweep) {
    changed = alone = Mask(false);
#pragma GCC unroll 8
    for (int i = 0; i < n; ++i) changed = changed || balance_one(A, i, alone);
  }
  lane.hard = lane.hard || changed;
  if (any_of(alone)) gather_isolated(A, lane);
}

// --- Hessenberg form.

// A reflector I + c u uᵀ, u = (1, x₂ scale, x₃ scale, ...), that maps x to its first component; the
// identity if x is zero or `where` is not set.                                [11, alg. 5.1.1]
struct Householder {
  Real c, scale;
  Real first;  // new value of the first component
};
[[gnu::always_inline]] inline Householder householder(const Real& first, const Real& squares,
                                                      const Mask& where) {
  const Real length = sqrt(squares);
  const Real turned = choose(first < 0.0, length, -length);
  const Real u = first - turned;
  const Real q = choose(where && Real(least_square) < squares, Real(1.0) / (u * turned), Real(0.0));
  return {u * u * q, turned * q, turned};
}

template <int N>
[[gnu::always_inline]] inline void reduce_column(Matrix<N>& A, int k) {
  const int n = A.n();
  Real u[Matrix<N>::rows];
  Real below = 0.0;
#pragma GCC unroll 8
  for (int i = k + 2; i < n; ++i) below = multiply_add(A(i, k), A(i, k), below);
  const Real x = A(k + 1, k);
  const Mask some = Real(least_square) < below;
  const Householder t = householder(x, multiply_add(x, x, below), some);
  A(k + 1, k) = choose(some, t.first, x);
#pragma GCC unroll 8
  for (int i = k + 2; i < n; ++i) {
    u[i] = A(i, k) * t.scale;
    A(i, k) = 0.0;
  }
#pragma GCC unroll 8
  for (int j = k + 1; j < n; ++j) {
    Real sum = A(k + 1, j);
    for (int i = k + 2; i < n; ++i) sum = multiply_add(u[i], A(i, j), sum);
    sum = sum * t.c;
    A(k + 1, j) = A(k + 1, j) + sum;
    for (int i = k + 2; i < n; ++i) A(i, j) = multiply_add(sum, u[i], A(i, j));
  }
#pragma GCC unroll 8
  for (int i = 0; i < n; ++i) {
    Real sum = A(i, k + 1);
    for (int j = k + 2; j < n; ++j) sum = multiply_add(u[j], A(i, j), sum);
    sum = sum * t.c;
    A(i, k + 1) = A(i, k + 1) + sum;
    for (int j = k + 2; j < n; ++j) A(i, j) = multiply_add(sum, u[j], A(i, j));
  }
}

template <int N>
[[gnu::noinline]] void hessenberg(Matrix<N>* A) {
  const int n = A->n();
#pragma GCC unroll 8
  for (int k = 0; k + 2 < n; ++k) {
#pragma GCC unroll 4
    for (int g = 0; g < groups; ++g) reduce_column(A[g], k);
  }
}

}  // namespace

}  // namespace tiltrim::TILTRIM_LANES
