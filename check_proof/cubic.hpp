/// Complex functions of the box and of a frequency's place in its interval, to third order.
/// Internal to check_proof/.
#pragma once

#include <acb.h>

#include <utility>

#include "check_proof/polynomial.hpp"

namespace tiltrim::checking {

class Complex {
 public:
  Complex() { acb_init(z_); }
  Complex(double re) : Complex() { acb_set_d(z_, re); }
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
  bool is_zero() const { return acb_is_zero(z_); }
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
inline Complex conjugate(const Complex& a) {
  Complex r;
  acb_conj(r.get(), a.get());
  return r;
}
/// Near ± i conj(a): v a is imaginary, and v z has a positive real part.
inline Complex turned_across(const Complex& a, const Complex& z) {
  Complex v = midpoint(Complex(Ball(0), Ball(1)) * conjugate(a));
  if (!(v * z).real().is_positive()) v = v * Ball(-1);
  return v;
}
/// The largest modulus, as a point.
inline Ball magnitude(const Complex& a) {
  Ball r;
  acb_get_abs_ubound_arf(arb_midref(r.get()), a.get(), bits);
  return r;
}

/// Of at most five numbers of the box and the frequency.
using Cubic = Polynomial<Complex, 6, 3>;

/// A lower bound of Re(v z) over the box.
inline Ball least_real(const Complex& v, const Cubic& z) {
  const Monomials& m = Cubic::monomials();
  Ball least = (v * z.value()).real() - magnitude(v) * z.rest;
  for (std::size_t i = 1; i < z.c.size(); ++i) least -= magnitude((v * z.c[i]).real());
  for (std::size_t k = 0; k < z.n; ++k) {  // d_k² in [0, 1]
    const Ball square = (v * z.c[m.product(m.linear(k), m.linear(k))]).real();
    if (square.is_positive()) least += magnitude(square);
  }
  return lower(least);
}

}  // namespace tiltrim::checking
