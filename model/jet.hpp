/// @file
/// Ranges of a function with its first and second derivatives, and the sides of its switches.
#pragma once

#include <cmath>
#include <limits>
#include <vector>

#include "model/interval.hpp"

namespace tiltrim {

/// The outcomes of comparisons while a model is evaluated on ranges. A comparison that a range
/// leaves open has two sides; which one holds must not depend on the unknowns.
struct Branches {
  std::size_t unknowns = 0;       ///< the first directions of every Jet
  std::vector<char> taken{};      ///< outcomes of the comparisons of known quantities, in order
  std::size_t next = 0;           ///< position in `taken`; what follows is appended
  std::vector<char> open{};       ///< whether each of `taken` was open: both outcomes are possible
  std::vector<char> all{};        ///< outcomes of all comparisons
  bool blocked = false;           ///< a comparison of unknowns was open, or one contradicts `taken`
  bool free = false;              ///< a part of where `taken` holds: what is not open may differ
  std::vector<double> extents{};  ///< of the directions; not empty: values are tightened
  bool replay = false;            ///< `taken` is complete: a further open comparison blocks
};

/// The sides of this thread; null: an open comparison gives NaN.
inline thread_local Branches* current_branches = nullptr;

/// Makes these the sides of this thread during its lifetime.
class Watched {
 public:
  explicit Watched(Branches& sides) { current_branches = &sides; }  ///< from now on
  ~Watched() { current_branches = nullptr; }
  Watched(const Watched&) = delete;
  Watched& operator=(const Watched&) = delete;
};

/// A range with the ranges of its first and second derivatives along n directions. Constants have
/// none. Functions are those of DualOf that are smooth, and min, max, abs where one side holds.
struct Jet {
  Interval value;               ///< of the number
  Interval centre;              ///< its value at the middle of all directions
  std::vector<Interval> slope;  ///< n, or none for a constant
  std::vector<Interval> bend;   ///< n (n + 1)/2, row by row of the lower triangle, or none
  std::vector<Interval> tilt;   ///< slopes at the middle of all directions; n, or none

  Jet() = default;                                 ///< 0
  Jet(double x) : value(x), centre(x) {}           ///< a constant
  Jet(const Interval& x) : value(x), centre(x) {}  ///< a constant that is known to a range

  /// Variable `along` of `count`, with this range and middle; without second derivatives unless
  /// `curved`.
  static Jet variable(const Interval& range, double middle, std::size_t along, std::size_t count,
                      double scale, bool curved) {
    Jet x(range);
    x.centre = middle;
    x.slope.resize(count);
    if (curved) x.bend.resize(count * (count + 1) / 2);
    x.slope[along] = scale;
    if (curved) x.tilt = x.slope;
    return x;
  }
  /// Second derivative along i and j.
  Interval bend_at(std::size_t i, std::size_t j) const {
    if (bend.empty()) return {};
    return i >= j ? bend[i * (i + 1) / 2 + j] : bend[j * (j + 1) / 2 + i];
  }
  /// First derivative along i.
  Interval slope_at(std::size_t i) const { return slope.empty() ? Interval() : slope[i]; }

  /// A function's value and its first and second derivative.
  struct Taylor {
    Interval value;  ///< g
    Interval slope;  ///< g'
    Interval bend;   ///< g''
  };
  /// g(a), by g over a.value and at a.centre.
  friend Jet chain(const Jet& a, const Taylor& over, const Taylor& centre);
  /// g(a), of a function of ranges that returns a Taylor.
  template <class G>
  friend Jet chain(const Jet& a, const G& g) {
    return chain(a, g(a.value), g(a.centre));
  }

  /// @cond
  friend Jet operator+(const Jet& a, const Jet& b);
  friend Jet operator-(const Jet& a, const Jet& b);
  friend Jet operator*(const Jet& a, const Jet& b);
  friend Jet operator/(const Jet& a, const Jet& b);
  friend Jet operator-(const Jet& a);
  friend Jet operator+(const Jet& a) { return a; }
  Jet& operator+=(const Jet& b) { return *this = *this + b; }
  Jet& operator-=(const Jet& b) { return *this = *this - b; }
  Jet& operator*=(const Jet& b) { return *this = *this * b; }
  Jet& operator/=(const Jet& b) { return *this = *this / b; }

  friend bool operator<(const Jet& a, const Jet& b) { return below(a, b, false); }
  friend bool operator<=(const Jet& a, const Jet& b) { return below(a, b, true); }
  friend bool operator>(const Jet& a, const Jet& b) { return below(b, a, false); }
  friend bool operator>=(const Jet& a, const Jet& b) { return below(b, a, true); }
  friend bool below(const Jet& a, const Jet& b, bool or_equal);

  friend Jet abs(const Jet& a) { return a >= 0.0 ? a : -a; }
  friend Jet min(const Jet& a, const Jet& b) { return b < a ? b : a; }
  friend Jet max(const Jet& a, const Jet& b) { return a < b ? b : a; }
  friend Jet clamp(const Jet& a, const Jet& low, const Jet& high) { return min(max(a, low), high); }

  friend Jet sqrt(const Jet& a) {
    return chain(a, [](const Interval& x) {
      const Interval g = sqrt(x), g1 = Interval(1.0) / (2.0 * g);
      return Taylor{g, g1, -g1 / (2.0 * x)};
    });
  }
  friend Jet exp(const Jet& a) {
    return chain(a, [](const Interval& x) { return Taylor{exp(x), exp(x), exp(x)}; });
  }
  friend Jet log(const Jet& a) {
    return chain(a, [](const Interval& x) {
      const Interval g1 = Interval(1.0) / x;
      return Taylor{log(x), g1, -square(g1)};
    });
  }
  friend Jet sin(const Jet& a) {
    return chain(a, [](const Interval& x) { return Taylor{sin(x), cos(x), -sin(x)}; });
  }
  friend Jet cos(const Jet& a) {
    return chain(a, [](const Interval& x) { return Taylor{cos(x), -sin(x), -cos(x)}; });
  }
  friend Jet tan(const Jet& a) { return sin(a) / cos(a); }
  friend Jet atan(const Jet& a) {
    return chain(a, [](const Interval& x) {
      const Interval g1 = Interval(1.0) / (1.0 + square(x));
      return Taylor{atan(x), g1, -2.0 * x * square(g1)};
    });
  }
  friend Jet tanh(const Jet& a) {
    return chain(a, [](const Interval& x) {
      const Interval g = tanh(x), g1 = 1.0 - square(g);
      return Taylor{g, g1, -2.0 * g * g1};
    });
  }
  friend Jet sinh(const Jet& a) {
    return chain(a, [](const Interval& x) { return Taylor{sinh(x), cosh(x), sinh(x)}; });
  }
  friend Jet cosh(const Jet& a) {
    return chain(a, [](const Interval& x) { return Taylor{cosh(x), sinh(x), cosh(x)}; });
  }
  friend Jet pow(const Jet& a, double b) {
    return chain(a, [b](const Interval& x) {
      return Taylor{pow(x, b), b * pow(x, b - 1), b * (b - 1) * pow(x, b - 2)};
    });
  }
  friend Jet atan2(const Jet& y, const Jet& x) {
    if (x.value.lower() > 0) return atan(y / x);
    const double side = y.value.lower() > 0 ? 1 : y.value.upper() < 0 ? -1 : none;
    return side * Jet(half_turn()) - atan(x / y);
  }
  static constexpr double none = std::numeric_limits<double>::quiet_NaN();
  static Interval half_turn() {
    return Interval::around(std::numbers::pi / 2, std::numbers::pi / 2);
  }
  /// @endcond
};

using Jets = std::vector<Jet>;  ///< one per signal

}  // namespace tiltrim
