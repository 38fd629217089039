#include "model/jet.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "model/branches.hpp"

namespace tiltrim {

namespace {

constexpr double unit = std::numeric_limits<double>::epsilon() / 2;
constexpr double not_known = std::numeric_limits<double>::quiet_NaN();
// A stored coefficient is a sum of at most four products: it errs by at most 5 u times the sum of
// their moduli.
constexpr double coefficient_error = 8 * unit;
// Sums of moduli have at most a few hundred terms and so err by less than this share.
constexpr double upward = 1 + 1e-12;
// More than the underflow of all coefficients.
constexpr double underflow = 1e-300;

// Sums of moduli of a row.
struct Size {
  double linear = 0, quadratic = 0, rest = 0, all = 0;
};

Size size_of(const double* a, std::size_t n) {
  Size s;
  const std::size_t last = Quadratic::length(n) - 1;
  for (std::size_t k = 1; k <= n; ++k) s.linear += std::abs(a[k]);
  for (std::size_t k = n + 1; k < last; ++k) s.quadratic += std::abs(a[k]);
  s.rest = a[last];
  s.all = std::abs(a[0]) + s.linear + s.quadratic;
  return s;
}

// out = a b, or out += a b if `more`.
template <bool more>
void multiply(const double* a, const Size& A, const double* b, const Size& B, double* out,
              std::size_t n) {
  const double a0 = a[0], b0 = b[0];
  const auto put = [](double& at, double x) { at = more ? at + x : x; };
  const std::size_t last = Quadratic::length(n) - 1;
  put(out[0], a0 * b0);
  for (std::size_t k = 1; k <= n; ++k) put(out[k], a0 * b[k] + b0 * a[k]);
  for (std::size_t k = 1, at = n + 1; k <= n; ++k) {
    for (std::size_t l = 1; l < k; ++l, ++at)
      put(out[at], (a0 * b[at] + b0 * a[at]) + (a[k] * b[l] + a[l] * b[k]));
    put(out[at], (a0 * b[at] + b0 * a[at]) + a[k] * b[k]);
    ++at;
  }
  const double rest = (A.linear + A.quadratic) * B.quadratic + A.quadratic * B.linear +
                      A.rest * (B.all + B.rest) + A.all * B.rest +
                      coefficient_error * A.all * B.all;
  put(out[last], rest * upward + underflow);
}

// What the sums of `multiply<true>` lost, of three terms in all.
void round_sum(double* out, std::size_t n) {
  const Size s = size_of(out, n);
  out[Quadratic::length(n) - 1] = (s.rest + coefficient_error * s.all) * upward + underflow;
}

void add(const double* a, const double* b, double sign, double* out, std::size_t n) {
  const std::size_t last = Quadratic::length(n) - 1;
  double moduli = 0;
  for (std::size_t k = 0; k < last; ++k) {
    out[k] = a[k] + sign * b[k];
    moduli += std::abs(out[k]);
  }
  out[last] = (a[last] + b[last] + 2 * unit * moduli) * upward;
}

// out = a times x, known to within r.
void scale(const double* a, double x, double r, double* out, std::size_t n) {
  const Size A = size_of(a, n);
  const std::size_t last = Quadratic::length(n) - 1;
  for (std::size_t k = 0; k < last; ++k) out[k] = a[k] * x;
  const double x_abs = std::abs(x);
  out[last] = (A.rest * (x_abs + r) + A.all * r + 2 * unit * A.all * x_abs) * upward + underflow;
}

// Not told by the ranges: a side if no unknown decides, else that of the centre, which blocks.
bool side_of(bool unknown, int told, bool centre) {
  Branches& sides = *current_branches;
  if (unknown) {
    if (told < 0) sides.blocked = true;
    return told < 0 ? centre : told == 1;
  }
  if (sides.next == sides.taken.size()) {
    sides.taken.push_back(char(told == 1));
    sides.open.push_back(char(told < 0));
    if (told < 0 && sides.replay) sides.blocked = true;
  } else if (told < 0 && !sides.open[sides.next]) {
    sides.blocked = true;  // its other outcome was not foreseen
  } else if (told >= 0 && sides.taken[sides.next] != char(told)) {
    sides.blocked = true;
  }
  return sides.taken[sides.next++] != 0;
}

}  // namespace

// Term by term: a d + b d² has its extremes at ±1 or at -a/(2b).
Interval Quadratic::range() const {
  if (n_ == 0) return Interval(at_[0]) + Interval(-rest(), rest());
  double low = at_[0], high = at_[0], moduli = std::abs(at_[0]) + rest();
  for (std::size_t k = 0, at = 1 + n_; k < n_; ++k) {
    for (std::size_t l = 0; l < k; ++l, ++at) {
      const double cross = std::abs(at_[at]);
      low -= cross;
      high += cross;
      moduli += cross;
    }
    const double a = std::abs(at_[1 + k]), b = at_[at++];
    moduli += a + std::abs(b);
    const bool within = a < 2 * std::abs(b);
    const double inside = within ? -a * a / (4 * b) : 0.0;
    low += within && b > 0 ? inside : b - a;
    high += within && b < 0 ? inside : b + a;
  }
  const double wide = (rest() + 4 * double(length(n_)) * unit * moduli) * upward + underflow;
  low -= wide;
  high += wide;
  return low <= high ? Interval(low, high) : Interval::unknown();
}

Jet::Jet(const Interval& x) : constant_{middle(x), radius(x)} {
  if (!x.finite()) constant_ = {not_known, not_known};
}

Jet Jet::quadratic(std::vector<double> row) {
  Jet x;
  while (Quadratic::length(x.n_) < row.size()) ++x.n_;
  if (x.n_ == 0)
    x.constant_ = {row[0], row[1]};
  else
    x.rows_ = std::move(row);
  return x;
}

Jet Jet::number(double middle, double radius, std::size_t along, std::size_t n) {
  Jet x(n, 0);
  x.rows_[0] = middle;
  x.rows_[1 + along] = radius;
  return x;
}

Jet Jet::unknown(std::size_t along, std::size_t m) const {
  Jet x(n_, m);
  std::copy_n(row(0), Quadratic::length(n_), x.row(0));
  if (along < m) {
    x.row(1 + along)[0] = 1;
    x.active_ = 1ULL << along;
  }
  x.moving_ = true;
  return x;
}

Jet Jet::widened(double by) const {
  Jet x = *this;
  double& rest = x.row(0)[Quadratic::length(n_) - 1];
  rest = (rest + by) * upward;
  return x;
}

Jet Jet::change() const {
  Jet x = *this;
  std::fill_n(x.row(0), n_ == 0 ? 2 : Quadratic::length(n_), 0.0);
  return x;
}

Jet Jet::value_only() const { return quadratic({row(0), row(0) + Quadratic::length(n_)}); }

Jet Jet::derivative(std::size_t i) const {
  if (!active(i)) return {};
  const double* from = row(1 + i);
  return quadratic({from, from + Quadratic::length(n_)});
}

// Of derivatives one side is chosen only if the ranges do not touch: where they do, there may be a
// kink.
bool below(const Jet& a, const Jet& b, bool or_equal) {
  const Interval x = a.range(), y = b.range();
  const bool unknown = a.moving_ || b.moving_;
  const bool apart = unknown && current_branches && !current_branches->values;
  int told = -1;
  if (or_equal && !apart ? x.upper() <= y.lower() : x.upper() < y.lower()) told = 1;
  if (or_equal || apart ? x.lower() > y.upper() : x.lower() >= y.upper()) told = 0;
  if (!current_branches) return told == 1;
  const double p = a.row(0)[0], q = b.row(0)[0];
  return side_of(unknown, told, or_equal ? p <= q : p < q);
}

// Whether an unknown moves it and no derivatives are wanted, so that both sides of a kink may
// count.
bool Jet::only_values(const Jet& a) {
  return a.moving_ && current_branches && current_branches->values;
}

Jet Jet::value_within(const Interval& range) {
  Jet x{range};
  x.moving_ = true;
  return x;
}

Jet abs(const Jet& a) {
  const Interval all = a.range();
  if (Jet::only_values(a) && all.lower() < 0 && all.upper() > 0)
    return Jet::value_within({0.0, magnitude(all)});
  return a >= 0.0 ? a : -a;
}

Jet min(const Jet& a, const Jet& b) {
  const Interval x = a.range(), y = b.range();
  const bool across = x.lower() < y.upper() && y.lower() < x.upper();
  if ((Jet::only_values(a) || Jet::only_values(b)) && across)
    return Jet::value_within({std::min(x.lower(), y.lower()), std::min(x.upper(), y.upper())});
  return b < a ? b : a;
}

Jet operator-(const Jet& a) {
  Jet c = a;
  const std::size_t length = Quadratic::length(a.n_);
  if (a.n_ == 0) c.constant_[0] = -a.constant_[0];
  for (std::size_t i = 0; i < c.rows_.size(); ++i)
    if (i % length != length - 1) c.rows_[i] = -c.rows_[i];
  return c;
}

namespace {

// Adds a constant to a row's value.
void shift(double* a, const std::array<double, 2>& by, double sign, std::size_t n) {
  a[0] += sign * by[0];
  double& rest = a[Quadratic::length(n) - 1];
  rest = (rest + by[1] + 2 * unit * std::abs(a[0])) * upward;
}

}  // namespace

Jet operator+(const Jet& a, const Jet& b) {
  if (a.n_ == 0 && b.n_ > 0) return b + a;
  Jet c(a.n_, std::max(a.m_, b.m_));
  c.moving_ = a.moving_ || b.moving_;
  c.active_ = a.active_ | b.active_;
  if (b.n_ == 0) {
    c.rows_ = a.rows_;
    c.constant_ = a.constant_;
    shift(c.row(0), b.constant_, 1, a.n_);
    return c;
  }
  const std::size_t length = Quadratic::length(a.n_);
  add(a.row(0), b.row(0), 1, c.row(0), a.n_);
  for (std::size_t i = 0; i < c.m_; ++i) {
    if (a.active(i) && b.active(i))
      add(a.row(1 + i), b.row(1 + i), 1, c.row(1 + i), a.n_);
    else if (a.active(i) || b.active(i))
      std::copy_n((a.active(i) ? a : b).row(1 + i), length, c.row(1 + i));
  }
  return c;
}

Jet operator-(const Jet& a, const Jet& b) { return a + -b; }

Jet operator*(const Jet& a, const Jet& b) {
  if (a.n_ == 0 && b.n_ > 0) return b * a;
  Jet c(a.n_, std::max(a.m_, b.m_));
  c.moving_ = a.moving_ || b.moving_;
  if (b.n_ == 0) {
    if (b.constant_[0] == 0 && b.constant_[1] == 0 && std::isfinite(a.value().rest())) return {};
    c.active_ = a.active_;
    for (std::size_t i = 0; i <= a.m_; ++i)
      if (i == 0 || a.active(i - 1))
        scale(a.row(i), b.constant_[0], b.constant_[1], c.row(i), a.n_);
    return c;
  }
  const std::size_t n = a.n_;
  const Size A = size_of(a.row(0), n), B = size_of(b.row(0), n);
  multiply<false>(a.row(0), A, b.row(0), B, c.row(0), n);
  c.active_ = a.active_ | b.active_;
  for (std::size_t i = 0; i < c.m_; ++i) {
    const bool left = a.active(i), right = b.active(i);
    double* out = c.row(1 + i);
    if (left) multiply<false>(b.row(0), B, a.row(1 + i), size_of(a.row(1 + i), n), out, n);
    if (!right) continue;
    const Size S = size_of(b.row(1 + i), n);
    if (left) {
      multiply<true>(a.row(0), A, b.row(1 + i), S, out, n);
      round_sum(out, n);
    } else {
      multiply<false>(a.row(0), A, b.row(1 + i), S, out, n);
    }
  }
  return c;
}

// With δ = a - c:  g(c) + g'(c) δ + ½ g'' δ² + rest,  |rest| <= third D³/6,  D >= |δ|
static std::vector<double> expanded(const double* a, std::size_t n, const Interval& all,
                                    const Interval& g, const Interval& g1, const Interval& g2,
                                    double third) {
  std::vector<double> out(Quadratic::length(n));
  const std::size_t last = out.size() - 1;
  Size A = size_of(a, n);
  const double c = a[0], small = A.linear + A.quadratic;
  const double D = std::min(small + A.rest, magnitude(all - Interval(c))) * upward;
  const double s = middle(g1), h = 0.5 * middle(g2);
  out[0] = middle(g);
  for (std::size_t k = 1; k < last; ++k) out[k] = s * a[k];
  for (std::size_t k = 1, at = n + 1; k <= n; ++k) {
    for (std::size_t l = 1; l < k; ++l) out[at++] += 2 * h * (a[k] * a[l]);
    out[at++] += h * (a[k] * a[k]);
  }
  // δ² = (linear part)² + what is below
  const double square_rest =
      (2 * A.linear + A.quadratic) * A.quadratic + (2 * small + A.rest) * A.rest;
  out[last] = radius(g) + magnitude(g1) * A.rest + radius(g1) * small + std::abs(h) * square_rest +
              0.5 * radius(g2) * D * D + third * D * D * D / 6 +
              coefficient_error * (std::abs(s) * small + 2 * std::abs(h) * small * small);
  out[last] = out[last] * upward + underflow;
  return out;
}

Jet composed(const Jet& a, const Jet::Derivatives& centre, const Jet::Derivatives& over,
             int order) {
  const std::size_t o = std::size_t(order);
  if (a.n_ == 0) return Jet(over[o]);
  Jet c = Jet::quadratic(expanded(a.row(0), a.n_, a.range(), centre[o], centre[o + 1],
                                  centre[o + 2], magnitude(over[o + 3])));
  return c;
}

Jet composed(const Jet& a, const Interval& g, const Interval& g1, const Interval& g2) {
  return Jet::quadratic(expanded(a.row(0), a.n_, a.range(), g, g1, g2, 0.0));
}

Jet along(const Jet& a, Jet value, const Jet& slope) {
  if (a.m_ == 0) {
    value.moving_ = a.moving_;
    return value;
  }
  Jet c(a.n_, a.m_);
  c.moving_ = a.moving_;
  c.active_ = a.active_;
  std::copy_n(value.row(0), Quadratic::length(a.n_), c.row(0));
  const Size S = size_of(slope.row(0), a.n_);
  for (std::size_t i = 0; i < a.m_; ++i)
    if (a.active(i))
      multiply<false>(slope.row(0), S, a.row(1 + i), size_of(a.row(1 + i), a.n_), c.row(1 + i),
                      a.n_);
  return c;
}

}  // namespace tiltrim
