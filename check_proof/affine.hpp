/// Functions of the box: value + Σ slope_k d_k for d in [-1, 1]ⁿ. Every quantity that is not linear
/// in d is enclosed in the radius of the value, second derivatives included. Internal to
/// check_proof/.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>

#include "check_proof/ball.hpp"

namespace tiltrim::checking {

inline constexpr std::size_t most_numbers = 8;  ///< of a box; no certificate has more

struct Affine {
  Ball value{};
  std::array<Ball, most_numbers> slopes{};
  std::size_t n = 0;  ///< slopes beyond are zero

  Affine() = default;
  Affine(double constant) : value(constant) {}
  Affine(Ball constant) : value(std::move(constant)) {}

  bool is_zero() const { return n == 0 && value.is_zero(); }
};

/// Σ |slope_k|
inline Ball spread_of(const Affine& a) {
  Ball sum;
  for (std::size_t k = 0; k < a.n; ++k) sum += magnitude(a.slopes[k]);
  return sum;
}

/// All its values.
inline Ball range(const Affine& a) { return widened(a.value, spread_of(a)); }

inline Affine& operator+=(Affine& a, const Affine& b) {
  a.value += b.value;
  for (std::size_t k = 0; k < b.n; ++k) a.slopes[k] += b.slopes[k];
  a.n = std::max(a.n, b.n);
  return a;
}
inline Affine& operator-=(Affine& a, const Affine& b) {
  a.value -= b.value;
  for (std::size_t k = 0; k < b.n; ++k) a.slopes[k] -= b.slopes[k];
  a.n = std::max(a.n, b.n);
  return a;
}
inline Affine operator+(Affine a, const Affine& b) { return std::move(a += b); }
inline Affine operator-(Affine a, const Affine& b) { return std::move(a -= b); }
inline Affine operator-(const Affine& a) {
  Affine r;
  r -= a;
  return r;
}

/// (a₀ + Σ aₖdₖ)(b₀ + Σ bₖdₖ): of the products of slopes, dₖ² is in [0, 1], dⱼdₖ in [-1, 1].
inline Affine operator*(const Affine& a, const Affine& b) {
  Affine r;
  if (a.is_zero() || b.is_zero()) return r;
  r.value = a.value * b.value;
  r.n = std::max(a.n, b.n);
  for (std::size_t k = 0; k < a.n; ++k) r.slopes[k] = a.slopes[k] * b.value;
  for (std::size_t k = 0; k < b.n; ++k) r.slopes[k].add_product(a.value, b.slopes[k]);
  Ball rest;
  for (std::size_t k = 0; k < std::min(a.n, b.n); ++k) {
    const Ball half = halved(a.slopes[k] * b.slopes[k]);
    r.value += half;
    rest += magnitude(half);
  }
  for (std::size_t j = 0; j < a.n; ++j)
    for (std::size_t k = 0; k < j; ++k)
      rest += magnitude(a.slopes[j] * b.slopes[k] + a.slopes[k] * b.slopes[j]);
  for (std::size_t j = a.n; j < b.n; ++j)
    for (std::size_t k = 0; k < a.n; ++k) rest += magnitude(a.slopes[k] * b.slopes[j]);
  r.value = widened(std::move(r.value), rest);
  return r;
}

/// f(x) by f(m) and f'(m) at a point m, and f'' over all values of x:
///   f(m) + f'(m) (x - m) + ½ f'' (x - m)²
/// This holds for f' that is only Lipschitz, with all of its slopes in f''.
inline Affine composed(const Affine& x, const Ball& f, const Ball& slope, const Ball& second) {
  Affine r;
  const Ball around = x.value - midpoint(x.value);
  r.n = x.n;
  for (std::size_t k = 0; k < x.n; ++k) r.slopes[k] = slope * x.slopes[k];
  const Ball distance = magnitude(around) + spread_of(x);
  const Ball quarter = halved(halved(second * distance * distance));
  // ½ f'' (x - m)² lies between 0 and twice this.
  r.value = widened(f + slope * around + quarter, magnitude(quarter));
  return r;
}

inline Affine inverse(const Affine& x) {
  if (x.n == 0) return {Ball(1) / x.value};
  const Ball m = midpoint(x.value), all = range(x);
  const Ball f = Ball(1) / m;
  return composed(x, f, -(f * f), Ball(2) / (all * all * all));
}
inline Affine operator/(const Affine& a, const Affine& b) { return a * inverse(b); }

inline Affine sqrt(const Affine& x) {
  if (x.n == 0) return {sqrt(x.value)};
  const Ball m = midpoint(x.value), all = range(x);
  const Ball f = sqrt(m);
  return composed(x, f, Ball(0.5) / f, Ball(-0.25) / (all * sqrt(all)));
}

inline Affine sin(const Affine& x) {
  const Ball m = midpoint(x.value);
  const Ball f = sin(m);
  return composed(x, f, cos(m), -sin(range(x)));
}

inline Affine cos(const Affine& x) {
  const Ball m = midpoint(x.value);
  const Ball f = cos(m);
  return composed(x, f, -sin(m), -cos(range(x)));
}

/// |x|; where x may vanish, the range of it.
inline Affine abs(const Affine& x) {
  const Ball all = range(x);
  if (all.is_positive()) return x;
  if (all.is_negative()) return -x;
  return {abs(all)};
}

/// 1, -1, or between them where x may vanish.
inline Affine sign(const Affine& x) {
  const Ball all = range(x);
  if (all.is_positive()) return {1.0};
  if (all.is_negative()) return {-1.0};
  return {widened(Ball(0), Ball(1))};
}

/// A number and its derivatives with respect to the six states.
struct Dual {
  Affine value{};
  std::array<Affine, 6> slopes{};

  Dual() = default;
  Dual(double constant) : value(constant) {}
  Dual(Affine constant) : value(std::move(constant)) {}
};

inline Dual operator+(Dual a, const Dual& b) {
  a.value += b.value;
  for (std::size_t i = 0; i < 6; ++i) a.slopes[i] += b.slopes[i];
  return a;
}
inline Dual operator-(Dual a, const Dual& b) {
  a.value -= b.value;
  for (std::size_t i = 0; i < 6; ++i) a.slopes[i] -= b.slopes[i];
  return a;
}
inline Dual operator*(const Dual& a, const Dual& b) {
  Dual r{a.value * b.value};
  for (std::size_t i = 0; i < 6; ++i) r.slopes[i] = a.slopes[i] * b.value + a.value * b.slopes[i];
  return r;
}

/// The chain rule.
inline Dual chained(const Dual& x, Affine value, const Affine& slope) {
  Dual r{std::move(value)};
  for (std::size_t i = 0; i < 6; ++i) r.slopes[i] = slope * x.slopes[i];
  return r;
}

inline Dual operator/(const Dual& a, const Dual& b) {
  const Affine over = inverse(b.value);
  return a * chained(b, over, -(over * over));
}
inline Dual sqrt(const Dual& x) {
  const Affine root = sqrt(x.value);
  return chained(x, root, inverse(root + root));
}
inline Dual sin(const Dual& x) { return chained(x, sin(x.value), cos(x.value)); }
inline Dual cos(const Dual& x) { return chained(x, cos(x.value), -sin(x.value)); }
inline Dual abs(const Dual& x) { return chained(x, abs(x.value), sign(x.value)); }

}  // namespace tiltrim::checking
