// Functions of jets: parabolas through Chebyshev's nodes, with bounds of what these leave out.
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>

#include "model/jet.hpp"

namespace tiltrim {

namespace {

constexpr double tiny = 1e-300;  // more than the underflow of the coefficients

// The parabola through g at Chebyshev's nodes of the range of a, about the centre of a, and
//   |g - parabola| <= max |g'''| / 6  max |(x - x₀)(x - x₁)(x - x₂)|
// which is a quarter of Taylor's remainder.
Jet interpolated(const Jet& a, const std::array<double, 3>& x, const std::array<Interval, 3>& g,
                 const Interval& third) {
  const Interval c = a.value().centre(), all = a.range();
  const Interval d01 = (g[1] - g[0]) / (Interval(x[1]) - x[0]);
  const Interval d12 = (g[2] - g[1]) / (Interval(x[2]) - x[1]);
  const Interval d2 = (d12 - d01) / (Interval(x[2]) - x[0]);
  const Interval from0 = c - x[0], from1 = c - x[1];
  const double rho = radius(all), s = x[2] - x[1];
  constexpr double slack = 1 + 1e-6;  // the nodes are symmetric to rounding
  const double nodes = std::max(rho * (rho * rho - s * s), 0.385 * s * s * s) * slack;
  return composed(a, g[0] + d01 * from0 + d2 * from0 * from1, d01 + d2 * (from0 + from1), 2.0 * d2)
      .widened(magnitude(third) / 6 * nodes * slack + tiny);
}

// g and g' as functions of a, without directions.
template <class G>
std::array<Jet, 2> fitted(const Jet& a, const G& g) {
  const Interval all = a.range();
  const double m = middle(all), rho = radius(all);
  const Jet::Derivatives over = g(all);
  constexpr double narrow = 1e-6;  // there Taylor's form is as good
  if (a.constant() || !(rho > narrow * (1 + std::abs(m)))) {
    const Jet::Derivatives centre = g(Interval(a.value().centre()));
    return {composed(a, centre, over, 0), composed(a, centre, over, 1)};
  }
  const double s = 0.5 * std::sqrt(3.0) * rho;
  const std::array<double, 3> x{m - s, m, m + s};
  const Jet::Derivatives low = g(Interval(x[0])), mid = g(Interval(x[1])), high = g(Interval(x[2]));
  return {interpolated(a, x, {low[0], mid[0], high[0]}, over[3]),
          interpolated(a, x, {low[1], mid[1], high[1]}, over[4])};
}

template <class G>
Jet smooth(const Jet& a, const G& g) {
  auto [value, slope] = fitted(a, g);
  return along(a, std::move(value), slope);
}

}  // namespace

Jet Jet::reciprocal(const Jet& a) {
  return smooth(a, [](const Interval& x) {
    const Interval g = Interval(1.0) / x, g2 = square(g);
    return Jet::Derivatives{g, -g2, 2.0 * (g * g2), -6.0 * square(g2), 24.0 * (g * square(g2))};
  });
}

Jet operator/(const Jet& a, const Jet& b) {
  if (b.n_ == 0) return a * Jet(Interval(1.0) / b.range());
  return a * Jet::reciprocal(b);
}

std::array<Jet, 2> sine_cosine(const Jet& a) {
  const auto [sine, cosine] = fitted(a, [](const Interval& x) {
    const Interval s = sin(x), c = cos(x);
    return Jet::Derivatives{s, c, -s, -c, s};
  });
  return {along(a, sine, cosine), along(a, cosine, -sine)};
}

Jet sqrt(const Jet& a) {
  return smooth(a, [](const Interval& x) {
    const Interval g = sqrt(x), g1 = Interval(1.0) / (2.0 * g), over = Interval(1.0) / (2.0 * x);
    const Interval g2 = -g1 * over, g3 = -3.0 * (g2 * over);
    return Jet::Derivatives{g, g1, g2, g3, -5.0 * (g3 * over)};
  });
}
Jet exp(const Jet& a) {
  return smooth(a, [](const Interval& x) {
    const Interval g = exp(x);
    return Jet::Derivatives{g, g, g, g, g};
  });
}
Jet log(const Jet& a) {
  return smooth(a, [](const Interval& x) {
    const Interval g1 = Interval(1.0) / x, g2 = square(g1);
    return Jet::Derivatives{log(x), g1, -g2, 2.0 * (g1 * g2), -6.0 * square(g2)};
  });
}
Jet atan(const Jet& a) {
  return smooth(a, [](const Interval& x) {
    const Interval xx = square(x), g = Interval(1.0) / (1.0 + xx), g2 = square(g);
    return Jet::Derivatives{atan(x), g, -2.0 * x * g2, (6.0 * xx - 2.0) * (g * g2),
                            24.0 * x * (1.0 - xx) * square(g2)};
  });
}
Jet tanh(const Jet& a) {
  return smooth(a, [](const Interval& x) {
    const Interval g = tanh(x), gg = square(g), g1 = 1.0 - gg;
    return Jet::Derivatives{g, g1, -2.0 * g * g1, g1 * (6.0 * gg - 2.0),
                            g1 * g * (16.0 - 24.0 * gg)};
  });
}
Jet sinh(const Jet& a) {
  return smooth(a, [](const Interval& x) {
    const Interval s = sinh(x), c = cosh(x);
    return Jet::Derivatives{s, c, s, c, s};
  });
}
Jet cosh(const Jet& a) {
  return smooth(a, [](const Interval& x) {
    const Interval s = sinh(x), c = cosh(x);
    return Jet::Derivatives{c, s, c, s, c};
  });
}
// Where b (b-1) ... and b - k are exact, by powers. Elsewhere x^(b-k) would miss its bound with the
// rounding of b - k: there each derivative is the last one times (b-k)/x.
Jet pow(const Jet& a, double b) {
  const bool exact = b == std::floor(b) && std::abs(b) < 1000;
  return smooth(a, [b, exact](const Interval& x) {
    Jet::Derivatives g{pow(x, b)};
    double factor = 1;
    for (int k = 0; k < 4; ++k) {
      factor *= b - k;
      if (exact)
        g[k + 1] = factor == 0 ? 0.0 : factor * pow(x, b - (k + 1));
      else
        g[k + 1] = (Interval(b) - double(k)) * g[k] / x;
    }
    return g;
  });
}
Jet atan2(const Jet& y, const Jet& x) {
  if (x.range().lower() > 0) return atan(y / x);
  const Interval up = y.range();
  const double side = up.lower() > 0   ? 1
                      : up.upper() < 0 ? -1
                                       : std::numeric_limits<double>::quiet_NaN();
  constexpr double half = std::numbers::pi / 2;
  return side * Jet(Interval::around(half, half)) - atan(x / y);
}

// By identities, each undefined where a function in it is.
Jet pow(const Jet& a, const Jet& b) {
  const Quadratic exponent = b.value();
  if (b.constant() && exponent.rest() == 0) return pow(a, exponent.centre());
  return exp(b * log(a));
}
Jet asin(const Jet& a) { return atan(a / sqrt((1.0 - a) * (1.0 + a))); }
Jet acos(const Jet& a) {
  constexpr double half = std::numbers::pi / 2;
  return Jet(Interval::around(half, half)) - asin(a);
}
Jet asinh(const Jet& a) {
  if (a.value().centre() < 0) return -asinh(-a);  // without cancellation
  return log(a + sqrt(a * a + 1.0));
}
Jet acosh(const Jet& a) { return log(a + sqrt((a - 1.0) * (a + 1.0))); }
Jet atanh(const Jet& a) { return 0.5 * log((1.0 + a) / (1.0 - a)); }
Jet log10(const Jet& a) { return log(a) / Jet(log(Interval(10.0))); }
Jet cbrt(const Jet& a) {
  if (a.range().upper() < 0) return -cbrt(-a);
  return exp(log(a) / 3.0);
}
Jet hypot(const Jet& a, const Jet& b) { return sqrt(a * a + b * b); }

}  // namespace tiltrim
