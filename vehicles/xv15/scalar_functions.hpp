/// What the physics needs of its scalar: double, dual or complex numbers.
/// Internal to vehicles/xv15/.
#pragma once

#include <cmath>
#include <complex>
#include <concepts>
#include <numbers>

#include "model/degrees.hpp"
#include "model/dual.hpp"

namespace tiltrim::xv15 {

using std::atan2;
using std::cos;
using std::sin;
using std::sqrt;

/// The value that decides on which piece of a table a scalar lies.
inline double real_part(double x) { return x; }
inline double real_part(const std::complex<double>& x) { return x.real(); }
template <class T, int width>
double real_part(const DualOf<T, width>& x) {
  return x.value;
}

/// A scalar without derivatives.
template <class S>
constexpr bool without_slopes = std::same_as<S, double> || std::same_as<S, Plain>;

/// Zero in value and derivatives.
inline bool vanishes(double x) { return x == 0; }
inline bool vanishes(const std::complex<double>& x) { return x == 0.0; }
template <class T, int width>
bool vanishes(const DualOf<T, width>& x) {
  return x.value == 0 && (x.slopes == T(0)).all();
}

/// Analytic near the real axis; std has no complex atan2.
inline std::complex<double> atan2(const std::complex<double>& y, const std::complex<double>& x) {
  const double angle = std::atan2(y.real(), x.real());
  // The angle of (x, y) turned back by its real part is small.
  const double c = std::cos(angle), s = std::sin(angle);
  return angle + std::atan((y * c - x * s) / (x * c + y * s));
}

constexpr double degree = std::numbers::pi / 180;

/// max(0, x) with its kink rounded within `width`: the mean of max over a parabolic window, C².
template <class S>
S rounded_ramp(const S& x, double width) {
  const double at = real_part(x);
  if (at <= -width) return S(0.0);
  if (at >= width) return x;
  const S t = x * (1 / width);
  return width * 0.5 * (t + (0.375 + t * t * (0.75 - 0.125 * t * t)));
}

/// |d| with its kink replaced within `width`: C², equal to |d| outside and at its middle.
template <class S>
S rounded_kink(const S& d, double width) {
  const S t2 = d * d * (1 / (width * width));
  return width * t2 * (1.875 + t2 * (0.375 * t2 - 1.25));
}

}  // namespace tiltrim::xv15
