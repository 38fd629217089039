/// The scalars of the physics: numbers, dual numbers and ranges, and operations specialized for
/// each, such as rotation by an angle.
/// Internal to model/ and vehicles/.
#pragma once

#include <cmath>
#include <limits>
#include <utility>

#include "model/dual.hpp"
#include "model/interval.hpp"
#include "model/jet.hpp"

namespace tiltrim {
/// Number of directions along which a Dual carries derivatives.
inline constexpr int dual_width = Dual::directions;
}  // namespace tiltrim

namespace tiltrim::physics {

// For double; the other scalars define their own.
inline double abs(double x) { return std::abs(x); }
inline double sqrt(double x) { return std::sqrt(x); }
inline double atan2(double y, double x) { return std::atan2(y, x); }

/// An angle with its sine and cosine, computed once and used in every row.
template <class S>
struct SinCos {
  S angle, sin, cos;
};

// Adjacent, so that the compiler merges the two calls into one.
inline SinCos<double> sin_cos(double angle) { return {angle, std::sin(angle), std::cos(angle)}; }

template <class T>
SinCos<DualOf<T>> sin_cos(const DualOf<T>& angle) {
  const SinCos<T> at = sin_cos(angle.value);
  return {angle, {at.sin, at.cos * angle.slopes}, {at.cos, -at.sin * angle.slopes}};
}

inline SinCos<Interval> sin_cos(const Interval& angle) { return {angle, sin(angle), cos(angle)}; }
inline SinCos<Jet> sin_cos(const Jet& angle) {
  auto [sine, cosine] = sine_cosine(angle);
  return {angle, std::move(sine), std::move(cosine)};
}

// Sum of two angles.
template <class S>
SinCos<S> operator+(const SinCos<S>& a, const SinCos<S>& b) {
  return {a.angle + b.angle, a.sin * b.cos + a.cos * b.sin, a.cos * b.cos - a.sin * b.sin};
}

// The same values; the derivatives come from the angle, without the product rule.
template <class T>
SinCos<DualOf<T>> operator+(const SinCos<DualOf<T>>& a, const SinCos<DualOf<T>>& b) {
  const DualOf<T> angle = a.angle + b.angle;
  const T sin = a.sin.value * b.cos.value + a.cos.value * b.sin.value;
  const T cos = a.cos.value * b.cos.value - a.sin.value * b.sin.value;
  return {angle, {sin, cos * angle.slopes}, {cos, -sin * angle.slopes}};
}

// Interval products ignore that both factors depend on the same angle; use the angle's range.
inline SinCos<Interval> operator+(const SinCos<Interval>& a, const SinCos<Interval>& b) {
  return sin_cos(a.angle + b.angle);
}
inline SinCos<Jet> operator+(const SinCos<Jet>& a, const SinCos<Jet>& b) {
  return sin_cos(a.angle + b.angle);
}

template <class S>
SinCos<S> operator-(const SinCos<S>& a, const SinCos<S>& b) {
  return a + SinCos<S>{-b.angle, -b.sin, b.cos};
}

/// Zero, as the length or angle of a vector (u, w) that vanishes: no derivative, except along
/// directions in which the vector is constant.
inline double vanished(double, double) { return 0.0; }

inline Dual vanished(const Dual& u, const Dual& w) {
  constexpr double none = std::numeric_limits<double>::quiet_NaN();
  return {0.0, (u.slopes == 0 && w.slopes == 0).select(Dual::Slopes::Zero(), none)};
}

}  // namespace tiltrim::physics
