/// @file
/// Ranges of numbers, rounded outward: every operation returns a range that contains all results.
///
/// Assumed: IEEE 754 binary64 with rounding to nearest and subnormal numbers (RoundToNearest), so
/// that + - * / and sqrt are correctly rounded, and a C library whose other functions err by at
/// most `library_ulps` units in the last place (docs/prove.md). A range that cannot be determined
/// is NaN, and no comparison with it holds.
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace tiltrim {

/// @cond
// Allowed error of the C library's sin, exp, ... in units in the last place.
inline constexpr double library_ulps = 8;
/// @endcond

/// A closed range [lower, upper].
class Interval {
 public:
  Interval() = default;                                   ///< [0, 0]
  Interval(double x) : lower_(x), upper_(x) {}            ///< one number
  Interval(double a, double b) : lower_(a), upper_(b) {}  ///< a <= b

  double lower() const { return lower_; }  ///< included
  double upper() const { return upper_; }  ///< included

  /// @cond
  // fl(c - (φ|c| + η)) is at most the predecessor of c, φ = u(1 + 2u)     [100]
  static double down(double c) { return c - (outward * std::abs(c) + smallest); }
  static double up(double c) { return c + (outward * std::abs(c) + smallest); }
  static Interval around(double a, double b) { return {down(a), up(b)}; }
  static Interval unknown() {
    constexpr double none = std::numeric_limits<double>::quiet_NaN();
    return {none, none};
  }
  bool zero() const { return lower_ == 0 && upper_ == 0; }

  friend Interval operator-(const Interval& a) { return {-a.upper_, -a.lower_}; }
  friend Interval operator+(const Interval& a) { return a; }
  friend Interval operator+(const Interval& a, const Interval& b) {
    if (a.zero()) return b;
    if (b.zero()) return a;
    return around(a.lower_ + b.lower_, a.upper_ + b.upper_);
  }
  friend Interval operator-(const Interval& a, const Interval& b) { return a + -b; }
  friend Interval operator*(const Interval& a, const Interval& b) {
    if ((a.zero() && b.finite()) || (b.zero() && a.finite())) return {};
    const double ll = a.lower_ * b.lower_, lu = a.lower_ * b.upper_;
    const double ul = a.upper_ * b.lower_, uu = a.upper_ * b.upper_;
    if (!std::isfinite((ll + lu) + (ul + uu))) return unknown();  // min and max would lose NaN
    return around(std::min(std::min(ll, lu), std::min(ul, uu)),
                  std::max(std::max(ll, lu), std::max(ul, uu)));
  }
  friend Interval operator/(const Interval& a, const Interval& b) {
    if (!(b.lower_ > 0 || b.upper_ < 0)) return unknown();
    return a * around(1 / b.upper_, 1 / b.lower_);
  }
  Interval& operator+=(const Interval& b) { return *this = *this + b; }
  Interval& operator-=(const Interval& b) { return *this = *this - b; }
  Interval& operator*=(const Interval& b) { return *this = *this * b; }
  /// @endcond

  /// Whether both ends are finite numbers.
  bool finite() const { return std::isfinite(lower_) && std::isfinite(upper_); }

 private:
  static constexpr double unit = std::numeric_limits<double>::epsilon() / 2;
  static constexpr double outward = unit * (1 + 2 * unit);
  static constexpr double smallest = std::numeric_limits<double>::denorm_min();

  double lower_ = 0.0, upper_ = 0.0;
};

/// @cond
// The range that both contain, if they have a number in common and contain the same quantity.
inline Interval both(const Interval& a, const Interval& b) {
  return {std::max(a.lower(), b.lower()), std::min(a.upper(), b.upper())};
}

// What contains both; NaN unless both are known.
inline Interval hull(const Interval& a, const Interval& b) {
  if (!a.finite() || !b.finite()) return Interval::unknown();
  return {std::min(a.lower(), b.lower()), std::max(a.upper(), b.upper())};
}

// The largest magnitude, a bound from above.
inline double magnitude(const Interval& a) {
  if (!a.finite()) return std::numeric_limits<double>::infinity();
  return std::max(std::abs(a.lower()), std::abs(a.upper()));
}

// A number near the middle.
inline double middle(const Interval& a) { return 0.5 * (a.lower() + a.upper()); }
// A bound from above of the distance from middle() to the ends.
inline double radius(const Interval& a) {
  if (!a.finite()) return std::numeric_limits<double>::infinity();
  const double m = middle(a);
  return Interval::up(std::max(a.upper() - m, m - a.lower()));
}

// The range of a function that does not decrease, from the C library's values at its ends.
inline Interval rising(double at_lower, double at_upper) {
  if (!std::isfinite(at_lower) || !std::isfinite(at_upper)) return Interval::unknown();
  constexpr double error = library_ulps * std::numeric_limits<double>::epsilon();
  constexpr double least = library_ulps * std::numeric_limits<double>::denorm_min();
  return Interval::around(at_lower - (error * std::abs(at_lower) + least),
                          at_upper + (error * std::abs(at_upper) + least));
}

inline Interval square(const Interval& a) {
  const double l = a.lower() * a.lower(), u = a.upper() * a.upper();
  if (!std::isfinite(l + u)) return Interval::unknown();
  const bool across = a.lower() < 0 && a.upper() > 0;
  return {across ? 0.0 : std::max(0.0, Interval::down(std::min(l, u))),
          Interval::up(std::max(l, u))};
}

inline Interval abs(const Interval& a) {
  if (a.lower() >= 0) return a;
  if (a.upper() <= 0) return -a;
  return a.finite() ? Interval(0.0, magnitude(a)) : Interval::unknown();
}

inline Interval sqrt(const Interval& a) {
  if (!(a.lower() >= 0)) return Interval::unknown();
  const double low = std::sqrt(a.lower());
  return {std::max(0.0, Interval::down(low)), Interval::up(std::sqrt(a.upper()))};
}

inline Interval exp(const Interval& a) {
  const Interval r = rising(std::exp(a.lower()), std::exp(a.upper()));
  return {r.lower() < 0 ? 0.0 : r.lower(), r.upper()};
}
inline Interval log(const Interval& a) {
  return a.lower() > 0 ? rising(std::log(a.lower()), std::log(a.upper())) : Interval::unknown();
}
inline Interval atan(const Interval& a) {
  return rising(std::atan(a.lower()), std::atan(a.upper()));
}
inline Interval tanh(const Interval& a) {
  return rising(std::tanh(a.lower()), std::tanh(a.upper()));
}
inline Interval asin(const Interval& a) {
  return rising(std::asin(a.lower()), std::asin(a.upper()));
}
inline Interval sinh(const Interval& a) {
  return rising(std::sinh(a.lower()), std::sinh(a.upper()));
}
inline Interval cosh(const Interval& a) {
  const Interval m = abs(a);
  return rising(std::cosh(m.lower()), std::cosh(m.upper()));
}

// A wave of period 2π with value at the ends, and a crest at `crest`, a trough at crest + π. Crests
// near an end within rounding are taken to be inside.
inline Interval wave(const Interval& a, double at_lower, double at_upper, double crest) {
  constexpr double pi = std::numbers::pi, largest = 1e6, slack = 1e-9;
  if (!a.finite()) return Interval::unknown();
  if (a.upper() - a.lower() >= 2 * pi || magnitude(a) > largest) return {-1.0, 1.0};
  const auto holds = [&](double at) {
    const double turns = std::ceil((a.lower() - slack - at) / (2 * pi));
    return at + 2 * pi * turns <= a.upper() + slack;
  };
  const Interval ends = rising(std::min(at_lower, at_upper), std::max(at_lower, at_upper));
  return {holds(crest + pi) ? -1.0 : std::max(-1.0, ends.lower()),
          holds(crest) ? 1.0 : std::min(1.0, ends.upper())};
}
inline Interval sin(const Interval& a) {
  return wave(a, std::sin(a.lower()), std::sin(a.upper()), std::numbers::pi / 2);
}
inline Interval cos(const Interval& a) {
  return wave(a, std::cos(a.lower()), std::cos(a.upper()), 0.0);
}

// Of a positive base; of any base for whole exponents.
inline Interval pow(const Interval& a, double b) {
  if (b == 0) return 1.0;
  if (!a.finite() || !std::isfinite(b)) return Interval::unknown();
  if (b < 0) return Interval(1.0) / pow(a, -b);
  if (a.lower() >= 0) return rising(std::pow(a.lower(), b), std::pow(a.upper(), b));
  if (b != std::floor(b)) return Interval::unknown();
  const bool odd = std::fmod(b, 2.0) != 0;
  if (!odd) return pow(abs(a), b);
  return rising(std::pow(a.lower(), b), std::pow(a.upper(), b));
}

// Where x > 0 or y does not change sign: the angle is continuous and extreme at corners.
inline Interval atan2(const Interval& y, const Interval& x) {
  if (!y.finite() || !x.finite()) return Interval::unknown();
  if (!(x.lower() > 0 || y.lower() > 0 || y.upper() < 0)) return Interval::unknown();
  const double a = std::atan2(y.lower(), x.lower()), b = std::atan2(y.lower(), x.upper());
  const double c = std::atan2(y.upper(), x.lower()), d = std::atan2(y.upper(), x.upper());
  return rising(std::min(std::min(a, b), std::min(c, d)), std::max(std::max(a, b), std::max(c, d)));
}
/// @endcond

}  // namespace tiltrim
