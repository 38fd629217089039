// Verdicts without eigenvalues: Householder reduction to Hessenberg form, its characteristic
// polynomial by La Budde's recursion, and Routh's array, each with an error bound. The bounds are
// derived in docs/linearize.md; u = ε/2 throughout.                          [32, 33, 34, 35]
#include "linearize/lanes_routh.hpp"

#include <cstddef>
#include <cstdint>

#include "runtime/lanes.hpp"

namespace tiltrim::TILTRIM_LANES {
namespace {

constexpr int groups = 2;  // interleaved, so that one works while the other waits for a division
using Real = Pack<groups>;
using Mask = PackMask<groups>;
constexpr std::size_t width = groups * lane_count;
constexpr std::size_t largest = 16;  // largest_batch_matrix

constexpr double u = 0x1p-53;
// Covers the rounding of the bounds themselves: sums and products of positive numbers, each with a
// relative error of at most a few hundred u.
constexpr double inflated = 1.01;
// Columns whose squared length is below this count as zero.
constexpr double least_square = 1e-250;
// Bounds all underflow in matrices of about norm one; negligible compared with other errors.
constexpr double underflow = 1e-120;
constexpr double underflow_of_step = 1e-290;

// The size of a matrix: a compile-time constant, or fixed = 0 and known at run time.
template <std::size_t fixed>
struct Size {
  static constexpr std::size_t capacity = fixed > 0 ? fixed : largest;
  std::size_t n;
  constexpr operator std::size_t() const { return fixed > 0 ? fixed : n; }
};

template <class N>
struct Square {
  N n;
  Real entry[N::capacity * N::capacity];
  [[gnu::always_inline]] Real& operator()(std::size_t i, std::size_t j) { return entry[i * n + j]; }
  [[gnu::always_inline]] const Real& operator()(std::size_t i, std::size_t j) const {
    return entry[i * n + j];
  }
};

// Coefficients of sⁿ + c₁ sⁿ⁻¹ + ... + cₙ, c₀ = 1, and their error bounds.
template <class N>
struct Polynomial {
  Real c[N::capacity + 1], error[N::capacity + 1];
};

// If fewer values than lanes are left, the last lanes repeat the last value.
[[gnu::always_inline]] inline Real load(const double* from, std::size_t left) {
  Real r;
  if (left >= width) {
    r.load(from);
    return r;
  }
  double padded[width];
  for (std::size_t i = 0; i < width; ++i) padded[i] = from[i < left ? i : left - 1];
  r.load(padded);
  return r;
}

struct Signs {
  Mask stable, unstable;
};

[[gnu::always_inline]] inline void store(const Signs& signs, RouthVerdict* to, std::size_t left) {
  const Real stable = double(RouthVerdict::stable), unstable = double(RouthVerdict::unstable),
             undecided = double(RouthVerdict::undecided);
  double verdict[width];
  choose(signs.stable, stable, choose(signs.unstable, unstable, undecided)).store(verdict);
  for (std::size_t i = 0; i < width && i < left; ++i) to[i] = RouthVerdict(int(verdict[i]));
}

// --- Exact balancing with powers of two, by manipulation of the exponent bits.

// The compiler's vector type: shifts of std::experimental::simd are wrong with clang 14.
using Bits [[gnu::vector_size(sizeof(Lanes))]] = std::int64_t;
constexpr int mantissa = 52;
constexpr std::int64_t bias = 1023;

// 1/x of a power of two.
Real inverse_power(const Real& x) {
  Real r;
  for (int g = 0; g < groups; ++g)
    r.of[g] = __builtin_bit_cast(
        Lanes, Bits(((2 * bias) << mantissa) - __builtin_bit_cast(Bits, x.of[g])));
  return r;
}

// The largest power of two not above x, for x > 0.
Real power(const Real& x) {
  constexpr std::int64_t exponent = std::int64_t{0x7ff} << mantissa;
  Real r;
  for (int g = 0; g < groups; ++g)
    r.of[g] = __builtin_bit_cast(Lanes, Bits(__builtin_bit_cast(Bits, x.of[g]) & exponent));
  return r;
}

// A power of two within a factor 2 of √x, for x > 0.
Real power_near_root(const Real& x) {
  Real r;
  for (int g = 0; g < groups; ++g) {
    const Bits bits = __builtin_bit_cast(Bits, x.of[g]);
    r.of[g] = __builtin_bit_cast(Lanes, Bits((((bits >> mantissa) + bias) >> 1) << mantissa));
  }
  return r;
}

// Scales the largest entry to [1, 2): a positive factor does not change the verdict.
template <class N>
void scale(Square<N>& A) {
  const std::size_t n = A.n;
  Real size = 0.0;
  for (std::size_t i = 0; i < n * n; ++i) size = max(size, abs(A.entry[i]));
  constexpr double most = 0x1p1022, least = 0x1p-1022;
  size = choose(Real(most) < size, Real(most), max(size, Real(least)));
  const Real factor = inverse_power(power(size));
  for (std::size_t i = 0; i < n * n; ++i) A.entry[i] = A.entry[i] * factor;
}

// A sweep of D⁻¹ A D that makes each state's row and column sums nearly equal.           [8]
template <class N>
void balance(Square<N>& A) {
  const std::size_t n = A.n;
  for (std::size_t i = 0; i < n; ++i) {
    Real row = 0.0, column = 0.0;
    for (std::size_t j = 0; j < n; ++j) {
      if (j == i) continue;
      row = row + abs(A(i, j));
      column = column + abs(A(j, i));
    }
    // Limited to 2^±32, so that no entry can leave the range of doubles.
    Real ratio = max(row / column, Real(0x1p-64));
    ratio = choose(ratio < Real(0x1p64), ratio, Real(0x1p64));
    ratio = choose(Real(0.0) < row + column, ratio, Real(1.0));
    const Real f = power_near_root(ratio), inverse = inverse_power(f);
    for (std::size_t j = 0; j < n; ++j) {
      if (j == i) continue;
      A(j, i) = A(j, i) * f;
      A(i, j) = A(i, j) * inverse;
    }
  }
}

// --- The characteristic polynomial.

// A -> P A P, P = I - β v vᵀ, with v such that column k becomes zero below k + 1; the zeros are not
// stored.                                                                     [11, sec. 7.4.3]
template <class N>
[[gnu::always_inline]] inline void reflect(Square<N>& A, std::size_t k) {
  const std::size_t n = A.n;
  const std::size_t first = k + 1;
  Real v[N::capacity];
  Real squares = 0.0;
#pragma GCC unroll 8
  for (std::size_t i = first; i < n; ++i) {
    v[i] = A(i, k);
    squares = multiply_add(v[i], v[i], squares);
  }
  const Real length = sqrt(squares), head = v[first];
  // ½ vᵀv = ‖x‖² + |x₁| ‖x‖
  const Real beta = choose(squares < Real(least_square), Real(0.0),
                           Real(-1.0) / multiply_add(abs(head), length, squares));
  const Real signed_length = choose(head < Real(0.0), -length, length);
  v[first] = head + signed_length;
  A(first, k) = -signed_length;
#pragma GCC unroll 8
  for (std::size_t j = first; j < n; ++j) {
    Real dot = 0.0;
    for (std::size_t i = first; i < n; ++i) dot = multiply_add(v[i], A(i, j), dot);
    dot = dot * beta;
    for (std::size_t i = first; i < n; ++i) A(i, j) = multiply_add(dot, v[i], A(i, j));
  }
#pragma GCC unroll 8
  for (std::size_t i = 0; i < n; ++i) {
    Real dot = 0.0;
    for (std::size_t j = first; j < n; ++j) dot = multiply_add(v[j], A(i, j), dot);
    dot = dot * beta;
    for (std::size_t j = first; j < n; ++j) A(i, j) = multiply_add(dot, v[j], A(i, j));
  }
}

// det(sI - H) of a Hessenberg matrix from those of its leading blocks:
//   pᵢ = (s - hᵢᵢ) pᵢ₋₁ - Σₘ hᵢ₋ₘ,ᵢ (hᵢ₋ₘ₊₁,ᵢ₋ₘ ... hᵢ,ᵢ₋₁) pᵢ₋ₘ₋₁                    [32, sec. 4]
template <class N>
void characteristic(const Square<N>& H, Real (&c)[N::capacity + 1]) {
  const std::size_t n = H.n;
  Real p[N::capacity + 1][N::capacity + 1];
  p[0][0] = 1.0;
#pragma GCC unroll 8
  for (std::size_t i = 1; i <= n; ++i) {
    const Real here = -H(i - 1, i - 1);
    p[i][0] = 1.0;
    for (std::size_t k = 1; k < i; ++k) p[i][k] = multiply_add(here, p[i - 1][k - 1], p[i - 1][k]);
    p[i][i] = here * p[i - 1][i - 1];
    Real below = -1.0;  // -(hᵢ₋ₘ₊₁,ᵢ₋ₘ ... hᵢ,ᵢ₋₁)
#pragma GCC unroll 8
    for (std::size_t m = 1; m < i; ++m) {
      below = below * H(i - m, i - m - 1);
      const Real factor = below * H(i - m - 1, i - 1);
      for (std::size_t k = m + 1; k <= i; ++k)
        p[i][k] = multiply_add(factor, p[i - m - 1][k - m - 1], p[i][k]);
    }
  }
  for (std::size_t k = 0; k <= n; ++k) c[k] = p[n][k];
}

// Error bounds of the coefficients: H is within distance = relative ‖H‖ of a matrix similar to A,
//   |δcₖ| <= ½ n (n + 3) u eₖ + √(n - k + 1) distance eₖ₋₁
// where eₖ are the elementary symmetric functions of its column sums and `distance`.     [33]
template <class N>
void coefficient_errors(const Square<N>& H, const Real& relative, Real (&error)[N::capacity + 1]) {
  const std::size_t n = H.n;
  Real sum[N::capacity], e[N::capacity + 1];
  Real squares = 0.0;
#pragma GCC unroll 8
  for (std::size_t j = 0; j < n; ++j) {
    Real of_column = 0.0;
    sum[j] = 0.0;
    for (std::size_t i = 0; i <= j + 1 && i < n; ++i) {
      of_column = multiply_add(H(i, j), H(i, j), of_column);
      sum[j] = sum[j] + abs(H(i, j));
    }
    squares = squares + of_column;
  }
  const Real distance = multiply_add(sqrt(squares), relative, Real(underflow));
  e[0] = 1.0;
#pragma GCC unroll 8
  for (std::size_t j = 0; j < n; ++j) {
    const Real column = sum[j] + distance;
    e[j + 1] = column * e[j];
    for (std::size_t k = j; k > 0; --k) e[k] = multiply_add(column, e[k - 1], e[k]);
  }
  const Real roundings = inflated * u * double(n * (n + 3)) / 2;
  error[0] = 0.0;
#pragma GCC unroll 8
  for (std::size_t k = 1; k <= n; ++k) {
    const Real moved = distance * Real(inflated * __builtin_sqrt(double(n - k + 1)));
    error[k] = multiply_add(moved, e[k - 1], roundings * e[k]) + Real(underflow_of_step);
  }
}

// --- Routh's test.

// Signs of Routh's first column, every entry within its bound: all positive is stable. One negative
// entry after positive ones is unstable, whatever follows. A negative coefficient is unstable too,
// as a polynomial without roots right of the axis has no negative Hurwitz determinant.     [34]
template <class N>
[[gnu::always_inline]] inline Signs routh(N order, Polynomial<N>& p) {
  const std::size_t n = order;
  const Real u_of_step = inflated * 4 * u, least = underflow_of_step, zero = 0.0;
  Mask positive = zero < Real(1.0), unstable = p.c[1] + p.error[1] < zero;
  for (std::size_t k = 2; k <= n; ++k) unstable = unstable || p.c[k] + p.error[k] < zero;
#pragma GCC unroll 8
  for (std::size_t i = 1; i <= n; ++i) {
    unstable = unstable || (positive && p.c[i] + p.error[i] < zero);
    positive = positive && p.error[i] + p.error[i] < p.c[i];
    if (i + 1 >= n) continue;  // the last two rows are unchanged
    // Row i + 1 = row i - 1 minus `ratio` times row i; 1/(1 - t) <= 1 + 2t for t <= ½
    const Real inverse = Real(1.0) / p.c[i], t = p.error[i] * inverse, ratio = p.c[i - 1] * inverse;
    const Real apart = multiply_add(ratio, p.error[i], p.error[i - 1]) * inverse;
    const Real ratio_error = multiply_add(t + t, apart, multiply_add(ratio, u_of_step, apart));
    for (std::size_t j = i + 1; j < n; j += 2) {
      const Real size = abs(p.c[j + 1]);
      p.c[j] = multiply_add(-ratio, p.c[j + 1], p.c[j]);
      p.error[j] = multiply_add(ratio_error, size,
                                multiply_add(ratio + ratio_error, p.error[j + 1], p.error[j])) +
                   multiply_add(abs(p.c[j]), u_of_step, least);
    }
  }
  return {positive, unstable};
}

// Relative backward error of the reduction: each of its n - 2 reflections, of m = 2 .. n - 1
// entries, contributes at most (14 m + 56) u ‖A‖.
double reduction_error(std::size_t n) {
  double sum = 0;
  for (std::size_t m = 2; m < n; ++m) sum += 14.0 * double(m) + 56;
  return inflated * u * sum;
}

template <class N>
void routh_of(N order, const MatrixTask& task) {
  const std::size_t n = order;
  const Real relative = reduction_error(n) + inflated * task.entry_error;
  for (std::size_t at = task.first; at < task.last; at += width) {
    const std::size_t left = task.last - at;
    Square<N> A;
    A.n = order;
    for (std::size_t i = 0; i < n * n; ++i)
      A.entry[i] = load(task.entries + i * task.count + at, left);
    if (task.balanced) {
      scale(A);
      for (int sweep = 0; sweep < 2; ++sweep) balance(A);
    }
#pragma GCC unroll 8
    for (std::size_t k = 0; k + 2 < n; ++k) reflect(A, k);
    Polynomial<N> p;
    characteristic(A, p.c);
    coefficient_errors(A, relative, p.error);
    store(routh(order, p), task.verdict + (at - task.first), left);
  }
}

template <class N>
void routh_of(N n, const LineTask& task) {
  for (std::size_t at = 0; at < task.count; at += width) {
    const std::size_t left = task.count - at;
    const Real b = load(task.b + at, left), size = abs(b);
    Polynomial<N> p;
    p.c[0] = 1.0;
    p.error[0] = 0.0;
    for (std::size_t k = 1; k <= n; ++k) {
      p.c[k] = multiply_add(b, Real(task.q[k]), Real(task.p[k]));
      p.error[k] = multiply_add(size, Real(task.q_error[k]), Real(task.p_error[k]));
    }
    store(routh(n, p), task.verdict + at, left);
  }
}

template <class Task>
void by_size(const Task& task) {
  if (task.n == 4) return routh_of(Size<4>{4}, task);
  if (task.n == 6) return routh_of(Size<6>{6}, task);
  routh_of(Size<0>{task.n}, task);
}

}  // namespace

}  // namespace tiltrim::TILTRIM_LANES

namespace tiltrim {

using namespace TILTRIM_LANES;

template <>
void routh_of_matrices<InstructionSet::TILTRIM_SET>(const MatrixTask& task) {
  by_size(task);
}

template <>
void routh_of_line<InstructionSet::TILTRIM_SET>(const LineTask& task) {
  by_size(task);
}

}  // namespace tiltrim
