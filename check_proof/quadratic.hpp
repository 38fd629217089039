/// Complex functions of the box and of a frequency's place in its interval, with the second-order
/// terms kept: value + Σ linear_k d_k + Σ_{k≥l} second_kl d_k d_l + rest, |d_k| ≤ 1.
/// Internal to check_proof/.
#pragma once

#include <acb.h>

#include <array>
#include <utility>

#include "check_proof/affine.hpp"

namespace tiltrim::checking {

class Complex {
 public:
  Complex() { acb_init(z_); }
  Complex(const Ball& re, const Ball& im) : Complex() { acb_set_arb_arb(z_, re.get(), im.get()); }
  Complex(const Complex& other) : Complex() { acb_set(z_, other.z_); }
  Complex(Complex&& other) noexcept : Complex() { acb_swap(z_, other.z_); }
  Complex& operator=(const Complex& other) {
    acb_set(z_, other.z_);
    return *this;
  }
  Complex& operator=(Complex&& other) noexcept {
    acb_swap(z_, other.z_);
    return *this;
  }
  ~Complex() { acb_clear(z_); }

  acb_ptr get() { return z_; }
  acb_srcptr get() const { return z_; }

  Complex& operator+=(const Complex& b) {
    acb_add(z_, z_, b.z_, bits);
    return *this;
  }
  Complex& operator-=(const Complex& b) {
    acb_sub(z_, z_, b.z_, bits);
    return *this;
  }
  Complex& add_product(const Complex& a, const Complex& b) {
    acb_addmul(z_, a.z_, b.z_, bits);
    return *this;
  }
  Ball real() const {
    Ball r;
    arb_set(r.get(), acb_realref(z_));
    return r;
  }

 private:
  acb_t z_;
};

inline Complex operator+(Complex a, const Complex& b) { return std::move(a += b); }
inline Complex operator-(Complex a, const Complex& b) { return std::move(a -= b); }
inline Complex operator*(const Complex& a, const Complex& b) {
  Complex r;
  acb_mul(r.get(), a.get(), b.get(), bits);
  return r;
}
inline Complex operator*(const Complex& a, const Ball& b) {
  Complex r;
  acb_mul_arb(r.get(), a.get(), b.get(), bits);
  return r;
}
inline Complex inverse(const Complex& a) {
  Complex r;
  acb_inv(r.get(), a.get(), bits);
  return r;
}
inline Complex midpoint(const Complex& a) {
  Complex r;
  acb_get_mid(r.get(), a.get());
  return r;
}
/// The largest modulus, as a point.
inline Ball magnitude(const Complex& a) {
  Ball r;
  acb_get_abs_ubound_arf(arb_midref(r.get()), a.get(), bits);
  return r;
}

struct Quadratic {
  static constexpr std::size_t most = most_numbers + 1;
  std::size_t n = 0;
  Complex value{};
  std::array<Complex, most> linear{};
  std::array<std::array<Complex, most>, most> second{};  ///< [k][l], l ≤ k
  Ball rest{};                                           ///< a bound of the modulus

  Ball linear_sum() const {
    Ball sum;
    for (std::size_t k = 0; k < n; ++k) sum += magnitude(linear[k]);
    return sum;
  }
  Ball second_sum() const {
    Ball sum;
    for (std::size_t k = 0; k < n; ++k)
      for (std::size_t l = 0; l <= k; ++l) sum += magnitude(second[k][l]);
    return sum;
  }
};

inline Quadratic operator-(Quadratic a, const Quadratic& b) {
  a.value -= b.value;
  for (std::size_t k = 0; k < a.n; ++k) {
    a.linear[k] -= b.linear[k];
    for (std::size_t l = 0; l <= k; ++l) a.second[k][l] -= b.second[k][l];
  }
  a.rest = upper(a.rest + b.rest);
  return a;
}
inline Quadratic operator+(Quadratic a, const Quadratic& b) {
  a.value += b.value;
  for (std::size_t k = 0; k < a.n; ++k) {
    a.linear[k] += b.linear[k];
    for (std::size_t l = 0; l <= k; ++l) a.second[k][l] += b.second[k][l];
  }
  a.rest = upper(a.rest + b.rest);
  return a;
}

inline Quadratic operator*(const Quadratic& a, const Quadratic& b) {
  Quadratic r;
  r.n = a.n;
  r.value = a.value * b.value;
  for (std::size_t k = 0; k < a.n; ++k) {
    r.linear[k] = (a.value * b.linear[k]).add_product(a.linear[k], b.value);
    for (std::size_t l = 0; l <= k; ++l) {
      Complex& s = r.second[k][l];
      s = (a.value * b.second[k][l]).add_product(a.second[k][l], b.value);
      s.add_product(a.linear[k], b.linear[l]);
      if (l < k) s.add_product(a.linear[l], b.linear[k]);
    }
  }
  const Ball a1 = a.linear_sum(), a2 = a.second_sum(), b1 = b.linear_sum(), b2 = b.second_sum();
  const Ball all_a = magnitude(a.value) + a1 + a2, all_b = magnitude(b.value) + b1 + b2;
  r.rest = upper(a1 * b2 + a2 * b1 + a2 * b2 + a.rest * (all_b + b.rest) + all_a * b.rest);
  return r;
}

/// A lower bound of Re(v z) over the box.
inline Ball least_real(const Complex& v, const Quadratic& z) {
  Ball least = (v * z.value).real() - magnitude(v) * z.rest;
  for (std::size_t k = 0; k < z.n; ++k) {
    least -= magnitude((v * z.linear[k]).real());
    for (std::size_t l = 0; l < k; ++l) least -= magnitude((v * z.second[k][l]).real());
    const Ball square = (v * z.second[k][k]).real();  // d_k² in [0, 1]
    if (!square.is_positive()) least -= magnitude(square);
  }
  return lower(least);
}

}  // namespace tiltrim::checking
