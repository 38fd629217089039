#include <random>

#include "qualities/qualities.hpp"
#include "qualities/transfer_function.hpp"
#include "tests/check.hpp"

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::RowVectorXd;
using Eigen::VectorXd;
using namespace tiltrim;
using Complex = std::complex<double>;

namespace zeros_test {

namespace {

// The Boeing 747 of [2], section 6.2, with its elevator, section 7.6; states u, w, q, theta.
TransferFunction jet(const RowVectorXd& c) {
  MatrixXd A(4, 4);
  A << -0.006868, 0.01395, 0, -32.2, -0.09055, -0.3151, 773.98, 0, 0.0001187, -0.001026, -0.4285, 0,
      0, 0, 1, 0;
  return {A, Eigen::Vector4d(-0.000187, -17.85, -1.158, 0), c};
}

// Coefficients of Π(s - root), the highest power first.
std::vector<Complex> polynomial(const std::vector<Complex>& roots) {
  std::vector<Complex> p{1.0};
  for (const Complex r : roots) {
    p.push_back(0.0);
    for (std::size_t k = p.size(); --k > 0;) p[k] -= r * p[k - 1];
  }
  return p;
}

std::vector<Complex> values(const std::vector<EnclosedRoot>& roots) {
  std::vector<Complex> all;
  for (const EnclosedRoot& r : roots) all.push_back(r.value);
  return all;
}

// Controllable canonical form of Π(s - zero)/Π(s - pole).
TransferFunction canonical(const std::vector<Complex>& zeros, const std::vector<Complex>& poles) {
  const Index n = std::ssize(poles);
  const auto below = polynomial(poles), above = polynomial(zeros);
  TransferFunction g{MatrixXd::Zero(n, n), VectorXd::Unit(n, n - 1), RowVectorXd::Zero(n)};
  g.A.topRightCorner(n - 1, n - 1).setIdentity();
  for (Index k = 0; k < n; ++k) g.A(n - 1, k) = -below[std::size_t(n - k)].real();
  for (std::size_t k = 0; k < above.size(); ++k) g.c[Index(above.size() - 1 - k)] = above[k].real();
  return g;
}

}  // namespace

TEST_CASE("the numerator of pitch to elevator, to every digit printed") {
  const ZerosAndPoles g = zeros_and_poles(jet(RowVectorXd::Unit(4, 3)));
  REQUIRE(g.status == ZerosStatus::found);
  CHECK(g.relative_degree == 2);
  CHECK(g.cancelled == 0);
  // [2], section 7.7: -(1.158 s² + 0.3545 s + 0.003873)
  CHECK_NEAR(g.gain, -1.158, printed_to("1.158"));
  const auto p = polynomial(values(g.zeros));
  CHECK_NEAR(g.gain * p[1].real(), -0.3545, printed_to("0.3545"));
  CHECK_NEAR(g.gain * p[2].real(), -0.003873, printed_to("0.003873"));
  for (const EnclosedRoot& zero : g.zeros) CHECK(zero.error < 1e-12);
}

TEST_CASE("planted zeros lie in their disks") {
  std::mt19937_64 random(1);
  std::uniform_real_distribution<double> left(-5, 0), up(0.5, 5), right(-1, 1);
  for (int trial = 0; trial < trials(200); ++trial) {
    CAPTURE(trial);
    std::vector<Complex> poles, zeros;
    for (int k = 0; k < 3; ++k) {
      const Complex p(left(random), up(random));
      poles.insert(poles.end(), {p, std::conj(p)});
    }
    const Complex z(right(random), up(random));
    zeros = {z, std::conj(z)};
    if (trial % 2 == 0) zeros.push_back(left(random));
    const TransferFunction own = canonical(zeros, poles);
    const ZerosAndPoles exact = zeros_and_poles(own);
    REQUIRE(exact.status == ZerosStatus::found);
    CHECK(exact.relative_degree == 6 - std::ssize(zeros));
    for (const Complex& planted : zeros) {
      double distance = INFINITY, error = 0;
      for (const EnclosedRoot& r : exact.zeros)
        if (std::abs(r.value - planted) < distance) {
          distance = std::abs(r.value - planted);
          error = r.error;
        }
      // The coefficients of the canonical form are rounded: 1e-12 with a condition of at most 100.
      CHECK(distance <= error + 1e-11);
      CHECK(error < 1e-10);
    }
  }
}

TEST_CASE("disks contain the zeros of every matrix within the error bounds") {
  TransferFunction g = jet(RowVectorXd::Unit(4, 3));
  g.A_error = 1e-3 * g.A.cwiseAbs();
  g.b_error = 1e-3 * g.b.cwiseAbs();
  const ZerosAndPoles all = zeros_and_poles(g);
  REQUIRE(all.status == ZerosStatus::found);
  std::mt19937_64 random(2);
  std::bernoulli_distribution side;
  double farthest = 0.0;
  for (int trial = 0; trial < trials(300); ++trial) {
    TransferFunction other = jet(RowVectorXd::Unit(4, 3));
    for (Index i = 0; i < 4; ++i) {
      other.b[i] += (side(random) ? 1 : -1) * g.b_error[i];
      for (Index j = 0; j < 4; ++j) other.A(i, j) += (side(random) ? 1 : -1) * g.A_error(i, j);
    }
    const ZerosAndPoles one = zeros_and_poles(other);
    REQUIRE(one.zeros.size() == all.zeros.size());
    for (std::size_t k = 0; k < one.zeros.size(); ++k) {
      const double moved = std::abs(one.zeros[k].value - all.zeros[k].value);
      CHECK(moved <= all.zeros[k].error);
      farthest = std::max(farthest, moved / all.zeros[k].error);
    }
  }
  CHECK(farthest > 0.3);  // the bound is not loose
}

TEST_CASE("every status of the zeros is reached") {
  TransferFunction g = jet(RowVectorXd::Unit(4, 3));
  g.b.setZero();
  CHECK(zeros_and_poles(g).status == ZerosStatus::no_response);
  CHECK(to_string(ZerosStatus::no_response) == "no_response");
  SUBCASE("a Markov parameter within its error") {
    g = jet(RowVectorXd::Unit(4, 3));
    g.b_error = VectorXd::Constant(4, 1e-6);  // b[3] = 0 ± 1e-6: cb may be zero or not
    CHECK(zeros_and_poles(g).status == ZerosStatus::degree_undecided);
  }
  SUBCASE("a double zero has no disk of its own") {
    g = canonical({-1.0, -1.0}, {-2.0, -3.0, -4.0});
    const ZerosAndPoles found = zeros_and_poles(g);
    CHECK(found.status == ZerosStatus::not_enclosed);
    REQUIRE(found.zeros.size() == 2);
    CHECK(std::isinf(found.zeros[0].error));
    CHECK_FALSE(bandwidth(found).known);
  }
  SUBCASE("a state that the output cannot see is left out") {
    g = jet(RowVectorXd::Unit(4, 3));
    MatrixXd A = MatrixXd::Zero(5, 5);
    A.topLeftCorner(4, 4) = g.A;
    A(4, 0) = 1;  // a distance
    VectorXd b = VectorXd::Zero(5);
    b.head(4) = g.b;
    const ZerosAndPoles found = zeros_and_poles({A, b, RowVectorXd::Unit(5, 3)});
    CHECK(found.cancelled == 1);
    CHECK(found.poles.size() == 4);
    CHECK(found.zeros.size() == 2);
  }
}

TEST_CASE("bandwidth and phase delay against closed forms") {
  // K/(s (T s + 1)) with a lag 1/(L s + 1): the phase is -90° - atan(Tω) - atan(Lω).
  constexpr double T = 0.3, L = 0.05;
  const auto lagged = [](double delay_lag) { return canonical({}, {0.0, -1 / T, -1 / delay_lag}); };
  const Bandwidth b = bandwidth(zeros_and_poles(lagged(L)));
  REQUIRE(b.known);
  // atan(Tω) + atan(Lω) = 90°: T L ω² = 1; = 45°: T L ω² + (T + L) ω = 1
  const double crossover = 1 / std::sqrt(T * L);
  CHECK_NEAR(b.crossover.value, crossover, b.crossover.error);
  CHECK(b.crossover.error < 1e-12);
  const double half = (std::sqrt((T + L) * (T + L) + 4 * T * L) - (T + L)) / (2 * T * L);
  CHECK_NEAR(b.phase_bandwidth.value, half, b.phase_bandwidth.error);
  const double twice = 2 * crossover;
  const double beyond = std::atan(T * twice) + std::atan(L * twice) - std::numbers::pi / 2;
  CHECK_NEAR(b.phase_delay.value, beyond / twice, b.phase_delay.error + 1e-15);
  const auto gain = [](double w) { return 1 / (w * std::hypot(1, T * w) * std::hypot(1, L * w)); };
  CHECK_NEAR(20 * std::log10(gain(b.gain_bandwidth.value) / gain(crossover)), 6, 1e-10);
  CHECK(b.bandwidth.value == std::min(b.gain_bandwidth.value, b.phase_bandwidth.value));
  CHECK(bandwidth(zeros_and_poles(lagged(L)), ResponseType::attitude).bandwidth.value ==
        b.phase_bandwidth.value);
  SUBCASE("two poles in excess never reach -180 degrees") {
    const Bandwidth two = bandwidth(zeros_and_poles(canonical({}, {0.0, -1 / T})));
    CHECK_NEAR(two.phase_bandwidth.value, 1 / T, 1e-12);
    CHECK(std::isinf(two.crossover.value));
    CHECK(two.phase_delay.value == 0);
  }
}

TEST_CASE("a delay as a Padé approximant lowers the bandwidth, for both signs of the stick") {
  // 2 P(0.2 s)/(s (s + 2)); P has the gain 1, and lags 2 atan(0.1 ω) or 2 atan(30 ω/(300 - ω²)).
  const Complex pair(15, std::sqrt(75.0));
  struct Delayed {
    std::vector<Complex> zeros;
    double crossover;  // tan(90° - atan(ω/2)) = tan(lag): a polynomial in ω²
    double bandwidth, delay;
  };
  const std::vector<Delayed> orders{
      {{10.0}, std::sqrt(100.0 / 11), 1.2109, 0.1269},
      {{pair, std::conj(pair)}, std::sqrt((5250 - std::sqrt(24772500.0)) / 31), 1.2088, 0.1447}};
  for (const Delayed& d : orders) {
    const auto lag = [&](double w) {
      return 2 * (d.zeros.size() == 1 ? std::atan(0.1 * w) : std::atan2(30 * w, 300 - w * w));
    };
    std::vector<Complex> poles{0.0, -2.0};
    for (const Complex z : d.zeros) poles.push_back(-z);
    TransferFunction g = canonical(d.zeros, poles);
    for (const double sign : {1.0, -1.0}) {
      g.b *= sign;
      const Bandwidth b = bandwidth(zeros_and_poles(g));
      REQUIRE(b.known);
      CHECK_NEAR(b.crossover.value, d.crossover, b.crossover.error);
      CHECK(b.crossover.error < 1e-10);
      const double at = b.phase_bandwidth.value, twice = 2 * d.crossover;
      CHECK_NEAR(std::atan(at / 2) + lag(at), std::numbers::pi / 4, 1e-10);
      // |G|⁻² = ω² (ω² + 4)/4
      const double c = d.crossover * d.crossover;
      const double gain = std::sqrt(std::sqrt(4 + c * (c + 4) / std::pow(10, 0.6)) - 2);
      CHECK_NEAR(b.gain_bandwidth.value, gain, 1e-10);
      CHECK_NEAR(b.bandwidth.value, d.bandwidth, printed_to("1.2109"));
      CHECK_NEAR(b.phase_delay.value,
                 (std::atan(twice / 2) + lag(twice) - std::numbers::pi / 2) / twice, 1e-10);
      CHECK_NEAR(b.phase_delay.value, d.delay, printed_to("0.1269"));
    }
  }
}

TEST_CASE(
    "zeros near the origin and undamped ones: no jump from one side of the axis to the other") {
  const auto found = [](const std::vector<Complex>& zeros) {
    std::vector<Complex> poles{-0.01, -2.0, -20.0};
    for (std::size_t k = 1; k < zeros.size(); ++k) poles.push_back(-0.8 - double(k));
    return bandwidth(zeros_and_poles(canonical(zeros, poles)));
  };
  const Bandwidth left = found({-1e-6}), right = found({1e-6}), origin = found({0.0});
  CHECK(left.bandwidth.value > 1);
  CHECK_NEAR(right.bandwidth.value, left.bandwidth.value, 1e-5);
  CHECK_NEAR(origin.bandwidth.value, left.bandwidth.value, 1e-5);
  const Complex undamped(0, 1), rounding(1e-17, 0);
  const Bandwidth damped = found({undamped - 1e-6, std::conj(undamped) - 1e-6});
  const Bandwidth beside =
      found({undamped + rounding, std::conj(undamped) + rounding});  // within its error of the axis
  CHECK_NEAR(beside.bandwidth.value, damped.bandwidth.value, 1e-4);
}

TEST_CASE("mistakes of the caller") {
  TransferFunction g = jet(RowVectorXd::Unit(4, 3));
  g.b = VectorXd::Zero(3);
  CHECK(contains(refusal([&] { (void)zeros_and_poles(g); }), "4 x 4, b has 3"));
  g = jet(RowVectorXd::Unit(4, 3));
  g.A(0, 0) = NAN;
  CHECK(contains(refusal([&] { (void)zeros_and_poles(g); }), "not finite"));
  g = jet(RowVectorXd::Unit(4, 3));
  g.b_error = VectorXd::Zero(2);
  CHECK(contains(refusal([&] { (void)zeros_and_poles(g); }), "another size"));
  CHECK(contains(refusal([&] { (void)transfer_function({}, "a", "b"); }), "no linear model"));
}

}  // namespace zeros_test
