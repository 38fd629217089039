/// Real numbers enclosed in Arb's balls [103]: midpoint and radius, every operation rounded
/// outward. Internal to check_proof/.
#pragma once

#include <arb.h>

#include <utility>

namespace tiltrim::checking {

inline constexpr slong bits = 64;  ///< of a midpoint: one word

class Ball {
 public:
  Ball() { arb_init(x_); }
  Ball(double value) : Ball() { arb_set_d(x_, value); }
  Ball(const Ball& other) : Ball() { arb_set(x_, other.x_); }
  Ball(Ball&& other) noexcept : Ball() { arb_swap(x_, other.x_); }
  Ball& operator=(const Ball& other) {
    arb_set(x_, other.x_);
    return *this;
  }
  Ball& operator=(Ball&& other) noexcept {
    arb_swap(x_, other.x_);
    return *this;
  }
  ~Ball() { arb_clear(x_); }

  arb_ptr get() { return x_; }
  arb_srcptr get() const { return x_; }

  Ball& operator+=(const Ball& b) {
    arb_add(x_, x_, b.x_, bits);
    return *this;
  }
  Ball& operator-=(const Ball& b) {
    arb_sub(x_, x_, b.x_, bits);
    return *this;
  }
  Ball& operator*=(const Ball& b) {
    arb_mul(x_, x_, b.x_, bits);
    return *this;
  }
  Ball& operator/=(const Ball& b) {
    arb_div(x_, x_, b.x_, bits);
    return *this;
  }
  /// this += a b
  Ball& add_product(const Ball& a, const Ball& b) {
    arb_addmul(x_, a.x_, b.x_, bits);
    return *this;
  }
  bool is_zero() const { return arb_is_zero(x_); }
  /// Also false for what is not a number.
  bool is_positive() const { return arb_is_positive(x_); }
  bool is_negative() const { return arb_is_negative(x_); }

 private:
  arb_t x_;
};

inline Ball operator+(Ball a, const Ball& b) { return std::move(a += b); }
inline Ball operator-(Ball a, const Ball& b) { return std::move(a -= b); }
inline Ball operator*(Ball a, const Ball& b) { return std::move(a *= b); }
inline Ball operator/(Ball a, const Ball& b) { return std::move(a /= b); }

inline Ball operator-(const Ball& a) {
  Ball r;
  arb_neg(r.get(), a.get());
  return r;
}

inline bool equal(const Ball& a, double b) {
  return arb_is_exact(a.get()) && arf_equal_d(arb_midref(a.get()), b);
}

/// Every pair of their numbers.
inline bool less(const Ball& a, const Ball& b) { return arb_lt(a.get(), b.get()); }
inline bool less_equal(const Ball& a, const Ball& b) { return arb_le(a.get(), b.get()); }

inline Ball pi() {
  Ball r;
  arb_const_pi(r.get(), bits);
  return r;
}

inline Ball sqrt(const Ball& a) {
  Ball r;
  arb_sqrt(r.get(), a.get(), bits);
  return r;
}

inline Ball sin(const Ball& a) {
  Ball r;
  arb_sin(r.get(), a.get(), bits);
  return r;
}

inline Ball cos(const Ball& a) {
  Ball r;
  arb_cos(r.get(), a.get(), bits);
  return r;
}

inline Ball atan2(const Ball& y, const Ball& x) {
  Ball r;
  arb_atan2(r.get(), y.get(), x.get(), bits);
  return r;
}

inline Ball halved(const Ball& a) {
  Ball r;
  arb_mul_2exp_si(r.get(), a.get(), -1);
  return r;
}

/// The absolute value, as a range.
inline Ball abs(const Ball& a) {
  Ball r;
  arb_abs(r.get(), a.get());
  return r;
}

/// The largest absolute value, as a point.
inline Ball magnitude(const Ball& a) {
  Ball r;
  arb_get_abs_ubound_arf(arb_midref(r.get()), a.get(), bits);
  return r;
}

inline Ball midpoint(const Ball& a) {
  Ball r;
  arb_get_mid_arb(r.get(), a.get());
  return r;
}

/// a with its radius increased by |by|.
inline Ball widened(Ball a, const Ball& by) {
  arb_add_error(a.get(), by.get());
  return a;
}

/// The least ball around both.
inline Ball hull(const Ball& a, const Ball& b) {
  Ball r;
  arb_union(r.get(), a.get(), b.get(), bits);
  return r;
}

inline Ball lower(const Ball& a) {
  Ball r;
  arb_get_lbound_arf(arb_midref(r.get()), a.get(), bits);
  return r;
}

inline Ball upper(const Ball& a) {
  Ball r;
  arb_get_ubound_arf(arb_midref(r.get()), a.get(), bits);
  return r;
}

/// An upper bound of the numbers in it, for reports and look-ups.
inline double double_above(const Ball& a) {
  return arf_get_d(arb_midref(upper(a).get()), ARF_RND_CEIL);
}
inline double double_below(const Ball& a) {
  return arf_get_d(arb_midref(lower(a).get()), ARF_RND_FLOOR);
}

}  // namespace tiltrim::checking
