#include "check_proof/roots.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>

namespace tiltrim::checking {

Pencil pencil(const Numbers& a, const Loop<Dual>& loop) {
  Pencil p;
  const Form over_g = inverse(a.gravity), kappa = a.k_V * over_g;
  const std::array<Form, 6> zero{};
  const std::array<const std::array<Form, 6>*, 3> rows{
      &loop.rates.V.slopes, &loop.rates.gamma.slopes, &loop.rates.q.slopes};
  for (std::size_t i = 0; i < 3; ++i) {
    const auto& [v, c, theta, q, x1, x2] = *rows[i];
    const Form both = x1 + x2;
    p.M1[i] = {v + both * over_g, c, q};
    p.M0[i] = {kappa * both, x1 - x2, theta};
    if (i < 2)  // V_err' = -V', gamma_err' = -gamma'
      for (std::size_t j = 0; j < 3; ++j) {
        p.M1[i][j] = -p.M1[i][j];
        p.M0[i][j] = -p.M0[i][j];
      }
    for (std::size_t j = 0; j < 3; ++j) p.n = std::max({p.n, p.M1[i][j].n, p.M0[i][j].n});
  }
  return p;
}

namespace {

using Complex3 = std::array<std::array<Complex, 3>, 3>;
using Cubic3 = std::array<std::array<Cubic, 3>, 3>;

template <class T>
T determinant(const std::array<std::array<T, 3>, 3>& m) {
  const auto minor = [&](std::size_t j, std::size_t k) {
    return m[1][j] * m[2][k] - m[1][k] * m[2][j];
  };
  return m[0][0] * minor(1, 2) - m[0][1] * minor(0, 2) + m[0][2] * minor(0, 1);
}

// By cofactors; any matrix near the inverse serves.
Complex3 near_inverse(const Complex3& m) {
  const Complex over = inverse(determinant(m));
  Complex3 r;
  for (std::size_t i = 0; i < 3; ++i)
    for (std::size_t j = 0; j < 3; ++j) {
      const std::size_t a = (j + 1) % 3, b = (j + 2) % 3, c = (i + 1) % 3, d = (i + 2) % 3;
      r[i][j] = midpoint((m[a][c] * m[b][d] - m[a][d] * m[b][c]) * over);
    }
  return r;
}

// s² I - s M1 - M0 for w = at + half d_n, d_n in [-1, 1] after the numbers of the box.
Cubic3 pencil_at(const Pencil& p, const Ray& ray, const Ball& at, const Ball& half) {
  const Complex s = ray.from + ray.along * at, step = ray.along * half;
  const Monomials &of_form = Form::monomials(), &of_cubic = Cubic::monomials();
  const std::size_t w = of_cubic.linear(p.n);
  Cubic3 all;
  for (std::size_t i = 0; i < 3; ++i)
    for (std::size_t j = 0; j < 3; ++j) {
      Cubic& z = all[i][j];
      z.reserve(p.n + 1);
      Form M1 = p.M1[i][j], M0 = p.M0[i][j];
      M1.reserve(p.n);
      M0.reserve(p.n);
      const auto set = [&](std::size_t from, std::size_t to) {
        z.c[to] = Complex(-M0.c[from], Ball(0)) - s * M1.c[from];
        z.c[of_cubic.product(to, w)] = step * -M1.c[from];
      };
      set(0, 0);
      for (std::size_t k = 0; k < p.n; ++k) {
        set(of_form.linear(k), of_cubic.linear(k));
        for (std::size_t l = 0; l <= k; ++l)
          set(of_form.product(of_form.linear(k), of_form.linear(l)),
              of_cubic.product(of_cubic.linear(k), of_cubic.linear(l)));
      }
      z.rest = upper(M0.rest + (magnitude(s) + magnitude(step)) * M1.rest);
      if (i != j) continue;
      z.value() += s * s;
      z.c[w] += s * step * Ball(2);
      z.c[of_cubic.product(w, w)] += step * step;
    }
  return all;
}

Cubic3 product(const Cubic3& Z, const Complex3& G) {
  Cubic3 r;
  for (std::size_t i = 0; i < 3; ++i)
    for (std::size_t j = 0; j < 3; ++j) {
      Cubic& z = r[i][j];
      z.reserve(Z[0][0].n);
      for (std::size_t m = 0; m < 3; ++m) {
        for (std::size_t k = 0; k < z.c.size(); ++k) z.c[k].add_product(Z[i][m].c[k], G[m][j]);
        z.rest += magnitude(G[m][j]) * Z[i][m].rest;
      }
      z.rest = upper(z.rest);
    }
  return r;
}

// Whether the half-plane of v, or one whose edge runs along a linear term, holds all values: the
// stated v is for the middle of the whole interval and box, not for those of its halves.
bool one_half_plane(const Complex& v, const Cubic& z) {
  if (least_real(v, z).is_positive()) return true;
  for (std::size_t k = 0; k < z.n; ++k) {
    const Complex across = turned_across(z.slope(k), z.value());
    if (least_real(across, z).is_positive()) return true;
  }
  return false;
}

constexpr int most_halvings = 7;  // of an interval of the certificate

bool excluded(const Pencil& p, const Ray& ray, double from, double to, const Complex& v,
              int halvings) {
  const Ball at = halved(Ball(from) + Ball(to)), half = halved(Ball(to) - Ball(from));
  const Cubic3 Z = pencil_at(p, ray, at, half);
  Complex3 centre;
  for (std::size_t i = 0; i < 3; ++i)
    for (std::size_t j = 0; j < 3; ++j) centre[i][j] = midpoint(Z[i][j].value());
  const Cubic z = determinant(product(Z, near_inverse(centre)));
  if (one_half_plane(v, z)) return true;
  const double middle = from + (to - from) / 2;
  if (halvings == most_halvings || !(from < middle && middle < to)) return false;
  return excluded(p, ray, from, middle, v, halvings + 1) &&
         excluded(p, ray, middle, to, v, halvings + 1);
}

// Whether no member has a root of a modulus of at least w: a positive x with N x < x for the
// moduli N = |M1|/w + |M0|/w² proves that I - M1/s - M0/s² is regular.
bool none_beyond(const Pencil& p, double w) {
  std::array<std::array<Ball, 3>, 3> N;
  for (std::size_t i = 0; i < 3; ++i)
    for (std::size_t j = 0; j < 3; ++j)
      N[i][j] = magnitude(range(p.M1[i][j])) / Ball(w) +
                magnitude(range(p.M0[i][j])) / (Ball(w) * Ball(w));
  std::array<double, 3> x{1, 1, 1};
  const auto times = [&](std::size_t i) {
    return N[i][0] * Ball(x[0]) + N[i][1] * Ball(x[1]) + N[i][2] * Ball(x[2]);
  };
  for (int step = 0; step < 40; ++step) {
    const std::array<double, 3> next{double_above(times(0)), double_above(times(1)),
                                     double_above(times(2))};
    const double most = std::ranges::max(next);
    for (std::size_t i = 0; i < 3; ++i) x[i] = (x[i] + next[i] / most) / 2;
  }
  for (std::size_t i = 0; i < 3; ++i)
    if (!(x[i] > 0) || !less(times(i), Ball(x[i]))) return false;
  return true;
}

}  // namespace

Ray line_at(const Ball& sigma) { return {Complex(-sigma, Ball(0)), Complex(Ball(0), Ball(1))}; }

Ray ray_of(const Ball& damping) {
  return {Complex(Ball(0), Ball(0)), Complex(-damping, sqrt(Ball(1) - damping * damping))};
}

std::optional<std::string> excluded(const Pencil& p, const Ray& ray,
                                    const std::vector<Half>& intervals) {
  double end = 0;
  for (const Half& half : intervals) {
    if (half.from != end || !(half.to > half.from))
      return "the intervals of frequency are not connected";
    end = half.to;
    // The determinant is 1 in the middle: a half-plane without it holds nothing.
    if (!(half.re > 0))
      return fmt::format("the direction for w in [{:.6g}, {:.6g}] rad/s excludes the middle",
                         half.from, half.to);
    if (!excluded(p, ray, half.from, half.to, Complex(Ball(half.re), Ball(half.im)), 0))
      return fmt::format("a root on the line is not excluded for w in [{:.6g}, {:.6g}] rad/s",
                         half.from, half.to);
  }
  constexpr int most_further = 60;
  for (int more = 0; !none_beyond(p, end); ++more) {
    if (more == most_further || !(end > 0)) return "no bound of the roots";
    if (!excluded(p, ray, end, 1.5 * end, Complex(Ball(1), Ball(0)), 0))
      return fmt::format("a root on the line is not excluded beyond w = {:.6g} rad/s", end);
    end *= 1.5;
  }
  return {};
}

std::array<Ball, 7> characteristic(const Pencil& p) {
  using Polynomial = std::array<Ball, 7>;
  const auto entry = [&](std::size_t i, std::size_t j) {
    Polynomial e;
    e[0] = -midpoint(p.M0[i][j].value());
    e[1] = -midpoint(p.M1[i][j].value());
    if (i == j) e[2] = Ball(1);
    return e;
  };
  const auto times = [](const Polynomial& a, const Polynomial& b) {
    Polynomial r;
    for (std::size_t i = 0; i < 7; ++i)
      for (std::size_t j = 0; i + j < 7; ++j) r[i + j].add_product(a[i], b[j]);
    return r;
  };
  Polynomial sum;
  for (std::size_t j = 0; j < 3; ++j) {
    const std::size_t k = (j + 1) % 3, l = (j + 2) % 3;
    const Polynomial plus = times(entry(0, j), times(entry(1, k), entry(2, l)));
    const Polynomial minus = times(entry(0, j), times(entry(1, l), entry(2, k)));
    for (std::size_t i = 0; i < 7; ++i) sum[i] += plus[i] - minus[i];
  }
  return sum;
}

namespace {

// Routh's array: the changes of sign in its first column are the roots right of the axis. The
// coefficients of s⁰ to sⁿ, the last of them positive.
std::optional<int> changes_of_sign(const std::vector<Ball>& c) {
  const std::size_t n = c.size() - 1, width = n / 2 + 1;
  std::vector<Ball> above(width), row(width);
  for (std::size_t j = 0; j <= n; ++j) (j % 2 == 0 ? above : row)[j / 2] = c[n - j];
  int changes = 0;
  bool positive = true;
  for (std::size_t i = 0; i < n; ++i) {
    if (!row[0].is_positive() && !row[0].is_negative()) return {};
    changes += row[0].is_positive() != positive;
    positive = row[0].is_positive();
    std::vector<Ball> next(width);
    for (std::size_t j = 0; j + 1 < width; ++j)
      next[j] = above[j + 1] - above[0] * row[j + 1] / row[0];
    above = std::move(row);
    row = std::move(next);
  }
  return changes;
}

}  // namespace

// Of p(s - σ).
std::optional<int> roots_right(const Pencil& p, const Ball& sigma) {
  std::array<Ball, 7> c = characteristic(p);
  for (std::size_t i = 0; i < 6; ++i)
    for (std::size_t j = 6; j-- > i;) c[j] -= sigma * c[j + 1];
  return changes_of_sign({c.begin(), c.end()});
}

// Of p(s exp(iφ)) p(s exp(-iφ)), whose coefficients are real, Σ c_k c_l cos((k - l) φ): its roots
// are those of p turned by φ either way, which leaves one right of the axis if and only if p has
// one outside the sector.
std::optional<bool> less_damped(const Pencil& p, const Ball& damping) {
  const std::array<Ball, 7> c = characteristic(p);
  std::array<Ball, 7> cosine{Ball(1), sqrt(Ball(1) - damping * damping)};
  for (std::size_t k = 2; k < cosine.size(); ++k)
    cosine[k] = Ball(2) * cosine[1] * cosine[k - 1] - cosine[k - 2];
  std::vector<Ball> both(2 * c.size() - 1);
  for (std::size_t k = 0; k < c.size(); ++k)
    for (std::size_t l = 0; l < c.size(); ++l)
      both[k + l].add_product(c[k] * c[l], cosine[k < l ? l - k : k - l]);
  const std::optional<int> changes = changes_of_sign(both);
  if (!changes) return {};
  return *changes > 0;
}

}  // namespace tiltrim::checking
