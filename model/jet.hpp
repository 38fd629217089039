/// @file
/// Functions of a box to second order with a bound of what that leaves out, their derivatives with
/// respect to states, and the sides of their switches.
#pragma once

#include <array>
#include <cstddef>
#include <limits>
#include <span>
#include <vector>

#include "model/interval.hpp"

namespace tiltrim {

/// A function of d in [-1, 1]ⁿ: c + Σ a_k d_k + Σ_{k≥l} b_kl d_k d_l + rest, |rest| <= r, stored as
/// c, a, b (row by row of the lower triangle), r. With n = 0 a constant.
class Quadratic {
 public:
  Quadratic(const double* at, std::size_t n) : at_(at), n_(n) {}           ///< a view
  double centre() const { return at_[0]; }                                 ///< c
  std::size_t numbers() const { return n_; }                               ///< n
  double slope(std::size_t k) const { return k < n_ ? at_[1 + k] : 0.0; }  ///< a_k
  /// b_kl, l <= k
  double bend(std::size_t k, std::size_t l) const {
    return k < n_ ? at_[1 + n_ + k * (k + 1) / 2 + l] : 0.0;
  }
  double rest() const { return at_[length(n_) - 1]; }  ///< r; NaN if nothing is known
  Interval range() const;                              ///< that contains all values
  /// Of what is stored.
  static std::size_t length(std::size_t n) { return 2 + n + n * (n + 1) / 2; }

 private:
  const double* at_;
  std::size_t n_;
};

/// A scalar for proofs: a Quadratic of the box with its derivatives along m directions, which are
/// Quadratics as well. Constants have none. Functions are those of DualOf that are smooth, and min,
/// max, abs where one side holds. Where a function or its slope may not exist, the answer is not
/// known, and nothing is proved with it.
struct Jet {
  Jet() = default;                                ///< 0
  Jet(double x) : constant_{x, 0.0} {}            ///< a constant
  Jet(const Interval& x);                         ///< a constant that is known to a range
  static Jet quadratic(std::vector<double> row);  ///< without directions, as Quadratic stores it

  /// middle + radius d_along, of n numbers of the box.
  static Jet number(double middle, double radius, std::size_t along, std::size_t n);
  /// This quantity as an unknown, along one of m directions, or along none if only values are
  /// wanted.
  Jet unknown(std::size_t along, std::size_t m) const;

  Quadratic value() const { return {row(0), n_}; }  ///< of the quantity
  /// Its derivative along direction i.
  Quadratic slope(std::size_t i) const {
    static constexpr std::array<double, 2> zero{};
    return active(i) ? Quadratic(row(1 + i), n_) : Quadratic(zero.data(), 0);
  }
  Jet derivative(std::size_t i) const;  ///< the same, on its own
  /// Zero with the same derivatives: how the quantity moves about its value.
  Jet change() const;
  Jet value_only() const;                               ///< without directions
  Interval range() const { return value().range(); }    ///< all values
  bool depends_on_unknowns() const { return moving_; }  ///< whether a direction may move it
  bool constant() const { return n_ == 0; }             ///< over the box
  /// Whether the value has a bound.
  bool known() const { return std::isfinite(value().centre()) && std::isfinite(value().rest()); }
  /// Some value of this range that unknowns move, without derivatives.
  static Jet value_within(const Interval& range);
  Jet widened(double by) const;  ///< with a rest that is larger by this

  /// A function with its first four derivatives on a range.
  using Derivatives = std::array<Interval, 5>;
  /// g(a), by g and g' as functions of a, without directions.
  friend Jet along(const Jet& a, Jet value, const Jet& slope);
  /// g^(order) of a, without directions, by g at the centre of a and over all of a.
  friend Jet composed(const Jet& a, const Derivatives& centre, const Derivatives& over, int order);
  /// g(a) without directions, by g, g' at the centre of a and all slopes g'' of g' over a.
  friend Jet composed(const Jet& a, const Interval& g, const Interval& g1, const Interval& g2);
  /// The sine and cosine, computed once.
  friend std::array<Jet, 2> sine_cosine(const Jet& a);

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

  friend Jet abs(const Jet& a);
  friend Jet min(const Jet& a, const Jet& b);
  friend Jet max(const Jet& a, const Jet& b) { return -min(-a, -b); }
  friend Jet clamp(const Jet& a, const Jet& low, const Jet& high) { return min(max(a, low), high); }

  friend Jet sin(const Jet& a) { return sine_cosine(a)[0]; }
  friend Jet cos(const Jet& a) { return sine_cosine(a)[1]; }
  friend Jet tan(const Jet& a) {
    const auto [s, c] = sine_cosine(a);
    return s / c;
  }
  friend Jet sqrt(const Jet& a);
  friend Jet exp(const Jet& a);
  friend Jet log(const Jet& a);
  friend Jet atan(const Jet& a);
  friend Jet tanh(const Jet& a);
  friend Jet sinh(const Jet& a);
  friend Jet cosh(const Jet& a);
  friend Jet pow(const Jet& a, double b);
  friend Jet pow(const Jet& a, const Jet& b);
  friend Jet atan2(const Jet& y, const Jet& x);
  friend Jet asin(const Jet& a);
  friend Jet acos(const Jet& a);
  friend Jet asinh(const Jet& a);
  friend Jet acosh(const Jet& a);
  friend Jet atanh(const Jet& a);
  friend Jet log10(const Jet& a);
  friend Jet cbrt(const Jet& a);
  friend Jet hypot(const Jet& a, const Jet& b);
  /// @endcond

 private:
  Jet(std::size_t n, std::size_t m)
      : rows_(n > 0 ? Quadratic::length(n) * (m + 1) : 0), n_(n), m_(m) {}
  double* row(std::size_t i) {
    return n_ == 0 ? constant_.data() : rows_.data() + i * Quadratic::length(n_);
  }
  const double* row(std::size_t i) const {
    return n_ == 0 ? constant_.data() : rows_.data() + i * Quadratic::length(n_);
  }
  bool active(std::size_t i) const { return i < m_ && (active_ >> i & 1) != 0; }
  static Jet reciprocal(const Jet& a);
  static bool only_values(const Jet& a);

  std::array<double, 2> constant_{};  // c and r, if n = 0
  std::vector<double> rows_;          // the value, then one per direction
  std::size_t n_ = 0, m_ = 0;
  unsigned long long active_ = 0;  // of the directions, those whose derivative is not zero
  bool moving_ = false;
};

}  // namespace tiltrim
