/// Real functions of the box to second order. Internal to check_proof/.
#pragma once

#include <array>
#include <cstddef>

#include "check_proof/polynomial.hpp"

namespace tiltrim::checking {

inline constexpr std::size_t most_numbers = 8;  ///< of a box; no certificate has more

using Form = Polynomial<Ball, most_numbers, 2>;

/// a d + b d² for d in [-1, 1], as a ball.
inline Ball parabola(const Ball& a, const Ball& b) {
  const Ball slope = magnitude(a), half = halved(b);
  if (less_equal(magnitude(b + b), slope)) return widened(b, slope);  // monotone
  return widened(half, slope + magnitude(half));
}

/// All its values.
inline Ball range(const Form& f) {
  const Monomials& m = Form::monomials();
  Ball all = widened(f.value(), f.rest);
  for (std::size_t k = 0; k < f.n; ++k) {
    const std::size_t own = m.linear(k), square = m.product(own, own);
    for (std::size_t i = own + 1; i < m.count(k + 1); ++i)
      if (i != square) all = widened(std::move(all), magnitude(f.c[i]));
    all += parabola(f.c[own], f.c[square]);
  }
  return all;
}

/// f(x) by the parabola through f at m - a, m, m + a, where m is the middle of x. With t = x - m in
/// [-r, r] it leaves out (t³ - a² t) f‴/6; for a near √3/2 r that is at most r³ f‴/24. This holds
/// for f″ that is only Lipschitz, with all of its slopes in f‴.
template <class Function>
Form composed(const Form& x, const Function& f, const Ball& third) {
  const Ball all = range(x), m = midpoint(all), r = magnitude(all - m);
  if (x.n == 0) return {f(all)};
  const Ball f0 = f(m);
  if (r.is_zero()) return {f0};
  const Ball a = midpoint(r * Ball(0.8660254)), a2 = a * a;
  const Ball below = f(m - a), above = f(m + a);
  const Ball slope = (above - below) / (a + a), bend = (halved(above + below) - f0) / a2;
  const Ball most = hull(r * (r * r - a2), Ball(0.38490018) * a * a2);  // at the ends, at a/√3
  const Form t = x - Form(m);
  Form fit = t * (Form(slope) + Form(bend) * t) + Form(f0);
  fit.rest = upper(fit.rest + magnitude(third) * magnitude(most) / Ball(6));
  return fit;
}

inline Form inverse(const Form& x) {
  const Ball over = Ball(1) / range(x), square = over * over;
  return composed(
      x, [](const Ball& at) { return Ball(1) / at; }, Ball(-6) * square * square);
}
inline Form operator/(const Form& a, const Form& b) { return a * inverse(b); }

inline Form sqrt(const Form& x) {
  const Ball all = range(x);
  return composed(
      x, [](const Ball& at) { return sqrt(at); }, Ball(0.375) / (all * all * sqrt(all)));
}

inline Form sin(const Form& x) {
  return composed(
      x, [](const Ball& at) { return sin(at); }, -cos(range(x)));
}

inline Form cos(const Form& x) {
  return composed(
      x, [](const Ball& at) { return cos(at); }, sin(range(x)));
}

/// |x|; where x may vanish, the range of it.
inline Form abs(const Form& x) {
  const Ball all = range(x);
  if (all.is_positive()) return x;
  if (all.is_negative()) return -x;
  return {abs(all)};
}

/// 1, -1, or between them where x may vanish.
inline Form sign(const Form& x) {
  const Ball all = range(x);
  if (all.is_positive()) return {1.0};
  if (all.is_negative()) return {-1.0};
  return {widened(Ball(0), Ball(1))};
}

/// A number and its derivatives with respect to the six states.
struct Dual {
  Form value{};
  std::array<Form, 6> slopes{};

  Dual() = default;
  Dual(double constant) : value(constant) {}
  Dual(Form constant) : value(std::move(constant)) {}
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
inline Dual chained(const Dual& x, Form value, const Form& slope) {
  Dual r{std::move(value)};
  for (std::size_t i = 0; i < 6; ++i) r.slopes[i] = slope * x.slopes[i];
  return r;
}

inline Dual operator/(const Dual& a, const Dual& b) {
  const Form over = inverse(b.value);
  return a * chained(b, over, -(over * over));
}
inline Dual sqrt(const Dual& x) {
  const Form root = sqrt(x.value);
  return chained(x, root, inverse(root + root));
}
inline Dual sin(const Dual& x) { return chained(x, sin(x.value), cos(x.value)); }
inline Dual cos(const Dual& x) { return chained(x, cos(x.value), -sin(x.value)); }
inline Dual abs(const Dual& x) { return chained(x, abs(x.value), sign(x.value)); }

}  // namespace tiltrim::checking
