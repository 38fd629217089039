/// Polynomials of the place d in a box, |d_k| ≤ 1, with a bound of what they leave out. Internal to
/// check_proof/.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <utility>
#include <vector>

#include "check_proof/ball.hpp"

namespace tiltrim::checking {

/// Monomials of up to a degree in variables 0 to most - 1, ordered so that those of the first n
/// variables come first, for every n.
class Monomials {
 public:
  Monomials(std::size_t most, std::size_t degree) : count_{1}, degree_{0} {
    std::vector<std::vector<std::size_t>> powers{std::vector<std::size_t>(most)};
    for (std::size_t k = 0; k < most; ++k) {
      for (std::size_t i = 0; i < powers.size(); ++i) {
        if (degree_[i] == degree) continue;
        powers.push_back(powers[i]);
        ++powers.back()[k];
        degree_.push_back(degree_[i] + 1);
      }
      count_.push_back(powers.size());
    }
    times_.resize(powers.size());
    for (std::size_t i = 0; i < powers.size(); ++i)
      for (std::size_t j = 0; j < powers.size(); ++j) {
        if (degree_[i] + degree_[j] > degree) continue;
        std::vector<std::size_t> sum = powers[i];
        for (std::size_t k = 0; k < most; ++k) sum[k] += powers[j][k];
        times_[i].push_back({j, std::size_t(std::ranges::find(powers, sum) - powers.begin())});
      }
  }

  std::size_t count(std::size_t n) const { return count_[n]; }  ///< of n variables
  std::size_t degree(std::size_t i) const { return degree_[i]; }
  std::size_t linear(std::size_t k) const { return count_[k]; }  ///< d_k
  /// Of i times j, whose degrees are not too high together.
  std::size_t product(std::size_t i, std::size_t j) const {
    return std::ranges::find(times_[i], j, &Factor::by)->gives;
  }
  struct Factor {
    std::size_t by, gives;
  };
  /// What i may be multiplied by, ascending.
  const std::vector<Factor>& factors(std::size_t i) const { return times_[i]; }

 private:
  std::vector<std::size_t> count_, degree_;
  std::vector<std::vector<Factor>> times_;
};

/// Σ c_i m_i(d) + rest over the monomials m_i, with c_i within balls for each d and a rest of at
/// most this modulus. Numbers are of the class T, balls or complex balls.
template <class T, std::size_t most, std::size_t order>
struct Polynomial {
  std::size_t n = 0;      ///< variables
  std::vector<T> c{T()};  ///< one per monomial of these
  Ball rest{};

  static const Monomials& monomials() {
    static const Monomials all(most, order);
    return all;
  }

  Polynomial() = default;
  Polynomial(double constant) : c{T(constant)} {}
  Polynomial(T constant) : c{std::move(constant)} {}
  /// value + radius d_k
  static Polynomial variable(const T& value, const T& radius, std::size_t k, std::size_t n) {
    Polynomial x(value);
    x.reserve(n);
    x.slope(k) = radius;
    return x;
  }

  T& value() { return c[0]; }
  const T& value() const { return c[0]; }
  T& slope(std::size_t k) { return c[monomials().linear(k)]; }
  const T& slope(std::size_t k) const { return c[monomials().linear(k)]; }
  bool is_zero() const { return n == 0 && c[0].is_zero() && rest.is_zero(); }
  /// As a function of at least this many variables.
  void reserve(std::size_t variables) {
    if (variables <= n) return;
    n = variables;
    c.resize(monomials().count(n));
  }
  /// Sum of the moduli of the coefficients of each degree.
  std::array<Ball, order + 1> sums() const {
    std::array<Ball, order + 1> all;
    for (std::size_t i = 0; i < c.size(); ++i) all[monomials().degree(i)] += magnitude(c[i]);
    return all;
  }

  Polynomial& operator+=(const Polynomial& b) {
    reserve(b.n);
    for (std::size_t i = 0; i < b.c.size(); ++i) c[i] += b.c[i];
    if (!b.rest.is_zero()) rest = upper(rest + b.rest);
    return *this;
  }
  Polynomial& operator-=(const Polynomial& b) {
    reserve(b.n);
    for (std::size_t i = 0; i < b.c.size(); ++i) c[i] -= b.c[i];
    if (!b.rest.is_zero()) rest = upper(rest + b.rest);
    return *this;
  }
  friend Polynomial operator+(Polynomial a, const Polynomial& b) { return std::move(a += b); }
  friend Polynomial operator-(Polynomial a, const Polynomial& b) { return std::move(a -= b); }
  friend Polynomial operator-(const Polynomial& a) {
    Polynomial r;
    r -= a;
    return r;
  }

  /// What exceeds the order adds to the rest, by moduli.
  friend Polynomial operator*(const Polynomial& a, const Polynomial& b) {
    Polynomial r;
    if (a.is_zero() || b.is_zero()) return r;
    r.reserve(std::max(a.n, b.n));
    for (std::size_t i = 0; i < a.c.size(); ++i)
      for (const auto& [by, gives] : monomials().factors(i)) {
        if (by >= b.c.size()) break;
        r.c[gives].add_product(a.c[i], b.c[by]);
      }
    const bool exact = a.rest.is_zero() && b.rest.is_zero();
    if (exact && (a.n == 0 || b.n == 0)) return r;
    const auto of_a = a.sums(), of_b = b.sums();
    Ball all_a, all_b;
    for (std::size_t i = 0; i <= order; ++i) {
      all_a += of_a[i];
      all_b += of_b[i];
      for (std::size_t j = order + 1 - i; j <= order; ++j) r.rest.add_product(of_a[i], of_b[j]);
    }
    r.rest += a.rest * (all_b + b.rest) + all_a * b.rest;
    r.rest = upper(r.rest);
    return r;
  }
};

}  // namespace tiltrim::checking
