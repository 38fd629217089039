/// @file
/// Dual numbers for forward-mode differentiation, with the functions of `<cmath>`.
///
/// Used instead of Eigen's AutoDiffScalar because every operation returns a plain value: physics
/// can use `const auto` without dangling references, and an exact Jacobian costs clearly less than
/// with expression templates (bench/README.md).
#pragma once

#include <Eigen/Core>
#include <cmath>
#include <compare>
#include <numbers>

namespace tiltrim {

/// A number of type T with its derivatives along `width` directions; with width 0 a plain number
/// whose functions are found by the same lookup.
///
/// Provided are + - * / and their assignments, comparisons (of values), abs, fabs, min, max, fmin,
/// fmax, clamp, sqrt, cbrt, hypot, exp, expm1, log, log1p, log10, pow, sin, cos, tan, asin, acos,
/// atan, atan2, sinh, cosh, tanh, asinh, acosh and atanh, all called without std::; each accepts a
/// T in place of one of its arguments.
///
/// At a kink the derivative is that of the branch whose value is taken: abs at 0 from above, min
/// and max of equal arguments the first. Along a direction with zero derivative the result has zero
/// derivative even if the slope is infinite (sqrt at 0).
template <class T, int width = 6>
struct DualOf {
  static constexpr int directions = width;   ///< along which it carries derivatives
  using Slopes = Eigen::Array<T, width, 1>;  ///< one derivative per direction
  T value;                                   ///< the number itself
  Slopes slopes;                             ///< its derivatives

  DualOf() = default;                                    ///< uninitialized, like a double
  DualOf(T v) : value(v), slopes(Slopes::Zero()) {}      ///< a constant
  DualOf(T v, const Slopes& d) : value(v), slopes(d) {}  ///< a value and its derivatives

  /// A function by its value g and its derivative at a.value: a table, a spline, or any function
  /// not listed above.
  friend DualOf chain(const DualOf& a, T g, T slope) { return {g, along(slope, a)}; }

  /// @cond
  friend DualOf operator+(const DualOf& a, const DualOf& b) {
    return {a.value + b.value, a.slopes + b.slopes};
  }
  friend DualOf operator-(const DualOf& a, const DualOf& b) {
    return {a.value - b.value, a.slopes - b.slopes};
  }
  friend DualOf operator*(const DualOf& a, const DualOf& b) {
    return {a.value * b.value, b.value * a.slopes + a.value * b.slopes};
  }
  friend DualOf operator/(const DualOf& a, const DualOf& b) {
    const T ratio = a.value / b.value;
    return {ratio, (a.slopes - ratio * b.slopes) * (1 / b.value)};
  }
  friend DualOf operator+(const DualOf& a) { return a; }
  friend DualOf operator-(const DualOf& a) { return {-a.value, -a.slopes}; }
  friend DualOf operator+(const DualOf& a, T b) { return {a.value + b, a.slopes}; }
  friend DualOf operator+(T a, const DualOf& b) { return {a + b.value, b.slopes}; }
  friend DualOf operator-(const DualOf& a, T b) { return {a.value - b, a.slopes}; }
  friend DualOf operator-(T a, const DualOf& b) { return {a - b.value, -b.slopes}; }
  friend DualOf operator*(const DualOf& a, T b) { return {a.value * b, a.slopes * b}; }
  friend DualOf operator*(T a, const DualOf& b) { return {a * b.value, a * b.slopes}; }
  friend DualOf operator/(const DualOf& a, T b) { return {a.value / b, a.slopes * (1 / b)}; }
  friend DualOf operator/(T a, const DualOf& b) {
    const T ratio = a / b.value;
    return {ratio, b.slopes * (-ratio / b.value)};
  }
  DualOf& operator+=(const DualOf& b) { return *this = *this + b; }
  DualOf& operator-=(const DualOf& b) { return *this = *this - b; }
  DualOf& operator*=(const DualOf& b) { return *this = *this * b; }
  DualOf& operator/=(const DualOf& b) { return *this = *this / b; }

  // Comparisons
  friend bool operator==(const DualOf& a, const DualOf& b) { return a.value == b.value; }
  friend bool operator==(const DualOf& a, T b) { return a.value == b; }
  friend auto operator<=>(const DualOf& a, const DualOf& b) { return a.value <=> b.value; }
  friend auto operator<=>(const DualOf& a, T b) { return a.value <=> b; }

  // Pieces
  friend DualOf abs(const DualOf& a) { return a.value < 0 ? -a : a; }
  friend DualOf fabs(const DualOf& a) { return abs(a); }
  friend DualOf min(const DualOf& a, const DualOf& b) { return b.value < a.value ? b : a; }
  friend DualOf max(const DualOf& a, const DualOf& b) { return a.value < b.value ? b : a; }
  friend DualOf fmin(const DualOf& a, const DualOf& b) {
    return std::isnan(a.value) ? b : min(a, b);
  }
  friend DualOf fmax(const DualOf& a, const DualOf& b) {
    return std::isnan(a.value) ? b : max(a, b);
  }
  friend DualOf clamp(const DualOf& a, const DualOf& low, const DualOf& high) {
    return min(max(a, low), high);
  }

  // Roots, powers, logarithms
  friend DualOf sqrt(const DualOf& a) {
    const T root = std::sqrt(a.value);
    return {root, along(1 / (2 * root), a)};
  }
  friend DualOf cbrt(const DualOf& a) {
    const T root = std::cbrt(a.value);
    return {root, along(1 / (3 * root * root), a)};
  }
  friend DualOf hypot(const DualOf& a, const DualOf& b) {
    const T length = std::hypot(a.value, b.value);
    return {length, along(a.value / length, a) + along(b.value / length, b)};
  }
  friend DualOf exp(const DualOf& a) {
    const T power = std::exp(a.value);
    return {power, along(power, a)};
  }
  friend DualOf expm1(const DualOf& a) { return chain(a, std::expm1(a.value), std::exp(a.value)); }
  friend DualOf log(const DualOf& a) { return chain(a, std::log(a.value), 1 / a.value); }
  friend DualOf log1p(const DualOf& a) { return chain(a, std::log1p(a.value), 1 / (1 + a.value)); }
  friend DualOf log10(const DualOf& a) {
    return chain(a, std::log10(a.value), 1 / (std::numbers::ln10_v<T> * a.value));
  }
  friend DualOf pow(const DualOf& a, T b) {
    return {std::pow(a.value, b), along(by_base(a.value, b), a)};
  }
  friend DualOf pow(T a, const DualOf& b) {
    const T power = std::pow(a, b.value);
    return {power, along(by_exponent(a, power), b)};
  }
  friend DualOf pow(const DualOf& a, const DualOf& b) {
    const T power = std::pow(a.value, b.value);
    return {power, along(by_base(a.value, b.value), a) + along(by_exponent(a.value, power), b)};
  }

  // Circular and hyperbolic functions
  friend DualOf sin(const DualOf& a) { return chain(a, std::sin(a.value), std::cos(a.value)); }
  friend DualOf cos(const DualOf& a) { return chain(a, std::cos(a.value), -std::sin(a.value)); }
  friend DualOf tan(const DualOf& a) {
    const T tangent = std::tan(a.value);
    return {tangent, along(1 + tangent * tangent, a)};
  }
  friend DualOf asin(const DualOf& a) {
    return chain(a, std::asin(a.value), 1 / std::sqrt((1 - a.value) * (1 + a.value)));
  }
  friend DualOf acos(const DualOf& a) {
    return chain(a, std::acos(a.value), -1 / std::sqrt((1 - a.value) * (1 + a.value)));
  }
  friend DualOf atan(const DualOf& a) {
    return chain(a, std::atan(a.value), 1 / (1 + a.value * a.value));
  }
  friend DualOf atan2(const DualOf& y, const DualOf& x) {
    // d atan2(y, x) = (x dy - y dx) / (x² + y²)
    const T square = x.value * x.value + y.value * y.value;
    return {std::atan2(y.value, x.value), along(x.value / square, y) - along(y.value / square, x)};
  }
  friend DualOf sinh(const DualOf& a) { return chain(a, std::sinh(a.value), std::cosh(a.value)); }
  friend DualOf cosh(const DualOf& a) { return chain(a, std::cosh(a.value), std::sinh(a.value)); }
  friend DualOf tanh(const DualOf& a) {
    const T c = std::cosh(a.value);
    return chain(a, std::tanh(a.value), 1 / c / c);
  }
  friend DualOf asinh(const DualOf& a) {
    return chain(a, std::asinh(a.value), 1 / std::hypot(T(1), a.value));
  }
  friend DualOf acosh(const DualOf& a) {
    return chain(a, std::acosh(a.value), 1 / std::sqrt((a.value - 1) * (a.value + 1)));
  }
  friend DualOf atanh(const DualOf& a) {
    return chain(a, std::atanh(a.value), 1 / ((1 - a.value) * (1 + a.value)));
  }
  /// @endcond

 private:
  // slope · da; zero where da is zero, even for an infinite slope.
  static Slopes along(T slope, const DualOf& a) {
    if (std::isfinite(slope)) return slope * a.slopes;
    return (a.slopes == T(0)).select(Slopes::Zero(), slope * a.slopes);
  }
  // d aᵇ = b aᵇ⁻¹ da + aᵇ ln a db
  static T by_base(T a, T b) { return b == 0 ? T(0) : b * std::pow(a, b - 1); }
  static T by_exponent(T a, T power) { return power == 0 ? T(0) : power * std::log(a); }
};

/// A number with derivatives along six directions.
using Dual = DualOf<double>;
/// A number without derivatives, whose functions are found by the same lookup as a Dual's.
using Plain = DualOf<double, 0>;

}  // namespace tiltrim

/// @cond
// Eigen traits for vectors and matrices of dual numbers and their products with plain numbers.
template <class T, int width>
struct Eigen::NumTraits<tiltrim::DualOf<T, width>> : Eigen::NumTraits<T> {
  using Real = tiltrim::DualOf<T, width>;
  using NonInteger = tiltrim::DualOf<T, width>;
  using Nested = tiltrim::DualOf<T, width>;
  enum {
    RequireInitialization = 1,
    ReadCost = 1 + width,
    AddCost = 1 + width,
    MulCost = 1 + 3 * width
  };
};
template <class T, int width, class Operation>
struct Eigen::ScalarBinaryOpTraits<tiltrim::DualOf<T, width>, T, Operation> {
  using ReturnType = tiltrim::DualOf<T, width>;
};
template <class T, int width, class Operation>
struct Eigen::ScalarBinaryOpTraits<T, tiltrim::DualOf<T, width>, Operation> {
  using ReturnType = tiltrim::DualOf<T, width>;
};
/// @endcond
