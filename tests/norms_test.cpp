#include <cmath>
#include <complex>
#include <limits>

#include "design/design.hpp"
#include "tests/algebra.hpp"
#include "tests/check.hpp"
#include "tests/random_draws.hpp"

using namespace tiltrim;
using Eigen::Index;
using Eigen::MatrixXcd;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using Complex = std::complex<double>;

namespace norms_test {

namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();

struct System {
  MatrixXd A, B, C, D;
};

MatrixXd rows(std::initializer_list<std::initializer_list<double>> values) {
  return MatrixXd(values);
}
MatrixXd scalar(double value) { return MatrixXd::Constant(1, 1, value); }

System first_order(double a, double b, double c, double d) {
  return {scalar(a), scalar(b), scalar(c), scalar(d)};
}
// 1/(s² + 2 ζ ω s + ω²)
System oscillator(double omega, double zeta) {
  return {rows({{0, 1}, {-omega * omega, -2 * zeta * omega}}), rows({{0}, {1}}), rows({{1, 0}}),
          scalar(0)};
}

Peak hinf(const System& g, double tolerance = 1e-8) {
  return hinf_norm(g.A, g.B, g.C, g.D, tolerance);
}
H2Norm h2(const System& g) { return h2_norm(g.A, g.B, g.C, g.D); }

// The example of AB13DD [79]: three resonances of unlike damping.
const System resonances{rows({{0, 1, 0, 0, 0, 0},
                              {-0.5, -0.0002, 0, 0, 0, 0},
                              {0, 0, 0, 1, 0, 0},
                              {0, 0, -1, -0.00002, 0, 0},
                              {0, 0, 0, 0, 0, 1},
                              {0, 0, 0, 0, -2, -0.000002}}),
                        rows({{1}, {0}, {1}, {0}, {1}, {0}}), rows({{1, 0, 1, 0, 1, 0}}),
                        scalar(0)};

// That of AB13BD: two areas of a power system, unstable: it has an L2 norm but no H2 norm.
const System power{rows({{-0.04165, 0, 4.92, 0.492, 0, 0, 0},
                         {-5.21, -12.5, 0, 0, 0, 0, 0},
                         {0, 3.33, -3.33, 0, 0, 0, 0},
                         {0.545, 0, 0, 0, 0.0545, 0, 0},
                         {0, 0, 0, -0.492, 0.004165, 0, 4.92},
                         {0, 0, 0, 0, 0.521, -12.5, 0},
                         {0, 0, 0, 0, 0, 3.33, -3.33}}),
                   rows({{0, 0}, {12.5, 0}, {0, 0}, {0, 0}, {0, 0}, {0, 12.5}, {0, 0}}),
                   rows({{1, 0, 0, 0, 0, 0, 0}, {0, 0, 0, 1, 0, 0, 0}, {0, 0, 0, 0, 1, 0, 0}}),
                   MatrixXd::Zero(3, 2)};

double gain(const System& g, double omega) {
  MatrixXcd M = -g.A.cast<Complex>();
  M.diagonal().array() += Complex(0, omega);
  const MatrixXcd G = g.C * algebra::inverse(M) * g.B + g.D;
  const MatrixXcd square = G.adjoint() * G;
  return std::sqrt(algebra::eigenvalues(square).real().maxCoeff());
}

// √(tr C P Cᵀ), A P + P Aᵀ + B Bᵀ = 0 as n² equations in long double.
double wide_h2(const System& g) {
  const Index n = g.A.rows();
  algebra::WideMatrix S = algebra::WideMatrix::Zero(n * n, n * n), q(n * n, 1);
  const algebra::WideMatrix A = g.A.cast<long double>(), B = g.B.cast<long double>(),
                            C = g.C.cast<long double>(), noise = B * B.transpose(),
                            weight = C.transpose() * C;
  for (Index i = 0; i < n; ++i) {
    for (Index j = 0; j < n; ++j) {
      q(i * n + j, 0) = -noise(i, j);
      for (Index k = 0; k < n; ++k) {
        S(i * n + j, k * n + j) += A(i, k);
        S(i * n + j, i * n + k) += A(j, k);
      }
    }
  }
  const algebra::WideMatrix P = algebra::solve(S, q);
  long double square = 0;
  for (Index i = 0; i < n * n; ++i) square += weight(i / n, i % n) * P(i, 0);
  return double(std::sqrt(square));
}

}  // namespace

TEST_CASE("hinf_norm: closed forms") {
  // 1/(2 ζ √(1 - ζ²) ω²) at ω √(1 - 2 ζ²); from ζ = 1/√2 on 1/ω² at 0.
  for (const double zeta : {1e-6, 1e-3, 0.1, 0.5, 0.7}) {
    for (const double omega : {1e-3, 1.0, 40.0}) {
      CAPTURE(zeta);
      CAPTURE(omega);
      const Peak found = hinf(oscillator(omega, zeta));
      REQUIRE(found);
      const double gain = 1 / (2 * zeta * std::sqrt(1 - zeta * zeta)) / (omega * omega);
      CHECK_NEAR(found.gain / gain, 1, 1e-9);  // of ζ = 1e-6 rounding leaves 10 digits
      CHECK(found.upper >= gain * (1 - 1e-9));
      CHECK(found.upper <= found.gain * (1 + 1.01e-8));
      CHECK_NEAR(found.frequency / omega, std::sqrt(1 - 2 * zeta * zeta), 1e-5);
    }
  }
  const Peak damped = hinf(oscillator(2, 0.8));
  CHECK_NEAR(damped.gain, 0.25, 1e-15);
  CHECK(damped.frequency == 0);
}

TEST_CASE("hinf_norm: gains of D, at infinity, of nothing") {
  const Peak high = hinf(first_order(-2, 1, -1, 1));  // (s + 1)/(s + 2)
  REQUIRE(high);
  CHECK(high.gain == 1);
  CHECK(high.frequency == infinity);
  const Peak low = hinf(first_order(-1, 1, 1, 1));  // (s + 2)/(s + 1)
  REQUIRE(low);
  CHECK_NEAR(low.gain, 2, 1e-15);
  const Peak all_pass = hinf(first_order(-1, 1, -2, 1));  // (s - 1)/(s + 1)
  CHECK_NEAR(all_pass.gain, 1, 1e-15);
  CHECK(all_pass);
  CHECK(hinf({MatrixXd(0, 0), MatrixXd(0, 1), MatrixXd(1, 0), scalar(-3)}).gain == 3);
  const Peak none = hinf(first_order(-1, 0, 1, 0));
  CHECK(none);
  CHECK(none.gain == 0);
  CHECK(none.upper == 0);
  CHECK(hinf({scalar(-1), MatrixXd(1, 0), scalar(1), MatrixXd(1, 0)}).gain == 0);
}

TEST_CASE("hinf_norm: published values") {
  const Peak slicot = hinf(resonances);
  REQUIRE(slicot);
  CHECK_NEAR(slicot.gain, 0.5000000001e6, printed_to("0.5000000001E+06"));
  CHECK_NEAR(slicot.frequency, 1.414213562, printed_to("1.414213562"));
  // [0, 3 s/(s² + s + 10); (s + 1)/(s + 5), 2/(s + 6)]: 3.0150 at 3.1623           [84]
  const System two{rows({{0, 1, 0, 0}, {-10, -1, 0, 0}, {0, 0, -5, 0}, {0, 0, 0, -6}}),
                   rows({{0, 0}, {0, 1}, {1, 0}, {0, 1}}), rows({{0, 3, 0, 0}, {0, 0, -4, 2}}),
                   rows({{0, 0}, {1, 0}})};
  const Peak matlab = hinf(two);
  REQUIRE(matlab);
  CHECK_NEAR(matlab.gain, 3.0150, printed_to("3.0150"));
  CHECK_NEAR(matlab.frequency, 3.1623, 2e-4);  // printed with a tolerance of 1 % of the gain
}

TEST_CASE("hinf_norm: statuses and mistakes") {
  for (const double a : {0.0, 1.0}) {
    const Peak unstable = hinf(first_order(a, 1, 1, 0));
    CHECK(to_string(unstable.status) == "unstable");
    CHECK(unstable.gain == infinity);
  }
  CHECK(hinf(power).status == PeakStatus::unstable);
  CHECK(refusal([] {
          (void)hinf_norm(scalar(-1), scalar(1), rows({{1, 2}}), scalar(0));
        }) == "hinf_norm: A is 1 x 1, B is 1 x 1, C is 1 x 2 (expected 1 x 1), D is 1 x 1");
  CHECK(contains(refusal([] { (void)hinf(first_order(NAN, 1, 1, 0)); }), "A(1, 1) is nan"));
  CHECK(contains(refusal([] { (void)hinf(power, 0); }), "tolerance"));
}

TEST_CASE("hinf_norm: no frequency of a fine grid has a larger gain") {
  Random random = draws(7);
  for (int trial = 0; trial < trials(40); ++trial) {
    const Index n = 1 + trial % 9, m = 1 + trial % 3, p = 1 + trial / 3 % 3;
    MatrixXd A = normal(random, n, n);
    A -= (A.norm() + 1e-3) * MatrixXd::Identity(n, n) * (trial % 2 == 0 ? 0.6 : 1.0);
    const System g{A, normal(random, n, m), normal(random, p, n),
                   double(trial % 2) * normal(random, p, m)};
    const Peak found = hinf(g);
    CAPTURE(trial);
    if (found.status == PeakStatus::unstable) continue;
    REQUIRE(found);
    if (std::isfinite(found.frequency)) CHECK_NEAR(gain(g, found.frequency) / found.gain, 1, 1e-10);
    double largest = 0;
    for (int k = 0; k < 300; ++k)
      largest = std::max(largest, gain(g, 1e-3 * std::pow(1e6, k / 299.0)));
    CHECK(largest <= found.upper * (1 + 1e-12));
  }
}

TEST_CASE("hinf_norm: a slow peak beside a fast mode that nearly cancels D") {
  // 0.9999 at 1 rad/s, 0.85 from 1e7 rad/s on: near 0.85 the Hamiltonian matrix is all rounding.
  const System g{rows({{-0.01, 0, 0}, {1, -100, 0}, {0, 0, -1e7}}), rows({{1}, {0}, {1}}),
                 rows({{100, -1e4, 0.85e7}}), scalar(-0.85)};
  const Peak found = hinf(g);
  REQUIRE(found);
  CHECK_NEAR(found.gain, 0.99990001, 2e-9);
  CHECK_NEAR(found.frequency, 1, 1e-3);
  CHECK(found.upper >= 0.99990001);
  CHECK(found.upper <= found.gain * (1 + 1.01e-8));
}

TEST_CASE("hinf_norm: no bound is below the gain, over ten decades of time scales") {
  Random random = draws(8);
  int found = 0, of = 0;
  for (int trial = 0; trial < trials(200); ++trial) {
    const Index n = 1 + trial % 8, m = 1 + trial / 8 % 2, p = 1 + trial / 16 % 2;
    VectorXd rates(n);
    for (double& rate : rates) rate = std::pow(10, uniform(random, -3, 7));
    MatrixXd A = MatrixXd::Zero(n, n);
    A.diagonal() = -rates;
    for (Index i = 0; i + 1 < n; i += 2) {
      if (trial % 3 == 0) continue;  // lightly damped pairs
      const double damping = std::pow(10, uniform(random, -4, 0));
      A.block(i, i, 2, 2) = rates[i] * rows({{-damping, 1}, {-1, -damping}});
    }
    for (Index i = 0; i < n; ++i)
      for (Index j = 0; j + 1 < i && trial % 3 == 2; ++j)
        A(i, j) = uniform(random, -1, 1) * std::sqrt(rates[i] * rates[j]);
    const double through = trial % 5 == 0 ? 0 : std::pow(10, uniform(random, -2, 2));
    const System g{A, normal(random, n, m), normal(random, p, n) * rates.asDiagonal(),
                   through * normal(random, p, m)};
    const Peak peak = hinf(g);
    CAPTURE(trial);
    if (peak.status == PeakStatus::unstable) continue;
    ++of;
    if (peak) ++found;
    CHECK(bool(peak) == (peak.upper <= peak.gain * (1 + 1.01e-8)));
    double largest = 0;
    for (int k = 0; k < 400; ++k)
      largest = std::max(largest, gain(g, std::pow(10, -5 + 14 * k / 399.0)));
    CHECK(largest <= peak.upper * (1 + 1e-12));
  }
  CHECK(found >= 0.9 * of);
}

TEST_CASE("hinf_norm: the same gain at all frequencies") {
  // ∏ (s - r)/(s + r): x' = -r x + v, y = v - 2 r x, one after the other
  const VectorXd rates{{0.5, 1, 30, 1e4}};
  System g{MatrixXd::Zero(4, 4), MatrixXd::Ones(4, 1), -2 * rates.transpose(), scalar(1)};
  for (Index i = 0; i < 4; ++i) {
    g.A(i, i) = -rates[i];
    g.A.row(i).head(i) = -2 * rates.head(i).transpose();
  }
  for (const double omega : {0.0, 3.0, 500.0}) CHECK_NEAR(gain(g, omega), 1, 1e-12);
  const Peak found = hinf(g);
  REQUIRE(found);
  CHECK_NEAR(found.gain, 1, 1e-11);
  CHECK(found.upper >= 1);
  CHECK(found.upper <= 1 + 1.1e-8);
}

TEST_CASE("h2_norm: closed forms and a published value") {
  for (const double a : {1e-6, 1.0, 1e6}) {
    const H2Norm found = h2(first_order(-a, a, 1, 0));  // a/(s + a): √(a/2)
    CHECK_NEAR(found.norm / std::sqrt(a / 2), 1, 1e-14);
    CHECK(found.error < 1e-14);
  }
  CHECK_NEAR(h2(oscillator(3, 0.2)).norm, std::sqrt(1 / (4 * 0.2 * 27)), 1e-15);
  // (c₂ s² + c₁ s + c₀)/(s³ + d₂ s² + d₁ s + d₀), by the table of integrals of [85, appendix E].
  const double c0 = 2, c1 = -1, c2 = 3, d0 = 4, d1 = 6, d2 = 5;
  const H2Norm third = h2({rows({{0, 1, 0}, {0, 0, 1}, {-d0, -d1, -d2}}), rows({{0}, {0}, {1}}),
                           rows({{c0, c1, c2}}), scalar(0)});
  CHECK_NEAR(
      third.norm * third.norm,
      (c2 * c2 * d0 * d1 + (c1 * c1 - 2 * c0 * c2) * d0 + c0 * c0 * d2) / (2 * d0 * (d1 * d2 - d0)),
      1e-14);
  CHECK(third.error < 1e-14);
  CHECK(h2(power).norm == infinity);
  CHECK(h2(first_order(-1, 1, 1, 0.5)).norm == infinity);
  CHECK(h2(first_order(1, 1, 1, 0)).norm == infinity);
  CHECK(h2(first_order(-1, 0, 1, 0)).norm == 0);
}

TEST_CASE("h2_norm: the error bounds what conditioning does") {
  // A pole at -1e-10 beside one at -1e3; the norm in 60 digits.
  const H2Norm found = h2(
      {rows({{3, 700}, {-4.3, -1003.3333333}}), rows({{1}, {0.3}}), rows({{1, 0.3}}), scalar(0)});
  CHECK(std::abs(found.norm - 85671.1534888) <= found.error * found.norm);
  CHECK(found.error < 1e-2);

  Random random = draws(9);
  for (int trial = 0; trial < trials(200); ++trial) {
    const Index n = 1 + trial % 6, m = 1 + trial % 2, p = 1 + trial % 3;
    const bool stiff = trial % 4 == 3;
    MatrixXd A = normal(random, n, n);
    A -= (A.norm() + 0.1) * MatrixXd::Identity(n, n);
    if (stiff)
      for (Index i = 0; i < n; ++i) A.row(i) *= std::pow(10, uniform(random, -4, 4));
    const System g{A, normal(random, n, m), normal(random, p, n), MatrixXd::Zero(p, m)};
    const H2Norm one = h2(g);
    CAPTURE(trial);
    if (one.norm == infinity) continue;
    CHECK(std::abs(one.norm - wide_h2(g)) <= one.error * one.norm);
    if (!stiff) CHECK(one.error < 1e-11);
  }
}

}  // namespace norms_test
