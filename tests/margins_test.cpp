#include "linearize/margins.hpp"

#include <algorithm>
#include <numbers>

#include "linearize/eigenvalues.hpp"
#include "linearize/peak_search.hpp"
#include "tests/algebra.hpp"
#include "tests/check.hpp"
#include "tests/random_draws.hpp"

using namespace tiltrim;
using Eigen::Index;
using Eigen::MatrixXcd;
using Eigen::MatrixXd;
using Eigen::RowVectorXd;
using Eigen::VectorXcd;
using Eigen::VectorXd;
using Complex = std::complex<double>;

namespace margins_test {

namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();
constexpr double pi = std::numbers::pi;

// Polynomials by rising powers; the denominator's last coefficient is 1. In the companion form.
using Polynomial = std::vector<double>;

Polynomial operator*(const Polynomial& p, const Polynomial& q) {
  Polynomial r(p.size() + q.size() - 1, 0.0);
  for (std::size_t i = 0; i < p.size(); ++i)
    for (std::size_t j = 0; j < q.size(); ++j) r[i + j] += p[i] * q[j];
  return r;
}

LoopTransfer ratio(Polynomial over, const Polynomial& under) {
  const Index n = std::ssize(under) - 1;
  over.resize(under.size(), 0.0);
  LoopTransfer g{MatrixXd::Zero(n, n), VectorXd::Unit(n, n - 1), RowVectorXd(n), over.back()};
  for (Index i = 0; i + 1 < n; ++i) g.A(i, i + 1) = 1;
  for (Index i = 0; i < n; ++i) {
    g.A(n - 1, i) = -under[std::size_t(i)];
    g.c[i] = over[std::size_t(i)] - g.d * under[std::size_t(i)];
  }
  return g;
}

LoopTransfer gain(double d) { return {MatrixXd(0, 0), VectorXd(0), RowVectorXd(0), d}; }

LoopTransfer in_units(const LoopTransfer& g, const VectorXd& unit) {
  const auto T = unit.asDiagonal();
  const auto inverse = unit.cwiseInverse();
  return {inverse.asDiagonal() * g.A * T, inverse.asDiagonal() * g.b, g.c * T, g.d};
}

// The closed loop with a real or complex factor where the loop is broken.
double abscissa(const LoopTransfer& g, Complex factor) {
  const MatrixXcd A = g.A.cast<Complex>() - (factor / (1.0 + factor * g.d)) * (g.b * g.c);
  return algebra::eigenvalues(A).real().maxCoeff();
}

bool stable(const LoopTransfer& g, double factor) {
  return eigenvalues(g.A - factor / (1 + factor * g.d) * g.b * g.c).real().maxCoeff() < 0;
}

/// The same margins from L on a dense grid, refined around features between its points.
struct Scan {
  double gain_up = infinity, gain_down = 0, phase = infinity, delay = infinity, half = 0, peak = 0;
  int crossovers = 0;
};

// L by partial fractions: a fast method independent of the library's.
struct Fractions {
  VectorXcd poles, residues;
  double d;

  explicit Fractions(const LoopTransfer& g) : d(g.d) {
    const auto [values, V] = algebra::eigensystem(g.A);
    poles = values;
    residues =
        (g.c * V).transpose().cwiseProduct(algebra::solve(V, MatrixXcd(g.b.cast<Complex>())));
  }
  Complex operator()(double w) const {
    Complex L = d;
    for (Index i = 0; i < poles.size(); ++i) L += residues[i] / (Complex(0, w) - poles[i]);
    return L;
  }
};

template <class F>
double bisected(const F& f, double low, double high) {
  const bool up = f(low) > 0;
  for (int k = 0; k < 100; ++k) {
    const double middle = std::sqrt(low * high);
    ((f(middle) > 0) == up ? low : high) = middle;
  }
  return low;
}

template <class F>
double highest(const F& f, double low, double high) {
  constexpr double section = 0.6180339887498949;
  for (int k = 0; k < 60; ++k) {
    const double a = high - section * (high - low), b = low + section * (high - low);
    if (f(a) > f(b))
      high = b;
    else
      low = a;
  }
  return f(low);
}

template <class Response>
Scan scan(const Response& L, double d, double from, double to, int points) {
  Scan s;
  const auto imaginary = [&](double w) { return L(w).imag(); };
  const auto size = [&](double w) { return std::abs(L(w)) - 1; };
  const auto from_half = [](Complex at) { return std::abs(1.0 / (1.0 + at) - 0.5); };
  const auto sensitivity = [](Complex at) { return 1 / std::abs(1.0 + at); };
  const auto crossing = [&](double real) {
    const double factor = -1 / real;
    if (factor > 1 && factor < 1e9) s.gain_up = std::min(s.gain_up, factor);
    if (factor < 1 && factor > 1e-9) s.gain_down = std::max(s.gain_down, factor);
  };
  const auto crossover = [&](double w) {
    const double lag = std::arg(-L(w));
    s.phase = std::min(s.phase, std::abs(lag));
    s.delay = std::min(s.delay, (lag > 0 ? lag : lag + 2 * pi) / w);
    ++s.crossovers;
  };
  for (const Complex end : {L(0), Complex(d)}) {
    if (!std::isfinite(std::abs(end))) continue;  // an integrator: S = 0
    crossing(end.real());
    s.half = std::max(s.half, from_half(end));
    s.peak = std::max(s.peak, sensitivity(end));
  }
  std::vector<double> w;
  std::vector<Complex> at;
  for (int k = 0; k < points; ++k) {
    w.push_back(from * std::pow(to / from, double(k) / (points - 1)));
    at.push_back(L(w.back()));
  }
  for (std::size_t k = 1; k < w.size(); ++k) {
    if ((at[k].imag() > 0) != (at[k - 1].imag() > 0))
      crossing(L(bisected(imaginary, w[k - 1], w[k])).real());
    if ((std::abs(at[k]) > 1) != (std::abs(at[k - 1]) > 1))
      crossover(bisected(size, w[k - 1], w[k]));
    const auto top = [&](const auto& f, double& best) {
      if (k + 1 < w.size() && f(at[k]) >= std::max(f(at[k - 1]), f(at[k + 1])))
        best = std::max(best, highest([&](double x) { return f(L(x)); }, w[k - 1], w[k + 1]));
    };
    top(from_half, s.half);
    top(sensitivity, s.peak);
  }
  if (std::abs(d) >= 1) s.delay = 0;
  return s;
}

// What the scan finds exists. What it misses lies between its points, and is worse.
int check_found(const Margins& m, const Scan& s) {
  int finer = 0;
  const auto agree = [&](double ours, double scanned, bool worse) {
    if (ours == scanned || std::abs(ours - scanned) <= 1e-6 * std::abs(scanned)) return;
    CHECK_MESSAGE(worse, fmt::format("margin {:.17g}, by the scan {:.17g}", ours, scanned));
    ++finer;
  };
  agree(m.gain_up, s.gain_up, m.gain_up < s.gain_up);
  agree(m.gain_down, s.gain_down, m.gain_down > s.gain_down);
  agree(m.phase, s.phase, m.phase < s.phase);
  agree(m.delay, s.delay, m.delay < s.delay);
  agree(1 / m.disk, s.half, 1 / m.disk > s.half);
  agree(m.sensitivity_peak, s.peak, m.sensitivity_peak > s.peak);
  CHECK(std::ssize(m.gain_crossovers) >= s.crossovers);
  return finer;
}

// Poles and zeros over two decades, one in ten at the origin, as many in the right half plane as a
// stable closed loop can have.
struct Factored {
  struct Factor {
    double frequency, damping;
    bool pair;
    double last() const { return pair ? frequency * frequency : std::copysign(frequency, damping); }
    Polynomial polynomial() const {
      return pair ? Polynomial{last(), 2 * damping * frequency, 1} : Polynomial{last(), 1};
    }
    Complex operator()(Complex s) const {
      return pair ? (s + 2 * damping * frequency) * s + last() : s + last();
    }
  };
  std::vector<Factor> zeros, poles;
  double gain = 1;

  explicit Factored(Random& random) {
    const auto make = [&](std::vector<Factor>& factors, int degree) {
      while (degree > 0) {
        const bool at_rest = random() % 10 == 0, pair = degree > 1 && random() % 2 == 0;
        factors.push_back({at_rest ? 0.0 : std::pow(10, uniform(random, -1, 1)),
                           uniform(random, -0.1, 1.2), pair});
        degree -= pair ? 2 : 1;
      }
    };
    const int n = 1 + int(random() % 8);
    make(poles, n);
    make(zeros, int(random() % (n + 1)));
    const double crossover = std::pow(10, uniform(random, -1, 1));
    gain = (random() % 4 == 0 ? -1 : 1) / std::abs((*this)(crossover));
  }
  Complex operator()(double w) const {
    Complex L = gain;
    for (const Factor& f : zeros) L *= f(Complex(0, w));
    for (const Factor& f : poles) L /= f(Complex(0, w));
    return L;
  }
  LoopTransfer realized() const {
    Polynomial over{gain}, under{1};
    for (const Factor& f : zeros) over = over * f.polynomial();
    for (const Factor& f : poles) under = under * f.polynomial();
    return ratio(over, under);
  }
};

// A stable closed loop: built either closed, or from an open loop that may itself be unstable.
LoopTransfer stable_loop(Random& random) {
  for (;;) {
    const Index n = 1 + Index(random() % 8);
    const MatrixXd A = normal(random, n, n) - uniform(random, 0, 2) * MatrixXd::Identity(n, n);
    const double size = std::pow(10, uniform(random, -1, 1));
    const double d = random() % 3 == 0 ? uniform(random, -0.9, 2) : 0.0;
    LoopTransfer g{A, size * normal(random, n, 1), normal(random, 1, n), d};
    if (random() % 2 == 0 && 1 + d > 0.05) g = opened(g.A, g.b, g.c, g.d);
    if (std::abs(1 + g.d) > 0.05 && abscissa(g, 1) < -0.01) return g;
  }
}

void check_same(const Margins& a, const Margins& b, double tolerance) {
  const auto same = [&](double x, double y) {
    CHECK((x == y || std::abs(x - y) <= tolerance * std::abs(x)));
  };
  CHECK(a.closed_loop == b.closed_loop);
  same(a.gain_up, b.gain_up);
  same(a.gain_down, b.gain_down);
  same(a.phase, b.phase);
  same(a.delay, b.delay);
  same(a.disk, b.disk);
  same(a.sensitivity_peak, b.sensitivity_peak);
  CHECK(a.phase_crossings.size() == b.phase_crossings.size());
  CHECK(a.gain_crossovers.size() == b.gain_crossovers.size());
}

// Stable just before, unstable just after, by eigenvalues.
void check_true(const LoopTransfer& g, const Margins& m) {
  constexpr double step = 1e-6;
  if (m.gain_up < infinity) {
    CHECK(stable(g, 1 + (m.gain_up - 1) * (1 - step)));
    CHECK_FALSE(stable(g, 1 + (m.gain_up - 1) * (1 + step)));
  }
  if (m.gain_down > 0) {
    CHECK(stable(g, 1 + (m.gain_down - 1) * (1 - step)));
    CHECK_FALSE(stable(g, 1 + (m.gain_down - 1) * (1 + step)));
  }
  if (m.phase < infinity) {
    const auto turned = [&](double by) {
      return std::max(abscissa(g, std::polar(1.0, by)), abscissa(g, std::polar(1.0, -by)));
    };
    CHECK(turned(m.phase * (1 - step)) < 0);
    CHECK(turned(m.phase * (1 + step)) > 0);
  }
  if (m.delay > 0 && m.delay < infinity) {
    const Complex L = response(g, m.delay_at);
    CHECK(std::abs(1.0 + std::polar(1.0, -m.delay_at * m.delay) * L) < 1e-10);
  }
  // No f = (1 + z)/(1 - z) with |z| < disk/2 destabilises, and one with |z| = disk/2 does
  const Complex L = response(g, m.disk_at), f = -1.0 / L;
  if (L != 0.0) CHECK_NEAR(std::abs((f - 1.0) / (f + 1.0)), m.disk / 2, 1e-8 * m.disk);
  for (int k = 0; k < 60 && m.disk < 1.9; ++k) {
    const Complex z = std::polar(0.5 * m.disk * (1 - step), 2 * pi * k / 60);
    CHECK(abscissa(g, (1.0 + z) / (1.0 - z)) < 0);
  }
}

}  // namespace

TEST_CASE("margins: k/(s(s + a)(s + b)) has the gain margin ab(a + b)/k at √(ab)") {
  // Routh: s³ + (a + b) s² + ab s + k
  Random random(1);
  for (int i = 0; i < trials(100); ++i) {
    const double a = std::pow(10, uniform(random, -4, 4)), b = std::pow(10, uniform(random, -4, 4));
    const double most = a * b * (a + b), k = most * uniform(random, 0.01, 0.99);
    const Margins m = margins(ratio({k}, Polynomial{0, 1} * Polynomial{a, 1} * Polynomial{b, 1}));
    REQUIRE(m.stable());
    CHECK(m.complete);
    CHECK_NEAR(m.gain_up, most / k, 1e-10 * most / k);
    CHECK_NEAR(m.gain_up_at, std::sqrt(a * b), 1e-10 * std::sqrt(a * b));
    CHECK(m.gain_down == 0);
    CHECK(m.gain_crossovers.size() == 1);
    CHECK(m.residual < 1e-9);
  }
}

TEST_CASE("margins: k/s has 90 degrees, a delay of π/2k, the whole right half for a disk") {
  for (const double k : {1e-6, 0.3, 1.0, 7.0, 1e6}) {
    const Margins m = margins(ratio({k}, {0, 1}));
    CHECK(m.gain_up == infinity);
    CHECK(m.gain_down == 0);
    CHECK_NEAR(m.phase, pi / 2, 1e-14);
    CHECK_NEAR(m.phase_at, k, 1e-14 * k);
    CHECK_NEAR(m.delay, pi / (2 * k), 1e-14 / k);
    CHECK_NEAR(m.disk, 2, 1e-14);  // S - ½ = (s - k)/2(s + k)
    CHECK(m.disk_gain_up() > 1e14);
    CHECK(m.disk_gain_down() < 1e-14);
    CHECK_NEAR(m.disk_phase(), pi / 2, 1e-14);
    CHECK_NEAR(m.sensitivity_peak, 1, 1e-14);
    CHECK(m.complete);
  }
}

TEST_CASE("margins: k/(s + a) crosses at √(k² - a²), or never") {
  const Margins m = margins(ratio({5}, {3, 1}));
  CHECK_NEAR(m.phase, pi - std::atan(4.0 / 3.0), 1e-14);
  CHECK_NEAR(m.phase_at, 4, 1e-14);
  CHECK_NEAR(m.delay, m.phase / 4, 1e-14);
  const Margins low = margins(ratio({2}, {3, 1}));
  CHECK(low.phase == infinity);
  CHECK(low.delay == infinity);
  CHECK(low.gain_up == infinity);
  CHECK(low.phase_crossings.empty());
  CHECK(low.gain_crossovers.empty());
  const Margins unstable_plant = margins(ratio({5}, {-3, 1}));  // stable for k > 3
  CHECK_NEAR(unstable_plant.gain_down, 0.6, 1e-14);
  CHECK(unstable_plant.gain_down_at == 0);
  CHECK_NEAR(unstable_plant.phase, std::atan(4.0 / 3.0), 1e-14);
}

TEST_CASE("margins: ω²/(s(s + 2ζω)), by its damping") {
  for (const double zeta : {0.01, 0.1, 0.3, 0.5, 0.7, 1.0, 3.0}) {
    const double w = 2.5, z2 = zeta * zeta;
    const Margins m = margins(ratio({w * w}, {0, 2 * zeta * w, 1}));
    // Phase margin and peak of sensitivity of the standard second-order loop            [48, 49]
    const double cross = w * std::sqrt(std::sqrt(1 + 4 * z2 * z2) - 2 * z2);
    CHECK_NEAR(m.phase, std::atan(2 * zeta * w / cross), 1e-12);
    CHECK_NEAR(m.phase_at, cross, 1e-12);
    const double r = std::sqrt(8 * z2 + 1);
    CHECK_NEAR(m.sensitivity_peak,
               std::sqrt((8 * z2 + 1 + (4 * z2 + 1) * r) / (8 * z2 + 1 + (4 * z2 - 1) * r)),
               2e-9 * m.sensitivity_peak);
    CHECK_NEAR(m.sensitivity_peak_at, w * std::sqrt((1 + r) / 2), 1e-3 * w);
    CHECK(m.gain_up == infinity);
    CHECK(m.gain_down == 0);
  }
}

TEST_CASE("margins: the disk of 1/(s(s + 1))") {
  // |2S - 1|² = (x² + 3x + 1)/(x² - x + 1), x = ω², is largest at x = 1: 5
  const Margins m = margins(ratio({1}, {0, 1, 1}));
  CHECK_NEAR(m.disk, 2 / std::sqrt(5.0), 2e-9);
  CHECK_NEAR(m.disk_at, 1, 1e-4);
  CHECK_NEAR(m.disk_phase(), 2 * std::atan(1 / std::sqrt(5.0)), 2e-9);
  CHECK_NEAR(m.disk_gain_up() * m.disk_gain_down(), 1, 1e-14);
  CHECK_NEAR(m.disk_gain_up(), (std::sqrt(5.0) + 1) / (std::sqrt(5.0) - 1), 1e-8);
}

TEST_CASE("margins: a double integrator with proportional and derivative feedback") {
  for (const double kp : {1e-4, 0.5, 3.0})
    for (const double kd : {0.01, 1.0, 40.0}) {
      const Margins m = margins(ratio({kp, kd}, {0, 0, 1}));
      const double cross = std::sqrt(0.5 * (kd * kd + std::hypot(kd * kd, 2 * kp)));
      CHECK(m.stable());
      CHECK_NEAR(m.phase, std::atan(kd * cross / kp), 1e-10);
      CHECK_NEAR(m.phase_at, cross, 1e-10 * cross);
      CHECK(m.gain_up == infinity);
      CHECK(m.gain_down == 0);
    }
}

TEST_CASE("margins: conditionally stable loops") {
  SUBCASE("2 (s + 2)²/s³: s³ + k s² + 4k s + 4k is stable for k > 1") {
    const Margins m =
        margins(ratio(Polynomial{2} * Polynomial{2, 1} * Polynomial{2, 1}, {0, 0, 0, 1}));
    CHECK_NEAR(m.gain_down, 0.5, 1e-12);
    CHECK_NEAR(m.gain_down_at, 2, 1e-12);
    CHECK(m.gain_up == infinity);
  }
  SUBCASE("30 (s + 1)/(s(s - 1)(s² + 4s + 16)): Routh, k² - 59k + 832 = 0") {  // [49]
    const LoopTransfer g =
        ratio({30, 30}, Polynomial{0, 1} * Polynomial{-1, 1} * Polynomial{16, 4, 1});
    const Margins m = margins(g);
    const double low = 0.5 * (59 - std::sqrt(153.0)), high = 0.5 * (59 + std::sqrt(153.0));
    CHECK_NEAR(m.gain_down, low / 30, 1e-12);
    CHECK_NEAR(m.gain_down_at, std::sqrt((low - 16) / 3), 1e-12);
    CHECK_NEAR(m.gain_up, high / 30, 1e-12);
    CHECK_NEAR(m.gain_up_at, std::sqrt((high - 16) / 3), 1e-12);
    CHECK(m.phase_crossings.size() == 2);
    check_true(g, m);
  }
}

TEST_CASE("margins: a direct way through") {
  SUBCASE("(1.75 - s/4)/(s + 1): unstable from infinity on, at a factor of 4") {
    const Margins m = margins(ratio({1.75, -0.25}, {1, 1}));
    CHECK_NEAR(m.gain_up, 4, 1e-14);
    CHECK(m.gain_up_at == infinity);
    CHECK_NEAR(m.phase_at, std::sqrt(2.2), 1e-14);
    CHECK(m.gain_down == 0);
    CHECK(m.residual < 1e-14);
  }
  SUBCASE("|d| >= 1 bears no delay") {
    const Margins m = margins(ratio({1, 2}, {3, 1}));
    CHECK(m.delay == 0);
    CHECK(m.delay_at == infinity);
    CHECK_NEAR(m.phase_at, std::sqrt(8.0 / 3), 1e-14);
    const Margins one = margins(ratio({4, 1}, {3, 1}));  // |L| > 1, and 1 at infinity
    CHECK(one.delay == 0);
    CHECK_NEAR(one.phase, pi, 1e-14);
    CHECK(one.phase_at == infinity);
  }
}

TEST_CASE("margins: a gain alone") {
  const Margins half = margins(gain(0.5));
  CHECK(half.stable());
  CHECK(half.gain_up == infinity);
  CHECK(half.gain_down == 0);
  CHECK(half.phase == infinity);
  CHECK(half.delay == infinity);
  CHECK_NEAR(half.sensitivity_peak, 2.0 / 3, 1e-15);
  CHECK_NEAR(half.disk, 6, 1e-14);
  CHECK(half.disk_gain_up() == infinity);
  CHECK(half.disk_gain_down() == 0);
  CHECK(margins(gain(-0.5)).gain_up == 2);
  CHECK(margins(gain(-2)).gain_down == 0.5);
  CHECK(margins(gain(-2)).delay == 0);
  CHECK_NEAR(margins(gain(1)).phase, pi, 1e-15);
  CHECK(margins(gain(1)).disk == infinity);
  CHECK(margins(gain(0)).disk == 2);
  CHECK(response(gain(3), 1.0) == 3.0);
  CHECK(opened(MatrixXd(0, 0), VectorXd(0), RowVectorXd(0), -0.5).d == 1);
}

TEST_CASE("margins: where L only touches") {
  // 2ζ ω s/(s² + 2ζ ω s + ω²) has the magnitude 1 at ω alone, and the phase 0
  const Margins peak = margins(ratio({0, 0.6}, {1, 0.6, 1}));
  CHECK(peak.gain_crossovers.size() == 1);
  CHECK_NEAR(peak.phase, pi, 1e-6);
  CHECK_NEAR(peak.phase_at, 1, 1e-6);
  CHECK_NEAR(peak.delay, pi, 1e-5);
  // 1/(s + 1) has it at rest alone, and bears any delay
  const Margins rest = margins(ratio({1}, {1, 1}));
  CHECK_NEAR(rest.phase, pi, 1e-6);
  CHECK(rest.delay == infinity);
}

TEST_CASE("margins: two crossings close together") {
  // (1 + δ) 2ζs/(s² + 2ζs + 1) has the magnitude 1 where ω - 1/ω = ±2ζ √(2δ + δ²)
  for (const double delta : {1e-2, 1e-4, 1e-6, 1e-8, 1e-10}) {
    CAPTURE(delta);
    const double zeta = 0.3, apart = 2 * zeta * std::sqrt(2 * delta + delta * delta);
    const Margins m = margins(ratio({0, (1 + delta) * 2 * zeta}, {1, 2 * zeta, 1}));
    REQUIRE(m.gain_crossovers.size() == 2);
    const double off = 1e-15 / apart + 1e-14;  // ε moves δ by ε, and the crossings by ε/apart
    CHECK_NEAR(m.gain_crossovers[0].frequency, 0.5 * (std::hypot(2, apart) - apart), off);
    CHECK_NEAR(m.gain_crossovers[1].frequency, 0.5 * (std::hypot(2, apart) + apart), off);
  }
  const Margins below = margins(ratio({0, (1 - 1e-10) * 0.6}, {1, 0.6, 1}));
  CHECK(below.gain_crossovers.empty());
  CHECK(below.delay == infinity);
}

TEST_CASE("margins: poles and zeros of L on the axis") {
  // A resonance and a notch without damping, in a loop that damps the one
  const LoopTransfer g =
      ratio(Polynomial{0, 0.2} * Polynomial{9, 0, 1}, Polynomial{4, 0, 1} * Polynomial{16, 1, 1});
  const Margins m = margins(g);
  REQUIRE(m.stable());
  CHECK(m.complete);
  CHECK(m.residual < 1e-12);
  CHECK(m.gain_down == 0);
  CHECK(response(g, 2.0).real() == infinity);
  CHECK(std::abs(response(g, 3.0)) < 1e-15);
  check_true(g, m);
  // An integrator that the loop stabilizes, but not one outside it
  LoopTransfer beside{MatrixXd{{0, 0}, {1, 0}}, VectorXd{{1, 0}}, RowVectorXd{{1, 0}}, 0};
  CHECK(margins(beside).closed_loop == Verdict::undecided);
  CHECK(margins(beside).phase == 0);
}

TEST_CASE("margins: a weak mode without damping in an integrator's loop") {
  // 1/2s + κ/(s² + 1): L = x - i/2 near ω = 1, x all reals, so |S| <= 2 and |S - T| <= √5 + 2
  for (const double kappa : {1e-5, 1e-6, 3e-7, 1e-7, 1e-8, 1e-9}) {
    CAPTURE(kappa);
    const Margins m = margins(ratio({0.5, kappa, 0.5}, {0, 1, 0, 1}));
    REQUIRE(m.stable());
    CHECK(m.complete);
    const double off =
        kappa + 1e-6;  // ω is 1 within κ; rounding moves the pole by ε/κ of its width
    CHECK_NEAR(m.disk, 2 / (std::sqrt(5.0) + 2), off);
    CHECK_NEAR(m.sensitivity_peak, 2, 2 * off);
    CHECK_NEAR(m.phase, pi / 6, 2 * off);
    CHECK(m.gain_crossovers.size() == 3);
  }
}

TEST_CASE("margins: a notch and a resonance within 1e-8 of each other") {
  // (1/2s) (s²/z² + 40 ζs/z + 1)/(s² + 2ζs + 1), z = 1 + 10ζ. With s = i + ζ q and q = iδ,
  // L = -i/2 (q - 10i + 20)/(q + 1), so S = c (1 + (1 + p)/(q - p)), c = 0.8 + 0.4i: a circle
  const Complex c{0.8, 0.4}, p{-0.8, 9.6}, middle = c - 0.5 * c * (1.0 + p) / p.real();
  const double radius = 0.5 * std::abs(c * (1.0 + p) / p.real());
  const double delta = (-5 + std::sqrt(397.0)) / 1.5;  // 3/4 δ² + 5δ - 124 = 0 where |L| = 1
  const double lag = std::arg(Complex(0, 0.5) * Complex(20, delta - 10) / Complex(1, delta));
  for (const double zeta : {1e-7, 1e-8, 1e-9}) {
    CAPTURE(zeta);
    const double z = 1 + 10 * zeta;
    const Margins m = margins(
        ratio({0.5, 20 * zeta / z, 0.5 / (z * z)}, Polynomial{0, 1} * Polynomial{1, 2 * zeta, 1}));
    REQUIRE(m.stable());
    CHECK(m.complete);
    const double off = 100 * zeta + 1e-6;  // relative; rounding moves the pole by ε/ζ of its width
    CHECK_NEAR(m.disk, 1 / (std::abs(middle - 0.5) + radius), off * m.disk);
    CHECK_NEAR(m.sensitivity_peak, std::abs(middle) + radius, off * m.sensitivity_peak);
    CHECK_NEAR(m.phase, std::abs(lag), off);
    CHECK_NEAR(m.delay, std::abs(lag), off);
    CHECK(m.gain_crossovers.size() == 3);
  }
}

TEST_CASE("margins: a resonance narrower than rounding resolves is not reported as complete") {
  for (const double kappa : {1e-12, 1e-13, 1e-14, 1e-15}) {
    const Margins m = margins(ratio({0.5, kappa, 0.5}, {0, 1, 0, 1}));
    CHECK((!m.stable() || !m.complete));
  }
}

TEST_CASE("margins: an unstable closed loop has none") {
  const Margins m = margins(ratio({7}, {0, 2, 3, 1}));  // stable for k < 6
  CHECK(m.closed_loop == Verdict::unstable);
  CHECK_FALSE(m.stable());
  CHECK(m.gain_up == 1);
  CHECK(m.gain_down == 1);
  CHECK(m.phase == 0);
  CHECK(m.delay == 0);
  CHECK(m.disk == 0);
  CHECK(m.sensitivity_peak == infinity);
  CHECK(m.disk_gain_up() == 1);
  CHECK(m.disk_gain_down() == 1);
  CHECK(m.disk_phase() == 0);
  CHECK(margins(ratio({6}, {0, 2, 3, 1})).closed_loop == Verdict::undecided);
}

TEST_CASE("margins: a search that meets its cap says so") {
  CHECK_FALSE(margins(ratio({1}, {0, 1, 1}), 0).complete);
  CHECK_FALSE(margins(ratio({1}, {0, 1, 1}), 0).complete);
  CHECK(margins(ratio({1}, {0, 1, 1})).complete);
}

TEST_CASE("margins: a caller's mistakes are named") {
  LoopTransfer g = ratio({1}, {1, 2, 1});
  CHECK_THROWS_WITH_AS((void)margins({g.A, VectorXd(3), g.c, 0}),
                       "loop: A is 2 x 2, b has 3 rows, c 2 columns", std::invalid_argument);
  CHECK_THROWS_WITH_AS((void)response({MatrixXd(2, 3), g.b, g.c, 0}, 1.0),
                       "loop: A is 2 x 3, b has 2 rows, c 2 columns", std::invalid_argument);
  CHECK_THROWS_AS((void)response(g, std::nan("")), std::invalid_argument);
  CHECK_THROWS_AS((void)bode(g, 1.0, 1.0, 5), std::invalid_argument);
  CHECK_THROWS_AS((void)bode(g, 0.0, 1.0, 5), std::invalid_argument);
  CHECK_THROWS_AS((void)bode(g, 1.0, 2.0, 1), std::invalid_argument);
  g.d = -1;
  CHECK_THROWS_AS((void)margins(g), std::invalid_argument);
  CHECK_THROWS_AS((void)opened(g.A, g.b, g.c, -1.0), std::invalid_argument);
  g.d = 0;
  g.A(0, 0) = std::nan("");
  CHECK_THROWS_AS((void)margins(g), std::invalid_argument);
  CHECK_THROWS_AS((void)bode(g, 1.0, 2.0, 5), std::invalid_argument);
}

TEST_CASE("opened: a plant and a controller, broken by hand at the plant's input and output") {
  Random random(2);
  for (int k = 0; k < trials(300); ++k) {
    // x' = A x + B (u + v), y = C x;  z' = F z + G (y + w), u = -(H z + J (y + w))
    const Index n = 1 + Index(random() % 5), l = 1 + Index(random() % 4), nu = 2, ny = 2;
    const MatrixXd A = normal(random, n, n), B = normal(random, n, nu), C = normal(random, ny, n);
    const MatrixXd F = normal(random, l, l), G = normal(random, l, ny), H = normal(random, nu, l),
                   J = normal(random, nu, ny);
    MatrixXd closed(n + l, n + l);
    closed << A - B * J * C, -B * H, G * C, F;
    // At input 0: what is added appears as u₀ + v; the other loops remain closed
    const VectorXd b = (VectorXd(n + l) << B.col(0), VectorXd::Zero(l)).finished();
    const RowVectorXd c = (RowVectorXd(n + l) << -J.row(0) * C, -H.row(0)).finished();
    const LoopTransfer L = opened(closed, b, c);
    // Manually: u₀ is cut, and its would-be value is the response, negated
    const MatrixXd cut = closed - b * c;
    // At output 1: what is added comes out as y₁ + w
    const VectorXd b_out = (VectorXd(n + l) << -B * J.col(1), G.col(1)).finished();
    const RowVectorXd c_out = (RowVectorXd(n + l) << C.row(1), RowVectorXd::Zero(l)).finished();
    const LoopTransfer L_out = opened(closed, b_out, c_out);
    for (const double w : {0.1, 1.0, 10.0}) {
      const MatrixXcd I = Complex(0, w) * MatrixXcd::Identity(n + l, n + l);
      const Complex hand =
          -(c * algebra::solve(MatrixXcd(I - cut), MatrixXcd(b.cast<Complex>()))).value();
      CHECK(std::abs(response(L, w) - hand) <= 1e-9 * (1 + std::abs(hand)));
      const MatrixXcd Ip = Complex(0, w) * MatrixXcd::Identity(n, n),
                      Ic = Complex(0, w) * MatrixXcd::Identity(l, l);
      const MatrixXcd P = C * algebra::solve(MatrixXcd(Ip - A), MatrixXcd(B.cast<Complex>()));
      const MatrixXcd K = H * algebra::solve(MatrixXcd(Ic - F), MatrixXcd(G.cast<Complex>())) + J;
      // L at one place of a matrix: the other place remains closed.  1/(1 + L) is S's entry
      const MatrixXcd S_in = algebra::inverse(MatrixXcd(MatrixXcd::Identity(nu, nu) + K * P));
      const MatrixXcd S_out = algebra::inverse(MatrixXcd(MatrixXcd::Identity(ny, ny) + P * K));
      CHECK(std::abs(1.0 / (1.0 + response(L, w)) - S_in(0, 0)) <= 1e-8 * (1 + S_in.norm()));
      CHECK(std::abs(1.0 / (1.0 + response(L_out, w)) - S_out(1, 1)) <= 1e-8 * (1 + S_out.norm()));
    }
  }
}

TEST_CASE("opened: with a direct way through, and back") {
  Random random(3);
  for (int k = 0; k < trials(300); ++k) {
    const LoopTransfer L = stable_loop(random);
    // S = 1/(1 + L): 1 + c (sI - A)⁻¹ b + d
    const double D = 1 + L.d;
    const LoopTransfer again = opened(L.A - L.b * L.c / D, L.b / D, -L.c / D, 1 / D - 1);
    for (const double w : {0.0, 0.3, 3.0, infinity})
      CHECK(std::abs(response(again, w) - response(L, w)) <= 1e-9 * (1 + std::abs(response(L, w))));
  }
}

TEST_CASE("opened: by signal names") {
  Random random(4);
  LinearModel closed;
  closed.states = {{"x1", ""}, {"x2", ""}, {"x3", ""}};
  closed.inputs = {{"aileron", ""}, {"rudder", ""}};
  closed.outputs = {{"beta", ""}, {"law", ""}};
  closed.A = normal(random, 3, 3), closed.B = normal(random, 3, 2);
  closed.C = normal(random, 2, 3), closed.D = normal(random, 2, 2);
  const LoopTransfer named = opened(closed, "rudder", "law");
  const LoopTransfer L = opened(closed.A, closed.B.col(1), closed.C.row(1), closed.D(1, 1));
  CHECK(named.A == L.A);
  CHECK(named.b == L.b);
  CHECK(named.c == L.c);
  CHECK(named.d == L.d);
  const auto message = [&](const char* input, const char* output) {
    return refusal<std::invalid_argument>([&] { (void)opened(closed, input, output); });
  };
  CHECK(message("ruder", "law").find("no input 'ruder'; the model has: aileron, rudder") !=
        std::string::npos);
  CHECK(message("rudder", "x1").find("no output 'x1'; the model has: beta, law") !=
        std::string::npos);
}

TEST_CASE("margins: none missed and none invented, against a dense scan of random loops" *
          thorough) {
  Random random(4);
  int with_gain_up = 0, with_gain_down = 0, with_phase = 0, finer = 0;
  for (int k = 0; k < trials(1000); ++k) {
    CAPTURE(k);
    const LoopTransfer g = stable_loop(random);
    const Margins m = margins(g);
    REQUIRE(m.stable());
    CHECK(m.complete);
    CHECK(m.residual < 1e-12);
    finer += check_found(m, scan(Fractions(g), g.d, 1e-4, 1e5, 6000));
    check_true(g, m);
    with_gain_up += m.gain_up < infinity;
    with_gain_down += m.gain_down > 0;
    with_phase += m.phase < infinity;
  }
  CHECK(finer <= trials(1000) / 100);
  CHECK(with_gain_up > trials(400));
  CHECK(with_gain_down > trials(150));
  CHECK(with_phase > trials(300));
}

TEST_CASE("margins: the same in any units") {
  Random random(5);
  for (int k = 0; k < trials(1000); ++k) {
    CAPTURE(k);
    const LoopTransfer g = stable_loop(random);
    const VectorXd unit =
        VectorXd::NullaryExpr(g.A.rows(), [&] { return std::pow(10, uniform(random, -6, 6)); });
    check_same(margins(g), margins(in_units(g, unit)), 1e-6);
  }
}

TEST_CASE("margins: none missed, against a scan of the factors that L is made of" *
          doctest::skip(sanitized)) {
  Random random(7);
  for (int k = 0; k < trials(1000);) {
    const Factored L(random);
    const LoopTransfer g = L.realized();
    if (std::abs(1 + g.d) < 1e-3) continue;
    const Margins m = margins(g);
    if (!m.stable()) continue;
    ++k;
    CAPTURE(k);
    CHECK(m.complete);
    CHECK(m.residual < 1e-8);
    check_found(m, scan(L, g.d, 1e-6, 1e6, 6000));
  }
}

TEST_CASE(
    "margins: of a loop opened from the closed one, integrators by rounding among its poles") {
  for (const Polynomial& under : {Polynomial{0, 1}, Polynomial{0, 0, 1}, Polynomial{0, 0, 0, 1},
                                  Polynomial{0, 2, 3, 1}, Polynomial{0, -16, 12, 3, 1}}) {
    Polynomial over{1};  // (s + 2)ᵐ: one zero less than poles
    for (std::size_t i = 2; i < under.size(); ++i) over = over * Polynomial{2, 1};
    const LoopTransfer g = ratio(Polynomial{20} * over, under);
    const double D = 1 + g.d;
    const MatrixXd T =
        MatrixXd::Identity(g.A.rows(), g.A.rows()) + 0.3 * MatrixXd::Ones(g.A.rows(), g.A.rows());
    const MatrixXd closed = T * (g.A - g.b * g.c / D) * algebra::inverse(T);
    const LoopTransfer again =
        opened(closed, T * g.b / D, -g.c * algebra::inverse(T) / D, 1 / D - 1);
    const Margins m = margins(again);
    REQUIRE(m.stable());
    CHECK(m.complete);
    check_same(margins(g), m, 1e-9);
  }
}

TEST_CASE("bode: phase without jumps") {
  const Bode two = bode(ratio({1}, {0, 0, 1}), 0.1, 10, 3);
  CHECK_NEAR(two.frequency[1], 1, 1e-15);
  CHECK(two.frequency[2] == 10);
  CHECK_NEAR(two.magnitude[0], 100, 1e-12);
  for (const double phase : two.phase) CHECK_NEAR(phase, -pi, 1e-12);
  const LoopTransfer negative = ratio({-1}, {1, 1}), washout = ratio({0, 1}, {1, 1});
  CHECK_NEAR(bode(negative, 1e-9, 1, 2).phase[0], -pi, 1e-8);
  CHECK_NEAR(bode(washout, 1e-9, 1, 2).phase[0], pi / 2, 1e-8);
  // Five poles and two resonances of 1e-9 damping between two points: -5 · 90° - 2 · 180°
  Polynomial under{1};
  for (int i = 0; i < 5; ++i) under = under * Polynomial{1, 1};
  under = under * Polynomial{4, 4e-9, 1} * Polynomial{9, 6e-9, 1};
  const Bode fast = bode(ratio({1}, under), 1e-6, 1e6, 2);
  CHECK_NEAR(fast.phase[0], 0, 1e-4);
  CHECK_NEAR(fast.phase[1], -4.5 * pi, 1e-4);
  // Independent of the grid
  Random random(6);
  for (int k = 0; k < trials(100); ++k) {
    const LoopTransfer g = stable_loop(random);
    CHECK_NEAR(bode(g, 1e-3, 1e3, 2).phase[1] - bode(g, 1e-3, 1e3, 4001).phase[4000], 0, 1e-9);
  }
}

}  // namespace margins_test
