/// The scalars the physics is evaluated on: numbers, numbers with derivatives, ranges; and what
/// each does in its own way: turning by an angle, looking up the polar.
/// Internal to model/.
#pragma once

#include <boost/numeric/interval.hpp>
#include <cmath>
#include <limits>

#include "model/dual.hpp"
#include "model/polar.hpp"

namespace tiltrim::physics {

using Rounding = boost::numeric::interval_lib::save_state_nothing<
    boost::numeric::interval_lib::rounded_transc_exact<double>>;
/// A range of numbers. Not outward rounded: who concludes from it leaves a margin (trim/proof.cpp).
using Interval =
    boost::numeric::interval<double,
                             boost::numeric::interval_lib::policies<
                                 Rounding, boost::numeric::interval_lib::checking_base<double>>>;

// For double; the other scalars bring their own.
inline double abs(double x) { return std::abs(x); }
inline double sqrt(double x) { return std::sqrt(x); }
inline double atan2(double y, double x) { return std::atan2(y, x); }

/// An angle with its sine and cosine, found together once and used in every row.
template <class S>
struct Turn {
  S angle, sin, cos;
};

// Side by side, so that the compiler makes one call of the two.
inline Turn<double> turn(double angle) { return {angle, std::sin(angle), std::cos(angle)}; }

template <class T>
Turn<DualOf<T>> turn(const DualOf<T>& angle) {
  const Turn<T> at = turn(angle.value);
  return {angle, {at.sin, at.cos * angle.slopes}, {at.cos, -at.sin * angle.slopes}};
}

inline Turn<Interval> turn(const Interval& angle) { return {angle, sin(angle), cos(angle)}; }

// One turn after another.
template <class S>
Turn<S> operator+(const Turn<S>& a, const Turn<S>& b) {
  return {a.angle + b.angle, a.sin * b.cos + a.cos * b.sin, a.cos * b.cos - a.sin * b.sin};
}

// The same values; the slopes need no product rule, for the angle has them.
template <class T>
Turn<DualOf<T>> operator+(const Turn<DualOf<T>>& a, const Turn<DualOf<T>>& b) {
  const DualOf<T> angle = a.angle + b.angle;
  const T sin = a.sin.value * b.cos.value + a.cos.value * b.sin.value;
  const T cos = a.cos.value * b.cos.value - a.sin.value * b.sin.value;
  return {angle, {sin, cos * angle.slopes}, {cos, -sin * angle.slopes}};
}

// Ranges of products forget that both factors turn by one angle; the range of the angle does not.
inline Turn<Interval> operator+(const Turn<Interval>& a, const Turn<Interval>& b) {
  return turn(a.angle + b.angle);
}

template <class S>
Turn<S> operator-(const Turn<S>& a, const Turn<S>& b) {
  return a + Turn<S>{-b.angle, -b.sin, b.cos};
}

template <class S>
struct CoefficientsOf {
  S CL, CD, CM;
};

inline CoefficientsOf<double> coefficients(const Polar& polar, double alpha) {
  const auto [CL, CD, CM] = polar.at(alpha);
  return {CL, CD, CM};
}

inline CoefficientsOf<Dual> coefficients(const Polar& polar, const Dual& alpha) {
  const auto [value, slope] = polar.slope_at(alpha.value);
  return {{value.CL, slope.CL * alpha.slopes},
          {value.CD, slope.CD * alpha.slopes},
          {value.CM, slope.CM * alpha.slopes}};
}

inline CoefficientsOf<Interval> coefficients(const Polar& polar, const Interval& alpha) {
  const auto [CL, CD, CM] = polar.range(alpha.lower(), alpha.upper());
  return {{CL.lower, CL.upper}, {CD.lower, CD.upper}, {CM.lower, CM.upper}};
}

/// Zero, as the length or angle of a vector (u, w) that vanishes: without derivative, but along
/// directions in which the vector stays.
inline double vanished(double, double) { return 0.0; }

inline Dual vanished(const Dual& u, const Dual& w) {
  constexpr double none = std::numeric_limits<double>::quiet_NaN();
  return {0.0, (u.slopes == 0 && w.slopes == 0).select(Dual::Slopes::Zero(), none)};
}

}  // namespace tiltrim::physics
