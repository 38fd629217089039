/// A number with its derivatives along `dual_width` directions (forward mode).
/// Internal to model/.
///
/// Own rather than Eigen's AutoDiffScalar: every operation returns a plain value, so that physics
/// may say `const auto` and nothing dangles, and an exact Jacobian costs clearly less than through
/// expression templates (bench/README.md). T is the real behind it.
#pragma once

#include <Eigen/Core>
#include <cmath>

namespace tiltrim::physics {

inline constexpr int dual_width = 6;

template <class T>
struct DualOf {
  using Slopes = Eigen::Array<T, dual_width, 1>;
  T value;
  Slopes slopes;

  DualOf() = default;  // left unset, as a double is
  DualOf(T v) : value(v), slopes(Slopes::Zero()) {}
  DualOf(T v, const Slopes& d) : value(v), slopes(d) {}

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

  friend bool operator<=(const DualOf& a, T b) { return a.value <= b; }
  friend bool operator>=(const DualOf& a, T b) { return a.value >= b; }
  friend bool operator>(const DualOf& a, T b) { return a.value > b; }
  friend bool operator>=(const DualOf& a, const DualOf& b) { return a.value >= b.value; }

  friend DualOf abs(const DualOf& a) { return a.value < 0 ? -a : a; }
  friend DualOf sqrt(const DualOf& a) {
    const T root = std::sqrt(a.value);
    return {root, a.slopes * (1 / (2 * root))};
  }
  // d atan2(y, x) = (x dy - y dx) / (x² + y²)
  friend DualOf atan2(const DualOf& y, const DualOf& x) {
    const T square = x.value * x.value + y.value * y.value;
    return {std::atan2(y.value, x.value),
            (x.value / square) * y.slopes - (y.value / square) * x.slopes};
  }
};

using Dual = DualOf<double>;

}  // namespace tiltrim::physics
