// Eigenvalues of small matrices, one per lane, as in EISPACK: balancing, Householder reduction to
// Hessenberg form and Francis' double shift [8; 11, secs 7.4, 7.5], with shifts and exceptional
// shifts as in LAPACK's dlahqr [9]. Each lane has its own window low .. high of rows not yet
// deflated; the loops run over the union of the windows, and a lane outside its own window is given
// the identity as its reflector. The bits of a lane therefore depend only on its own matrix: an
// identity may change the sign of a zero, but no result here depends on that sign.
#include "linearize/lanes_eigenvalues.hpp"

#include <cstddef>

#include "linearize/lanes_hessenberg.hpp"

namespace tiltrim::TILTRIM_LANES {

namespace {

constexpr double epsilon = 0x1p-52;

// The values of LaneStatus in batch.hpp.
constexpr unsigned char converged = 0, fallback = 1, not_finite = 3;

// --- The QR iteration.

// The last row to look at: of a size known to the compiler all, which it unrolls. Rows that no
// window has do not change.
template <int N>
constexpr int last_row(int top) {
  return N > 0 ? N - 1 : top;
}

// Sets subdiagonal entries below rounding of their diagonal neighbours to zero.
template <int N>
[[gnu::always_inline]] inline void deflate(Matrix<N>& H, int top) {
  const int last = last_row<N>(top);
#pragma GCC unroll 8
  for (int k = 1; k <= last; ++k) {
    const Real size = abs(H(k - 1, k - 1)) + abs(H(k, k));
    H(k, k - 1) = choose(abs(H(k, k - 1)) <= Real(epsilon) * size, Real(0.0), H(k, k - 1));
  }
}

// Every lane's lowest window of three or more rows; lanes without such a window are done, high < 2.
template <int N>
[[gnu::always_inline]] inline void find_windows(Matrix<N>& H, Lane& lane, int top) {
  const int last = last_row<N>(top);
  Mask done;
  for (int round = 0; round <= top; ++round) {
    lane.low = 0.0;
#pragma GCC unroll 8
    for (int k = 1; k <= last; ++k)
      lane.low =
          choose(H(k, k - 1) == 0.0 && Real(double(k)) <= lane.high, Real(double(k)), lane.low);
    const Mask single = lane.low == lane.high && Real(0.0) <= lane.high,
               pair = lane.low + 1.0 == lane.high;
    done = single || pair;
    if (!any_of(done && Real(1.5) < lane.high)) break;
    lane.high = choose(pair, lane.high - 2.0, choose(single, lane.high - 1.0, lane.high));
    lane.iterations = choose(done, Real(0.0), lane.iterations);
  }
}

// The start of a double-shift sweep: the first column of (H - s₁)(H - s₂), not normalized.
struct Start {
  Real x, y, z;
};

template <int N>
[[gnu::always_inline]] inline Start start(Matrix<N>& H, const Lane& lane, int top) {
  Real a = H(top - 1, top - 1), b = H(top - 1, top), c = H(top, top - 1), d = H(top, top);
  Real above = H(top - 1, top - 2);
  for (int m = top - 1; m >= 2; --m) {
    const Mask here = lane.high == double(m);
    a = choose(here, H(m - 1, m - 1), a);
    b = choose(here, H(m - 1, m), b);
    c = choose(here, H(m, m - 1), c);
    d = choose(here, H(m, m), d);
    above = choose(here, H(m - 1, m - 2), above);
  }
  // Eigenvalues of the last two rows; if they are real, the one nearer to the corner, twice.   [9]
  const Real mean = (a + d) * 0.5, half = (a - d) * 0.5;
  const Real discriminant = multiply_add(half, half, b * c);
  const Real root = sqrt(abs(discriminant));
  const Mask complex = discriminant < 0.0;
  const Real nearer = choose(half < 0.0, mean + root, mean - root);
  Real shift = choose(complex, mean, nearer);
  Real square = choose(complex, -discriminant, Real(0.0));
  constexpr double every = 10;
  const Mask stuck =
      lane.iterations == every || lane.iterations == 2 * every || lane.iterations == 3 * every;
  if (any_of(stuck)) {
    const Real size = abs(c) + abs(above);
    shift = choose(stuck, multiply_add(Real(0.75), size, d), shift);
    square = choose(stuck, Real(0.4375) * size * size, square);
  }
  Real h11 = H(0, 0), h12 = H(0, 1), h21 = H(1, 0), h22 = H(1, 1), h32 = H(2, 1);
  for (int l = 1; l + 2 <= top; ++l) {
    const Mask here = lane.low == double(l);
    if (!any_of(here)) continue;
    h11 = choose(here, H(l, l), h11);
    h12 = choose(here, H(l, l + 1), h12);
    h21 = choose(here, H(l + 1, l), h21);
    h22 = choose(here, H(l + 1, l + 1), h22);
    h32 = choose(here, H(l + 2, l + 1), h32);
  }
  const Real apart = h11 - shift;
  return {multiply_add(apart, apart, multiply_add(h12, h21, square)), h21 * (apart + (h22 - shift)),
          h21 * h32};
}

// The state of one register's matrices during a sweep: the reflector of rows or columns k .. k + 2,
// I + c u uᵀ with u = (1, y, z), and the entries of column k in the bulge outside the Hessenberg
// form.
struct Reflector {
  Real c, y, z;
};
struct Bulge {
  Start begin;
  Real x, y, z;  // rows k + 1, k + 2, k + 3
  Real fill;     // row k + 3 of column k + 1
};

[[gnu::always_inline]] inline void apply(const Reflector& t, Real& a, Real& b, Real& c) {
  const Real sum = t.c * multiply_add(t.z, c, multiply_add(t.y, b, a));
  a = a + sum;
  b = multiply_add(sum, t.y, b);
  c = multiply_add(sum, t.z, c);
}

[[gnu::always_inline]] inline void apply(const Reflector& t, Real& a, Real& b) {
  const Real sum = t.c * multiply_add(t.y, b, a);
  a = a + sum;
  b = multiply_add(sum, t.y, b);
}

// The reflector of step k, from the bulge or, at the start of a lane's window, from its shifts.
template <int N>
[[gnu::always_inline]] inline Reflector prepare(Matrix<N>& H, const Lane& lane, const Bulge& b,
                                                int k) {
  const Mask inside = lane.low <= double(k) && Real(double(k)) < lane.high;
  const Mask first = lane.low == double(k);
  const Real x = choose(first, b.begin.x, b.x), y = choose(first, b.begin.y, b.y),
             z = choose(first, b.begin.z, b.z);
  const Householder t = householder(x, multiply_add(z, z, multiply_add(y, y, x * x)), inside);
  if (k > 0) H(k, k - 1) = choose(inside && !first, t.first, b.x);
  return {t.c, y * t.scale, z * t.scale};
}

// Updates the entries the next reflector needs: the block where rows and columns of this one meet,
// and the row below.
template <int N>
[[gnu::always_inline]] inline void turn_block(Matrix<N>& H, const Reflector& t, Bulge& b, int k,
                                              int top) {
  H(k + 2, k) = b.fill;
#pragma GCC unroll 3
  for (int j = k; j <= k + 2; ++j) apply(t, H(k, j), H(k + 1, j), H(k + 2, j));
#pragma GCC unroll 3
  for (int i = k + 2; i >= k; --i) apply(t, H(i, k), H(i, k + 1), H(i, k + 2));
  b.x = H(k + 1, k);
  b.y = H(k + 2, k);
  if (k + 3 > top) {  // the last reflector has two rows
    b.z = b.begin.z = 0.0;
    return;
  }
  b.z = t.c * (t.z * H(k + 3, k + 2));
  b.fill = b.z * t.y;
  H(k + 3, k + 2) = multiply_add(b.z, t.z, H(k + 3, k + 2));
}

template <int N>
[[gnu::always_inline]] inline void turn_others(Matrix<N>& H, const Reflector& t, int k, int top) {
#pragma GCC unroll 8
  for (int j = k + 3; j <= top; ++j) apply(t, H(k, j), H(k + 1, j), H(k + 2, j));
#pragma GCC unroll 8
  for (int i = 0; i < k; ++i) apply(t, H(i, k), H(i, k + 1), H(i, k + 2));
}

// The last reflector, for rows k and k + 1.
template <int N>
[[gnu::always_inline]] inline void turn_last(Matrix<N>& H, const Reflector& t, int k) {
#pragma GCC unroll 2
  for (int j = k; j <= k + 1; ++j) apply(t, H(k, j), H(k + 1, j));
#pragma GCC unroll 8
  for (int i = 0; i <= k + 1; ++i) apply(t, H(i, k), H(i, k + 1));
}

// A double-shift sweep over rows 0 .. top, a compile-time constant if `fixed` > 0: unrolled code
// keeps in registers what loops would store. The square root and quotient of a reflector are
// started before independent work, and the groups are interleaved to hide their latency.
template <int N, int fixed>
[[gnu::noinline]] void sweep_rows(Matrix<N>* H, const Lane* lane, int rows_to) {
  const int top = fixed > 0 ? fixed : rows_to;
  Bulge b[groups];
  Reflector turn[groups];
#pragma GCC unroll 4
  for (int g = 0; g < groups; ++g) {
    b[g].begin = start(H[g], lane[g], top);
    b[g].x = b[g].y = b[g].z = b[g].fill = 0.0;
    turn[g] = prepare(H[g], lane[g], b[g], 0);
  }
#pragma GCC unroll 8
  for (int k = 0; k + 1 < top; ++k) {
#pragma GCC unroll 4
    for (int g = 0; g < groups; ++g) turn_block(H[g], turn[g], b[g], k, top);
    Reflector next[groups];
#pragma GCC unroll 4
    for (int g = 0; g < groups; ++g) next[g] = prepare(H[g], lane[g], b[g], k + 1);
#pragma GCC unroll 4
    for (int g = 0; g < groups; ++g) {
      turn_others(H[g], turn[g], k, top);
      turn[g] = next[g];
    }
  }
#pragma GCC unroll 4
  for (int g = 0; g < groups; ++g) turn_last(H[g], turn[g], top - 1);
}

template <int N, int top = N - 1>
[[gnu::always_inline]] inline void sweep(Matrix<N>* H, const Lane* lane, int rows_to) {
  if constexpr (N == 0)
    sweep_rows<N, 0>(H, lane, rows_to);
  else if (top == 2 || rows_to == top)
    sweep_rows<N, top>(H, lane, top);
  else if constexpr (top > 2)
    sweep<N, top - 1>(H, lane, rows_to);
}

// Deflates, and returns the last row of a window, below 2 if no lane has one of three or more rows.
template <int N>
[[gnu::always_inline]] inline int settle(Matrix<N>& H, Lane& lane, int top, int max_iterations) {
  deflate(H, top);
  find_windows(H, lane, top);
  const Mask stopped = Real(double(max_iterations)) <= lane.iterations && Real(1.5) < lane.high;
  if (any_of(stopped)) {
    lane.hard = lane.hard || stopped;
    lane.high = choose(stopped, Real(-1.0), lane.high);
  }
  lane.low = choose(lane.high < 2.0, Real(double(largest)), lane.low);
  lane.iterations = lane.iterations + 1.0;
  while (top >= 2 && !any_of(Real(double(top)) <= lane.high)) --top;
  return top;
}

// Until every lane's windows have one or two rows, or its iteration limit is met. [11, alg. 7.5.2]
template <int N>
[[gnu::noinline]] void iterate(Matrix<N>* H, Lane* lane, int max_iterations) {
  const int n = H[0].n(), cap = max_iterations * n;
  int top = n - 1;
  for (int g = 0; g < groups; ++g) lane[g].iterations = 0.0;
  for (int sweeps = 0; sweeps <= cap; ++sweeps) {
    int next = 0;
    for (int g = 0; g < groups; ++g) {
      const int last = settle(H[g], lane[g], top, max_iterations);
      next = last > next ? last : next;
    }
    top = next;
    if (top < 2) return;
    sweep(H, lane, top);
  }
}

// --- The remaining 1x1 and 2x2 blocks.

struct Two {
  Real re1, re2, im;
};

// Eigenvalues of [a b; c d] without cancellation: the smaller of two real ones from the product.
[[gnu::always_inline]] inline Two of_two(const Real& a, const Real& b, const Real& c,
                                         const Real& d) {
  const Real half = (a - d) * 0.5, product = b * c;
  const Real discriminant = multiply_add(half, half, product);
  const Real root = sqrt(abs(discriminant));
  const Real z = half + choose(half < 0.0, -root, root);
  const Real small = choose(z == 0.0, Real(0.0), product / z);
  const Mask complex = discriminant < 0.0;
  const Real mean = d + half;
  return {choose(complex, mean, d + z), choose(complex, mean, d - small),
          choose(complex, root, Real(0.0))};
}

template <int N>
[[gnu::noinline]] void finish(Matrix<N>& H, const Lane& lane, double* re, double* im,
                              std::size_t stride) {
  const int n = H.n();
  Real values[Matrix<N>::rows], imaginary[Matrix<N>::rows];
  for (int i = 0; i < n; ++i) {
    values[i] = H(i, i);
    imaginary[i] = 0.0;
  }
  for (int i = 0; i + 1 < n; ++i) {
    const Mask pair = !(H(i + 1, i) == 0.0);
    if (!any_of(pair)) continue;
    const Two two = of_two(H(i, i), H(i, i + 1), H(i + 1, i), H(i + 1, i + 1));
    values[i] = choose(pair, two.re1, values[i]);
    values[i + 1] = choose(pair, two.re2, values[i + 1]);
    imaginary[i] = choose(pair, two.im, imaginary[i]);
    imaginary[i + 1] = choose(pair, -two.im, imaginary[i + 1]);
  }
  const Real nan = __builtin_nan("");
  for (int i = 0; i < n; ++i) {  // + 0: removes the sign of a zero
    const std::size_t at = std::size_t(i) * stride;
    choose(lane.finite, values[i] * lane.unit + 0.0, nan).copy_to(re + at, element_aligned);
    choose(lane.finite, imaginary[i] * lane.unit + 0.0, nan).copy_to(im + at, element_aligned);
  }
}

template <int N>
[[gnu::noinline]] void solve(int n, const double* entries, std::size_t stride, double* re,
                             double* im, std::size_t out, int max_iterations,
                             unsigned char* status) {
  Matrix<N> A[groups];
  Lane lane[groups];
  for (int g = 0; g < groups; ++g) {
    A[g].size_ = n;
    load(entries + g * lane_count, stride, A[g], lane[g]);
    balance(A[g], lane[g]);
  }
  hessenberg(A);
  iterate(A, lane, max_iterations);
  for (int g = 0; g < groups; ++g) {
    finish(A[g], lane[g], re + g * lane_count, im + g * lane_count, out);
    for (std::size_t l = 0; l < lane_count; ++l)
      status[g * lane_count + l] = !lane[g].finite[l] ? not_finite
                                   : lane[g].hard[l]  ? fallback
                                                      : converged;
  }
}

// Prefetches the entries of the next matrices, n² streams apart, while these are processed.
void fetch(const EigenvalueTask& task, std::size_t k) {
  constexpr std::size_t line = 8;  // doubles
  if (k + width > task.last) return;
  for (std::size_t e = 0; e < task.n * task.n; ++e)
    for (std::size_t l = 0; l < width; l += line)
      __builtin_prefetch(task.entries + e * task.count + k + l);
}

template <int N>
void solve_all(const EigenvalueTask& task) {
  const std::size_t n = task.n, stride = task.count;
  std::size_t k = task.first;
  for (; k + width <= task.last; k += width) {
    fetch(task, k + width);
    solve<N>(int(n), task.entries + k, stride, task.re + k, task.im + k, stride,
             task.max_iterations, task.status + k);
  }
  const std::size_t left = task.last - k;
  if (left == 0) return;
  double entries[largest * largest * width] = {}, re[largest * width], im[largest * width];
  unsigned char status[width];
  for (std::size_t e = 0; e < n * n; ++e)
    for (std::size_t l = 0; l < left; ++l)
      entries[e * width + l] = task.entries[e * stride + k + l];
  solve<N>(int(n), entries, width, re, im, width, task.max_iterations, status);
  for (std::size_t l = 0; l < left; ++l) {
    for (std::size_t i = 0; i < n; ++i) {
      task.re[i * stride + k + l] = re[i * width + l];
      task.im[i * stride + k + l] = im[i * width + l];
    }
    task.status[k + l] = status[l];
  }
}

}  // namespace

}  // namespace tiltrim::TILTRIM_LANES

namespace tiltrim {

using namespace TILTRIM_LANES;

template <>
void eigenvalues<InstructionSet::TILTRIM_SET>(const EigenvalueTask& task) {
  switch (task.n) {
    case 4:
      return solve_all<4>(task);
    case 6:
      return solve_all<6>(task);
    default:
      return solve_all<0>(task);
  }
}

}  // namespace tiltrim
